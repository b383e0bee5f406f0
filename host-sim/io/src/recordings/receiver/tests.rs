use super::*;
use crate::recordings::record::Kind;
use firmware::wire::ubx::Pvt;
use test_bench::recordings::{file, message};

fn ubx(ms: u32) -> Vec<u8> {
    let pvt = Pvt {
        time_of_week: ms,
        fix: 3,
        flags: 1,
        latitude: 470_000_001,
        horizontal_accuracy: 1414,
        velocity: [1000, -500, 0],
        ..Pvt::default()
    };
    pvt.emit().to_vec()
}

fn nmea(sentence: &str) -> Vec<u8> {
    let sum = sentence.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${sentence}*{sum:02X}\r\n").into_bytes()
}

fn log(bytes: &[u8]) -> Result<Log, Error> {
    let (_dir, path) = file("in.log", bytes);
    read(&path, None, &|_, _| ())
}

/// A recording of rates from this time on.
fn record(start: f64) -> Record {
    Record {
        time: vec![start, start + 0.01].into(),
        kind: Kind::Rate,
        ..Record::default()
    }
}

#[test]
fn ubx_over_the_end_of_a_week() {
    let bytes: Vec<u8> = (0..20)
        .flat_map(|k| ubx((604_790_000 + 1000 * k) % 604_800_000))
        .collect();
    let log = log(&bytes).unwrap();
    assert_eq!((log.format, log.fixes.len()), (ReceiverFormat::Ubx, 20));
    let times: Vec<f64> = log.fixes.iter().map(|f| f.time).collect();
    assert_eq!(
        (times[0], times[10], times[19]),
        (604_790.0, 604_800.0, 604_809.0)
    );
    let f = log.fixes[3];
    assert!((f.lat_deg - 47.000_000_1).abs() < 1e-12);
    assert!((f.sigmas[0] - 1.0).abs() < 1e-3 && !f.has(2..3) && !f.has(3..6));
    // samples in seconds of week, in UTC, and from 0 with a known origin
    let at = |record: &mut Record, origin| {
        log.clone().beside(record, origin);
        record.fixes[0].time
    };
    assert_eq!(at(&mut record(604_780.0), None), 604_790.0);
    // GPS week 2300 ended on 2024-02-11 at 0 h GPS time, 18 s before in UTC
    let utc = 315_964_800.0 + 2301.0 * 604_800.0 - 18.0 - 10.0;
    assert_eq!(at(&mut record(utc - 3.0), None), utc);
    assert_eq!(at(&mut record(0.0), Some(utc + 5.0)), -5.0);
}

/// A log that a terminal has stored in UTF-16. Bytes that only begin like its mark are none.
#[test]
fn text_in_utf16_is_read() {
    let rmc = |k: u32| {
        nmea(&format!(
            "GPRMC,1200{k:02},A,4500.0,N,00500.0,E,1.0,90.0,271126,,"
        ))
    };
    let text: Vec<u8> = (0..5).flat_map(rmc).collect();
    let wide = [0xFF, 0xFE]
        .into_iter()
        .chain(text.iter().flat_map(|byte| [*byte, 0]));
    let [plain, wide] = [text.clone(), wide.collect()].map(|bytes| log(&bytes).unwrap());
    assert_eq!(plain.fixes.len(), 5);
    assert_eq!(plain.fixes, wide.fixes);
    let garbage = [&[0xFF, 0xFE][..], &ubx(1000), &ubx(2000)].concat();
    assert_eq!(log(&garbage).unwrap().fixes.len(), 2);
}

