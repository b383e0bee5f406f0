mod ends;

use super::*;
use crate::wire::receiver::testing::{self, DecodedMessage, NONE};
use crate::wire::{Error, ReceiverFormat, exactly};
use std::format;
use std::string::String;
use std::vec::Vec;

/// A sentence with its end and checksum, which is computed here from the definition.
pub(in crate::wire) fn sentence(text: &str) -> Vec<u8> {
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${text}*{sum:02X}\r\n").into_bytes()
}

pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    sentence(&format!(
        "GNGGA,0000{:02}.{:02},4717.11399,N,00833.91590,E,2,12,0.98,499.6,M,48.1,M,,0000",
        n / 100,
        n % 100
    ))
}

/// Fields apart, and joined again.
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    if !exactly(frame, scan)? {
        return Err(Error::Content);
    }
    let text = core::str::from_utf8(&frame[1..frame.len() - 5]).map_err(|_| Error::Field)?;
    let fields: Vec<&str> = text.split(',').collect();
    Ok(sentence(&fields.join(",")))
}

/// Made by `pynmeagps`.
const RMC: &str = "$GNRMC,092725.20,A,4717.11399,N,00833.91590,E,12.345,77.52,221126,,,D,V*0E\r\n";
const GGA: &str = "$GNGGA,092725.20,4717.11399,N,00833.91590,E,2,12,0.98,499.6,M,48.1,M,,0*7F\r\n";
const GST: &str = "$GNGST,092725.20,1.8,,,,1.7,1.3,2.2*63\r\n";
const VTG: &str = "$GNVTG,77.52,T,,M,12.345,N,22.863,K,D*1D\r\n";
const GNS: &str = "$GNGNS,092725.20,4717.11399,S,00833.91590,W,DANN,12,0.98,499.6,48.1,,0,V*26\r\n";
const GLL: &str = "$GNGLL,4717.11399,N,00833.91590,E,092725.20,A,D*71\r\n";
const THS: &str = "$GNTHS,77.52,A*2E\r\n";

const TIME_MS: u32 = ((9 * 60 + 27) * 60 + 25) * 1000 + 200;

fn part(text: &str) -> DecodedMessage {
    parse(text.as_bytes()).unwrap()
}

/// Values of a sentence without checksum and end.
fn of(text: &str) -> DecodedMessage {
    parse(&sentence(text)).unwrap()
}

fn close(a: f64, b: f64, within: f64) -> bool {
    (a - b).abs() <= within
}

fn parse(frame: &[u8]) -> Result<DecodedMessage, Error> {
    testing::parse(ReceiverFormat::Nmea, frame)
}

#[test]
fn golden_position() {
    for (text, sign) in [(GGA, 1.0), (GNS, -1.0)] {
        let part = part(text);
        assert_eq!(part.time, Time::Day(TIME_MS));
        let (position, own) = (part.position.unwrap(), part.own);
        let [lat, lon] = [47.285_233_1_f64, 8.565_265].map(|v| sign * v.to_radians());
        assert!(close(position.latitude, lat, 3e-9), "{position:?}");
        assert!(close(position.longitude, lon, 3e-9), "{position:?}");
        assert!(close(position.height, 547.7, 1e-9));
        // a digit is 18.52 mm; one of each height 0.1 m
        let want = [
            0.018_52 / 12_f64.sqrt(),
            0.018_52 / 12_f64.sqrt(),
            0.1 * 2_f64.sqrt() / 12_f64.sqrt(),
        ];
        for (own, want) in own.into_iter().zip(want) {
            assert!(close(own.into(), want, 1e-6), "{own} {want}");
        }
        let assumed = part.assumed;
        let distance = [1.9, 7.5][usize::from(sign < 0.0)] * 0.98;
        for (assumed, want) in assumed.iter().zip([0.5_f64.sqrt(), 0.5_f64.sqrt(), 2.0]) {
            assert!(close((*assumed).into(), want * distance, 1e-4), "{assumed}");
        }
        assert!(assumed[3..].iter().all(|sigma| *sigma == NOT_MEASURED));
    }
}

#[test]
fn golden_velocity() {
    let rmc = part(RMC);
    // 22 November 2026 is a Sunday
    assert_eq!((rmc.time, rmc.day), (Time::Day(TIME_MS), Some(0)));
    assert_eq!((part(VTG).position, part(VTG).time), (None, Time::Same));
    let speed = 12.345 * 1852.0 / 3600.0;
    let course = 77.52_f64.to_radians();
    for part in [rmc, part(VTG)] {
        let [north, east, down] = part.velocity.unwrap();
        let own = &part.own[3..];
        assert!(close(north, speed * course.cos(), 2e-4), "{north}");
        assert!(close(east, speed * course.sin(), 2e-4), "{east}");
        assert_eq!(down, 0.0);
        assert!(
            own[0] < 1e-3 && own[1] == own[0] && own[2] == NOT_MEASURED,
            "{own:?}"
        );
        assert_eq!(part.assumed[3..], [0.1, 0.1, NOT_MEASURED]);
    }
}

