//! Which crystal is at the board, by a measurement against the internal oscillator of an STM32F405.
//!
//! That oscillator has 16 MHz within 1 % at 25 degrees C, within 4 % from -10 to 85, and from -8 %
//! to +4.5 % from -40 to 105 (DS8626, table 41). The low-speed one has 17 to 47 kHz (table 42), a
//! factor of 2.8, which does not distinguish 8 MHz from 12. So the former measures.

/// Frequency of the internal oscillator, kHz.
pub const INTERNAL_KHZ: u32 = 16_000;
/// It may be slower by so much, per mille; one more, since the measurement is rounded ...
pub const SLOWEST: u32 = 81;
/// ... or faster.
pub const FASTEST: u32 = 46;
/// Crystals that the chip takes, whole MHz (DS8626, section 6.3.8).
pub const CRYSTALS: core::ops::RangeInclusive<u8> = 4..=26;
/// Of several values that fit, one is taken only when it is as near as this, per mille.
const NEAR: u32 = 15;

/// The crystal's frequency, kHz: `periods` of it have taken `ticks` of the internal oscillator.
#[must_use]
pub fn measured_khz(periods: u32, ticks: u32) -> Option<u32> {
    let product = u64::from(periods) * u64::from(INTERNAL_KHZ) + u64::from(ticks / 2);
    let khz = product.checked_div(u64::from(ticks))?;
    u32::try_from(khz).ok()
}

/// The value to take, MHz; `None`: none fits, so the internal oscillator is the better clock.
///
/// The value that the firmware was built for stays as long as the measurement may be of it: a right
/// one is never given up because the oscillator is cold. Of the others, the only one that may be it
/// is taken, or else the nearest if it is near. A wrong choice of that kind makes the clock no
/// worse than the internal oscillator is, by 1.5 % at most.
#[must_use]
pub fn choose(built_mhz: u8, measured_khz: u32) -> Option<u8> {
    if may_be(built_mhz, measured_khz) {
        return Some(built_mhz);
    }
    let mut fitting = CRYSTALS.filter(|mhz| may_be(*mhz, measured_khz));
    let first = fitting.next()?;
    if fitting.next().is_none() {
        return Some(first);
    }
    CRYSTALS
        .min_by_key(|mhz| off(*mhz, measured_khz))
        .filter(|mhz| {
            let khz = u32::from(*mhz) * 1000;
            off(*mhz, measured_khz) * 1000 <= khz * NEAR
        })
}

fn off(mhz: u8, khz: u32) -> u32 {
    khz.abs_diff(u32::from(mhz) * 1000)
}

/// Whether a crystal of `mhz` can be measured as `khz`. A slow oscillator makes it look fast.
fn may_be(mhz: u8, khz: u32) -> bool {
    let is = u64::from(mhz) * 1_000_000; // Hz, as `khz` times per mille
    let [slowest, fastest] = [1000 - SLOWEST, 1000 + FASTEST];
    let [low, high] = [slowest, fastest].map(|share| u64::from(khz) * u64::from(share));
    (low..=high).contains(&is)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measured frequency of a crystal with an internal oscillator that is off by `per_mille`.
    fn measured_by(mhz: u8, per_mille: i32) -> u32 {
        let oscillator = 16_000.0 * (1.0 + f64::from(per_mille) / 1000.0);
        (f64::from(mhz) * 16e6 / oscillator) as u32
    }

    #[test]
    fn periods_and_ticks_are_a_frequency() {
        // 248 periods of 12 MHz are 330.67 ticks of 16 MHz
        assert_eq!(measured_khz(248 * 16, 5291), Some(11_999));
        assert_eq!(measured_khz(248, 0), None);
        assert_eq!(measured_khz(u32::MAX, 1), None);
    }

    #[test]
    fn the_value_built_in_is_kept_wherever_the_oscillator_is() {
        for mhz in CRYSTALS {
            for off in -79..=44 {
                assert_eq!(choose(mhz, measured_by(mhz, off)), Some(mhz), "{mhz} {off}");
            }
        }
    }

    /// The crystals of common boards, each with the firmware of each other, at 25 degrees C.
    #[test]
    fn a_wrong_value_is_found_out() {
        for built in [8, 12, 16, 25] {
            for is in [8, 12, 16, 25] {
                for off in [-10, 0, 10] {
                    assert_eq!(
                        choose(built, measured_by(is, off)),
                        Some(is),
                        "{built} {is} {off}"
                    );
                }
            }
        }
    }

    /// Over the whole range of temperature no choice makes the clock worse than the internal
    /// oscillator by more than 1.5 %, and the common values up to 12 MHz are found or refused.
    #[test]
    fn no_choice_is_much_worse_than_the_internal_oscillator() {
        for built in [8, 12, 25] {
            for is in CRYSTALS.filter(|is| off(built, u32::from(*is) * 1000) > 4000) {
                for per_mille in -80..=45 {
                    let khz = measured_by(is, per_mille);
                    let Some(mhz) = choose(built, khz) else {
                        continue;
                    };
                    let clock = f64::from(is) / f64::from(mhz) - 1.0;
                    let internal = f64::from(per_mille) / 1000.0;
                    assert!(
                        clock.abs() < (1.0 + internal.abs()) * 1.0155 - 1.0,
                        "{built} {is} {per_mille}: {mhz}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_crystal_is_refused() {
        for khz in [0, 1_000, 3_600, 12_500, 13_500, 30_000, u32::MAX] {
            assert_eq!(choose(25, khz), None, "{khz}");
        }
    }
}
