//! The committed inputs of every target: nothing fails, and they get past the checks of the target.

use fuzz::{TARGETS, Target, targets::drive};
use std::path::{Path, PathBuf};

fn inputs(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(target);
    let files = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = files.map(|file| file.expect("a file").path()).collect();
    paths.sort();
    let read = |path: PathBuf| (path.clone(), std::fs::read(path).expect("a readable file"));
    paths.into_iter().map(read).collect()
}

/// How many of its inputs get that far, and how many there are.
fn replay(name: &str) -> (usize, usize) {
    let target = TARGETS.iter().find(|target| target.name == name);
    let Target { run, .. } = target.expect("a target of this name");
    let inputs = inputs(name);
    let far = inputs.iter().filter(|(path, input)| {
        let run = std::panic::catch_unwind(|| run(input));
        run.unwrap_or_else(|_| panic!("{} fails", path.display()))
    });
    (far.count(), inputs.len())
}

macro_rules! replayed {
    ($($name:ident: $least:literal,)+) => {
        $(#[test]
        fn $name() {
            let (far, all) = replay(stringify!($name));
            println!("{far} of {all}");
            assert!(far >= $least, "only {far} of {all} inputs get past the first checks");
        })+

        #[test]
        fn no_target_is_left_out() {
            let names = TARGETS.map(|target| target.name);
            assert_eq!(names, [$(stringify!($name)),+]);
        }
    };
}

// least number that gets that far
replayed! {
    app: 25,
    calibration: 4,
    command: 8,
    configuration: 19,
    csv: 3,
    drive: 3,
    fixes: 4,
    image: 15,
    mcap: 1,
    novatel: 6,
    receiver: 5,
    requests: 10,
    store: 15,
    stream: 11,
    ulog: 2,
    unit: 5,
    update: 6,
}

/// The application in the target `drive` navigates and learns from fixes, with a correction in
/// force, undisturbed and disturbed; over the long drive what it learns is promoted.
#[test]
fn the_drive_is_navigated_and_learnt_from() {
    let mut good = 0;
    for (path, input) in inputs("drive") {
        let [short, long] = [false, true].map(|long| drive::drive(&input, long).expect("an input"));
        let learns = short.navigates && short.fixes > 20 && short.corrected;
        let promotes = long.navigates && long.fixes > 300 && long.promotions > 0;
        println!("{}: {short:?} {long:?}", path.display());
        good += u32::from(learns && promotes);
        if path.ends_with("seed-empty") {
            assert!(learns && promotes, "undisturbed: {short:?} {long:?}");
        }
    }
    assert!(good >= 3, "only {good} drives are learnt from");
}
