//! Foxglove's protocol and MCAP files.

use super::server::Server;
use std::collections::BTreeMap;
use std::path::Path;

/// The topics of a file with the number of their messages. The file must be whole.
pub fn topics(file: &Path) -> BTreeMap<String, u64> {
    let bytes = std::fs::read(file).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().expect("a whole file");
    let counts = &summary.stats.as_ref().unwrap().channel_message_counts;
    let topics = summary.channels.iter();
    let topics = topics.map(|(id, channel)| {
        assert!(channel.schema.is_some(), "{}", channel.topic);
        (channel.topic.clone(), counts.get(id).copied().unwrap_or(0))
    });
    topics.collect()
}

/// The JSON messages of a topic.
pub fn messages(file: &Path, topic: &str) -> Vec<serde_json::Value> {
    let bytes = std::fs::read(file).unwrap();
    let all = mcap::MessageStream::new(&bytes).unwrap();
    let all = all.map(|message| message.unwrap());
    let of_topic = all.filter(|message| message.channel.topic == topic);
    of_topic
        .map(|message| serde_json::from_slice(&message.data).unwrap())
        .collect()
}

#[test]
fn a_recording_is_whole_after_ctrl_c() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("live.mcap");
    let name = file.to_str().unwrap();
    let args = [
        "--simulate",
        "--seconds",
        "400",
        "--speed",
        "50",
        "--unit",
        "medium",
    ];
    let server = Server::start(&[&args[..], &["--mcap", name]].concat());
    // until the learner navigates, so that all topics have something; frames are counted from when
    // the configuration is known
    let (mut known, mut first, mut frames) = (false, None, 0);
    server.events(|name, event| {
        known |= name == "info";
        if let Some(count) = event["counters"]["frames"].as_u64().filter(|_| known) {
            frames = count - *first.get_or_insert(count);
        }
        name == "status" && event["solution"].is_object()
    });
    assert_eq!(server.interrupt(), Some(0));
    let topics = topics(&file);
    for topic in ["/health", "/rehearsals", "/errors", "/track"] {
        assert!(topics[topic] > 0, "{topics:?}");
    }
    let [raw, corrected] = ["/imu/raw", "/imu/corrected"].map(|topic| topics[topic]);
    // a line that nobody reads in time loses frames, on a busy machine too; but never one of a pair
    assert!(
        frames > 0 && raw > 0 && raw == corrected,
        "{topics:?}, {frames} frames"
    );
    let last = messages(&file, "/health").pop().unwrap();
    assert_eq!(last["mode"], "learn");
    let force = messages(&file, "/imu/raw").pop().unwrap()["force"].clone();
    let size: f64 = ["x", "y", "z"]
        .map(|axis| force[axis].as_f64().unwrap().powi(2))
        .iter()
        .sum();
    assert!((8.0..12.0).contains(&size.sqrt()), "{force}");
}

#[test]
fn foxglove_sees_the_topics_live() {
    let server = Server::start(&[
        "--simulate",
        "--unit",
        "medium",
        "--foxglove",
        "127.0.0.1:0",
    ]);
    let mut server = server;
    let line = server.line();
    let url = line.trim().rsplit_once(' ').unwrap().1.to_owned();
    assert!(url.starts_with("ws://127.0.0.1:"), "{line}");
    use tungstenite::client::IntoClientRequest;
    let mut request = url.as_str().into_client_request().unwrap();
    let protocol = "foxglove.sdk.v1".parse().unwrap();
    request
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", protocol);
    let (mut socket, _) = tungstenite::connect(request).unwrap();
    let mut topics = Vec::new();
    while topics.len() < 7 {
        let message = socket.read().unwrap();
        let Ok(text) = message.to_text() else {
            continue;
        };
        let Ok(message_json) = serde_json::from_str::<serde_json::Value>(text) else {
            continue;
        };
        for channel in message_json["channels"].as_array().into_iter().flatten() {
            topics.push(channel["topic"].as_str().unwrap().to_owned());
        }
    }
    topics.sort();
    let expected = [
        "/errors",
        "/health",
        "/imu/corrected",
        "/imu/raw",
        "/log",
        "/rehearsals",
        "/track",
    ];
    assert_eq!(topics, expected);
    drop(socket);
    assert_eq!(server.interrupt(), Some(0));
}
