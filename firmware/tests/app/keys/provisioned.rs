//! A device gets its key, another one, or none.

use super::*;
use firmware::model::Nets;
use firmware::store::{Content, Progress, Step, Store};
use firmware::wire::command::{Protection, fault};

/// A board that can store and has no key.
fn new() -> Device {
    let mut device = keyed(20);
    device.app.set_key(Key::Unprovisioned);
    device
}

/// Steps of storing that the board carries out, pass by pass.
fn stored(device: &mut Device) -> Vec<Step> {
    let mut steps = Vec::new();
    while device.app.wants_to_store() {
        assert!(device.app.may_halt() && steps.len() < 9);
        device.app.store(|step, _| {
            steps.push(step);
            true
        });
    }
    steps
}

const GIVE: Request = Request::Provision(Provision::Secret(KEY));

#[test]
fn a_key_is_given_once_and_then_only_by_who_has_it() {
    let mut device = new();
    assert_eq!(security(&mut device).protection, Protection::Unprovisioned);
    // as delivered it is open, and a sealed request says that there is no key
    device.order(&Request::SetMode(Mode::Frozen));
    device.ask(&GIVE, |answer| {
        assert_eq!(answer, Response::Refused(Reason::Mode));
    });
    device.order(&Request::SetMode(Mode::Bypass));
    let same = Request::Provision(Provision::Secret(Secret([0xFF; 32])));
    device.ask(&same, |answer| {
        assert_eq!(answer, Response::Refused(Reason::Range));
    });
    assert_eq!(security(&mut device).protection, Protection::Unprovisioned);
    assert!(!device.app.wants_to_store());
    device.order(&GIVE);
    assert_eq!(*device.app.key(), Key::Secret(KEY));
    // twice, each time erasing what is older
    assert_eq!(stored(&mut device), [Step::Renew; 2]);
    assert_eq!(security(&mut device).protection, Protection::Keyed);
    device.ask(&GIVE, |answer| {
        assert_eq!(answer, Response::Refused(Reason::KeyNeeded));
    });

    // another one: sealed with the old one, and nobody who listens learns it
    let mut host = Host::at(&mut device, KEY);
    let veiled = KEY.veiled(&host.challenge, 1, &OTHER);
    assert_ne!(veiled, OTHER);
    let change = Request::Provision(Provision::Secret(veiled));
    let packet = host.packet(&change);
    assert!(!packet.windows(8).any(|bytes| bytes == &OTHER.0[..8]));
    let first = raw(&mut device, &packet);
    assert!(open::<Response>(&mut first.clone()).is_ok_and(|a| a.seal.is_some()));
    assert_eq!(*device.app.key(), Key::Secret(OTHER));
    assert_eq!(stored(&mut device), [Step::Renew; 2]);
    // the answer may have been lost, but the session is over
    assert_eq!(raw(&mut device, &packet), first);
    assert!(!device.app.wants_to_store());
    let packet = host.packet(&Request::SetMode(Mode::Frozen));
    assert_eq!(refused(&mut device, &packet), Reason::Session);
    let mut old = Host::at(&mut device, KEY);
    let packet = old.packet(&Request::SetMode(Mode::Frozen));
    assert_eq!(refused(&mut device, &packet), Reason::Key);
    let mut host = Host::at(&mut device, OTHER);
    host.order(&mut device, &Request::SetMode(Mode::Frozen));
    host.order(&mut device, &Request::SetMode(Mode::Bypass));

    // off again, by choice and visibly; the answer to it may be lost too
    let packet = host.packet(&Request::Provision(Provision::OpenByChoice));
    let first = raw(&mut device, &packet);
    assert_eq!(security(&mut device).protection, Protection::OpenByChoice);
    assert_eq!(raw(&mut device, &packet), first);
    assert_eq!(stored(&mut device), [Step::Renew; 2]);
    device.order(&Request::SetMode(Mode::Frozen));
    let mut host = Host { counter: 0, ..host };
    let packet = host.packet(&Request::SetMode(Mode::Bypass));
    assert_eq!(refused(&mut device, &packet), Reason::NoKey);
}

