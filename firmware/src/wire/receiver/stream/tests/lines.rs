//! Lines as receivers and loggers make them. The protocol is configured or detected.

use super::*;
use crate::wire::checksum::{fletcher8, xmodem};

/// Fixes of a line: times of validity, complete and arrived (ms), measured values.
type Fixes = Vec<(u32, u64, u64, u8)>;

/// Reads seconds of a line at 115 200 bit/s in pieces of this size.
fn read(
    configured: Option<ReceiverFormat>,
    seconds: &[Vec<u8>],
    piece: usize,
) -> (Receiver, Fixes) {
    let mut wire = Wire::new(configured);
    (wire.piece, wire.byte_us) = (piece, 87);
    for (second, bytes) in (1..).zip(seconds) {
        wire.silent_until(1_000_000 * second);
        wire.send(bytes);
    }
    wire.silent_until(wire.us + 500_000);
    let fixes = wire.found.iter().filter_map(|(us, solution)| {
        let fix = solution.fix?;
        let given = (0..6).filter(|value| fix.has(*value..value + 1)).count();
        Some((fix.time_ms, us / 1000, fix.arrived_us / 1000, given as u8))
    });
    let fixes = fixes.collect();
    (wire.receiver, fixes)
}

/// A message of class NAV of so many bytes in all.
fn nav(id: u8, second: u32, len: usize) -> Vec<u8> {
    let mut message = std::vec![second as u8; len];
    message[..4].copy_from_slice(&[0xB5, 0x62, 1, id]);
    message[4..6].copy_from_slice(&(len as u16 - 8).to_le_bytes());
    message[6..10].copy_from_slice(&(second * 1000).to_le_bytes());
    let sum = fletcher8(&message[2..len - 2]);
    message[len - 2..].copy_from_slice(&sum);
    message
}

fn pvt(second: u32) -> Vec<u8> {
    let pvt = Pvt {
        time_of_week: second * 1000,
        fix: 3,
        flags: 1,
        horizontal_accuracy: 1000,
        vertical_accuracy: 1000,
        speed_accuracy: 100,
        ..Pvt::default()
    };
    pvt.emit().to_vec()
}

fn block(id: u16, second: u32, len: usize) -> Vec<u8> {
    let mut block = std::vec![second as u8; len];
    block[..2].copy_from_slice(b"$@");
    block[4..6].copy_from_slice(&id.to_le_bytes());
    block[6..8].copy_from_slice(&(len as u16).to_le_bytes());
    block[8..12].copy_from_slice(&(second * 1000).to_le_bytes());
    let sum = xmodem(&block[4..]);
    block[2..4].copy_from_slice(&sum.to_le_bytes());
    block
}

fn seconds(of: impl Fn(u32) -> Vec<u8>) -> Vec<Vec<u8>> {
    (0..60).map(of).collect()
}

/// What a u-blox receiver sends each second, and a Septentrio with two long blocks: no epoch is
/// lost, whether the protocol is configured or not, however the line is cut.
#[test]
fn long_messages_between_fixes_cost_none() {
    use ReceiverFormat::{Sbf, Ubx};
    let ubx = seconds(|n| [pvt(n), nav(0x35, n, 408), nav(0x43, n, 664)].concat());
    let sbf = seconds(|n| {
        let mut pvt = Sbf.example(0);
        pvt[8..12].copy_from_slice(&(n * 1000).to_le_bytes());
        let sum = xmodem(&pvt[4..]);
        pvt[2..4].copy_from_slice(&sum.to_le_bytes());
        [pvt, block(4027, n, 920), block(4013, n, 1312)].concat()
    });
    for (format, line) in [(Ubx, ubx), (Sbf, sbf)] {
        let times: Vec<u32> = (0..60).map(|n| n * 1000).collect();
        for configured in [None, Some(format)] {
            for piece in [1, 16, 64, 256] {
                let (receiver, fixes) = read(configured, &line, piece);
                let found: Vec<_> = fixes.iter().map(|(ms, ..)| *ms).collect();
                assert_eq!(found, times, "{format:?} {configured:?} {piece}");
                assert!(fixes.iter().all(|(.., given)| *given == 6));
                assert_eq!(receiver.format(), Some(format));
            }
        }
    }
}

/// Two protocols: that with the vertical velocity is used, whichever comes first in a second. It
/// loses nothing; the other one may have given the first epoch.
#[test]
fn of_two_protocols_the_better_one_is_used() {
    let text = |n| nmea(n, "221126", 0, &["RMC", "GGA"]);
    let first = seconds(|n| [pvt(n), text(n)].concat());
    let last = seconds(|n| [text(n), pvt(n)].concat());
    let faster = seconds(|n| [text(n), text(n + 100), text(n + 200), pvt(n)].concat());
    for (line, extra) in [(first, 0), (last, 1), (faster, 3)] {
        let (receiver, whole) = read(None, &line, 1);
        assert_eq!(receiver.format(), Some(ReceiverFormat::Ubx));
        let (of_text, of_ubx) = whole.split_at(whole.len() - 60);
        assert!(of_text.len() <= extra, "{of_text:?}");
        assert!(of_ubx.iter().all(|(.., given)| *given == 6));
        for piece in [7, 64, 256] {
            let (_, cut) = read(None, &line, piece);
            let same = |fixes: &Fixes| {
                fixes
                    .iter()
                    .map(|(ms, .., n)| (*ms, *n))
                    .collect::<Vec<_>>()
            };
            assert_eq!(same(&cut), same(&whole), "{piece}");
        }
    }
    // UBX without velocities does not displace NMEA with them
    let poor = seconds(|n| {
        let mut position = nav(0x02, n, 36);
        position[26..34].fill(1);
        position[10..26].fill(0);
        let sum = fletcher8(&position[2..34]);
        position[34..].copy_from_slice(&sum);
        [position, text(n)].concat()
    });
    let (receiver, fixes) = read(None, &poor, 64);
    assert_eq!(receiver.format(), Some(ReceiverFormat::Nmea));
    assert!(fixes.iter().filter(|(.., given)| *given == 5).count() >= 59);
    // a receiver that is set to the other protocol on the way is followed within half a minute
    let changed = seconds(|n| if n < 20 { pvt(n) } else { text(n) });
    let (receiver, fixes) = read(None, &changed, 64);
    assert_eq!(receiver.format(), Some(ReceiverFormat::Nmea));
    assert!(fixes.len() >= 30, "{}", fixes.len());
}