#[test]
fn nmea_is_in_utc_and_read_in_gps_time() {
    // 29 February 2024 is a Thursday
    let bytes: Vec<u8> = (0..30)
        .flat_map(|k| {
            [
                nmea(&format!(
                    "GNRMC,1235{k:02}.00,A,4730.000,N,00830.000,E,19.438,090.0,290224,,,A"
                )),
                nmea(&format!(
                    "GNGGA,1235{k:02}.00,4730.000,N,00830.000,E,1,12,0.8,400.0,M,48.0,M,,"
                )),
            ]
            .concat()
        })
        .collect();
    let log = log(&bytes).unwrap();
    assert_eq!(log.format, ReceiverFormat::Nmea);
    assert!((29..=30).contains(&log.fixes.len()), "{}", log.fixes.len());
    let last = log.fixes.last().unwrap();
    assert_eq!(
        last.time,
        f64::from(4 * 86_400 + 12 * 3600 + 35 * 60 + 29 + 18)
    );
    assert!((last.lat_deg - 47.5).abs() < 1e-9 && (last.lon_deg - 8.5).abs() < 1e-9);
    assert!((last.height_m - 448.0).abs() < 1e-9);
    assert!(
        (last.velocity[1] - 10.0).abs() < 1e-3,
        "{:?}",
        last.velocity
    );
}

#[test]
fn what_is_no_log_of_a_receiver_is_named() {
    let text = why(&[b'x'; 5000]);
    assert!(
        text.starts_with("in.log: 'fixes' has no messages of a receiver"),
        "{text}"
    );
    let bad: Vec<u8> = (0..9)
        .flat_map(|_| nmea("GNGGA,,,,,,0,00,,,M,,M,,"))
        .collect();
    let text = why(&bad);
    assert!(text.contains("NMEA: 9 GGA, none with a fix"), "{text}");
}

/// A gzipped log that is cut is read up to there.
#[test]
fn a_gzipped_log_that_is_cut_is_read_up_to_the_cut() {
    let bytes: Vec<u8> = (0..2000u32).flat_map(|k| ubx(1000 * k)).collect();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packed, &bytes).unwrap();
    let packed = packed.finish().unwrap();
    let part = log(&packed[..packed.len() / 2]).unwrap();
    let count = part.fixes.len();
    assert!((100..2000).contains(&count), "{count}");
    assert!(part.notes[0].starts_with("the gzip stream is cut"));
    let whole = log(&packed).unwrap();
    assert_eq!((whole.fixes.len(), whole.notes.len()), (2000, 0));
    assert_eq!(whole.fixes[count - 1].time, part.fixes[count - 1].time);
}

/// A receiver that restarts, or whose clock is set, goes back in time: the longest part is read.
#[test]
fn a_clock_that_goes_back_divides_the_log() {
    let times = [50_000, 51_000, 1000, 2000, 3000, 3000];
    let found = log(&times.map(ubx).concat()).unwrap();
    let seconds: Vec<f64> = found.fixes.iter().map(|fix| fix.time).collect();
    assert_eq!(seconds, [1.0, 2.0, 3.0]);
    let note = "the receiver's clock goes back within the log; of its 5 fixes the 3 in the longest";
    assert!(found.notes[0].starts_with(note), "{:?}", found.notes);
}

fn read_as(bytes: &[u8], format: ReceiverFormat) -> Result<Log, Error> {
    let (_dir, path) = file("in.log", bytes);
    read(&path, Some(format), &|_, _| ())
}

/// The sentences of a second of the day.
fn epoch(second: u32, kinds: &[&str], date: &str) -> Vec<u8> {
    let second = second % 86_400;
    let time = format!(
        "{:02}{:02}{:02}.00",
        second / 3600,
        second / 60 % 60,
        second % 60
    );
    let place = "4730.000,N,00830.000,E";
    let sentences = kinds.iter().flat_map(|kind| match *kind {
        "GGA" => nmea(&format!("GNGGA,{time},{place},1,12,0.8,400.0,M,48.0,M,,")),
        "RMC" => nmea(&format!("GNRMC,{time},A,{place},19.438,090.0,{date},,,A")),
        "ZDA" => nmea(&format!("GNZDA,{time},{date},00,00")),
        other => panic!("{other}"),
    });
    sentences.collect()
}

