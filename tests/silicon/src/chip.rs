//! Identifies core and chip by their identity registers, because one image runs on all of them.

/// Address of the device id of an STM32F4 or F7, DBGMCU_IDCODE (RM0090, RM0410: "MCU device ID
/// code"), bits 11:0.
pub const ID_F4_F7: u32 = 0xE004_2000;
/// Address of the device id of an STM32H7, seen by its own core: DBGMCU_IDC (RM0433). On an F7
/// nothing is there.
pub const ID_H7: u32 = 0x5C00_1000;
/// FLASH_ACR: wait states in bits 3:0 (RM0090, RM0410, RM0433).
const ACR_F4_F7: u32 = 0x4002_3C00;
const ACR_H7: u32 = 0x5200_2000;

/// The core, by the part number in CPUID (ARM DDI 0403, B3.2.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// Cortex-M4: no caches.
    M4,
    /// Cortex-M7: caches, and a lock on the cycle counter.
    M7,
    /// Another core; its settings are not changed.
    Other,
}

impl Core {
    /// The core for a value of CPUID.
    pub const fn of(cpuid: u32) -> Self {
        match cpuid >> 4 & 0xFFF {
            0xC24 => Self::M4,
            0xC27 => Self::M7,
            _ => Self::Other,
        }
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::M4 => "Cortex-M4",
            Self::M7 => "Cortex-M7",
            Self::Other => "a core not known",
        }
    }

    /// Whether the piece of work of this name is the form of the kernel for this core.
    pub fn own_form(self, work: &str) -> bool {
        match self {
            Self::M4 => work.ends_with("_m4"),
            Self::M7 => work.ends_with("_m7"),
            Self::Other => false,
        }
    }
}

/// How the bench sets up the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// 168 MHz, set up as the board image does.
    Board,
    /// Left at the internal oscillator that runs after reset, MHz: cycles are counted, not seconds.
    Reset(u8),
    /// Left unchanged; not known.
    Unknown,
}

/// Properties of a chip that the bench needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chip {
    /// The family.
    pub name: &'static str,
    /// How its clock is set up.
    pub clock: Clock,
    /// Address of FLASH_ACR.
    pub flash_acr: Option<u32>,
    /// KiB from 0x2000_0000 on that are the core's own memory (DTCM), which is never cached; SRAM
    /// follows.
    pub dtcm: u8,
}

/// A chip and the id by which it was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DetectedChip {
    /// The chip.
    pub chip: Chip,
    /// DEV_ID. For an unknown chip, the last one that was read; 0 if none.
    pub id: u16,
}

const fn f4(name: &'static str, clock: Clock) -> Chip {
    Chip {
        name,
        clock,
        flash_acr: Some(ACR_F4_F7),
        dtcm: 0,
    }
}

const fn f7(name: &'static str, dtcm: u8) -> Chip {
    Chip {
        name,
        clock: Clock::Reset(16),
        flash_acr: Some(ACR_F4_F7),
        dtcm,
    }
}

const fn h7(name: &'static str) -> Chip {
    Chip {
        name,
        clock: Clock::Reset(64),
        flash_acr: Some(ACR_H7),
        dtcm: 128,
    }
}

const F405: Chip = f4("STM32F405/407/415/417", Clock::Board);
const HSI: Clock = Clock::Reset(16);

/// Core, address of the id, id, chip. All have 128 KiB of contiguous memory from 0x2000_0000 on, as
/// `memory.x` assumes.
const KNOWN: [(Core, u32, u16, Chip); 13] = [
    (Core::M4, ID_F4_F7, 0x413, F405),
    // Revision A has the id of an F2 (errata ES0182), which has a Cortex-M3.
    (Core::M4, ID_F4_F7, 0x411, F405),
    (Core::M4, ID_F4_F7, 0x419, f4("STM32F427/429/437/439", HSI)),
    (Core::M4, ID_F4_F7, 0x421, f4("STM32F446", HSI)),
    (Core::M4, ID_F4_F7, 0x431, f4("STM32F411", HSI)),
    (Core::M4, ID_F4_F7, 0x434, f4("STM32F469/479", HSI)),
    (Core::M4, ID_F4_F7, 0x441, f4("STM32F412", HSI)),
    (Core::M7, ID_F4_F7, 0x449, f7("STM32F74x/75x", 64)),
    (Core::M7, ID_F4_F7, 0x451, f7("STM32F76x/77x", 128)),
    (Core::M7, ID_F4_F7, 0x452, f7("STM32F72x/73x", 64)),
    (Core::M7, ID_H7, 0x450, h7("STM32H74x/75x")),
    (Core::M7, ID_H7, 0x480, h7("STM32H7A3/7B3")),
    (Core::M7, ID_H7, 0x483, h7("STM32H72x/73x")),
];

const UNKNOWN: Chip = Chip {
    name: "a chip not known",
    clock: Clock::Unknown,
    flash_acr: None,
    dtcm: 0,
};

