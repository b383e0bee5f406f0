//! `cargo xtask sign`: builds a board's images for both slots, and signs the update of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use firmware::update::{DEVELOPMENT_SEED, FIRMWARE};
use firmware::wire::command::key::Secret;
use host_device::device::sign::{public_key, signed};
use host_device::device::{make_key, read_key};
use xtask::boards::{self, Updatable};
use xtask::images::target_directory;
use xtask::load;

/// Options of `sign`.
#[derive(Debug, clap::Args)]
pub struct Order {
    /// The board.
    #[arg(default_value = "h743")]
    board: String,
    /// The key that signs, as --new-key makes it. The images expect updates that are signed with
    /// it, too. Without it: the development key, which everybody has.
    #[arg(
        long,
        value_name = "FILE",
        env = "LRNN_SIGNING_KEY",
        hide_env_values = true
    )]
    key: Option<PathBuf>,
    /// The public key that the images expect, where the key is to change: updates that follow must
    /// be signed with the new one.
    #[arg(long, value_name = "FILE.pub", conflicts_with = "new_key")]
    next_key: Option<PathBuf>,
    /// Makes a new key in FILE, and its public key in FILE.pub; builds and signs nothing.
    #[arg(long, value_name = "FILE", conflicts_with = "key")]
    new_key: Option<PathBuf>,
    /// The folder for BOARD.update, the loader and the image that a probe flashes; by default
    /// target/update.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Builds and signs, or makes a key.
pub fn sign(order: &Order) -> Result<ExitCode> {
    if let Some(file) = &order.new_key {
        let key = make_key(file)?;
        let public = write_public(&key, &beside(file))?;
        println!(
            "{}: the key; keep it secret and outside of the tree: whoever has it can sign\n\
             {}: its public key, no secret",
            file.display(),
            public.display()
        );
        return Ok(ExitCode::SUCCESS);
    }
    let board = Updatable::named(&order.board)?;
    let out = match &order.out {
        Some(out) => out.clone(),
        None => target_directory()?.join("update"),
    };
    fs::create_dir_all(&out).with_context(|| out.display().to_string())?;
    let key = match &order.key {
        Some(file) => secret(file)?,
        None => {
            println!("signs with the development key, which everybody has; remedy: --key FILE");
            Secret(DEVELOPMENT_SEED)
        }
    };
    let public = write_public(&key, &out.join("signer.pub"))?;
    let expected = match &order.next_key {
        Some(file) => Some(fs::canonicalize(file).with_context(|| file.display().to_string())?),
        None => order.key.is_some().then_some(public),
    };
    let first = out.join(format!("{}-slot.elf", board.name));
    let mut images = Vec::new();
    for slot in board.slots {
        let built = board.build(slot, expected.as_deref())?;
        let bin = out.join("slot.bin");
        let start = load::bin(&built, &bin)?;
        ensure!(
            start == Some(slot),
            "{}: linked for {start:x?}, not for {slot:#x}",
            built.display()
        );
        let image = fs::read(&bin).with_context(|| bin.display().to_string())?;
        fs::remove_file(&bin)?;
        println!(
            "{}: image for the slot at {slot:#010x}, {} bytes",
            board.name,
            image.len()
        );
        if slot == board.slots[0] {
            fs::copy(&built, &first)?;
        }
        images.push((slot, image));
    }
    let loader = out.join(format!("{}.elf", board.loader));
    fs::copy(boards::build(board.loader, board.target)?, &loader)?;
    let file = out.join(format!("{}.update", board.name));
    let update = signed(board.name, FIRMWARE, &images, &key).context("the board's name is long")?;
    fs::write(&file, update).with_context(|| file.display().to_string())?;
    println!(
        "{}: the update, for `host-sim device update`\n{}, {}: for a probe, the first time",
        file.display(),
        loader.display(),
        first.display()
    );
    Ok(ExitCode::SUCCESS)
}

/// Reads the key that signs. A public key has the same form, but no device takes what it signs.
fn secret(file: &Path) -> Result<Secret> {
    ensure!(
        file.extension().is_none_or(|extension| extension != "pub"),
        "{}: is a public key, which cannot sign; remedy: give the file beside it, without .pub",
        file.display()
    );
    Ok(read_key(file)?)
}

/// Name of the file of the public key.
fn beside(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".pub");
    name.into()
}

/// Writes the public key of a key.
fn write_public(key: &Secret, file: &Path) -> Result<PathBuf> {
    let digits: String = public_key(key)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    fs::write(file, digits + "\n").with_context(|| file.display().to_string())?;
    fs::canonicalize(file).with_context(|| file.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::update::DEVELOPMENT_KEY;

    #[test]
    fn a_new_key_has_its_public_key_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("own.key");
        let order = Order {
            board: "h743".into(),
            key: None,
            next_key: None,
            new_key: Some(file.clone()),
            out: None,
        };
        sign(&order).expect("a key");
        let public = fs::read_to_string(beside(&file)).expect("beside it");
        let key = public_key(&read_key(&file).expect("a key"));
        assert_ne!(key, DEVELOPMENT_KEY);
        let digits: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(public.trim(), digits);
        assert!(sign(&order).is_err(), "it is not written over");
        let error = secret(&beside(&file)).expect_err("cannot sign").to_string();
        assert!(error.contains("without .pub"), "{error}");
        let error = Updatable::named("f405").expect_err("none").to_string();
        assert!(error.contains("remedy: h743"), "{error}");
    }
}