#[test]
fn of_two_protocols_the_better_fixes_are_used() {
    let mixed: Vec<u8> = (0..30)
        .flat_map(|k| {
            [
                epoch(43_200 + k, &["RMC", "GGA"], "290224"),
                ubx(475_218_000 + 1000 * k),
            ]
            .concat()
        })
        .collect();
    // NAV-PVT here has a position alone
    let log = log(&mixed).unwrap();
    assert_eq!((log.format, log.fixes.len()), (ReceiverFormat::Nmea, 30));
    let [note] = &log.notes[..] else {
        panic!("{:?}", log.notes)
    };
    assert!(
        note.contains("UBX is in the log, too, with 30 fixes; --fixes-protocol ubx"),
        "{note}"
    );
    let log = read_as(&mixed, ReceiverFormat::Ubx).unwrap();
    assert_eq!(
        (log.format, log.fixes.len(), log.notes.len()),
        (ReceiverFormat::Ubx, 30, 0)
    );
    let text = message(&read_as(&mixed, ReceiverFormat::Sbf).unwrap_err());
    assert!(text.contains("has no SBF messages"), "{text}");
    // fixes with more values do not make up for most of the time
    for (good, want) in [(30, ReceiverFormat::Nmea), (80, ReceiverFormat::Ubx)] {
        let better = |k| {
            let pvt = Pvt {
                vertical_accuracy: 1000,
                speed_accuracy: 100,
                ..Pvt::parse(&ubx(1000 * k)).unwrap()
            };
            pvt.emit().to_vec()
        };
        let some: Vec<u8> = (0..100)
            .flat_map(|k| {
                let text = epoch(k, &["RMC", "GGA"], "290224");
                if k < good {
                    [text, better(k)].concat()
                } else {
                    text
                }
            })
            .collect();
        let (_dir, path) = file("in.log", &some);
        let log = read(&path, None, &|_, _| ()).unwrap();
        assert_eq!(log.format, want);
    }
}

/// A log that begins at a GGA, or has its first date days later, has all its fixes on their days.
#[test]
fn a_date_counts_for_the_whole_log() {
    let thursday = 4 * 86_400;
    let late = 86_400 - 10;
    let times = |bytes: &[u8]| {
        let log = log(bytes).unwrap();
        assert!(log.dated && log.notes.is_empty());
        let times = log.fixes.iter().map(|fix| fix.time as i64 - 18);
        times.collect::<Vec<_>>()
    };
    let want: Vec<i64> = (0..20).map(|k| i64::from(thursday + late + k)).collect();
    // GGA first; the date behind midnight, in RMC or ZDA; before it only
    let begins: Vec<u8> = (0..20)
        .flat_map(|k| {
            let date = if k < 10 { "290224" } else { "010324" };
            epoch(late + k, &["GGA", "RMC"], date)
        })
        .collect();
    assert_eq!(times(&begins), want);
    for (kind, date, at) in [
        ("RMC", "010324", 15),
        ("ZDA", "01,03,2024", 15),
        ("ZDA", "29,02,2024", 3),
        ("RMC", "010324", 19),
        ("ZDA", "01,03,2024", 10),
    ] {
        let bytes: Vec<u8> = (0..20)
            .flat_map(|k| match k == at {
                true => epoch(late + k, &["GGA", kind], date),
                false => epoch(late + k, &["GGA"], ""),
            })
            .collect();
        assert_eq!(times(&bytes), want, "{kind} {at}");
    }
}

#[test]
fn without_a_date_the_day_is_that_of_the_samples() {
    let bytes: Vec<u8> = (0..60)
        .flat_map(|k| epoch(86_370 + k, &["GGA"], ""))
        .collect();
    let log = log(&bytes).unwrap();
    assert!(!log.dated && log.notes[0].contains("no date is in the log"));
    let placed = |start: f64, origin: Option<f64>| {
        let mut record = Record {
            time: vec![start, start + 60.0].into(),
            ..Record::default()
        };
        log.clone().beside(&mut record, origin);
        let times = record.fixes.iter().map(|fix| fix.time - start);
        times.collect::<Vec<_>>()
    };
    let want: Vec<f64> = (0..60).map(f64::from).collect();
    let near = |times: Vec<f64>| times.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-6);
    // seconds of week (GPS is 18 s ahead), UTC since 1970, and from 0 with a known origin
    let tuesday = 2.0 * 86_400.0;
    assert!(near(placed(tuesday + 86_370.0 + 18.0, None)));
    let day = 19_782.0 * 86_400.0;
    assert!(near(placed(day + 86_370.0, None)));
    assert!(near(placed(0.0, Some(day + 86_370.0))));
}