/// Identifies the chip. `read` returns the word at an address, or `None` when nothing answers
/// there. It does not read addresses at which no chip with this core has its id, and reads the H7's
/// only when the F4's and F7's address gave no known id.
pub fn identify(core: Core, mut read: impl FnMut(u32) -> Option<u32>) -> DetectedChip {
    let mut last = 0;
    for address in [ID_F4_F7, ID_H7] {
        let here = || {
            let known = KNOWN.iter();
            known.filter(move |(its_core, at, ..)| *its_core == core && *at == address)
        };
        if here().next().is_none() {
            continue;
        }
        let Some(word) = read(address) else { continue };
        let id = (word & 0xFFF) as u16;
        if let Some((.., chip)) = here().find(|(_, _, its_id, _)| *its_id == id) {
            return DetectedChip { chip: *chip, id };
        }
        last = id;
    }
    DetectedChip {
        chip: UNKNOWN,
        id: last,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const M4: u32 = 0x410F_C241;
    const M7: u32 = 0x411F_C271;

    fn read_of(words: &[(u32, u32)]) -> impl FnMut(u32) -> Option<u32> {
        |address| {
            let found = words.iter().find(|(at, _)| *at == address);
            found.map(|(_, word)| *word)
        }
    }

    #[test]
    fn cores_by_their_part_number() {
        assert_eq!(Core::of(M4), Core::M4);
        assert_eq!(Core::of(M7), Core::M7);
        assert_eq!(Core::of(0x410F_C271), Core::M7); // r0p1 of the F74x
        assert_eq!(Core::of(0x412F_C231), Core::Other); // Cortex-M3
    }

    #[test]
    fn each_chip_where_it_has_its_id() {
        for (core, address, id, chip) in KNOWN {
            // Revision, and reserved bits that an H743 sets.
            let word = 0x1003_0000 | 0x6000 | u32::from(id);
            assert_eq!(
                identify(core, read_of(&[(address, word)])),
                DetectedChip { chip, id }
            );
        }
    }

    #[test]
    fn only_the_f405_gets_the_boards_clock() {
        let chip = |core, address, word| identify(core, read_of(&[(address, word)])).chip;
        for word in [0x100F_6413, 0x2000_6411] {
            assert_eq!(chip(Core::M4, ID_F4_F7, word).clock, Clock::Board);
        }
        assert!(
            KNOWN
                .iter()
                .all(|(_, _, id, chip)| chip.clock != Clock::Board || [0x413, 0x411].contains(id))
        );
        // the same ids on another core, or at another address, are not its
        assert_eq!(chip(Core::M7, ID_F4_F7, 0x413).clock, Clock::Unknown);
        assert_eq!(chip(Core::M7, ID_H7, 0x413).clock, Clock::Unknown);
        assert_eq!(chip(Core::M4, ID_F4_F7, 0x450).clock, Clock::Unknown);
        assert_eq!(chip(Core::Other, ID_F4_F7, 0x413).clock, Clock::Unknown);
    }

    /// The addresses that are read on a chip, in order, without the zeros behind them.
    fn addresses(core: Core, words: &[(u32, u32)]) -> [u32; 2] {
        let (mut seen, mut count) = ([0; 2], 0);
        let mut read = read_of(words);
        identify(core, |address| {
            seen[count] = address;
            count += 1;
            read(address)
        });
        seen
    }

    #[test]
    fn the_second_address_is_read_only_on_an_m7_and_after_the_first() {
        assert_eq!(addresses(Core::M4, &[(ID_F4_F7, 0x413)]), [ID_F4_F7, 0]);
        assert_eq!(addresses(Core::M4, &[(ID_F4_F7, 0)]), [ID_F4_F7, 0]); // QEMU
        assert_eq!(addresses(Core::M4, &[]), [ID_F4_F7, 0]);
        assert_eq!(addresses(Core::M7, &[(ID_F4_F7, 0x451)]), [ID_F4_F7, 0]);
        assert_eq!(addresses(Core::M7, &[(ID_F4_F7, 0)]), [ID_F4_F7, ID_H7]);
        assert_eq!(addresses(Core::M7, &[(ID_H7, 0x450)]), [ID_F4_F7, ID_H7]);
        assert_eq!(addresses(Core::Other, &[]), [0, 0]);
    }

    #[test]
    fn nothing_anywhere_leaves_all_as_it_is() {
        for core in [Core::M4, Core::M7, Core::Other] {
            let found = identify(core, |_| None);
            assert_eq!((found.chip, found.id), (UNKNOWN, 0));
        }
        assert_eq!(identify(Core::M7, |_| Some(0xFFFF_F499)).id, 0x499);
    }

    #[test]
    fn the_own_form_of_the_kernel() {
        assert!(Core::M7.own_form("step_m7") && !Core::M7.own_form("step_m4"));
        assert!(Core::M4.own_form("descent_m4") && !Core::M4.own_form("step_rational"));
        assert!(!Core::Other.own_form("step_m4"));
    }
}
