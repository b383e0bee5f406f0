//! `host-sim hil` with ports that do not belong to a board.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use std::io::{Read, Write};
use std::net::TcpListener;

fn error(args: &[&str]) -> String {
    let mut command = Command::new(system::host_sim_binary());
    let assert = command.arg("hil").args(args).assert().code(2);
    String::from_utf8(assert.get_output().stderr.clone()).unwrap()
}

#[test]
fn ports_that_do_not_open_are_named_with_their_remedy() {
    let text = error(&["--imu", "/dev/tty-of-nobody", "--nav", "/dev/tty-of-nobody"]);
    assert!(
        text.contains("--imu /dev/tty-of-nobody: does not open"),
        "{text}"
    );
    assert!(text.contains("remedy: check cable and name"), "{text}");

    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let there = format!("tcp:{}", listener.local_addr().unwrap());
    let closed = TcpListener::bind("127.0.0.1:0").unwrap();
    let gone = format!("tcp:{}", closed.local_addr().unwrap());
    drop(closed);
    let text = error(&["--imu", &there, "--nav", &gone]);
    assert!(
        text.contains(&format!("--nav {gone}: does not connect")),
        "{text}"
    );
    let text = error(&["--imu", "tcp:nonsense", "--nav", &there]);
    assert!(
        text.contains("--imu tcp:nonsense: has no port number"),
        "{text}"
    );
    let text = error(&["--imu", &there]);
    assert!(text.contains("--nav"), "{text}");
}

#[test]
fn a_socket_that_never_answers_is_silent() {
    let listeners = [0; 2].map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
    let [imu, nav] = [0, 1].map(|at: usize| format!("tcp:{}", listeners[at].local_addr().unwrap()));
    let text = error(&["--imu", &imu, "--nav", &nav, "--seconds", "2", "--fast"]);
    assert!(
        text.contains(&format!(
            "--nav {nav}: nothing arrives although frames go into {imu}"
        )),
        "{text}"
    );
    assert!(text.contains("--baud"), "{text}");
}

/// A board that passes its input on equals software in the loop without a command link; one that
/// changes a byte does not, and the exit code is that of a difference, not of bad input.
#[test]
fn a_difference_has_an_exit_code_of_its_own() {
    for (wrong, code) in [(false, 0), (true, 1)] {
        let listeners = [0; 2].map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
        let [imu, nav] =
            [0, 1].map(|at: usize| format!("tcp:{}", listeners[at].local_addr().unwrap()));
        let board = std::thread::spawn(move || {
            let [mut imu, mut nav] = listeners.map(|listener| listener.accept().unwrap().0);
            let (mut buffer, mut passed) = ([0; 4096], 0);
            while let Ok(len @ 1..) = imu.read(&mut buffer) {
                // after the first second, which only shows that the board is present
                let at = 9000_usize.wrapping_sub(passed);
                if wrong && at < len {
                    buffer[at] ^= 0x10;
                }
                passed += len;
                if nav.write_all(&buffer[..len]).is_err() {
                    break;
                }
            }
        });
        let mut command = Command::new(system::host_sim_binary());
        let args = [
            "hil",
            "--imu",
            &imu,
            "--nav",
            &nav,
            "--seconds",
            "2",
            "--fast",
        ];
        let assert = command.args(args).assert().code(code);
        let text = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        assert_eq!(
            text.contains("differs from software in the loop"),
            wrong,
            "{text}"
        );
        board.join().unwrap();
    }
}
