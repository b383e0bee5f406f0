//! A running `host-sim-serve`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// How long it may take to end.
const PATIENCE: Duration = Duration::from_secs(20);

/// The program with these arguments.
pub fn program(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim-serve"));
    command.args(args).env_remove("LRNN_KEY");
    command
}

/// A running server; killed when dropped.
pub struct Server {
    child: Child,
    /// HOST:PORT of the page.
    pub at: String,
    out: BufReader<ChildStdout>,
}

impl Server {
    /// Starts it on a free port.
    pub fn start(args: &[&str]) -> Self {
        let mut command = program(args);
        command.args(["--listen", "127.0.0.1:0"]);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        let at = line.split_once("http://").map(|(_, rest)| rest);
        let at = at.and_then(|rest| rest.split_once('/')).expect("a page").0;
        Self {
            at: at.to_owned(),
            child,
            out,
        }
    }

    /// The next line that it prints.
    pub fn line(&mut self) -> String {
        let mut line = String::new();
        self.out.read_line(&mut line).unwrap();
        line
    }

    /// Sends a request and returns the answer: status and body.
    pub fn asks(&self, head: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.at).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut text = format!("{head} HTTP/1.1\r\nConnection: close\r\n");
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        text += &format!("Content-Length: {}\r\n\r\n{body}", body.len());
        stream.write_all(text.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        (status, body.to_owned())
    }

    /// The page's token.
    pub fn token(&self) -> String {
        let (status, page) = self.asks("GET /", &[("Host", &self.at)], "");
        assert_eq!(status, 200, "{page}");
        let (_, rest) = page.split_once("name=\"token\" content=\"").unwrap();
        rest.split_once('"').unwrap().0.to_owned()
    }

    /// Events until `enough` says so.
    pub fn events(&self, mut enough: impl FnMut(&str, &serde_json::Value) -> bool) {
        let mut stream = TcpStream::connect(&self.at).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let ask = format!("GET /events HTTP/1.0\r\nHost: {}\r\n\r\n", self.at);
        stream.write_all(ask.as_bytes()).unwrap();
        let mut name = String::new();
        for line in BufReader::new(stream).lines() {
            let line = line.unwrap();
            if let Some(of) = line.strip_prefix("event: ") {
                of.clone_into(&mut name);
            } else if let Some(data) = line.strip_prefix("data: ")
                && enough(&name, &serde_json::from_str(data).unwrap())
            {
                return;
            }
        }
        panic!("the events end");
    }

    /// Ends it as Ctrl-C does, and gives its exit code.
    pub fn interrupt(mut self) -> Option<i32> {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &pid]).status().unwrap();
        assert!(sent.success());
        let begun = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(begun.elapsed() < PATIENCE, "it does not end");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Runs a program that ends at once: exit code and standard error.
pub fn ends(args: &[&str]) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = program(args).output().unwrap();
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}
