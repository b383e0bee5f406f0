//! `host-sim device provision` and `--key`.

use super::{command, error, json, output};
use crate::software::{Device, Kind};
use std::path::Path;

fn path(directory: &Path, name: &str) -> String {
    directory.join(name).to_str().unwrap().to_owned()
}

#[test]
fn a_device_is_given_a_key_and_then_asks_for_it() {
    let directory = tempfile::tempdir().unwrap();
    let unit = super::file(directory.path(), "", "");
    let (key, new) = (path(directory.path(), "a"), path(directory.path(), "b"));
    let device = Device::start(&Kind::NEW);
    let port = &device.port;
    output(port, &["configure", &unit]);
    let info = output(port, &["info"]);
    assert!(info.contains("NOT PROVISIONED"), "{info}");
    let text = error(port, &["mode", "bypass", "--key", &key]);
    assert!(text.contains("no such file"), "{text}");

    let printed = output(port, &["provision", "--key-file", &key]);
    assert!(printed.contains("keep the file"), "{printed}");
    assert_eq!(std::fs::read_to_string(&key).unwrap().trim().len(), 2 * 32);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::metadata(&key).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "only its owner may read it");
    }
    assert_eq!(json(port, &["info"])["security"]["state"], "keyed");
    // the mode is unchanged
    assert_eq!(output(port, &["mode"]), "shadow\n");
    let text = error(port, &["mode", "frozen"]);
    assert!(
        text.contains("asks for a key") && text.contains("--key FILE"),
        "{text}"
    );
    assert_eq!(output(port, &["mode"]), "shadow\n");
    assert_eq!(output(port, &["mode", "frozen", "--key", &key]), "frozen\n");
    let mut by_variable = command(port, &["mode", "shadow"]);
    by_variable.env("LRNN_KEY", &key).assert().success();
    output(port, &["configure", &unit, "--key", &key]);

    // another device's key
    std::fs::write(&new, "11".repeat(31) + "12\n").unwrap();
    let text = error(port, &["mode", "frozen", "--key", &new]);
    assert!(text.contains("another one than the device's"), "{text}");
    // without the old key no new one is accepted
    let text = error(port, &["provision", "--key-file", &new]);
    assert!(text.contains("asks for a key"), "{text}");
    output(port, &["provision", "--key", &key, "--key-file", &new]);
    let text = error(port, &["mode", "frozen", "--key", &key]);
    assert!(text.contains("another one than the device's"), "{text}");
    assert_eq!(output(port, &["mode", "frozen", "--key", &new]), "frozen\n");

    output(port, &["provision", "--key", &new, "--open"]);
    let info = output(port, &["info"]);
    assert!(info.contains("OPEN by choice"), "{info}");
    let text = error(port, &["mode", "shadow", "--key", &new]);
    assert!(text.contains("it has no key"), "{text}");
    assert_eq!(output(port, &["mode", "shadow"]), "shadow\n");
}

#[test]
fn a_device_that_cannot_store_takes_no_key() {
    let directory = tempfile::tempdir().unwrap();
    let key = path(directory.path(), "k");
    let kind = Kind {
        stores: false,
        ..Kind::NEW
    };
    let device = Device::start(&kind);
    let text = error(&device.port, &["provision", "--key-file", &key]);
    assert!(text.contains("no place to store a key"), "{text}");
    assert!(!Path::new(&key).exists());
    command(&device.port, &["provision"]).assert().code(2);
}
