//! Which bit rates a UART can have: its clock divided by a whole number, or those of a list.
//!
//! Both ends of a line may differ only so far. A receiver looks at the middle of each bit, counted
//! from the start bit's edge. With 16 looks a bit, a USART of an STM32F405 tolerates 3.33 % between
//! the ends when its divider has a fraction, and with 8 looks 2 % (RM0090 30.3.5). The limits here
//! leave the other end and the crystals 1.3 % and 1 %.

/// Greatest error of a rate with 16 looks a bit, hundredths of a per cent.
pub const MAX_ERROR: u32 = 200;
/// The largest error with 8 looks a bit.
pub const MAX_ERROR_8: u32 = 100;
/// From this divider on there are 16 looks a bit.
pub const LOOKS: u32 = 16;

/// Clock of a UART, from which its bit rate is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clock {
    /// Hz; 0: not known, and every rate is taken for possible.
    pub hz: u32,
    /// Least divider.
    pub least: u32,
    /// Greatest divider.
    pub most: u32,
    /// The only rates that it has, bit/s; empty: one for each divider.
    pub listed: &'static [u32],
}

/// A bit rate that a UART can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// Clock by bit rate.
    pub divider: u32,
    /// The rate, bit/s, rounded.
    pub baud: u32,
    /// Error of the rate, hundredths of a per cent, rounded.
    pub error: u32,
}

impl Clock {
    /// A clock that is not known.
    pub const ANY: Clock = Clock {
        hz: 0,
        least: 1,
        most: 1,
        listed: &[],
    };

    /// Clock of a USART of an STM32F405: mantissa and fraction of its divider are together a number
    /// of 16 bits. Below 16 it looks 8 times a bit (OVER8), and 8 is the least (RM0090 30.3.4).
    #[must_use]
    pub const fn stm32(hz: u32) -> Clock {
        Clock {
            hz,
            least: 8,
            most: 0xFFFF,
            listed: &[],
        }
    }

    /// Clock of an Arm CMSDK UART (DDI 0479, section 4.3: 20 bits, at least 16).
    #[must_use]
    pub const fn cmsdk(hz: u32) -> Clock {
        Clock {
            hz,
            least: 16,
            most: 0xF_FFFF,
            listed: &[],
        }
    }

    /// A UART of this clock that has these rates and no others.
    #[must_use]
    pub const fn of(hz: u32, listed: &'static [u32]) -> Clock {
        Clock {
            hz,
            least: 1,
            most: 1,
            listed,
        }
    }

    /// The possible rate that is nearest to `baud` (> 0).
    #[must_use]
    pub fn nearest(&self, baud: u32) -> Rate {
        if self.hz == 0 {
            return Rate {
                divider: 1,
                baud,
                error: 0,
            };
        }
        if let Some(&listed) = self.listed.iter().min_by_key(|of| of.abs_diff(baud)) {
            return Rate {
                divider: rounded(self.hz.into(), listed.into()),
                baud: listed,
                error: error(listed.abs_diff(baud).into(), baud.into()),
            };
        }
        let below = self.hz.checked_div(baud).unwrap_or(self.most);
        let [fast, slow] = [below, below.saturating_add(1)].map(|divider| self.with(divider, baud));
        if fast.error <= slow.error { fast } else { slow }
    }

    /// The rate for `baud`.
    ///
    /// # Errors
    /// The nearest rate, bit/s, when it is too far away ([`MAX_ERROR`], [`MAX_ERROR_8`]).
    pub fn rate(&self, baud: u32) -> Result<Rate, u32> {
        let rate = self.nearest(baud);
        let limit = if self.hz == 0 || rate.divider >= LOOKS {
            MAX_ERROR
        } else {
            MAX_ERROR_8
        };
        if rate.error <= limit {
            Ok(rate)
        } else {
            Err(rate.baud)
        }
    }

    fn with(&self, divider: u32, wanted: u32) -> Rate {
        let divider = divider.max(self.least).min(self.most);
        let [hz, by, wanted] = [self.hz, divider, wanted].map(u64::from);
        let as_wanted = by * wanted;
        Rate {
            divider,
            baud: rounded(hz, by),
            error: error(hz.abs_diff(as_wanted), as_wanted),
        }
    }
}

/// `over` / `under`, rounded; 0 for a division by 0.
fn rounded(over: u64, under: u64) -> u32 {
    (over + under / 2).checked_div(under).unwrap_or(0) as u32
}