/// Times of week that cannot be are refused or read, whatever they add up to.
#[test]
fn wild_times_are_no_defect_of_the_program() {
    for times in [[u32::MAX, 0], [0, u32::MAX], [u32::MAX, u32::MAX - 2000]] {
        let read = log(&times.map(ubx).concat());
        assert!(read.is_err() || read.unwrap().fixes.iter().all(|fix| fix.time.is_finite()));
    }
}

#[test]
fn what_was_seen_is_named() {
    let frame = |class: u8, id: u8| {
        let mut frame = vec![0xB5, 0x62, class, id, 4, 0, 1, 2, 3, 4];
        let sum = frame[2..].iter().fold([0u8; 2], |[a, b], byte| {
            let a = a.wrapping_add(*byte);
            [a, b.wrapping_add(a)]
        });
        frame.extend(sum);
        frame
    };
    let other: Vec<u8> = (0..12)
        .flat_map(|_| [frame(1, 0x35), frame(2, 0x15), frame(0x33, 7)].concat())
        .collect();
    let text = why(&[other, nmea("GPGSV,1,1,00")].concat());
    let want = "UBX: 12 33-07, 12 NAV-SAT, 12 RXM-RAWX, wanted NAV-PVT, or NAV-POSLLH and NAV-VELNED; \
                NMEA: 1 GSV, wanted GGA, GNS, RMC or GLL of a receiver";
    assert!(text.contains(want), "{text}");
    // messages that are longer than a device holds are only named
    let raw = [&[0xB5, 0x62, 2, 0x15, 0x90, 2][..], &[0; 658]].concat();
    let text = why(&raw.repeat(5));
    assert!(text.contains("UBX: 5 RXM-RAWX, wanted NAV-PVT"), "{text}");
    let ships = [
        "INGGA,092725.20,4717.11399,N,00833.91590,E,1,9,1.0,1.0,M,1.0,M",
        "ECRMC",
    ];
    let text = why(&ships.map(nmea).concat());
    let want = "NMEA: 1 ECRMC, 1 INGGA, wanted GGA, GNS, RMC or GLL of a receiver (GP,";
    assert!(text.contains(want), "{text}");
    let bare: Vec<u8> = epoch(0, &["GGA", "RMC"], "290224")
        .split(|byte| *byte == b'\n')
        .filter(|line| line.len() > 4)
        .flat_map(|line| [&line[..line.len() - 4], b"\r\n"].concat())
        .collect();
    let text = why(&bare);
    assert!(
        text.contains("1 GGA, 1 RMC without a checksum; remedy: give --fixes-protocol nmea"),
        "{text}"
    );
    assert_eq!(read_as(&bare, ReceiverFormat::Nmea).unwrap().fixes.len(), 1);
    let text = why(b"$@\x40\x0f\xa8\x17\x08\x00");
    assert!(text.contains("messages of a receiver"), "{text}");
}

fn summed(begin: &[u8], sum: u16, end: &[u8]) -> Vec<u8> {
    [begin, &sum.to_be_bytes(), end].concat()
}