/// A device without a key takes its first one, or none by choice, only in the first minute after
/// power-on. One with a key takes another one at any time.
#[test]
fn the_first_key_comes_in_the_first_minute() {
    for late in [GIVE, Request::Provision(Provision::OpenByChoice)] {
        let mut device = new();
        device.pass_us(60_000_001);
        device.ask(&late, |answer| {
            assert_eq!(answer, Response::Refused(Reason::TooLate));
        });
        assert_eq!(security(&mut device).protection, Protection::Unprovisioned);
        assert!(!device.app.wants_to_store());
    }
    let mut device = new();
    device.pass_us(59_000_000);
    device.order(&GIVE);
    stored(&mut device);
    device.pass_us(600_000_000);
    let mut host = Host::at(&mut device, KEY);
    let veiled = KEY.veiled(&host.challenge, 1, &OTHER);
    host.order(&mut device, &Request::Provision(Provision::Secret(veiled)));
    assert_eq!(*device.app.key(), Key::Secret(OTHER));
}

/// Nor does a device take its first key in the first minute after a restart that it made itself or
/// that anybody asked for: only after the power came.
#[test]
fn a_restart_by_request_is_no_power_on() {
    use firmware::wire::command::cause::{BROWN_OUT, PIN, POWER_ON, SOFTWARE, WATCHDOG};
    for (causes, taken) in [
        (POWER_ON | BROWN_OUT | PIN, true),
        (POWER_ON | SOFTWARE, true),
        (PIN, true),
        (0, true), // a board that does not know
        (SOFTWARE | PIN, false),
        (WATCHDOG | PIN, false),
    ] {
        let reset = Reset { causes, ..START };
        let hardware = Hardware {
            reset: Some(reset),
            ..HARDWARE
        };
        let mut device = keyed_at(hardware, 20);
        device.app.set_key(Key::Unprovisioned);
        let want = match taken {
            true => Response::Done,
            false => Response::Refused(Reason::TooLate),
        };
        device.ask(&GIVE, |answer| assert_eq!(answer, want, "{causes:#b}"));
    }
}

/// A key is refused where it would be lost. Until both records are there, no mode but bypass is
/// accepted.
#[test]
fn a_key_that_cannot_be_stored_is_refused_or_reported() {
    let mut device = Device::new(STIM.config());
    device.ask(&GIVE, |answer| {
        assert_eq!(answer, Response::Refused(Reason::Unsupported));
    });
    assert_eq!(*device.app.key(), Key::Unprovisioned);
    let mut device = new();
    device.order(&Request::Provision(Provision::OpenByChoice));
    device.app.store(|_, _| true);
    assert!(device.app.wants_to_store(), "the second record");
    device.ask(&Request::SetMode(Mode::Frozen), |answer| {
        assert_eq!(answer, Response::Refused(Reason::Busy));
    });
    device.app.store(|_, _| true);
    device.order(&Request::SetMode(Mode::Frozen));
    // a worn flash
    device.order(&Request::SetMode(Mode::Bypass));
    device.order(&GIVE);
    device.app.store(|_, _| false);
    assert!(!device.app.wants_to_store());
    let both = fault::STORE | fault::KEY;
    assert_eq!(device.app.faults() & both, both);
    // what is stored afterwards has the new key, and does not show that no other one is left
    let mut host = Host::at(&mut device, KEY);
    host.order(&mut device, &Request::StoreImage);
    device.app.store(|step, _| step == Step::Save);
    assert_eq!(device.app.faults() & both, fault::KEY);
}

