//! Examples below the help of each command, and the exit codes. A test parses every example.

use clap::Command;

/// Meaning of the program's exit codes.
const EXIT_CODES: &str = "\
Exit codes:
  0    done; also when the reader of the output has closed the pipe, and at Ctrl-C where that is the
       usual end: device watch, serve
  1    a check has found a difference: hil, soak, replay blackbox
  2    bad arguments, bad input, a device that does not answer, or output that cannot be written;
       as with 1, one line on standard error says what, and the remedy
  101  a mistake of this program: please report it with the command
  130  interrupted; files are whole or absent, and --resume goes on where there is that option

Colours are used on terminals only, and nowhere when NO_COLOR is set.";

/// Commands and examples of them, each line after `host-sim`.
const EXAMPLES: &[(&str, &[&str])] = &[
    (
        "",
        &[
            "",
            "--seed 7 --out out/seed-7",
            "--scenario tactical --json out/tactical.json",
            "replay csv --header header.toml drive.csv",
        ],
    ),
    (
        "run",
        &[
            "run --seed 7 --out out/seed-7",
            "run --scenario mems --json mems.json",
            "run --unit unit.toml",
        ],
    ),
    (
        "replay",
        &[
            "replay csv --header header.toml drive.csv",
            "replay kitti drive.csv.gz",
        ],
    ),
    (
        "replay lasergyro",
        &["replay lasergyro rlg-rest.csv.gz --learn-s 480 --json rest.json"],
    ),
    (
        "replay fog-mems",
        &["replay fog-mems mems.csv.gz fog.csv.gz --unit mems"],
    ),
    ("replay kitti", &["replay kitti 0027.csv.gz 0034.csv.gz"]),
    (
        "replay hybrid",
        &["replay hybrid rlg-rest.csv.gz --roads 1,2,3"],
    ),
    (
        "replay sessions",
        &[
            "replay sessions unit.toml monday/header.toml tuesday/header.toml --page unit.html",
            "replay sessions sessions.toml --memory unit.flash --json unit.json",
        ],
    ),
    (
        "replay csv",
        &[
            "replay csv --header header.toml imu.csv gnss.csv --truth truth.csv",
            "replay csv --header header.toml --unit unit.toml --corrected corrected.csv imu.csv",
        ],
    ),
    (
        "replay kf-gins",
        &["replay kf-gins imu.txt gnss.txt --attitude 0.3,-0.5,184.2"],
    ),
    (
        "replay novatel",
        &[
            "replay novatel drive.gps --inventory --json inventory.json",
            "replay novatel drive.gps --mounting y,x,-z",
        ],
    ),
    (
        "replay mcap",
        &["replay mcap drive.mcap --imu-topic /imu/data --fix-topic /fix"],
    ),
    (
        "replay ulog",
        &["replay ulog flight.ulg --attitude-from-log"],
    ),
    (
        "replay ubx",
        &["replay ubx drive.ubx --lever-arm 1.2,0,-1.1"],
    ),
    (
        "replay euroc",
        &["replay euroc MH_01_easy --fix-interval-s 1"],
    ),
    ("replay blackbox", &["replay blackbox box.bin"]),
    (
        "campaign",
        &[
            "campaign --runs 20 --results results.md",
            "campaign --runs 20 --report campaign.html",
            "campaign --runs 100 --resume",
            "campaign --runs 1000 --shard 0/4 --out out/part-0",
        ],
    ),
    (
        "campaign merge",
        &["campaign merge out/part-0 out/part-1 out/part-2 out/part-3 --report campaign.html"],
    ),
    (
        "abuse",
        &[
            "abuse --runs 10 --cases jump --json abuse.json",
            "abuse --results abuse.md --resume",
        ],
    ),
    ("abuse merge", &["abuse merge out/part-0 out/part-1"]),
    (
        "allan",
        &[
            "allan rest.csv --out out/allan",
            "allan --unit nav --duration 14400 --json allan.json",
        ],
    ),
    (
        "learnability",
        &["learnability --unit tactical --minutes 20"],
    ),
    (
        "fleet",
        &[
            "fleet --units 50 --output type.toml",
            "fleet --recordings units --unit unit.toml --output type.toml --json prior.json",
        ],
    ),
    (
        "fleet merge",
        &["fleet merge out/part-0 out/part-1 --output type.toml"],
    ),
    (
        "convert",
        &["convert novatel drive.gps --to csv --out out/drive"],
    ),
    (
        "convert csv",
        &["convert csv --header header.toml imu.csv --to kf-gins --out out/drive"],
    ),
    (
        "convert kf-gins",
        &["convert kf-gins imu.txt gnss.txt --to csv --out out/drive"],
    ),
    (
        "convert novatel",
        &["convert novatel drive.gps --to csv --out out/drive"],
    ),
    (
        "convert mcap",
        &["convert mcap drive.mcap --to csv --out out/drive"],
    ),
    (
        "convert ulog",
        &["convert ulog flight.ulg --to csv --out out/flight"],
    ),
    (
        "convert ubx",
        &["convert ubx drive.ubx --to csv --out out/drive"],
    ),
    (
        "convert euroc",
        &["convert euroc MH_01_easy --to csv --out out/mh01"],
    ),
    (
        "device",
        &[
            "device --simulate --speed 10",
            "device --port /dev/ttyUSB2 info",
            "device --port /dev/ttyUSB2 configure unit.toml",
            "device --port tcp:192.168.0.7:4001 watch --json",
        ],
    ),
    ("device info", &["device --port /dev/ttyUSB2 info --json"]),
    (
        "device configure",
        &["device --port /dev/ttyUSB2 --key device.key configure unit.toml"],
    ),
    ("device show", &["device --port /dev/ttyUSB2 show"]),
    (
        "device mode",
        &[
            "device --port /dev/ttyUSB2 mode",
            "device --port /dev/ttyUSB2 mode learn",
        ],
    ),
    (
        "device weights",
        &["device --port /dev/ttyUSB2 weights get weights.bin"],
    ),
    (
        "device weights get",
        &["device --port /dev/ttyUSB2 weights get weights.bin"],
    ),
    (
        "device weights put",
        &["device --port /dev/ttyUSB2 weights put weights.bin"],
    ),
    (
        "device learnt",
        &["device --port /dev/ttyUSB2 learnt commit"],
    ),
    (
        "device learnt commit",
        &["device --port /dev/ttyUSB2 learnt commit"],
    ),
    (
        "device heading",
        &["device --port /dev/ttyUSB2 heading 184.2 --sigma 0.5"],
    ),
    ("device wheels", &["device --port /dev/ttyUSB2 wheels"]),
    (
        "device blackbox",
        &["device --port /dev/ttyUSB2 blackbox -o box.bin"],
    ),
    ("device store", &["device --port /dev/ttyUSB2 store"]),
    (
        "device update",
        &[
            "device --port /dev/ttyACM0 update h743.update",
            "device --port /dev/ttyACM0 --key device.key update h743.update --no-restart",
        ],
    ),
    (
        "device provision",
        &["device --port /dev/ttyUSB2 provision --key-file device.key"],
    ),
    (
        "device watch",
        &["device --port /dev/ttyUSB2 watch --seconds 60 --json"],
    ),
    (
        "hil",
        &[
            "hil --imu /dev/ttyUSB0 --nav /dev/ttyUSB1 --command /dev/ttyUSB2",
            "hil --imu tcp:127.0.0.1:4000 --nav tcp:127.0.0.1:4001 --fast --json hil.json",
        ],
    ),
    (
        "report",
        &[
            "report --unit unit.toml --from header.toml",
            "report --unit unit.toml --from device:/dev/ttyUSB2",
        ],
    ),
    (
        "serve",
        &[
            "serve --simulate",
            "serve --device /dev/ttyUSB2 --mcap drive.mcap",
        ],
    ),
    (
        "simulate",
        &[
            "simulate --out out/drive --seed 3",
            "simulate --unit unit.toml --vehicle ship --out ship",
        ],
    ),
    ("soak", &["soak --hours 24 --seed 5"]),
    (
        "start",
        &["start --class tactical --seeds 20 --json start.json"],
    ),
    (
        "unit",
        &[
            "unit new --from mems --output unit.toml",
            "unit check unit.toml",
        ],
    ),
    ("unit new", &["unit new --from mems --output unit.toml"]),
    (
        "unit from-log",
        &[
            "unit from-log rest.csv --latitude 48.1 --output unit.toml",
            "unit from-log cold.csv warm.csv hot.csv --temperature=-10,20,45 --preset stim300",
            "unit from-log monday.mcap tuesday.mcap --preset my.toml -- --imu-topic /imu",
        ],
    ),
    (
        "unit six-position",
        &[
            "unit six-position sides.csv --latitude 48.1",
            "unit six-position sides.csv turns.csv --turn-deg 360 --turn-sigma-deg 0.2",
            "unit six-position sides.csv --unit unit.toml --output calibrated.toml --weights w.bin",
            "unit six-position sides.mcap --imu-tk acc.calib --imu-calib imu.yaml",
        ],
    ),
    (
        "unit calibration",
        &[
            "unit calibration acc.calib --gyro gyro.calib --weights w.bin",
            "unit calibration imu.yaml --unit mems --output unit.toml",
        ],
    ),
    (
        "unit check",
        &["unit check unit.toml", "unit check unit.toml --json"],
    ),
    ("unit list", &["unit list --json"]),
    ("unit show", &["unit show tactical"]),
    ("unit schema", &["unit schema"]),
    (
        "completions",
        &["completions bash", "completions zsh", "completions fish"],
    ),
    ("manual", &["manual --out out/man"]),
];

