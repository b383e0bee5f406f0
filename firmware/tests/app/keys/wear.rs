//! A flood of requests to store does not wear the flash out.

use super::*;
use crate::stored::Flash;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use firmware::store::{Content, Store};

/// Two sectors of 128 KiB that count.
#[derive(Debug)]
struct Counting {
    flash: Vec<u8>,
    erased: u32,
    records: u32,
}

impl ErrorType for Counting {
    type Error = <Flash as ErrorType>::Error;
}

impl ReadNorFlash for Counting {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        bytes.copy_from_slice(&self.flash[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.flash.len()
    }
}

impl NorFlash for Counting {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.flash[from as usize..to as usize].fill(0xFF);
        self.erased += (to - from) / Self::ERASE_SIZE as u32;
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let place = &mut self.flash[offset as usize..][..bytes.len()];
        assert!(place.iter().all(|byte| *byte == 0xFF), "written twice");
        place.copy_from_slice(bytes);
        self.records += u32::from(bytes.starts_with(b"LRNS"));
        Ok(())
    }
}

/// Ten requests a second for an hour, each after another change. `changes`: there is a change.
fn flood(changes: bool) -> (u32, u32, u16) {
    let mut device = keyed(30);
    device.app.set_key(Key::Unprovisioned);
    let mut store = Store::new(Counting {
        flash: vec![0xFF; 2 * 128 * 1024],
        erased: 0,
        records: 0,
    })
    .expect("room");
    let mut unit = configured(STIM);
    unit.correction.mode = Mode::Bypass;
    let mut refused = 0;
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
        device
            .app
            .store(|step, content: &Content| store.carry_out(step, content));
    }
    let flash = store.into_inner();
    assert!(!changes || refused > 20_000);
    (flash.records, flash.erased, security(&mut device).stores)
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
