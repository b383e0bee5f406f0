//! The configuration datagram against the datasheet.

use super::*;
use crate::wire::Scan;
use crate::wire::field::hex;
use crate::wire::stim300::scan;

/// The configuration for the golden measurement frame, as a third-party client accepts it.
const GOLDEN: [u8; LEN] = hex("bc411f622071444071444070444000000000000000005601609c");

#[test]
fn golden_configuration() {
    assert_eq!(scan(&GOLDEN), Scan::Other(LEN));
    let config = Config::parse(&GOLDEN).unwrap();
    assert_eq!(config, Config::DEFAULT);
    assert_eq!(config.emit(), GOLDEN);
    assert_eq!(config.sample_rate(), Ok(Some(1000)));
    assert_eq!(config.counter_step(), Some(2));
    assert_eq!(config.bit_rate(), Ok(Some(921_600)));
    assert_eq!(config.contents().id(), 0x91);
    assert!(!config.crlf());
    assert_eq!(config.ranges(), Ok([Range::G10; 3]));
    let units = config.units().unwrap();
    assert_eq!(units.gyro.quantity, Quantity::Increment);
    assert_eq!(units.gyro.lsb, DEGREE / 2_097_152.0);
    assert_eq!(units.accel.lsb, 1.0 / 4_194_304.0);
    assert_eq!(units.accel.increment(0.001), Some(units.accel.lsb));
}

#[test]
fn a_damaged_configuration_is_refused() {
    for bit in 0..8 * LEN {
        let mut bytes = GOLDEN;
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Config::parse(&bytes).is_err(), "bit {bit}");
    }
    assert_eq!(Config::parse(&GOLDEN[1..]), Err(Error::Length));
}

#[test]
fn every_content_survives_the_datagram() {
    for id in (0..=255).filter(|&id| Contents::from_id(id).is_some()) {
        let contents = Contents::from_id(id).unwrap();
        let sent = Config::DEFAULT
            .with_contents(contents)
            .with_crlf(true)
            .emit();
        let config = Config::parse(&sent).unwrap();
        assert_eq!((config.contents().id(), config.crlf()), (id, true));
        assert_eq!(sent[0], 0xBD);
        assert_eq!(
            config
                .with_contents(Config::DEFAULT.contents())
                .with_crlf(false),
            Config::DEFAULT
        );
    }
    let steps = [16, 8, 4, 2, 1].map(Some);
    for (code, step) in (0..).zip(steps.into_iter().chain([None, None])) {
        let config = Config::DEFAULT.with_sample_rate_code(code);
        assert_eq!(config.counter_step(), step);
    }
}

#[test]
fn ranges_and_bit_rates_read_back() {
    for range in [Range::G5, Range::G10, Range::G30, Range::G80] {
        let config = Config::DEFAULT.with_accel_range(range);
        assert_eq!(config.ranges(), Ok([range; 3]));
        assert_eq!(Config::parse(&config.emit()), Ok(config));
    }
    for rate in [374_400, 460_800, 921_600, 1_843_200] {
        let config = Config::DEFAULT.with_bit_rate(rate);
        assert_eq!(config.bit_rate(), Ok(Some(rate)));
        assert_eq!(config.with_bit_rate(921_600), Config::DEFAULT);
    }
    assert_eq!(Config::DEFAULT.with_bit_rate(1).bit_rate(), Ok(None));
}

/// Equations 1 to 4 and tables 7-2, 7-3: full scale is 2^23 counts.
#[test]
fn units_follow_the_codes() {
    let full = 8_388_608.0;
    let full_scale = |gyro, accel| {
        let units = Config::DEFAULT
            .with_unit_codes(gyro, accel)
            .units()
            .unwrap();
        (units.gyro.lsb * full / DEGREE, units.accel.lsb * full)
    };
    assert_eq!(full_scale(0, 0), (512.0, 16.0 * G));
    assert_eq!(full_scale(1, 1), (4.0, 2.0));
    assert_eq!(full_scale(10, 10), (512.0, 16.0 * G)); // delayed averages
    assert_eq!(full_scale(3, 3), (4.0, 2.0 * G)); // +-4 deg, +-2 g s
    assert_eq!(full_scale(3, 4), (4.0, 2.0)); // +-2 m/s
    let rates = Config::DEFAULT.with_unit_codes(0, 3).units().unwrap();
    assert_eq!(rates.gyro.increment(0.001), Some(rates.gyro.lsb * 0.001));
    assert_eq!(rates.accel.increment(0.001), None);
    let unknown = Config::DEFAULT.with_unit_codes(5, 0);
    assert_eq!(unknown.units(), Err(Error::Field));
}

#[test]
fn special_datagrams_pass_unread() {
    for (id, len) in [(0xB1, 20), (0xB7, 20), (0xBF, 21), (0xD2, 40)] {
        let mut bytes = [0x5A; 40];
        bytes[0] = id;
        seal(&mut bytes[..len]);
        assert_eq!(special_len(id), Some(len));
        assert_eq!(scan(&bytes[..len]), Scan::Other(len));
        assert_eq!(scan(&bytes[..len - 1]), Scan::Partial(len));
        bytes[1] ^= 4;
        assert_eq!(scan(&bytes[..len]), Scan::BadChecksum);
    }
}