/// The command with examples below the help of each subcommand.
pub(super) fn with_examples(command: Command) -> Command {
    let all = format!("{}\n\n{EXIT_CODES}", text(of("")));
    given(command, "").after_help(all)
}

/// `path`: the names of the commands above it and its own.
fn given(mut command: Command, path: &str) -> Command {
    let names: Vec<String> = (command.get_subcommands())
        .map(|sub| sub.get_name().to_string())
        .collect();
    for name in names {
        let below = format!("{path} {name}");
        command = command.mut_subcommand(name, |sub| given(sub, below.trim()));
    }
    command.after_help(text(of(path)))
}

fn of(path: &str) -> &'static [&'static str] {
    let found = EXAMPLES.iter().find(|(known, _)| *known == path);
    found.map_or(&[], |(_, lines)| lines)
}

fn text(lines: &[&str]) -> String {
    let lines = lines.iter().map(|line| format!("\n  host-sim {line}"));
    format!("Examples:{}", lines.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;

    /// The paths of all commands.
    fn paths(command: &Command, path: &str, all: &mut Vec<String>) {
        all.push(path.to_string());
        for sub in command.get_subcommands() {
            let below = format!("{path} {}", sub.get_name());
            paths(sub, below.trim(), all);
        }
    }

    #[test]
    fn each_command_has_an_example_and_each_example_is_a_command() {
        let mut all = Vec::new();
        paths(&Cli::definition(), "", &mut all);
        for path in &all {
            assert!(!of(path).is_empty(), "no example of '{path}'");
        }
        for (path, lines) in EXAMPLES {
            assert!(all.iter().any(|known| known == path), "no command '{path}'");
            for line in *lines {
                let words = ["host-sim"].into_iter().chain(line.split_whitespace());
                let parsed = Cli::definition().try_get_matches_from(words);
                assert!(parsed.is_ok(), "{line}: {parsed:?}");
                assert!(
                    path.is_empty() || line.split(' ').any(|word| path.ends_with(word)),
                    "{line}"
                );
            }
        }
    }
}
