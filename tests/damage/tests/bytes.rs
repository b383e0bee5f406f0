//! A million damaged bytes of every protocol; `cargo xtask fuzz --long` reads a hundred million.

use damage::protocol::{Protocol, all};
use damage::{CHUNK, judge};

fn read(protocol: Protocol) -> Result<(), String> {
    let start = std::time::Instant::now();
    let figures = judge::chunk(protocol, 0, CHUNK)?;
    println!("{} {:?} {figures:?}", protocol.name(), start.elapsed());
    figures
        .check(protocol)
        .map_err(|what| format!("{}: {what}", protocol.name()))
}

#[test]
fn a_million_damaged_bytes_of_every_protocol() {
    let broken: Vec<_> = all()
        .into_iter()
        .filter_map(|protocol| read(protocol).err())
        .collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
