use super::*;
use crate::fix::NOT_MEASURED;
use crate::wire::examples::Examples;
use crate::wire::nmea::tests::sentence;
use crate::wire::receiver::epoch::Values;
use crate::wire::ubx::Pvt;
use std::format;
use std::vec::Vec;

mod lines;

/// A line with its clock: a byte takes `byte_us`.
struct Wire {
    receiver: Receiver,
    us: u64,
    byte_us: u64,
    piece: usize,
    found: Vec<(u64, Solution)>,
}

impl Wire {
    fn new(format: Option<ReceiverFormat>) -> Wire {
        Wire {
            receiver: Receiver::new(format),
            us: 1_000_000,
            byte_us: 1042, // 9600 bit/s
            piece: 1,
            found: Vec::new(),
        }
    }

    fn take(&mut self) {
        while let Some(solution) = self.receiver.next_fix() {
            self.found.push((self.us, *solution));
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        for piece in bytes.chunks(self.piece) {
            let now = Arrival {
                us: self.us,
                sample: (self.us / 1000) as u32,
            };
            self.receiver.push(piece, now);
            self.take();
            self.us += self.byte_us * piece.len() as u64;
        }
    }

    /// Until this time nothing comes; the application looks every 10 ms.
    fn silent_until(&mut self, us: u64) {
        while self.us < us {
            if self.receiver.is_due(self.us) {
                let now = Arrival {
                    us: self.us,
                    sample: 0,
                };
                self.receiver.push(&[], now);
                self.take();
            }
            self.us = (self.us + 10_000).min(us);
        }
    }

    /// Times after the whole second at which fixes were complete, and of their arrivals, ms.
    fn times(&self) -> Vec<(u64, u64)> {
        let ms = |us: u64| us / 1000 % 1000;
        let times = self.found.iter().map(|(us, s)| (ms(*us), ms(s.arrival.us)));
        times.collect()
    }
}

/// The sentences of one second, with others among them that take some time.
fn nmea(second: u32, date: &str, others: usize, kinds: &[&str]) -> Vec<u8> {
    let time = format!(
        "{:02}{:02}{:02}.00",
        second / 3600 % 24,
        second / 60 % 60,
        second % 60
    );
    let mut bytes = Vec::new();
    for kind in kinds {
        bytes.extend(match *kind {
            "RMC" => sentence(&format!(
                "GNRMC,{time},A,4717.11399,N,00833.91590,E,10.000,90.00,{date},,,A"
            )),
            "GGA" => sentence(&format!(
                "GNGGA,{time},4717.11399,N,00833.91590,E,1,12,1.00,499.6,M,48.1,M,,"
            )),
            "GST" => sentence(&format!("GNGST,{time},1.8,,,,0.7,0.6,1.2")),
            "HDT" => sentence("GNHDT,90.00,T"),
            "ZDA" => {
                // 22 November 2026 is a Sunday
                let date = if second < 86_400 { "21" } else { "22" };
                sentence(&format!("GPZDA,{time},{date},11,2026,00,00"))
            }
            "GLL" => sentence(&format!("GNGLL,4717.11399,N,00833.91590,E,{time},A,A")),
            other => panic!("{other}"),
        });
        for n in 0..others {
            bytes.extend(sentence(&format!(
                "GPGSV,3,{n},11,03,03,111,00,04,15,270,00,06,01,010,00,13,06,292,00"
            )));
            bytes.extend(sentence("GNTXT,01,01,02,ANT OK"));
        }
    }
    bytes
}

/// The age of a fix is counted from the first byte: it does not depend on how many other sentences
/// are among those that are read, at 9600 bit/s half a second's worth of them.
#[test]
fn a_fix_arrives_with_its_first_byte_and_is_complete_with_its_last_kind() {
    let mut wire = Wire::new(Some(ReceiverFormat::Nmea));
    for second in 0..6 {
        wire.silent_until(1_000_000 * (1 + u64::from(second)) + 80_000);
        wire.send(&nmea(
            second,
            "221126",
            (second % 3) as usize,
            &["RMC", "GGA", "GST"],
        ));
    }
    wire.silent_until(wire.us + 500_000);
    // 70, 81 and 37 bytes, and 96 of others
    let times = wire.times();
    assert_eq!(times.len(), 6);
    assert!(times.iter().all(|(_, arrival)| *arrival == 80), "{times:?}");
    let complete: Vec<_> = times.iter().map(|(complete, _)| *complete).collect();
    // the first one does not wait for GST, which nobody knows of yet
    let first = complete[0];
    assert!((225..235).contains(&first), "{complete:?}");
    assert!((262..280).contains(&complete[3]), "{complete:?}");
    assert!((460..480).contains(&complete[1]), "{complete:?}");
    let fix = wire.found[3].1.fix.unwrap();
    assert_eq!(
        fix.sigmas[..2].iter().filter(|s| **s < 1.0).count(),
        2,
        "{fix:?}"
    );
    assert_eq!(fix.sigmas[5], NOT_MEASURED);
    assert_eq!((fix.time_ms, fix.arrived_us), (3000, 4_080_000));
}

/// All bytes of a second at once, as a driver of a computer hands them over.
#[test]
fn the_size_of_the_pieces_changes_no_fix() {
    let of = |piece: usize| {
        let mut wire = Wire::new(Some(ReceiverFormat::Nmea));
        (wire.piece, wire.byte_us) = (piece, 100);
        for second in 0..5 {
            wire.silent_until(1_000_000 * (1 + u64::from(second)));
            wire.send(&nmea(second, "221126", 1, &["GGA", "RMC", "GST", "HDT"]));
        }
        wire.silent_until(wire.us + 500_000);
        let fixes = wire.found.iter().map(|(_, s)| s.fix.unwrap());
        fixes
            .map(|fix| {
                (
                    fix.time_ms,
                    fix.arrived_us,
                    fix.position,
                    fix.sigmas,
                    fix.heading,
                )
            })
            .collect::<Vec<_>>()
    };
    let one = of(1);
    assert_eq!(one.len(), 5);
    assert!(one[4].4.is_some());
    for piece in [7, 64, 256] {
        assert_eq!(of(piece), one, "{piece}");
    }
}

#[test]
fn a_kind_that_stays_away_is_waited_for_once() {
    let mut wire = Wire::new(Some(ReceiverFormat::Nmea));
    let kinds: [&[&str]; 6] = [
        &["GGA", "RMC", "GST"],
        &["GGA", "RMC", "GST"],
        &["GGA", "RMC"],
        &["GGA", "RMC"],
        &["GGA"],
        &["GGA"],
    ];
    for (second, kinds) in (0..).zip(kinds) {
        wire.silent_until(1_000_000 * (1 + u64::from(second)));
        wire.send(&nmea(second, "221126", 0, kinds));
    }
    wire.silent_until(wire.us + 500_000);
    let complete: Vec<_> = wire.times().iter().map(|(complete, _)| *complete).collect();
    // silences of 0.1 s for GST and RMC
    let near = |at: usize, ms: u64| complete[at].abs_diff(ms) <= 12;
    assert!(
        near(1, 195) && near(2, 260) && near(3, 157) && near(4, 187) && near(5, 85),
        "{complete:?}"
    );
    let last = wire.found[5].1.fix.unwrap();
    assert!(last.has(0..3) && !last.has(3..4), "position alone");
}

/// Fixes of RMC alone, of GLL alone and of GLL and VTG; where GGA comes, nobody waits for GLL.
#[test]
fn rmc_and_gll_alone_are_fixes() {
    let complete = |kinds: &[&str]| {
        let mut wire = Wire::new(None);
        for second in 0..4 {
            wire.silent_until(1_000_000 * (1 + u64::from(second)));
            wire.send(&nmea(second, "221126", 0, kinds));
        }
        wire.silent_until(wire.us + 500_000);
        let fixes = wire.found.iter().map(|(_, s)| s.fix.unwrap());
        assert!(fixes.clone().all(|fix| fix.has(0..2) && !fix.has(2..3)) || kinds.contains(&"GGA"));
        (wire.found.len(), wire.times().last().unwrap().0)
    };
    let (rmc, gll) = (
        nmea(0, "221126", 0, &["RMC"]).len(),
        nmea(0, "", 0, &["GLL"]).len(),
    );
    for (kinds, bytes) in [
        (&["RMC"][..], rmc),
        (&["GLL"], gll),
        (&["GLL", "RMC"], gll + rmc),
        (&["RMC", "GGA", "GLL"], rmc + nmea(0, "", 0, &["GGA"]).len()),
    ] {
        let (fixes, ms) = complete(kinds);
        assert_eq!(fixes, 4, "{kinds:?}");
        assert!(
            ms.abs_diff(bytes as u64 * 1042 / 1000) <= 2,
            "{kinds:?} {ms}"
        );
    }
}

/// The date of ZDA, before and behind the sentences of its second, and that of the next second: no
/// fix is lost, and midnight counts once.
#[test]
fn dates_of_zda() {
    for (first, ahead) in [(true, 0), (false, 0), (true, 1), (false, 1)] {
        let mut wire = Wire::new(None);
        for n in 0..6 {
            let second = 86_397 + n;
            let zda = nmea(second + ahead, "", 0, &["ZDA"]);
            let rest = nmea(second, "", 0, &["GGA"]);
            wire.silent_until(1_000_000 * (1 + u64::from(n)));
            wire.send(&if first { [zda, rest] } else { [rest, zda] }.concat());
        }
        wire.silent_until(wire.us + 500_000);
        let fixes: Vec<u32> = wire
            .found
            .iter()
            .map(|(_, s)| s.fix.unwrap().time_ms)
            .collect();
        let week = 604_800_000;
        let want: Vec<u32> = (0..6).map(|n| (week - 3000 + 1000 * n) % week).collect();
        assert_eq!(fixes[1..], want[1..], "{first} {ahead}");
        assert!(fixes[0] == want[0] || fixes[0] == 86_397_000, "{fixes:?}");
        assert!(wire.found[1..].iter().all(|(_, s)| s.dated));
    }
}

#[test]
fn midnight_and_the_end_of_the_week() {
    // Saturday 21 November 2026, 23:59:58, and on; and the same without dates
    for dated in [true, false] {
        let mut wire = Wire::new(Some(ReceiverFormat::Nmea));
        let mut fixes = Vec::new();
        for n in 0..5 {
            let second = 86_398 + n;
            let date = match (dated, second < 86_400) {
                (false, _) => "",
                (true, true) => "211126",
                (true, false) => "221126",
            };
            wire.silent_until(1_000_000 * (1 + u64::from(n)));
            wire.send(&nmea(second, date, 0, &["GGA", "RMC"]));
            fixes.push(wire.found.last().unwrap().1.fix.unwrap().time_ms);
        }
        let week = 604_800_000;
        let start = if dated { week - 2000 } else { 86_398_000 };
        let want: Vec<u32> = (0..5).map(|n| (start + 1000 * n) % week).collect();
        assert_eq!(fixes, want);
    }
}

#[test]
fn one_message_decides_and_another_format_is_found_again() {
    for format in ReceiverFormat::ALL {
        let mut wire = Wire::new(None);
        (wire.piece, wire.byte_us) = (64, 10);
        wire.send(&[0x55; 40]);
        wire.send(&format.example(0)[3..]);
        assert_eq!(wire.receiver.format(), None);
        for n in 1..=3 {
            wire.send(&format.example(n));
        }
        assert_eq!(wire.receiver.format(), Some(format));
        // another receiver
        let other = ReceiverFormat::ALL[usize::from(format == ReceiverFormat::Ubx)];
        for n in 0..40 {
            wire.send(&other.example(n));
        }
        assert_eq!(wire.receiver.format(), Some(other), "{format:?}");
    }
    // configured, it stays
    let mut wire = Wire::new(Some(ReceiverFormat::Sbf));
    (0..200).for_each(|n| wire.send(&ReceiverFormat::Ubx.example(n)));
    assert_eq!(wire.receiver.format(), Some(ReceiverFormat::Sbf));
    assert!(wire.found.is_empty());
}

/// A plain NAV-PVT is handed over with its last byte; with NAV-RELPOSNED it waits for the heading.
#[test]
fn ubx_waits_only_for_what_comes() {
    let pvt = |second: u32| {
        let pvt = Pvt {
            time_of_week: second * 1000,
            fix: 3,
            flags: 1,
            horizontal_accuracy: 1000,
            ..Pvt::default()
        };
        pvt.emit()
    };
    let baseline = |second: u32| {
        let mut frame = [0; 72];
        frame[..7].copy_from_slice(&[0xB5, 0x62, 0x01, 0x3C, 64, 0, 1]);
        frame[10..14].copy_from_slice(&(second * 1000).to_le_bytes());
        frame[30..34].copy_from_slice(&9_000_000_i32.to_le_bytes());
        frame[66..68].copy_from_slice(&0x0125_u16.to_le_bytes());
        let sum = crate::wire::checksum::fletcher8(&frame[2..70]);
        frame[70..].copy_from_slice(&sum);
        frame
    };
    let mut wire = Wire::new(Some(ReceiverFormat::Ubx));
    for second in 1..6 {
        wire.silent_until(1_000_000 * u64::from(second));
        wire.send(&pvt(second));
        let complete = wire.found.len();
        if second > 2 {
            wire.send(&baseline(second));
        }
        // known of from the fourth on
        assert_eq!(
            complete,
            second as usize - usize::from(second > 3),
            "{second}"
        );
    }
    assert_eq!(wire.found.len(), 5);
    let headings = wire
        .found
        .iter()
        .map(|(_, s)| s.fix.unwrap().heading.map(|h| h.angle));
    let half_pi = core::f32::consts::FRAC_PI_2;
    assert_eq!(
        headings.collect::<Vec<_>>(),
        [None, None, None, Some(half_pi), Some(half_pi)]
    );
}

/// Late and wild times: a message of an epoch that is over opens no new one, and after a jump of
/// the receiver's time fixes go on.
#[test]
fn late_messages_and_jumps() {
    let mut wire = Wire::new(Some(ReceiverFormat::Ubx));
    let mut send = |ms: u32| {
        let pvt = Pvt {
            time_of_week: ms,
            fix: 3,
            flags: 1,
            horizontal_accuracy: 1000,
            ..Pvt::default()
        };
        wire.send(&pvt.emit());
        wire.found.len()
    };
    assert_eq!(
        [5000, 6000, 5900, 6000, 7000].map(&mut send),
        [1, 2, 2, 2, 3]
    );
    assert_eq!(
        [1000, 2000, 604_799_000, 0, 1000].map(&mut send),
        [4, 5, 6, 7, 8]
    );
}

#[test]
fn sine_and_cosine_of_every_course() {
    for tenth in 0..=3600 {
        let course = tenth as f32 / 10.0;
        let mut values = Values::NONE;
        values.over_ground(30.0, course, 1.5);
        let (sin, cos) = f64::from(course).to_radians().sin_cos();
        let [north, east, down] = values.velocity;
        let wrong = (north - 30.0 * cos).hypot(east - 30.0 * sin);
        assert!(wrong < 1.2e-5 && down == -1.5, "{course} {wrong}");
    }
}

/// A receiver that restarts some seconds later, a little before the time at which it had stopped:
/// none of its fixes is taken for a late message.
#[test]
fn a_receiver_whose_time_goes_back_by_a_second_goes_on() {
    let mut wire = Wire::new(Some(ReceiverFormat::Nmea));
    for (k, second) in [0, 1, 2, 1, 2, 3].into_iter().enumerate() {
        let pause = if k < 3 { 0 } else { 3_000_000 };
        wire.silent_until(1_000_000 * (1 + k as u64) + pause);
        wire.send(&nmea(second, "221126", 0, &["RMC", "GGA"]));
    }
    wire.silent_until(wire.us + 500_000);
    assert_eq!(wire.found.len(), 6);
}

/// A message of the epoch before that comes behind the first one of the next, wherever midnight
/// lies between the two: it is late, and the day does not count twice.
#[test]
fn a_late_message_across_midnight_is_late() {
    use crate::wire::receiver::epoch::{Arrival, Head, Joiner, Time};
    const DAY_MS: u32 = 86_400_000;
    type Span = (fn(u32) -> Time, u32);
    let spans: [Span; 2] = [(Time::Day, DAY_MS), (Time::Week, 7 * DAY_MS)];
    for (time, span) in spans {
        let mut joiner = Joiner::new(1);
        let mut seen = Vec::new();
        for (number, ms) in [span - 1000, 0, span - 1000, 1000].into_iter().enumerate() {
            let us = 1_000_000 + 10_000 * number as u64;
            let head = Head {
                kind: 0,
                time: time(ms),
            };
            let place = joiner.place(head, Arrival { us, sample: 0 });
            seen.push(place.is_some());
            if let Some(values) = place {
                (values.own, values.stated) = ([0.0; 6], [1.0; 6]);
            }
            if joiner.is_ready() {
                joiner.take();
            }
        }
        assert_eq!(seen, [true, true, false, true], "{span}");
        let midnights = u32::from(span == DAY_MS);
        let head = Head {
            kind: 0,
            time: time(2000),
        };
        let at = Arrival {
            us: 5_000_000,
            sample: 0,
        };
        let values = joiner.place(head, at).expect("a new epoch");
        (values.own, values.stated) = ([0.0; 6], [1.0; 6]);
        assert!(joiner.is_ready());
        let fix = joiner.take().and_then(|solution| solution.fix);
        let times = fix.map(|fix| fix.time_ms);
        assert_eq!(times, Some(midnights * DAY_MS + 2000));
    }
}