/// Where a receiver sends neither GGA nor GNS, the horizontal position of RMC or GLL counts.
#[test]
fn position_of_rmc_and_gll() {
    let gga = part(GGA).position.unwrap();
    for text in [RMC, GLL] {
        let part = part(text);
        assert_eq!(part.time, Time::Day(TIME_MS), "{text}");
        let position = part.position.unwrap();
        assert_eq!(
            [position.latitude, position.longitude],
            [gga.latitude, gga.longitude]
        );
        assert!(part.own[1].is_finite() && part.own[2] == NOT_MEASURED);
        // differential, at an HDOP of 2
        let axis = 1.9 * 2.0 / 2_f32.sqrt();
        assert_eq!(part.assumed[..3], [axis, axis, NOT_MEASURED], "{text}");
    }
    let [rmc, gll] = ["GNRMC,092725.20,A,", "GNGLL,"];
    for (mode, metres) in [("A", 7.5), ("", 7.5), ("F", 0.5), ("R", 0.05)] {
        let rmc = of(&format!("{rmc}4717.1,N,00833.9,E,1,2,221126,,,{mode}"));
        let gll = of(&format!("{gll}4717.1,N,00833.9,E,092725.20,A,{mode}"));
        let axis = metres * 2.0 / 2_f32.sqrt();
        assert_eq!([rmc.assumed[0], gll.assumed[1]], [axis, axis], "{mode}");
    }
    for none in [
        "GNRMC,092725.20,V,4717.1,N,00833.9,E,1,2,221126,,,A",
        "GNRMC,092725.20,A,4717.1,N,00833.9,E,1,2,221126,,,E",
        "GNGLL,4717.1,N,00833.9,E,092725.20,V,A",
        "GNGLL,4717.1,N,00833.9,E,092725.20,A,S",
        "GNGLL,,,,,092725.20,A,A",
    ] {
        assert_eq!(of(none).position, None, "{none}");
    }
}

/// GGA decides, wherever it stands in the epoch: also that there is no position.
#[test]
fn gga_decides_before_rmc_and_gll() {
    let estimated =
        "$GNGGA,092725.20,4717.11399,N,00833.91590,E,6,12,0.98,499.6,M,48.1,M,,0*7B\r\n";
    let joined = |texts: [&str; 3]| {
        let mut values = Values::NONE;
        for text in texts {
            assert_eq!(scan(text.as_bytes()), Scan::Frame(text.len()), "{text}");
            read(text.as_bytes(), &mut values);
        }
        values
    };
    let want = part(GGA);
    for order in [[GGA, RMC, GLL], [RMC, GGA, GLL], [GLL, RMC, GGA]] {
        let values = joined(order);
        assert_eq!(Some(values.position), want.position);
        assert_eq!(values.own[..3], want.own[..3]);
        assert_eq!(values.assumed[..3], want.assumed[..3]);
        assert!(values.has(3));
    }
    for order in [[estimated, RMC, GLL], [RMC, GLL, estimated]] {
        assert!(!joined(order).has(0), "{order:?}");
    }
}

/// Old receivers send a VTG without a mode, or with a wrong one, while they have no fix.
#[test]
fn a_velocity_counts_only_in_an_epoch_with_a_fix() {
    let fixed = |sentences: [&str; 2]| {
        let mut values = Values::NONE;
        for text in sentences {
            read(format!("${text}*00\r\n").as_bytes(), &mut values);
        }
        values.given() & 0b11_1000 != 0
    };
    for vtg in [
        "GPVTG,0.0,T,10.5,M,0.0,N,0.0,K",
        "GPVTG,0.00,T,,,0.00,N,0.00,K,A",
    ] {
        assert!(fixed([
            vtg,
            "GPRMC,092725,A,4717.1,N,00833.9,E,0.0,0.0,221126,,"
        ]));
        for none in [
            "GPRMC,092725,V,4717.1,N,00833.9,E,0.0,0.0,221126,10.5,W,S",
            "GPGGA,092725,4717.1,N,00833.9,E,0,00,50.0,4.0,M,42.2,M,,",
            "GPGGA,092725,4717.1,N,00833.9,E,8,10,2.0,268.8,M,-33.9,M,,",
        ] {
            assert!(!fixed([vtg, none]) && !fixed([none, vtg]), "{none}");
        }
    }
}

