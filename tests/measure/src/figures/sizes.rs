//! Sizes that stand in the text of the documents: each that stands for an image is the measured
//! one, of `docs/figures/images.csv` and `stacks.csv`.

use std::fs;

use documents::pages;
use qemu::committed::Committed;
use xtask::images::workspace;

/// Parts of chips, and goals: they stand beside images and are not measured.
const NOT_MEASURED: [&str; 9] = [
    "16 KiB", "64 KiB", "64 kB", "128 KiB", "192 KiB",
    "256 KiB", // memory of chips and sectors
    "32 KiB", "96 KiB", // goals of stm32f405_window
    "8 KiB",  // the region for DMA
];

/// Bytes of the images: flash, variables, the same with the stack's room or what is used of it, and
/// core-coupled memory.
fn measured() -> (Vec<String>, Vec<f64>) {
    let images = Committed::read("images").expect("images.csv");
    let stacks = Committed::read("stacks").expect("stacks.csv");
    let (mut names, mut sizes) = (Vec::new(), Vec::new());
    for row in &images.rows {
        let bytes = row[1..].iter().filter_map(|cell| cell.parse::<f64>().ok());
        let bytes: Vec<f64> = bytes.collect();
        let stack = stacks.rows.iter().find(|stack| stack[0] == row[0]);
        let stack = stack.into_iter().flat_map(|stack| &stack[1..]);
        sizes.extend(stack.map(|cell| bytes[1] + cell.parse::<f64>().expect("a number")));
        sizes.extend(bytes);
        names.push(format!("`{}`", row[0]));
    }
    (names, sizes)
}

/// A size in a text, with what follows it.
struct Stated<'t> {
    text: &'t str,
    after: &'t str,
    /// Bytes, and the half of its last digit.
    bytes: f64,
    half: f64,
}

/// All sizes in KiB, kB and MiB of a text.
fn stated(text: &str) -> Vec<Stated<'_>> {
    let mut found = Vec::new();
    for (unit, worth) in [(" KiB", 1024.0), (" kB", 1e3), (" MiB", 1_048_576.0)] {
        for (end, _) in text.match_indices(unit) {
            let digits = |c: char| c.is_ascii_digit() || c == '.';
            let begin = text[..end]
                .rfind(|c: char| !digits(c))
                .map_or(0, |at| at + 1);
            let Ok(number) = text[begin..end].parse::<f64>() else {
                continue;
            };
            let decimals = text[begin..end]
                .split_once('.')
                .map_or(0, |(_, after)| after.len());
            found.push(Stated {
                text: &text[begin..end + unit.len()],
                after: &text[end + unit.len()..],
                bytes: number * worth,
                half: 0.5 * worth / 10_f64.powi(decimals as i32),
            });
        }
    }
    found
}

/// Paragraphs, items of lists and rows of tables, each as a line, with the number of its first.
fn pieces(text: &str) -> Vec<(usize, String)> {
    let mut pieces: Vec<(usize, String)> = Vec::new();
    let mut goes_on = false;
    for (number, line) in (1..).zip(text.lines()) {
        let begins = line.starts_with(['|', '-', '+', '#']) || line.starts_with("    ");
        match pieces.last_mut().filter(|_| goes_on && !begins) {
            Some((_, piece)) => *piece += &format!(" {}", line.trim()),
            None => pieces.push((number, line.trim().to_owned())),
        }
        goes_on = !line.trim().is_empty() && !line.starts_with('|');
    }
    pieces
}

/// What is wrong in a text: sizes of images that are not measured ones.
fn wrong(text: &str, names: &[String], sizes: &[f64], seen: &mut usize) -> Vec<String> {
    let mut wrong = Vec::new();
    for (line, piece) in pieces(text) {
        let coupled = piece.contains("ore-coupled memory");
        let of_an_image = coupled || names.iter().any(|name| piece.contains(name.as_str()));
        for size in stated(&piece) {
            let of_memory = [" of flash", " of RAM"];
            let memory = of_memory.iter().any(|of| size.after.starts_with(of));
            if !(of_an_image || memory) {
                continue;
            }
            *seen += 1;
            let of_a_chip = NOT_MEASURED.contains(&size.text);
            if !of_a_chip && !sizes.iter().any(|is| (is - size.bytes).abs() <= size.half) {
                wrong.push(format!("{line}: {} is no image's size", size.text));
            }
        }
    }
    wrong
}

#[test]
fn sizes_in_the_documents_are_measured() {
    let (names, sizes) = measured();
    let (mut seen, mut all) = (0, Vec::new());
    for page in pages() {
        let text = fs::read_to_string(&page).expect("a page");
        let name = page.strip_prefix(workspace()).expect("ours").display();
        let wrong = wrong(&text, &names, &sizes, &mut seen);
        all.extend(wrong.iter().map(|wrong| format!("{name}:{wrong}")));
    }
    assert!(
        all.is_empty(),
        "{}\nremedy: docs/figures/images.csv has them",
        all.join("\n")
    );
    assert!(seen > 5, "{seen} sizes beside images");
}

#[test]
fn a_wrong_size_is_found() {
    let names = ["`f405`".to_owned()];
    let of = |text: &str| wrong(text, &names, &[337_828.0, 47_384.0], &mut 0).len();
    assert_eq!(
        of("The image `f405` takes 330 KiB of\nflash, beside 128 KiB."),
        0
    );
    assert_eq!(of("It takes 337.8 kB of flash."), 0);
    assert_eq!(of("| `f405` | 154 KiB |\n| other | 154 KiB |"), 1);
    assert_eq!(of("154 KiB of flash; 47.4 kB of RAM; a record of 5 kB"), 1);
}