/// What stands between and behind the sentences does not matter.
#[test]
fn lines_of_loggers() {
    let plain = |n| nmea(n, "221126", 0, &["RMC", "GGA", "GST"]);
    let times: Vec<u32> = (0..60).map(|n| n * 1000).collect();
    let ends = |end: &'static str| move |line: &str| format!("{line}{end}");
    let changes: [&dyn Fn(&str) -> std::string::String; 10] = [
        &ends("\r\n"),
        &ends("\n"),
        &ends("\r"),
        &ends("\r\r\n"),
        &ends("\n\n\n"),
        &|line| format!("\\s:r3669961,c:1120959341*01\\{line}\r\n"),
        &|line| format!("2026-11-22T12:00:00.123 gps0: {line}\r\n"),
        &|line| format!("x{line}\r\n$GPXXX,{}*00\r\n", "9".repeat(200)),
        &|line| format!("{}\r\n", line.replace("GN", "GQ")),
        &|line| {
            let (text, sum) = line.split_once('*').unwrap();
            format!("{text}*{}\n", sum.to_lowercase())
        },
    ];
    for (at, change) in changes.iter().enumerate() {
        let line = seconds(|n| {
            let text = std::string::String::from_utf8(plain(n)).unwrap();
            let changed: std::string::String =
                text.lines().map(|line| resealed(&change(line))).collect();
            changed.into_bytes()
        });
        for configured in [None, Some(ReceiverFormat::Nmea)] {
            for piece in [1, 50, 256] {
                let (receiver, fixes) = read(configured, &line, piece);
                let found: Vec<_> = fixes.iter().map(|(ms, ..)| *ms).collect();
                assert_eq!(found, times, "change {at} {configured:?} {piece}");
                assert_eq!(receiver.format(), Some(ReceiverFormat::Nmea));
                // complete with the last sentence, or after a silence where only that ends it
                let late = fixes.iter().map(|(_, us, at, _)| us - at).max().unwrap();
                assert!(late < 160, "change {at} {late}");
            }
        }
    }
}

/// A changed talker needs another checksum.
fn resealed(line: &str) -> std::string::String {
    match line.split_once("$GQ").zip(line.rsplit_once('*')) {
        Some(((before, _), (text, end))) => {
            let text = &text[before.len() + 1..];
            let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
            format!("{before}${text}*{sum:02X}{}", &end[2..])
        }
        None => line.into(),
    }
}

/// Sentences without a checksum count where NMEA is configured and none has one.
#[test]
fn missing_checksums_are_read_where_they_are_told() {
    let bare = |n: u32| {
        let text = std::string::String::from_utf8(nmea(n, "221126", 0, &["RMC", "GGA"])).unwrap();
        let lines = text
            .lines()
            .map(|line| format!("{}\r\n", &line[..line.len() - 3]));
        lines.collect::<std::string::String>().into_bytes()
    };
    let line = seconds(bare);
    let configured = Some(ReceiverFormat::Nmea);
    for piece in [1, 64] {
        assert_eq!(read(configured, &line, piece).1.len(), 60);
        let (receiver, fixes) = read(None, &line, piece);
        assert_eq!((receiver.format(), fixes.len()), (None, 0));
    }
    // damage on a line whose sentences have checksums
    let mixed = seconds(|n| match n % 2 {
        0 => nmea(n, "221126", 0, &["RMC", "GGA"]),
        _ => bare(n),
    });
    assert_eq!(read(configured, &mixed, 64).1.len(), 30);
}

/// The day of the week is known from the first date on, by RMC or ZDA. Here it comes behind a fix
/// that did not wait for it.
#[test]
fn a_fix_tells_whether_its_day_is_known() {
    let mut wire = Wire::new(Some(ReceiverFormat::Nmea));
    for second in 0..6 {
        wire.silent_until(1_000_000 * (1 + u64::from(second)));
        wire.send(&nmea(second, "", 0, &["GGA"]));
        if second == 3 {
            wire.send(&sentence("GPZDA,000003.00,27,11,2026,00,00"));
        }
    }
    wire.silent_until(wire.us + 500_000);
    let fixes = wire
        .found
        .iter()
        .map(|(_, s)| (s.dated, s.fix.unwrap().time_ms));
    let friday = 5 * 86_400_000;
    let want = [(false, 0), (false, 1000), (false, 2000), (false, 3000)];
    assert_eq!(fixes.clone().take(4).collect::<Vec<_>>(), want);
    let dated = [(true, friday + 4000), (true, friday + 5000)];
    assert_eq!(fixes.skip(4).collect::<Vec<_>>(), dated);
}
