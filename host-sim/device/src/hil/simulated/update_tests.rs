//! The firmware of a simulated device is updated over its command link.

use super::tests::{ANY, simulation};
use super::*;
use crate::device::sign::signed;
use crate::device::{Link, Port, Tried, Update, info};
use firmware::control::Mode;
use firmware::update::DEVELOPMENT_SEED;
use firmware::update::header::HEADER_LEN;
use firmware::wire::command::Request;
use firmware::wire::command::key::Secret;
use std::path::PathBuf;
use std::sync::Arc;

/// An image that begins as one for this slot does.
fn image(slot: usize, fill: u8) -> (u32, Vec<u8>) {
    let mut image = vec![fill; 40_000];
    let vectors = [0x2000_0000, PLACES.address(slot) + 0x201].map(u32::to_le_bytes);
    image[..8].copy_from_slice(vectors.as_flattened());
    (PLACES.address(slot), image)
}

struct Files(tempfile::TempDir);

impl Files {
    fn update(&self, bytes: &[u8]) -> Update {
        Update::read(&self.write(bytes)).expect("an update")
    }

    fn write(&self, bytes: &[u8]) -> PathBuf {
        let file = self.0.path().join("device.update");
        std::fs::write(&file, bytes).expect("a file");
        file
    }
}

fn of(board: &str, version: [u16; 3], fill: u8, key: [u8; 32]) -> Vec<u8> {
    let images = [image(0, fill), image(1, fill)];
    signed(board, version, &images, &Secret(key)).expect("a short name")
}

#[test]
fn an_update_is_refused_by_name_or_interrupted_resumed_tried_and_confirmed() {
    let slow = Simulation {
        speed: 5.0, // one drive is longer than all of this
        ..simulation(300, ANY)
    };
    let device = Simulated::new(&slow).expect("a device");
    let command = device.ports[0].clone();
    let stop = Arc::new(AtomicBool::new(false));
    let ends = Arc::clone(&stop);
    let thread = thread::spawn(move || device.run(&ends, &mut |_| ()));
    let mut open = || Port::open("--port", &command, 0).map(|port| Link::new(port, "--port"));
    let files = Files(tempfile::tempdir().expect("a folder"));
    let mut link = open().expect("it listens");
    link.order(&Request::SetMode(Mode::Bypass)).expect("done");

    let mut refused = |bytes: &[u8], older: bool, named: &str| {
        let sent = files.update(bytes).send(&mut link, older, &mut |_, _| ());
        let text = sent.expect_err(named).to_string();
        assert!(text.contains(named), "{text}");
    };
    let [name, dev] = ["simulated", "h743"];
    refused(
        &of(dev, [9, 0, 0], 1, DEVELOPMENT_SEED),
        false,
        "board h743",
    );
    refused(
        &of(name, [9, 0, 0], 1, [7; 32]),
        false,
        "signed with another key",
    );
    refused(&of(name, [0, 0, 1], 1, DEVELOPMENT_SEED), false, "--older");
    let mut changed = of(name, [9, 0, 0], 1, DEVELOPMENT_SEED);
    changed[HEADER_LEN + 40_000 + HEADER_LEN + 20_000] ^= 1;
    refused(&changed, false, "not what was signed");

    // half of it, then the cable is lost
    let good = of(name, [9, 0, 0], 2, DEVELOPMENT_SEED);
    let second = &good[HEADER_LEN + 40_000..];
    let header = &second[..HEADER_LEN];
    link.order(&Request::BeginUpdate {
        header,
        older: false,
    })
    .expect("good");
    for at in (0..20_480).step_by(128) {
        let bytes = &second[HEADER_LEN + at..][..128];
        let offset = at as u32;
        link.order(&Request::WriteUpdate { offset, bytes })
            .expect("a piece");
    }
    drop(link);
    let mut link = open().expect("it listens");
    let known = info(&mut link).expect("it answers").updates.expect("slots");
    assert_eq!((known.running, known.received), ("flashed", Some(20_480)));
    assert_eq!(known.signer, "development");
    let update = files.update(&good);
    let mut first = None;
    let sent = update.send(&mut link, false, &mut |at, _| {
        first.get_or_insert(at);
    });
    sent.expect("the rest");
    assert_eq!(first, Some(20_480), "it goes on where it stopped");
    link.order(&Request::Restart).expect("in bypass");
    let tried = update.tried(&mut open, Duration::from_secs(60));
    assert_eq!(tried.expect("it comes back"), Tried::Confirmed);
    let known = info(&mut link).expect("it answers");
    assert!(known.stored, "the configuration is there");
    let updates = known.updates.expect("slots");
    assert_eq!(
        (updates.running, updates.slot),
        ("confirmed", PLACES.address(0))
    );
    stop.store(true, Ordering::Relaxed);
    thread.join().expect("it ends");
}
