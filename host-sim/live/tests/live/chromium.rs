//! Headless Chromium through its DevTools protocol, as far as these tests need it: open a page,
//! run JavaScript in it. A crate with the whole protocol compiles for a minute; this needs a few
//! commands.

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// Environment variable that makes a missing browser an error instead of a skipped test.
const REQUIRE: &str = "LRNN_REQUIRE_BROWSER";
/// Environment variable with the folder into which pictures are written.
const PICTURES: &str = "LRNN_PICTURES";
/// Names of the program.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// Longest wait for the page to show what is expected.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one page; ended when dropped.
pub struct Chromium {
    child: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    session: Option<String>,
    last: u64,
    _profile: TempDir,
}

/// The program, or `None`, with a line on standard error, on a machine that has none.
pub fn here_or_skip() -> Option<&'static str> {
    let starts = |name: &&&str| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    };
    let found = NAMES.iter().find(starts).copied();
    if found.is_none() {
        let what = "Chromium is not installed; remedy: Debian: apt-get install chromium";
        assert!(std::env::var_os(REQUIRE).is_none(), "{what}");
        // not eprintln, which the test harness swallows when the test passes
        let text = format!("skipped: {what}\n");
        let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
    }
    found
}

impl Chromium {
    /// Starts it and opens a page.
    pub fn open(program: &str, url: &str) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new(program)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu"])
            .args([
                "--no-first-run",
                "--disable-extensions",
                "--disable-dev-shm-usage",
            ])
            .args(["--remote-debugging-port=0", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let at = lines.by_ref().map_while(Result::ok).find_map(|line| {
            let (_, at) = line.split_once("DevTools listening on ")?;
            Some(at.trim().to_owned())
        });
        std::thread::spawn(move || lines.for_each(drop)); // else it blocks when the pipe is full
        let (socket, _) = tungstenite::connect(at.expect("DevTools")).unwrap();
        let mut browser = Self {
            child,
            socket,
            session: None,
            last: 0,
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({"url": url}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        let session = browser.call("Target.attachToTarget", attach);
        browser.session = session["sessionId"].as_str().map(str::to_owned);
        browser.call("Runtime.enable", json!({}));
        browser
    }

    /// One command of the protocol. An exception in the page fails the test.
    fn call(&mut self, method: &str, params: Value) -> Value {
        self.last += 1;
        let mut ask = json!({"id": self.last, "method": method});
        ask["params"] = params;
        if let Some(session) = &self.session {
            ask["sessionId"] = json!(session);
        }
        self.socket.send(Message::text(ask.to_string())).unwrap();
        loop {
            let message = self.socket.read().unwrap();
            let Ok(text) = message.to_text() else {
                continue;
            };
            let answer: Value = serde_json::from_str(text).unwrap_or_default();
            assert_ne!(answer["method"], "Runtime.exceptionThrown", "{answer}");
            if answer["id"] == self.last {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// The value of an expression in the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let result = self.call(
            "Runtime.evaluate",
            json!({"expression": expression, "returnByValue": true, "awaitPromise": true}),
        );
        let thrown = &result["exceptionDetails"];
        assert!(thrown.is_null(), "{expression}: {thrown}");
        result["result"]["value"].clone()
    }

    /// Text of an element.
    pub fn text(&mut self, id: &str) -> String {
        let text = self.value(&format!("document.getElementById('{id}').textContent"));
        text.as_str().unwrap_or_default().to_owned()
    }

    /// Waits until an expression is true.
    pub fn waits_for(&mut self, expression: &str) {
        let begun = Instant::now();
        while self.value(expression) != true {
            if begun.elapsed() > PATIENCE {
                let page = self.value("document.body.innerText.slice(-1500)");
                panic!("{expression} does not come: {page}");
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Clicks, as a finger does, on what a selector finds.
    pub fn click(&mut self, selector: &str) {
        self.waits_for(&format!("!document.querySelector('{selector}').disabled"));
        self.value(&format!("document.querySelector('{selector}').click()"));
    }

    /// Width and height of the window, and whether it is of a phone.
    pub fn resize(&mut self, width: u32, height: u32) {
        let size = json!({
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600,
        });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Writes the picture of the page as it stands in its window, where [`PICTURES`] asks for it.
    pub fn picture(&mut self, name: &str) {
        let Some(folder) = std::env::var_os(PICTURES) else {
            return;
        };
        std::thread::sleep(Duration::from_secs(1)); // until it is drawn
        let picture = self.call("Page.captureScreenshot", json!({"format": "png"}));
        let text = picture["data"].as_str().unwrap_or_default();
        let bytes = BASE64_STANDARD.decode(text).unwrap();
        std::fs::write(Path::new(&folder).join(name), bytes).unwrap();
    }

    /// Prefers dark colours from now on.
    pub fn dark(&mut self) {
        let dark = json!([{"name": "prefers-color-scheme", "value": "dark"}]);
        self.call("Emulation.setEmulatedMedia", json!({"features": dark}));
    }
}

impl Drop for Chromium {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