/// What is off `wanted` by so much, hundredths of a per cent, rounded.
fn error(off: u64, wanted: u64) -> u32 {
    match wanted {
        0 => 10_000,
        _ => rounded((off * 10_000).min(wanted * 10_000), wanted),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// USART1 and USART2 of an STM32F405 at 168 MHz.
    const FAST: Clock = Clock::stm32(84_000_000);
    const SLOW: Clock = Clock::stm32(42_000_000);

    #[test]
    fn rates_of_the_sensors() {
        let rate = |divider, baud, error| {
            Ok(Rate {
                divider,
                baud,
                error,
            })
        };
        // RM0090 30.3.4, its table for 42 MHz: 921.6 kbit/s are 913.043 kbit/s with 2.875, 0.93 %
        // off
        assert_eq!(SLOW.rate(921_600), rate(46, 913_043, 93));
        assert_eq!(SLOW.rate(1_000_000), rate(42, 1_000_000, 0));
        assert_eq!(FAST.rate(1_000_000), rate(84, 1_000_000, 0));
        assert_eq!(SLOW.rate(1_843_200), rate(23, 1_826_087, 93));
        assert_eq!(FAST.rate(1_843_200), rate(46, 1_826_087, 93));
        assert_eq!(SLOW.rate(115_200), rate(365, 115_068, 11));
        // with 8 looks a bit
        assert_eq!(SLOW.rate(3_000_000), rate(14, 3_000_000, 0));
        assert_eq!(SLOW.rate(5_250_000), rate(8, 5_250_000, 0));
    }

    #[test]
    fn impossible_rates_are_refused_with_the_nearest() {
        assert_eq!(SLOW.rate(4_000_000), Err(3_818_182)); // 42 / 11; 42 / 10 is 5 % off
        assert_eq!(SLOW.rate(12_000_000), Err(5_250_000));
        assert_eq!(FAST.rate(1_200), Err(1_282));
        assert_eq!(SLOW.rate(0), Err(641));
        // the internal oscillator without PLL
        let internal = Clock::stm32(16_000_000);
        assert_eq!(internal.rate(921_600), Err(941_176));
        assert_eq!(internal.rate(1_000_000).map(|rate| rate.error), Ok(0));
        assert_eq!(internal.rate(1_843_200), Err(1_777_778));
        // 25 MHz, at least 16
        let cmsdk = Clock::cmsdk(25_000_000);
        assert_eq!(cmsdk.rate(1_843_200), Err(1_562_500));
        assert_eq!(cmsdk.rate(921_600).map(|rate| rate.divider), Ok(27));
        assert_eq!(cmsdk.rate(1_000_000).map(|rate| rate.error), Ok(0));
        // a list, as that of an nRF52840
        let listed = Clock::of(16_000_000, &[250_000, 457_143, 941_176, 1_000_000]);
        assert_eq!(listed.rate(500_000), Err(457_143)); // 16 MHz / 32
        assert_eq!(listed.rate(2_000_000), Err(1_000_000));
        assert_eq!(listed.rate(921_600), Err(941_176));
        assert_eq!(listed.rate(0), Err(250_000));
        let taken = listed.rate(460_800).map(|rate| (rate.baud, rate.error));
        assert_eq!(taken, Ok((457_143, 79)));
        assert_eq!(listed.rate(941_176).map(|rate| rate.divider), Ok(17));
        assert_eq!(Clock::ANY.rate(12_345).map(|rate| rate.baud), Ok(12_345));
    }

    /// Compared with division in f64 over many rates: no other divider is nearer.
    #[test]
    fn the_nearest_is_the_nearest() {
        for clock in [FAST, SLOW, Clock::cmsdk(25_000_000)] {
            for baud in (1_200..6_000_000).step_by(7_919) {
                let rate = clock.nearest(baud);
                let error = |divider: u32| {
                    let is = f64::from(clock.hz) / f64::from(divider);
                    (is / f64::from(baud) - 1.0).abs()
                };
                let best = (clock.least..4000).map(error).fold(1.0, f64::min);
                let found = error(rate.divider);
                if clock.hz / baud < 3999 {
                    assert!(found <= best + 1e-4, "{clock:?} {baud}: {found} {best}");
                }
                assert!((f64::from(rate.error) / 1e4 - found).abs() < 1e-4);
            }
        }
    }
}