/// One slot is worn. The new key is in force, and the device reports that the old one can be read:
/// after the change, after power-on, and until another change of the key is complete.
#[test]
fn an_old_key_that_can_still_be_read_is_reported() {
    let bits = |device: &Device| device.app.faults() & (fault::STORE | fault::KEY);
    let mut device = new();
    device.order(&GIVE);
    let steps = [Progress::GoesOn; 2].map(|progress| {
        assert_eq!(bits(&device), 0, "it may still be");
        let mut seen = None;
        device.app.store(|step, _| {
            seen = Some(step);
            progress
        });
        seen
    });
    assert_eq!(steps, [Some(Step::Renew); 2]);
    assert!(!device.app.wants_to_store());
    assert_eq!(bits(&device), fault::STORE | fault::KEY);

    let mut unit = configured(STIM);
    unit.correction.mode = Mode::Bypass;
    let record = firmware::configuration::record::encode(&unit);
    let mut store = Store::new(crate::stored::blank()).expect("room");
    for key in [Key::Unprovisioned, Key::Secret(KEY)] {
        let content = Content::new(&Nets::NONE, &record);
        store.save(&Content { key, ..content }).expect("room");
    }
    device.app = App::power_on(HARDWARE, Some(store.load()), None);
    assert_eq!(bits(&device), fault::KEY);
    device.feed(&STIM.stream(0, 10).concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    // the same key given again, though it is stored already
    let mut host = Host::at(&mut device, KEY);
    let veiled = KEY.veiled(&host.challenge, 1, &KEY);
    host.order(&mut device, &Request::Provision(Provision::Secret(veiled)));
    while device.app.wants_to_store() {
        device
            .app
            .store(|step, content| store.carry_out(step, content));
    }
    assert_eq!(bits(&device), 0);
    let mut device = new();
    device.app = App::power_on(HARDWARE, Some(store.load()), None);
    assert_eq!(bits(&device), 0);
}

/// The key comes back at power-on, from whichever record; none from before it is left in the flash.
#[test]
fn a_key_survives_power_off_and_nothing_older_is_left() {
    let mut flash = crate::stored::blank();
    let power_on = |flash: &crate::stored::Flash| {
        let mut store = Store::new(flash.clone()).expect("room");
        let mut device = new();
        device.app = App::power_on(HARDWARE, Some(store.load()), None);
        (device, store)
    };
    let keep = |device: &mut Device, store: &mut Store<crate::stored::Flash>| {
        while device.app.wants_to_store() {
            let app = &mut device.app;
            app.store(|step, content| store.carry_out(step, content));
        }
    };
    let mut unit = configured(STIM);
    unit.correction.mode = Mode::Bypass;
    let (mut device, mut store) = power_on(&flash);
    // two records from before the key
    for name in ["one", "two"] {
        unit.identity.name = name.try_into().expect("short");
        let record = crate::record::record(&unit);
        assert_eq!(crate::record::configure(&mut device, &record), Ok(()));
        device.order(&Request::StoreImage);
        keep(&mut device, &mut store);
    }
    device.order(&GIVE);
    keep(&mut device, &mut store);
    flash = store.into_inner();
    let (mut device, mut store) = power_on(&flash);
    assert_eq!(security(&mut device).protection, Protection::Keyed);
    let mut host = Host::at(&mut device, KEY);
    host.order(&mut device, &Request::SetMode(Mode::Frozen));
    for passed in 0..2 {
        let record = store.load_older(passed).expect("ours").expect("a record");
        assert_eq!(record.key, Key::Secret(KEY), "{passed}");
    }
    assert_eq!(store.load_older(2), Ok(None));
    // a record of mode learn has it too, and another key leaves nothing of this one
    host.order(&mut device, &Request::SetMode(Mode::Bypass));
    let veiled = KEY.veiled(&host.challenge, host.counter + 1, &OTHER);
    host.order(&mut device, &Request::Provision(Provision::Secret(veiled)));
    keep(&mut device, &mut store);
    flash = store.into_inner();
    let (device, _) = power_on(&flash);
    assert_eq!(*device.app.key(), Key::Secret(OTHER));
    let holds = |secret: &Secret| flash.bytes.windows(32).any(|bytes| bytes == secret.0);
    assert!(holds(&OTHER) && !holds(&KEY));
}

#[test]
fn a_key_has_bytes_and_does_not_print() {
    for key in [Key::Unprovisioned, Key::OpenByChoice, Key::Secret(OTHER)] {
        assert_eq!(Key::from_bytes(&key.to_bytes()), Some(key));
    }
    let bytes = Key::Secret(OTHER).to_bytes();
    assert_eq!((bytes[0], &bytes[1..]), (0x3C, &OTHER.0[..]));
    for bit in 0..8 {
        for key in [Key::Unprovisioned, Key::OpenByChoice, Key::Secret(OTHER)] {
            let mut bytes = key.to_bytes();
            bytes[0] ^= 1 << bit;
            assert_eq!(Key::from_bytes(&bytes), None);
        }
    }
    let printed = format!("{:?} {:?}", Key::Secret(OTHER), GIVE);
    assert!(
        printed.matches("..").count() == 2 && !printed.contains("128"),
        "{printed}"
    );
}
