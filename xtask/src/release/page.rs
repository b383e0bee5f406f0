//! `RELEASE.md`: what is in the folder, and how to check and use it.

use std::fmt::Write as _;

use super::parts::Firmware;
use super::{Release, sums};
use crate::table::markdown;

/// The content of the page.
pub struct Page<'a> {
    pub release: &'a Release,
    /// Name and version of each format.
    pub formats: &'a [(String, String)],
    pub firmware: &'a [Firmware],
    /// Each file and its bytes.
    pub files: &'a [(String, u64)],
    /// Parts that were left out, with the reason, a sentence each.
    pub left_out: &'a [String],
    /// The entry of the changelog.
    pub changes: &'a str,
}

impl Page<'_> {
    /// The text.
    pub fn text(&self) -> String {
        let Release {
            version,
            source,
            toolchain,
            host,
            ..
        } = self.release;
        let mut out = format!(
            "# IMU compensation co-processor {version}\n\n\
             Commit `{}` of {}, built with {toolchain} on {host}.\n\n",
            source.commit, source.day
        );
        let row = |cells: &[&str]| cells.iter().map(|cell| (*cell).to_owned()).collect();
        let header: Vec<String> = row(&["format", "version"]);
        let rows = self.formats.iter();
        out += &markdown(&header, rows.map(|(name, version)| row(&[name, version])));
        out += "\n`docs/RELEASES.md` says what a change of each means.\n\n## Files\n\n";
        let rows = self.files.iter();
        let header = row(&["file", "bytes"]);
        out += &markdown(
            &header,
            rows.map(|(name, bytes)| row(&[name, &bytes.to_string()])),
        );
        out += "\n`.cdx.json` are bills of materials (CycloneDX 1.5) of the files of the same \
                name.\n";
        self.programs(&mut out);
        self.verify(&mut out);
        self.flash(&mut out);
        if !self.left_out.is_empty() {
            out += "\n## Left out\n\n";
            for why in self.left_out {
                _ = writeln!(out, "- {why}");
            }
        }
        if !self.changes.is_empty() {
            _ = write!(out, "\n## Changes\n\n{}\n", self.changes);
        }
        out
    }

    /// How to start the desktop's programs, where there are any.
    fn programs(&self, out: &mut String) {
        let names = self.files.iter().map(|(name, _)| name);
        let mut programs =
            names.filter(|name| name.starts_with("host-sim-") && !name.ends_with(".json"));
        if programs.next().is_some() {
            *out += "\n## Programs\n\n`host-sim-TARGET` needs nothing else; `host-sim-serve-TARGET` \
                     beside it is what `serve` starts.\n\n    \
                     chmod +x host-sim-*\n    ./host-sim-TARGET --help\n";
        }
    }

    fn verify(&self, out: &mut String) {
        let commit = &self.release.source.commit;
        _ = write!(
            out,
            "\n## Verify\n\n    sha256sum --check {}\n\n\
             The images can be built again, with the same checksums, on any machine of the same \
             kind ({}). In a clone:\n\n    \
             git checkout {commit}\n    cargo xtask release --only-images --snapshot\n",
            sums::NAME,
            self.release.host
        );
        if self.release.source.dirty {
            *out += "\nThis folder was built with uncommitted changes, so nobody can do that.\n";
        }
    }

    fn flash(&self, out: &mut String) {
        *out += "\n## Flash\n\nNothing of this has run on silicon yet.\n\n";
        let header = ["image", "board", "flash, B", "RAM, B", "`.bin` begins at"];
        let rows = self.firmware.iter().map(|image| {
            let start = image
                .start
                .map_or_else(String::new, |at| format!("{at:#010x}"));
            let [flash, ram] = image.bytes.clone();
            [image.name.into(), image.board.into(), flash, ram, start].to_vec()
        });
        *out += &markdown(&header.map(str::to_owned), rows);
        *out += "\nWith a debug probe ([probe-rs](https://probe.rs)):\n\n";
        for image in self.firmware {
            _ = writeln!(
                out,
                "    probe-rs run --chip {} {}.elf",
                image.chip, image.name
            );
        }
        *out += "\nWithout a probe:\n\n";
        for image in self.firmware {
            _ = match image.loader {
                Some("dfu") => writeln!(
                    out,
                    "    dfu-util -a 0 -s :leave -D {}.dfu    # BOOT0 high at a reset",
                    image.name
                ),
                Some(_) => writeln!(
                    out,
                    "    # {}.uf2: hold BOOTSEL while the board gets power, copy it to the drive",
                    image.name
                ),
                None => Ok(()),
            };
        }
        *out += "\nWhat a device keeps in its store is read by the new firmware; an older firmware \
                 may refuse it (`docs/RELEASES.md`).\n";
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::release::git::Source;

    #[test]
    fn the_page_names_all_that_is_there_and_all_that_is_not() {
        let source = Source {
            commit: "0123abcd".into(),
            day: "2026-11-24".into(),
            dirty: false,
        };
        let mut release = Release {
            version: "1.2.3".into(),
            source,
            toolchain: "rustc 1.95.0".into(),
            host: "x86_64".into(),
            folder: "f".into(),
        };
        let firmware = [Firmware {
            name: "pico2",
            board: "a Pico",
            chip: "RP235x",
            built: "pico2".into(),
            bytes: ["614400", "118784"].map(str::to_owned),
            start: Some(0x1000_0000),
            loader: Some("uf2"),
        }];
        let files = [("pico2.elf", 77), ("host-sim-riscv64", 78)];
        let files = files.map(|(name, bytes)| (name.to_owned(), bytes));
        let left_out = ["wheel: no maturin".to_owned()];
        let page = |release: &Release| {
            let page = Page {
                release,
                formats: &[("command link".to_owned(), "10".to_owned())],
                firmware: &firmware,
                files: &files,
                left_out: &left_out,
                changes: "- new",
            };
            page.text()
        };
        let text = page(&release);
        for part in [
            "# IMU compensation co-processor 1.2.3",
            "Commit `0123abcd` of 2026-11-24, built with rustc 1.95.0 on x86_64.",
            "| command link | 10 |",
            "| pico2.elf | 77 |",
            "| pico2 | a Pico | 614400 | 118784 | 0x10000000 |",
            "probe-rs run --chip RP235x pico2.elf",
            "pico2.uf2: hold BOOTSEL",
            "git checkout 0123abcd",
            "## Programs",
            "## Left out\n\n- wheel: no maturin\n",
            "## Changes\n\n- new\n",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(!text.contains("uncommitted"));
        release.source.dirty = true;
        assert!(page(&release).contains("uncommitted"));
    }
}