#[test]
fn golden_accuracy_and_heading() {
    let none = NOT_MEASURED;
    assert_eq!(part(GST).stated, [1.7, 1.3, 2.2, none, none, none]);
    let heading = part(THS).heading.unwrap();
    assert!(close(heading.angle.into(), 77.52_f64.to_radians(), 1e-6));
    assert!(close(heading.sigma.into(), 1_f64.to_radians(), 1e-6));
    assert_eq!(
        of("GPHDT,274.07,T").heading.map(|h| h.angle > 4.0),
        Some(true)
    );
    for none in ["GNTHS,77.52,V", "GNHDT,,T", "GNHDT,361.0,T", "GNHDT,-1,T"] {
        assert_eq!(of(none).heading, None, "{none}");
    }
}

#[test]
fn what_is_not_measured_is_not_reported() {
    let gga = |quality: &str, rest: &str| {
        of(&format!(
            "GPGGA,092725,4717.1,N,00833.9,E,{quality},12,{rest}"
        ))
    };
    let [sbas, differential] = ["9", "2"].map(|quality| gga(quality, "0.98,499.6,M,48.1,M,,"));
    assert!(sbas.position.is_some() && sbas.own == differential.own);
    for quality in ["0", "6", "7", "8", ""] {
        let part = gga(quality, "0.98,499.6,M,48.1,M,,");
        assert_eq!((part.position, part.assumed), (None, NONE), "{quality}");
    }
    // no geoid: no height above the ellipsoid
    let no_height = gga("1", "0.98,499.6,M,,M,,");
    assert!(no_height.position.is_some());
    let own = no_height.own;
    assert!(own[0].is_finite() && own[2] == NOT_MEASURED);
    // four decimals less are 185 m
    assert!(close(own[0].into(), 185.2 / 12_f64.sqrt(), 1e-3), "{own:?}");
    // without a dilution it is 2; one of 0 or 99.99 is none
    let [unstated, two] = ["", "2"].map(|hdop| gga("1", &format!("{hdop},499.6,M,48.1,M,,")));
    assert_eq!(
        (unstated.assumed, unstated.assumed[0] > 10.0),
        (two.assumed, true)
    );
    for none in ["0.0", "99.99", "x"] {
        let part = gga("1", &format!("{none},499.6,M,48.1,M,,"));
        assert_eq!(part.assumed, NONE, "{none}");
    }
    for bad in [
        "GPGGA,092725,4760.1,N,00833.9,E,1",
        "GPGGA,092725,9100.0,N,00833.9,E,1",
        "GPGGA,092725,4717.1,X,00833.9,E,1",
        "GPGGA,092725,4717.1,N,18100.0,E,1",
        "GPGGA,092725,,,,,1",
        "GPGGA,092725,47a7.1,N,00833.9,E,1",
    ] {
        assert_eq!(of(bad).position, None, "{bad}");
    }
    for bad in [
        "GNRMC,092725,V,,,,,1.0,10.0,221126,,,A",
        "GNRMC,092725,A,,,,,1.0,10.0,221126,,,E",
        "GNRMC,092725,A,,,,,,10.0,221126,,,A",
        "GNVTG,77.5,T,,M,12.3,N,22.8,K,N",
    ] {
        assert_eq!(of(bad).velocity, None, "{bad}");
    }
    for mode in ["NNNN", "AENN", ""] {
        let text = format!("GNGNS,092725,4717.1,N,00833.9,E,{mode},12,0.98,499.6,48.1,,");
        assert_eq!(of(&text).position, None, "{mode}");
    }
    for gst in [
        "GNGST,092725,1.8,,,,,1.3,2.2",
        "GNGST,092725,1.8,,,,0.0,1.3,2.2",
    ] {
        let [north, east, ..] = of(gst).stated;
        assert_eq!((north, east), (NOT_MEASURED, 1.3));
    }
    let no_height = of("GNGST,092725,1.8,,,,0.001,1.3,").stated;
    assert_eq!(no_height[..3], [0.005, 1.3, NOT_MEASURED]);
}

#[test]
fn without_a_course_the_speed_is_the_uncertainty() {
    let part = of("GNRMC,092725,A,,,,,0.100,,221126,,,A");
    let ([north, east, _], own) = (part.velocity.unwrap(), &part.own[3..]);
    assert_eq!((north, east), (0.0, 0.0));
    let speed = 0.1 * 1852.0 / 3600.0;
    assert!(close(own[0].into(), speed / 2_f64.sqrt(), 1e-4), "{own:?}");
}

