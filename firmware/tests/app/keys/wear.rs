//! A flood of requests to store does not wear the flash out.

use super::*;
use firmware::store::{Content, Progress, Store};
use test_bench::flash::Flash;

/// Bytes of a sector.
const SECTOR: usize = 128 * 1024;

/// Ten requests a second for an hour, each after another change. `changes`: there is a change.
fn flood(changes: bool) -> (u32, u32, u16) {
    let mut device = keyed(30);
    device.app.set_key(Key::Unprovisioned);
    let mut store = Store::new(Flash::<SECTOR>::blank(2 * SECTOR)).expect("room");
    let mut unit = configured(STIM);
    unit.correction.mode = Mode::Bypass;
    let (mut refused, mut records) = (0, 0);
    for n in 0..36_000_u32 {
        if changes && n.is_multiple_of(10) {
            unit.identity.name = format!("{n}").as_str().try_into().expect("short");
            let record = crate::record::record(&unit);
            assert_eq!(crate::record::configure(&mut device, &record), Ok(()));
        }
        device.pass_us(90_000);
        device.ask(&Request::StoreImage, |answer| match answer {
            Response::Done => {}
            Response::Refused(Reason::Wait(ms)) => {
                assert!(ms <= 600_000);
                refused += 1;
            }
            other => panic!("{other:?}"),
        });
        device.app.store(|step, content: &Content| {
            let progress = store.carry_out(step, content);
            records += u32::from(progress == Progress::Done);
            progress
        });
    }
    let flash = store.into_inner();
    let erased = (flash.erased / SECTOR) as u32;
    assert!(!changes || refused > 20_000);
    (records, erased, security(&mut device).stores)
}

#[test]
fn a_flood_of_requests_to_store_is_limited() {
    // nothing changes: the first one, and no more
    let (records, erased, _) = flood(false);
    assert_eq!((records, erased), (1, 1));
    // 16 at once and 6 an hour, all in one sector that is erased once
    let (records, erased, left) = flood(true);
    assert!((21..=22).contains(&records), "{records}");
    assert_eq!((erased, left), (1, 0));
}
