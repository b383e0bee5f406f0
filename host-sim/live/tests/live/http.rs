//! What is served, and what is refused, without a browser.

use super::server::{Server, ends, program};
use std::net::TcpListener;

const SIMULATED: [&str; 5] = ["--simulate", "--seconds", "100", "--unit", "medium"];

/// An order with these headers: status and body.
fn order(server: &Server, headers: &[(&str, &str)], body: &str) -> (u16, String) {
    server.asks("POST /order", headers, body)
}

#[test]
fn orders_from_elsewhere_are_refused() {
    let server = Server::start(&SIMULATED);
    let (host, origin, token) = (&*server.at, format!("http://{}", server.at), server.token());
    let json = ("Content-Type", "application/json");
    let good = [
        ("Host", host),
        ("Origin", &*origin),
        ("X-Live-Token", &*token),
        json,
    ];
    let bypass = r#"{"order":"mode","mode":"bypass"}"#;
    let without = |name: &str| -> Vec<_> {
        let rest = good.iter().filter(|(of, _)| *of != name);
        rest.copied().collect()
    };
    let with = |name: &'static str, value: &'static str| {
        let mut headers = without(name);
        headers.push((name, value));
        headers
    };
    for (headers, status, words) in [
        (without("Origin"), 403, "another site"),
        (with("Origin", "http://evil.example"), 403, "another site"),
        (with("Origin", "null"), 403, "another site"),
        (without("X-Live-Token"), 403, "load it again"),
        (with("X-Live-Token", "00"), 403, "load it again"),
        (with("Host", "evil.example"), 403, "--host NAME"),
        (with("Host", "evil.example:80"), 403, "--host NAME"),
        (with("Content-Type", "text/plain"), 415, "Content-Type"),
    ] {
        let (is, body) = order(&server, &headers, bypass);
        assert_eq!(is, status, "{headers:?}: {body}");
        assert!(body.contains(words), "{headers:?}: {body}");
    }
    for (body, status) in [
        (r#"{"order":"erase"}"#, 422),
        ("{", 400),
        (r#"{"order":"mode","mode":"fast"}"#, 409),
        (
            r#"{"order":"configure","unit":"name = 3","store":false}"#,
            409,
        ),
    ] {
        let (is, says) = order(&server, &good, body);
        assert_eq!(is, status, "{body}: {says}");
    }
    let long = format!(
        r#"{{"order":"configure","unit":"{}","store":false}}"#,
        "#".repeat(300_000)
    );
    assert_eq!(order(&server, &good, &long).0, 413);
    // none of them has reached the device, and the right one does
    let mut mode = String::new();
    server.events(|name, event| {
        mode = event["mode"].as_str().unwrap_or_default().to_owned();
        name == "status"
    });
    assert_eq!(mode, "learn");
    let (status, says) = order(&server, &good, bypass);
    assert_eq!(
        (status, says.contains("the mode is bypass")),
        (200, true),
        "{says}"
    );
    server.events(|name, event| name == "status" && event["mode"] == "bypass");
    let (status, says) = order(&server, &good, r#"{"order":"commit-learnt"}"#);
    let truth = says.contains("nothing has proved itself yet");
    assert_eq!((status, truth), (409, true), "{says}");
    let (status, says) = order(&server, &good, r#"{"order":"store"}"#);
    assert_eq!((status, says.contains("are stored")), (200, true), "{says}");
    assert_eq!(server.interrupt(), Some(0));
}

#[test]
fn a_page_that_only_shows_takes_no_orders() {
    let server = Server::start(&[&SIMULATED[..], &["--read-only"]].concat());
    let origin = format!("http://{}", server.at);
    let headers = [
        ("Host", &*server.at),
        ("Origin", &*origin),
        ("X-Live-Token", &*server.token()),
        ("Content-Type", "application/json"),
    ];
    let (status, says) = order(&server, &headers, r#"{"order":"store"}"#);
    assert_eq!(status, 403, "{says}");
    assert!(says.contains("--orders"), "{says}");
}

#[test]
fn files_are_served_with_what_a_browser_may_do() {
    let server = Server::start(&SIMULATED);
    let host = [("Host", &*server.at)];
    let (_, page) = server.asks("GET /", &host, "");
    let linked = page
        .split(['"'])
        .filter(|of| of.ends_with(".js") || of.ends_with(".css"));
    let mut count = 0;
    for file in linked {
        let (status, text) = server.asks(&format!("GET /{file}"), &host, "");
        assert_eq!(status, 200, "{file}");
        // all is here: the page works without the internet
        let fetches = ["https://", "http://"].iter().any(|of| text.contains(of));
        assert!(!fetches || file.starts_with("uplot"), "{file}"); // its comment names its home
        count += 1;
    }
    assert_eq!(count, 4, "two scripts, two styles");
    let (status, licence) = server.asks("GET /uplot-license.txt", &host, "");
    assert!(
        status == 200 && licence.contains("MIT License"),
        "{licence}"
    );
    assert_eq!(server.asks("GET /../Cargo.toml", &host, "").0, 404);
    assert_eq!(server.asks("GET /order", &host, "").0, 405);
}

#[test]
fn what_cannot_be_had_is_said_with_its_remedy() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().to_string();
    let existing = tempfile::NamedTempFile::new().unwrap();
    let existing = existing.path().to_str().unwrap();
    let closed = "tcp:127.0.0.1:1";
    for (args, words) in [
        (
            &["--simulate", "--seconds", "5", "--listen", &port][..],
            "--listen 127.0.0.1:",
        ),
        (
            &["--device", closed, "--listen", "127.0.0.1:0"],
            "--device tcp:127.0.0.1:1: does not",
        ),
        (
            &["--simulate", "--seconds", "5", "--unit", "no-such"],
            "no-such",
        ),
        (
            &[
                "--simulate",
                "--seconds",
                "5",
                "--unit",
                "adis16505",
                "--listen",
                "127.0.0.1:0",
            ],
            "serial line",
        ),
        (
            &[
                "--simulate",
                "--seconds",
                "5",
                "--listen",
                "127.0.0.1:0",
                "--foxglove",
                &port,
            ],
            "--foxglove",
        ),
        (
            &[
                "--simulate",
                "--seconds",
                "5",
                "--listen",
                "127.0.0.1:0",
                "--mcap",
                existing,
            ],
            "--mcap",
        ),
        (&["--device", closed, "--key", "/no/such.key"], "such.key"),
    ] {
        let (code, text) = ends(args);
        assert_eq!(code, Some(2), "{args:?}: {text}");
        assert!(
            text.contains(words) && text.contains("remedy: "),
            "{args:?}: {text}"
        );
    }
    assert_eq!(ends(&[]).0, Some(2));
}

/// However slow the browser is, the server goes on and keeps little.
#[test]
fn a_browser_that_does_not_read_costs_no_memory() {
    let server = Server::start(&[&SIMULATED[..], &["--speed", "20"]].concat());
    let mut idle = std::net::TcpStream::connect(&server.at).unwrap();
    let ask = format!("GET /events HTTP/1.1\r\nHost: {}\r\n\r\n", server.at);
    std::io::Write::write_all(&mut idle, ask.as_bytes()).unwrap();
    let mut count = 0;
    server.events(|name, _| {
        count += u32::from(name == "samples");
        count == 40
    });
    assert_eq!(server.interrupt(), Some(0));
}

/// A server that cannot print the address of its page ends.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_cannot_be_written_ends_it() {
    for args in [
        &["--help"][..],
        &["--version"],
        &["--simulate", "--listen", "127.0.0.1:0"],
    ] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
        let output = program(args).stdout(full.unwrap()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        let named = said.contains("host-sim serve: standard output: cannot be written (");
        assert!(named, "{args:?}: {said}");
    }
}
