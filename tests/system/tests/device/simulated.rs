//! `host-sim device --simulate`, as a person who practises uses it.

use super::{error, json};
use assert_cmd::Command;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::process::{Child, ChildStdout, Stdio};

/// A simulated device that runs, with the lines that it prints.
struct Practice {
    child: Child,
    out: BufReader<ChildStdout>,
    port: String,
}

impl Practice {
    fn start(args: &[&str]) -> Self {
        let mut child = std::process::Command::new(system::host_sim_binary())
            .args(["device", "--simulate", "--listen", "127.0.0.1:0"])
            .args(args)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let port = loop {
            let mut line = String::new();
            assert!(out.read_line(&mut line).unwrap() > 0, "it ends");
            if let Some(port) = line.strip_prefix("command link") {
                break port.trim().to_owned();
            }
        };
        Self { child, out, port }
    }

    /// Ends it as Ctrl-C does, and gives its exit code.
    fn interrupt(mut self) -> Option<i32> {
        let pid = self.child.id().to_string();
        let mut kill = std::process::Command::new("kill");
        assert!(kill.args(["-INT", &pid]).status().unwrap().success());
        self.child.wait().unwrap().code()
    }
}

impl Drop for Practice {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What a command that fails says.
fn refused(args: &[&str]) -> String {
    let output = Command::new(system::host_sim_binary())
        .args(args)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// It is the preset's device, learns, says what it waits for, is honest about what it has not
/// learnt, is switched off and on at the end of a drive, and ends with Ctrl-C.
#[test]
fn it_can_be_practised_with() {
    let mut practice = Practice::start(&["--speed", "50", "--seconds", "90"]);
    let port = practice.port.clone();
    let info = json(&port, &["info"]);
    assert_eq!(
        (&info["name"], &info["mode"]),
        (&"STIM300".into(), &"learn".into())
    );
    let output = Command::new(system::host_sim_binary())
        .args(["device", "--port", &port, "watch", "--seconds", "1"])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for step in ["aligned", "fixes", "proof", "stored", "in force"] {
        let bar = |line: &str| line.starts_with(step) && line.contains('[');
        assert!(text.lines().any(bar), "{step}: {text}");
    }
    let text = error(&port, &["learnt", "commit"]);
    assert!(text.contains("nothing has proved itself yet"), "{text}");
    assert!(text.contains("what is in use stays"), "{text}");
    let mut over = String::new();
    while !over.contains("drive 1 is over") {
        over.clear();
        assert!(practice.out.read_line(&mut over).unwrap() > 0, "it ends");
    }
    assert_eq!(
        json(&port, &["info"])["stored"],
        true,
        "after the power cycle"
    );
    assert_eq!(practice.interrupt(), Some(0));
}

#[test]
fn what_does_not_fit_is_refused_in_words() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = taken.local_addr().unwrap().to_string();
    let text = refused(&["device", "--simulate", "--listen", &at]);
    assert!(
        text.contains(&format!("--listen {at}: another program has this port")),
        "{text}"
    );
    let text = refused(&["device", "--simulate", "info"]);
    assert!(text.contains("takes no command"), "{text}");
    let text = refused(&["device", "--port", &at]);
    assert!(text.contains("a command is missing"), "{text}");
    let text = refused(&["device", "--port", &at, "--speed", "3", "info"]);
    assert!(
        text.contains("--port <PORT>' cannot be used with '--speed"),
        "{text}"
    );
    refused(&["device"]);
}