#[test]
fn times_and_dates() {
    let time = |text: &str| number::time_of_day(text.as_bytes());
    assert_eq!(time("000000"), Some(0));
    assert_eq!(time("235959.999"), Some(86_399_999));
    assert_eq!(time("235960.00"), Some(86_400_000)); // a leap second
    for bad in [
        "",
        "240000",
        "236000",
        "235961",
        "-000001",
        "12:00",
        "0000000000000000",
    ] {
        assert_eq!(time(bad), None, "{bad}");
    }
    let day = |text: &str| number::day_of_week(text.as_bytes());
    // 1 January 2000 and 31 December 2099: Saturday, Thursday; 29 February 2024: Thursday
    for (date, want) in [
        ("010100", 6),
        ("290224", 4),
        ("010324", 5),
        ("311299", 4),
        ("060180", 6),
    ] {
        assert_eq!(day(date), Some(want), "{date}");
    }
    for bad in ["", "001126", "321126", "221326", "2211", "22.126"] {
        assert_eq!(day(bad), None, "{bad}");
    }
    assert!(matches!(
        parse(&sentence("GPGGA,,,,,,0")),
        Err(Error::Field)
    ));
}

#[test]
fn other_sentences_pass_and_damage_does_not() {
    for text in [
        "GNTXT,01,01,02,ANT OK",
        "GPGSV,1,1,00",
        "PUBX,00,1",
        "HEHDT,1.0,T",
        "IIGGA,1",
        "A",
    ] {
        let bytes = sentence(text);
        assert_eq!(scan(&bytes), Scan::Other(bytes.len()), "{text}");
        assert_eq!(parse(&bytes), Err(Error::Content));
    }
    for (at, _) in GGA.char_indices().skip(1) {
        for bit in 0..8 {
            let mut bytes = GGA.as_bytes().to_vec();
            bytes[at] ^= 1 << bit;
            let same = bytes[at] == b'f'; // of the checksum
            assert_eq!(parse(&bytes).is_err(), !same, "byte {at} bit {bit}");
        }
    }
    let long = sentence(&format!("GNTXT,{}", "x".repeat(200)));
    assert_eq!(scan(&long), Scan::Garbage);
    let longest = sentence(&format!("GNTXT,{}", "x".repeat(LONGEST - 12)));
    assert_eq!(
        (longest.len(), scan(&longest)),
        (LONGEST, Scan::Other(LONGEST))
    );
}

#[test]
fn every_talker_of_satellite_receivers() {
    for talker in ["GP", "GN", "GL", "GA", "GB", "BD", "GQ", "QZ", "GI"] {
        let part = of(&format!(
            "{talker}GGA,092725.20,4717.11399,N,00833.91590,E,1,9,1.0,1.0,M,1.0,M"
        ));
        assert!(part.position.is_some(), "{talker}");
    }
}

#[test]
fn the_date_of_zda() {
    let day = |parts: &str| date(&sentence(&format!("GPZDA,092725.20,{parts},00,00")));
    assert_eq!(day("22,11,2026"), Some((0, TIME_MS)));
    assert_eq!(day("29,02,2024"), Some((4, TIME_MS)));
    assert_eq!(date(RMC.as_bytes()), None);
    assert_eq!(date(&sentence("GPZDA,,22,11,2026,00,00")), None);
    for none in [
        ",,",
        "22,11,26",
        "22,13,2026",
        "0,11,2026",
        "22,11,2100",
        "2.2,11,2026",
    ] {
        assert_eq!(day(none), None, "{none}");
    }
}

/// Any fields of a sentence give values in their ranges, or none.
#[test]
fn any_fields() {
    use proptest::prelude::*;
    let field = prop_oneof![
        "[0-9]{0,8}(\\.[0-9]{0,10})?",
        "[NSEWADRFPV0-9]?",
        "[ -#%-)+-~]{0,12}",
    ];
    let sentences = prop::sample::select(std::vec![
        "GGA", "GNS", "RMC", "GLL", "VTG", "GST", "HDT", "THS", "ZDA"
    ]);
    let strategy = (sentences, prop::collection::vec(field, 0..12));
    proptest!(ProptestConfig::with_cases(5000), |((name, fields) in strategy)| {
        let fields: Vec<String> = fields.iter().map(|f| f.replace(['$', '*', '!'], "")).collect();
        let bytes = sentence(&format!("GN{name},{}", fields.join(",")));
        let Ok(part) = parse(&bytes) else { return Ok(()) };
        if let Some(position) = part.position {
            prop_assert!(position.is_plausible() || part.own[2] == NOT_MEASURED);
        }
        if let Some(velocity) = part.velocity {
            prop_assert!(velocity.iter().all(|v| v.is_finite()));
        }
        prop_assert!(part.own.iter().all(|own| *own >= 0.0));
        prop_assert!(part.stated.iter().chain(&part.assumed).all(|sigma| *sigma > 0.0));
        if let Time::Day(ms) = part.time {
            prop_assert!(ms < 86_401_000);
        }
    });
}
