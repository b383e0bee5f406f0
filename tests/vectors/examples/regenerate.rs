//! Writes `src/inputs.rs` and `src/expected.rs` again; `cargo xtask vectors` calls it.
//!
//! The digests belong to the vectors with which this program was compiled. After a change of the
//! generator run it twice, as xtask does.

use std::fmt::Write;
use std::{fs, io};

use vectors::{CHECKS, generate};

fn main() -> io::Result<()> {
    let src = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
    fs::write(format!("{src}/inputs.rs"), inputs())?;
    fs::write(format!("{src}/expected.rs"), expected())
}

fn inputs() -> String {
    let mut text = String::from(
        "//! The input vectors, written by `cargo xtask vectors` from `generate.rs`.\n\n\
         /// Number of vectors.\n",
    );
    let _ = writeln!(text, "pub const VECTORS: usize = {};\n", generate::VECTORS);
    text += "/// Body rates in rad/s as bits of `f32`.\n#[rustfmt::skip] // three vectors a line\n";
    text += "pub static INPUTS: [[u32; 3]; VECTORS] = [\n";
    for row in (0..generate::VECTORS).collect::<Vec<_>>().chunks(3) {
        let row: Vec<String> = row.iter().map(|&index| vector(index)).collect();
        let _ = writeln!(text, "    {}", row.join(" "));
    }
    text + "];\n"
}

fn vector(index: usize) -> String {
    let [x, y, z] = generate::vector(index);
    format!("[{x:#010x}, {y:#010x}, {z:#010x}],")
}

fn expected() -> String {
    let mut text =
        String::from("//! The digests the desktop computed, written by `cargo xtask vectors`.\n\n");
    for check in CHECKS {
        let name = check.name.replace(", ", "_").to_uppercase();
        let value = format!("{:016x}", (check.digest)());
        let (a, b, c, d) = (&value[..4], &value[4..8], &value[8..12], &value[12..]);
        let _ = writeln!(text, "pub const {name}: u64 = 0x{a}_{b}_{c}_{d};");
    }
    text
}
