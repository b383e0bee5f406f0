//! A small program that GNU's assembler has written, and what becomes of the bound when it changes.

use super::*;

/// ```text
/// 100 reset:   push {r7, lr}; bl dynamic; bl switch; pop {r7, pc}
/// 10c dynamic: push {r4, lr}; sub sp, #8
/// 110          ldr r2, [r1, #12]; movs r0, #1; blx r2
/// 116          add sp, #8; pop {r4, pc}
/// 11a first:   sub sp, #64; add sp, #64; bx lr
/// 120 second:  sub sp, #4096; add sp, #4096; bx lr
/// 12a switch:  push {r4, lr}; tbb [pc, r0]; .byte 1, 5
/// 132          pop {r4, lr}; b tail
/// 13a          vpush {d8}; bl tail; vpop {d8}; pop {r4, pc}
/// 148 tail:    push {r4-r7, lr}; pop {r4-r7, pc}
/// 14c handler: push {r4-r7, lr}; ldr r1, =0x20001000; mov sp, r1; bl tail; udf #0
/// ```
const CODE: [u16; 46] = [
    0xb580, 0xf000, 0xf803, 0xf000, 0xf810, 0xbd80, 0xb510, 0xb082, 0x68ca, 0x2001, 0x4790, 0xb002,
    0xbd10, 0xb090, 0xb010, 0x4770, 0xf5ad, 0x5d80, 0xf50d, 0x5d80, 0x4770, 0xb510, 0xe8df, 0xf000,
    0x0501, 0xe8bd, 0x4010, 0xf000, 0xb807, 0xed2d, 0x8b02, 0xf000, 0xf803, 0xecbd, 0x8b02, 0xbd10,
    0xb5f0, 0xbdf0, 0xb5f0, 0x4902, 0x468d, 0xf7ff, 0xfff9, 0xde00, 0x1000, 0x2000,
];
const FIRST: &str = "<a::B as firmware::learn::Learner>::first";
const SECOND: &str = "<a::B as firmware::learn::Learner>::second";
const FUNCTIONS: [(u32, &str); 7] = [
    (0x100, "reset"),
    (0x10c, "firmware::app::dynamic"),
    (0x11a, FIRST),
    (0x120, SECOND),
    (0x12a, "switch"),
    (0x148, "tail"),
    (0x14c, "handler"),
];
/// A vtable: how to drop it, its size, its alignment, its two methods.
const VTABLE: [u32; 5] = [0, 8, 4, 0x11b, 0x121];

fn changed(halves: &[(usize, u16)]) -> Image {
    let mut code = CODE;
    for (address, half) in halves {
        code[(address - 0x100) / 2] = *half;
    }
    let code: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
    Image::of_parts(
        &code,
        &FUNCTIONS,
        &VTABLE,
        &[(0x130, 0x132), (0x158, 0x15c)],
    )
}

fn main_of(image: &Image) -> Result<Way> {
    Graph::new(image)?.way(0x100)
}

fn names(way: &Way) -> Vec<&str> {
    way.functions.iter().map(|(name, _)| &name[..]).collect()
}

#[test]
fn the_deepest_way_goes_through_the_method_that_is_meant() {
    let image = changed(&[]);
    let way = main_of(&image).expect("it can be followed");
    assert_eq!(way.bytes, 8 + 16 + 64);
    assert_eq!(names(&way), ["reset", "firmware::app::dynamic", FIRST]);
}

#[test]
fn four_kilobytes_on_the_way_are_seen() {
    // the second method is called instead; the caller's own frame has as much
    for halves in [&[(0x110, 0x690a)][..], &[(0x10e, 0xf5ad), (0x110, 0x5d80)]] {
        let way = main_of(&changed(halves));
        let bytes = way.map(|way| way.bytes);
        assert!(bytes.is_ok_and(|bytes| bytes > 4096), "{halves:x?}");
    }
}

#[test]
fn a_pointer_from_nowhere_can_mean_every_method() {
    // movs r2, #1
    let way = main_of(&changed(&[(0x112, 0x2201)])).expect("it can be followed");
    assert_eq!(way.bytes, 8 + 16 + 4096);
}

#[test]
fn a_jump_to_a_function_leaves_the_frame_and_a_table_is_followed() {
    let image = changed(&[]);
    let mut graph = Graph::new(&image).expect("it can be followed");
    // pop, then jump: 20; vpush, then call: 8 + 8 + 20
    assert_eq!(graph.way(0x12a).expect("it").bytes, 36);
    // the second entry leads to the first place, too
    let image = changed(&[(0x130, 0x0101)]);
    let mut graph = Graph::new(&image).expect("it can be followed");
    assert_eq!(graph.way(0x12a).expect("it").bytes, 20);
}

#[test]
fn a_handler_that_begins_at_the_top_is_by_itself() {
    let image = changed(&[]);
    let mut graph = Graph::new(&image).expect("it can be followed");
    assert_eq!(graph.way(0x14c).expect("it").bytes, 20);
    assert_eq!(graph.anew().expect("it").bytes, 20);
    let levels = levels(&image, &mut graph).expect("it");
    assert_eq!((levels.len(), levels[0].bytes), (1, 20 + EXCEPTION));
}