/// Messages of the protocols that are not read, after their descriptions.
#[test]
fn protocols_that_are_not_read_are_named() {
    let dle = |inner: &[u8]| [&[0x10][..], inner, &[0x10, 3]].concat();
    let zodiac = [0x81FF_u16, 1003, 1, 0].map(u16::to_le_bytes).concat();
    let minus = 0_u16.wrapping_sub(0x81FF + 1003 + 1).to_le_bytes();
    let garmin = [0x33, 2, 7, 5, 0_u8.wrapping_sub(0x33 + 2 + 7 + 5)];
    let star: Vec<u8> = vec![1, 20, !20, 2, 7, 9];
    let sum: u16 = star.iter().map(|byte| u16::from(*byte)).sum();
    let named = [
        (
            "SiRF",
            summed(&[0xA0, 0xA2, 0, 3, 2, 4, 6], 12, &[0xB0, 0xB3]),
        ),
        (
            "SkyTraq",
            [&[0xA0, 0xA1, 0, 2, 0xDF, 1, 0xDE][..], b"\r\n"].concat(),
        ),
        ("Zodiac", [&zodiac[..], &minus, &[9, 0, 247, 255]].concat()),
        (
            "iTalk",
            [&b"<!\x26\x7F\x01\x00\x02"[..], &[5; 6], b">"].concat(),
        ),
        ("SuperStar", summed(&star, sum.swap_bytes(), &[])),
        ("NCT", vec![2, 0x99, 0x66, 0x20, 4, 0, 0x20, 3]),
        ("GREIS", greis(b"RT005\x01bcd")),
        ("GeoStar", [&b"PSGG\x10\0\x01\0"[..], &[3; 8]].concat()),
        ("Garmin", dle(&garmin)),
        ("EverMore", dle(&[2, 5, 8, 9, 17])),
        ("TSIP", dle(&[0x46, 0, 0x10, 0x10, 7])),
        (
            "AIS",
            b"!AIVDM,1,1,,B,35MsUdPOh8JwI:0HUwquiIFH21>i,0*09\r\n".to_vec(),
        ),
        ("RTCM 3", rtcm(&[0x3E, 0xD0, 0, 3])),
    ];
    for (name, message) in named {
        let text = why(&[b"# a receiver\n".to_vec(), message.repeat(8)].concat());
        assert!(text.contains("messages, not read"), "{text}");
        assert!(text.contains(&format!("seen are {name}")), "{text}");
        assert!(text.contains(": 8 messages"), "{text}");
        let is_position = text.contains("gpspipe -w");
        assert_eq!(is_position, !["AIS", "RTCM 3"].contains(&name), "{text}");
    }
    // beside a protocol that is read and holds no fix
    let both = [nmea("GPGSV,1,1,00"), rtcm(&[0x3E, 0xD0, 0, 3])].concat();
    let text = why(&both.repeat(5));
    let want = "NMEA: 5 GSV, wanted GGA, GNS, RMC or GLL of a receiver";
    assert!(
        text.contains(want) && text.contains("; RTCM 3 (corrections): 5 messages"),
        "{text}"
    );
    let coded: Vec<u8> = (0..500_u32)
        .map(|k| 0x40 | (k * k * 7 % 61) as u8)
        .collect();
    assert!(why(&coded.repeat(3)).contains("messages of a receiver that is known"));
    let coded: Vec<u8> = (0..500_u32).map(|k| 0x40 | (k * 37 % 64) as u8).collect();
    assert!(why(&coded).contains("seen are RTCM 2 (corrections), not read"));
}

fn why(bytes: &[u8]) -> String {
    message(&log(bytes).unwrap_err())
}

/// Its last byte is the checksum.
fn greis(message: &[u8]) -> Vec<u8> {
    let sum = message
        .iter()
        .fold(0_u8, |sum, byte| sum.rotate_left(2) ^ byte);
    [message, &[sum.rotate_left(2)], b"\n"].concat()
}

/// With CRC-24Q, bit by bit.
fn rtcm(body: &[u8]) -> Vec<u8> {
    let mut bytes = [&[0xD3, 0, body.len() as u8][..], body].concat();
    let mut crc = 0_u32;
    for bit in 0..8 * bytes.len() {
        let new = u32::from(bytes[bit / 8] >> (7 - bit % 8) & 1);
        let top = crc >> 23 & 1;
        crc = (crc << 1) & 0xFF_FFFF;
        if top != new {
            crc ^= 0x86_4CFB;
        }
    }
    bytes.extend(&crc.to_be_bytes()[1..]);
    bytes
}
