//! Where a sentence ends.

use super::*;

/// What loggers do to a line: the sentence has the same values and ends where it ends.
#[test]
fn line_ends_and_small_letters() {
    let text = RMC.trim_end();
    for (end, len) in [
        ("\r\n", 2),
        ("\n", 1),
        ("\n\n", 1),
        ("\r$", 1),
        ("\r\r\n", 1),
        ("\n\r", 1),
    ] {
        for line in [String::from(text), text.replace("*0E", "*0e")] {
            let line = format!("{line}{end}");
            let len = text.len() + len;
            assert_eq!(scan(line.as_bytes()), Scan::Frame(len), "{line:?}");
            let mut values = Values::NONE;
            read(&line.as_bytes()[..len], &mut values);
            assert_eq!(Some(values.velocity), part(RMC).velocity);
            assert_eq!(values.day, part(RMC).day);
            for so_far in 0..len {
                let scanned = scan(&line.as_bytes()[..so_far]);
                let waits = matches!(scanned, Scan::Partial(needed)
                    if needed > so_far && needed <= len.max(text.len() + 2));
                assert!(waits, "{so_far} {scanned:?}");
            }
        }
    }
    for unended in ["$GNRMC,1*", "$GNRMC,1*0E ", "$GNRMC,1*0G\r\n"] {
        assert!(!matches!(
            scan(unended.as_bytes()),
            Scan::Frame(_) | Scan::Other(_)
        ));
    }
    // CR alone waits for what follows, until the line is silent
    let alone = format!("{text}\r");
    assert_eq!(scan(alone.as_bytes()), Scan::Partial(alone.len() + 1));
    for (line, ended) in [
        (&alone[..], true),
        (text, true),
        (&text[..text.len() - 1], false),
    ] {
        assert_eq!(is_ended_by_silence(line.as_bytes()), ended, "{line}");
    }
}

/// One wrong bit makes a star of a decimal point, and the two decimals behind it are the right
/// checksum by chance: no sentence ends there.
#[test]
fn a_decimal_point_that_became_a_star_ends_no_sentence() {
    const HDT: &str = "$GNHDT,77.52,T*2C\r\n";
    const ZDA: &str = "$GNZDA,092725.20,22,11,2026,00,00*77\r\n";
    let mut tried = 0;
    for text in [RMC, GGA, GST, VTG, GNS, GLL, THS, HDT, ZDA] {
        assert_eq!(scan(text.as_bytes()), Scan::Frame(text.len()), "{text}");
        for (at, _) in text.match_indices('.') {
            let sum = text.as_bytes()[1..at]
                .iter()
                .fold(0, |sum, byte| sum ^ byte);
            let before = &text[..at];
            let after = text[at + 1..].trim_start_matches(|c: char| c.is_ascii_digit());
            if after.starts_with('*') {
                continue; // no cell ends there
            }
            let damaged = format!("{before}*{sum:02X}{after}");
            assert_eq!(scan(damaged.as_bytes()), Scan::BadChecksum, "{damaged}");
            tried += 1;
        }
    }
    assert_eq!(tried, 30);
}

#[test]
fn a_line_without_checksum_is_no_frame() {
    let (text, _) = RMC.split_once('*').unwrap();
    let line = format!("{text}\r\n");
    assert_eq!(scan(line.as_bytes()), Scan::Other(text.len()));
    assert!(lacks_checksum(text.as_bytes()) && !lacks_checksum(RMC.as_bytes()));
    let mut values = Values::NONE;
    read(text.as_bytes(), &mut values);
    assert_eq!(Some(values.velocity), part(RMC).velocity);
    assert_eq!(scan(b"$GPGSV,1,1,00\r\n"), Scan::Garbage);
    for (line, ended) in [
        (&line[..], true),
        (&line[..line.len() - 1], true),
        (text, false),
    ] {
        assert_eq!(is_ended_by_silence(line.as_bytes()), ended, "{line:?}");
    }
}

/// In a cell of a table, with or without quotes.
#[test]
fn a_sentence_may_end_in_a_cell() {
    let bare = GGA.trim_end();
    for behind in ["\"\n", "\",4\n", ",4\n", "; 4\n", "\t4\n", " 4\n", "'\n"] {
        let cell = format!("{bare}{behind}");
        assert_eq!(scan(cell.as_bytes()), Scan::Frame(bare.len()), "{cell}");
    }
    assert_eq!(scan(format!("{bare}0\r\n").as_bytes()), Scan::BadChecksum);
    assert_eq!(
        scan(format!("{}00\"", &bare[..bare.len() - 2]).as_bytes()),
        Scan::BadChecksum
    );
}