#[test]
fn recursion_is_named() {
    // bl reset
    let image = changed(&[(0x13e, 0xf7ff), (0x140, 0xffdf)]);
    let error = main_of(&image).expect_err("recursion").to_string();
    assert!(error.contains("reset\n  calls switch"), "{error}");
}

#[test]
fn what_cannot_be_followed_is_an_error() {
    // sub sp, sp, r4; a jump to where no function begins; no vtable
    let image = changed(&[(0x120, 0xebad), (0x122, 0x0d04)]);
    assert!(main_of(&image).is_err());
    let image = changed(&[(0x138, 0xb808)]);
    assert!(main_of(&image).is_err());
    let code: Vec<u8> = CODE.iter().flat_map(|half| half.to_le_bytes()).collect();
    let image = Image::of_parts(&code, &FUNCTIONS, &[], &[(0x130, 0x132), (0x158, 0x15c)]);
    let error = main_of(&image).expect_err("nobody is meant").to_string();
    assert!(error.contains("nobody"), "{error}");
}

/// What narrows calls through vtables, against the sources: code of the learner has no `dyn
/// Learner`, and a hypothesis has no other.
#[test]
fn no_method_of_a_trait_calls_it_through_a_vtable() {
    let sources = crate::images::workspace().join("firmware/src");
    for (folder, dynamic) in [
        ("learn", "Learner"),
        ("nav", "Learner"),
        ("learn/bank/hypothesis.rs", "Hypothesis"),
    ] {
        let files = files(&sources.join(folder));
        assert!(!files.is_empty(), "{folder}");
        for file in files {
            let text = std::fs::read_to_string(&file).expect("a source");
            let code = text
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"));
            let named = |line: &str| line.split("dyn ").skip(1).any(|rest| last(rest) == dynamic);
            let lines: Vec<_> = code.filter(|line| named(line)).collect();
            assert!(lines.is_empty(), "{}: {lines:?}", file.display());
        }
    }
}

/// What narrows calls of the function that masks interrupts, against the sources: what the loop
/// does to the cutting of frames is one call of a method of it.
#[test]
fn what_is_done_with_interrupts_masked_calls_nothing_by_its_address() {
    let sources = crate::images::workspace().join("firmware/src");
    let mut calls = 0;
    let is_source = |file: &&Path| file.extension().is_some_and(|kind| kind == "rs");
    for file in files(&sources).iter().map(|file| &**file).filter(is_source) {
        let text = std::fs::read_to_string(file).expect("a source");
        for work in text.split(".cut(&mut ").skip(1) {
            let (work, _) = work.split_once(';').expect("a statement");
            let method = work.rsplit_once("= cut.").map(|(before, _)| before);
            let one = method.is_some_and(|before| !before.contains("cut."));
            assert!(one || work == "Cut::end)", "{}: {work}", file.display());
            calls += 1;
        }
    }
    assert!(calls > 3);
}

/// What makes the handlers two levels, against the source: each that is served has one of the two
/// priorities, but the window watchdog's.
#[test]
fn every_interrupt_that_is_served_has_one_of_two_priorities() {
    let file = crate::images::workspace().join("firmware/src/board/stm32f405/interrupts.rs");
    let text = std::fs::read_to_string(file).expect("the interrupt table");
    let list = |name: &str| {
        let (_, list) = text.split_once(&format!("const {name}: ")).expect("a list");
        let (_, list) = list.split_once("= [").expect("a list");
        let (list, _) = list.split_once("];").expect("its end");
        let names = list
            .split(',')
            .map(str::trim)
            .filter(|name| !name.is_empty());
        names.map(last).map(str::to_owned).collect::<BTreeSet<_>>()
    };
    let (cut, others) = (list("CUT_THROUGH"), list("OTHERS"));
    let entries = text.lines().filter_map(|line| {
        let (_, entry) = line.split_once("table[Interrupt::")?;
        let (name, handler) = entry.split_once(" as usize] = ")?;
        Some((name.to_owned(), last(handler).to_owned()))
    });
    let mut served: BTreeMap<_, _> = entries.collect();
    assert_eq!(served.remove("WWDG").as_deref(), Some("wwdg"));
    assert!(served.len() > 10 && cut.is_disjoint(&others));
    let all: BTreeSet<_> = served.keys().cloned().collect();
    assert_eq!(all, &cut | &others);
    let mut handlers: Vec<_> = cut.iter().map(|name| served[name].as_str()).collect();
    handlers.sort_unstable();
    assert_eq!(handlers, super::CUT_THROUGH.map(last));
}

/// The last name of the path with which a line goes on.
fn last(line: &str) -> &str {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let end = line.find(|c| !is_path(c)).unwrap_or(line.len());
    line[..end].rsplit("::").next().unwrap_or_default()
}

fn files(at: &Path) -> Vec<std::path::PathBuf> {
    let Ok(folder) = std::fs::read_dir(at) else {
        return vec![at.to_owned()];
    };
    let all = folder.flatten().flat_map(|entry| files(&entry.path()));
    all.filter(|file| !file.ends_with("tests.rs")).collect()
}
