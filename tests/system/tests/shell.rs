//! Output for shells, `man` and other programs.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn host_sim(dir: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(args);
    command.output().expect("it starts")
}

fn printed(dir: &Path, args: &[&str]) -> String {
    let output = host_sim(dir, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {output:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn completions_are_scripts_that_know_commands_and_options() {
    let dir = tempfile::tempdir().expect("a directory");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = printed(dir.path(), &["completions", shell]);
        for word in ["learnability", "estimate-time-offset", "tuning-units"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let script = printed(dir.path(), &["completions", "bash"]);
    let file = dir.path().join("host-sim.bash");
    // completions that the script offers after `host-sim le`
    let asked = "COMP_WORDS=(host-sim le); COMP_CWORD=1; _host__sim host-sim le host-sim; \
                 echo \"${COMPREPLY[@]}\"";
    std::fs::write(&file, script + asked + "\n").expect("written");
    let Ok(bash) = Command::new("bash").arg(&file).output() else {
        return; // no bash on this machine
    };
    let offered = String::from_utf8(bash.stdout).expect("UTF-8");
    assert_eq!(offered.trim(), "learnability", "{:?}", bash.stderr);
    let unknown = host_sim(dir.path(), &["completions", "tcsh"]);
    assert_eq!(unknown.status.code(), Some(2));
}

#[test]
fn each_command_has_a_page_in_the_manual() {
    let dir = tempfile::tempdir().expect("a directory");
    printed(dir.path(), &["manual", "--out", "man"]);
    for name in [
        "host-sim",
        "host-sim-replay-csv",
        "host-sim-device-weights-get",
    ] {
        let page = std::fs::read_to_string(dir.path().join(format!("man/{name}.1")));
        let page = page.expect("a page");
        assert!(page.contains(".SH OPTIONS"), "{name}");
        assert!(page.contains("Examples:"), "{name}");
    }
    let help = host_sim(dir.path(), &["replay", "csv", "--help"]).stdout;
    let help = String::from_utf8(help).expect("UTF-8");
    assert!(help.contains("host-sim replay csv --header"), "{help}");
}

#[test]
fn the_exit_codes_are_listed() {
    let dir = tempfile::tempdir().expect("a directory");
    let help = printed(dir.path(), &["--help"]);
    for code in ["  0 ", "  1 ", "  2 ", "  101 ", "  130 "] {
        assert!(help.contains(code), "{help}");
    }
}

#[test]
fn what_is_printed_as_a_table_is_there_as_json() {
    let dir = tempfile::tempdir().expect("a directory");
    let presets: Value =
        serde_json::from_str(&printed(dir.path(), &["unit", "list", "--json"])).expect("JSON");
    assert!(presets.as_array().expect("a list").len() > 5);
    let text = printed(dir.path(), &["unit", "show", "tactical"]);
    std::fs::write(dir.path().join("good.toml"), &text).expect("written");
    let wrong = text.replace("rate_hz =", "rate_hz = -1 #");
    assert_ne!(wrong, text);
    std::fs::write(dir.path().join("wrong.toml"), wrong).expect("written");
    let good: Value = serde_json::from_str(&printed(
        dir.path(),
        &["unit", "check", "good.toml", "--json"],
    ))
    .expect("JSON");
    assert!(good["unit"].is_string());
    let output = host_sim(dir.path(), &["unit", "check", "wrong.toml", "--json"]);
    assert_eq!(output.status.code(), Some(2));
    let examined: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(examined["unit"].is_null());
    let fault = &examined["findings"][0];
    assert!(fault["line"].is_u64(), "{examined}");
    for key in ["field", "problem", "remedy"] {
        assert!(
            fault[key].as_str().is_some_and(|text| !text.is_empty()),
            "{examined}"
        );
    }
}

/// Neither a pipe nor NO_COLOR gets escape sequences.
#[test]
fn a_pipe_gets_no_colours() {
    let dir = tempfile::tempdir().expect("a directory");
    for args in [&["--help"][..], &["unit", "list"], &["replay", "nothing"]] {
        let output = host_sim(dir.path(), args);
        let all = [output.stdout, output.stderr].concat();
        assert!(!all.is_empty() && !all.contains(&0x1b), "{args:?}");
    }
}
