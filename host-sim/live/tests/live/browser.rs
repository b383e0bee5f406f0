//! The page in headless Chromium: what it shows is what was sent, its buttons do what they say, and
//! a lost device is shown and found again.

use super::chromium::{Chromium, here_or_skip};
use super::recording::{messages, topics};
use super::server::Server;
use firmware::control::Mode;
use firmware::wire::framer::LONGEST;
use firmware::wire::{Fields, ImuFormat};
use host_device::device::{Link, images, load};
use host_device::hil::networks;
use qemu::images::BOARDS;
use qemu::listening::Listening;
use std::io::Write;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Counts in every frame: gyros, accelerometers.
const COUNTS: [[i32; 3]; 2] = [[4000, -2500, 1200], [700, -1100, -164_600]];
/// Frames a second.
const RATE: f64 = 250.0;
/// A count of a STIM300 with increments (datasheet, tables 5-20 and 5-21), deg and m/s.
const COUNT: [f64; 2] = [1.0 / 2_097_152.0, 1.0 / 4_194_304.0];

const UNIT: &str = "\
name = 'bench'
serial = 'N25581'
[sensor]
format = 'stim300'
rate_hz = 250
baud = 460800
silence_ms = 2000
[gyro]
bias_turn_on_dph = 10
bias_in_run_dph = 0.5
angle_random_walk_dpsqrth = 0.15
[accel]
bias_turn_on_ug = 2000
bias_in_run_ug = 50
velocity_random_walk_ugpsqrthz = 60
[correction]
mode = 'shadow'
";

/// A sensor that sends the same counts in real time.
struct Sensor {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Sensor {
    fn start(port: &str) -> Self {
        let mut line = TcpStream::connect(port.strip_prefix("tcp:").unwrap()).unwrap();
        let stop = Arc::default();
        let ends = Arc::<AtomicBool>::clone(&stop);
        let mut sent = 0;
        let begun = Instant::now();
        let thread = thread::spawn(move || {
            while !ends.load(Ordering::Relaxed) {
                let due = (begun.elapsed().as_secs_f64() * RATE) as u32;
                while sent < due {
                    line.write_all(&frame(sent)).unwrap();
                    sent += 1;
                }
                thread::sleep(Duration::from_millis(2));
            }
        });
        Self {
            stop,
            thread: Some(thread),
        }
    }

    /// Stops sending.
    fn end(mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

fn frame(index: u32) -> Vec<u8> {
    let sensor = &ImuFormat::Stim300.simulated()[0];
    let fields = Fields {
        index,
        time: f64::from(index + 1) / RATE,
        gyro: COUNTS[0],
        accel: COUNTS[1],
        rest: sensor.rest,
    };
    let mut frame = [0; LONGEST];
    let len = (sensor.emit)(&fields, &mut frame).unwrap();
    frame[..len].to_vec()
}

/// What was sent on an axis, deg/s and m/s2.
fn sent(axis: usize) -> f64 {
    f64::from(COUNTS[axis / 3][axis % 3]) * COUNT[axis / 3] * RATE
}

/// A number whose digits are in groups.
fn ungrouped(text: &str) -> f64 {
    let digits = text.replace('\u{a0}', "");
    digits.parse().unwrap_or_else(|_| panic!("{text}"))
}

fn number(page: &mut Chromium, id: &str) -> f64 {
    let text = page.text(id);
    text.parse().unwrap_or_else(|_| panic!("{id}: {text}"))
}

/// Presses a button and waits for the answer in words.
fn order(page: &mut Chromium, selector: &str, answer: &str) {
    page.value("document.getElementById('order-answer').textContent = ''");
    page.click(selector);
    page.waits_for("/^(Done|Refused)/.test(document.getElementById('order-answer').textContent)");
    let says = page.text("order-answer");
    assert!(says.contains(answer), "{selector}: {says}");
}

/// Presses a button that asks first: it says what is lost, a no sends nothing, and a yes sends it.
fn asked(page: &mut Chromium, selector: &str, lost: &[&str], answer: &str) {
    page.value("document.getElementById('order-answer').textContent = ''");
    for button in ["[value=no]", "#ask-yes"] {
        page.click(selector);
        page.waits_for("document.getElementById('ask').open");
        let says = page.text("ask-lost");
        assert!(lost.iter().all(|part| says.contains(part)), "{says}");
        page.click(&format!("#ask {button}"));
        page.waits_for(
            "/^(Nothing|Done|Refused)/.test(document.getElementById('order-answer').textContent)",
        );
        let says = page.text("order-answer");
        let expected = if button == "#ask-yes" {
            answer
        } else {
            "Nothing was sent"
        };
        assert!(says.contains(expected), "{selector}: {says}");
        page.value("document.getElementById('order-answer').textContent = ''");
    }
}

/// Gives a unit file to the page.
fn give(page: &mut Chromium, text: &str) {
    let text = serde_json::to_string(text).unwrap();
    page.value(&format!(
        "{{ const files = new DataTransfer(); files.items.add(new File([{text}], 'unit.toml')); \
         document.getElementById('unit-file').files = files.files; }}"
    ));
}

/// Gives the unit file to the page and has it sent to a device without a configuration.
fn configure(page: &mut Chromium, text: &str, answer: &str) {
    give(page, text);
    order(page, "#configure", answer);
}

fn mode(page: &mut Chromium, name: &str) {
    order(
        page,
        &format!("[data-mode={name}]"),
        &format!("the mode is {name}"),
    );
    page.waits_for(&format!(
        "document.getElementById('mode').textContent === '{name}'"
    ));
    let pressed = "document.querySelector('[aria-pressed=true]').dataset.mode";
    assert_eq!(page.value(pressed), name);
}

#[test]
fn a_board_is_shown_steered_lost_and_found() {
    let (Some(image), Some(chromium)) = (BOARDS[0].image.build_or_skip(), here_or_skip()) else {
        return;
    };
    let mut board = Listening::start(BOARDS[0], &image).expect("QEMU listens");
    let [sensor_port, stream, _, command] = board.ports.clone();
    let mut link = Link::open("--port", &command, 0).unwrap();
    let weights = images(&networks());
    link.orders(&load(&weights)).unwrap();
    drop(link);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("board.mcap");
    let server = Server::start(&[
        "--device",
        &command,
        "--stream",
        &stream,
        "--mcap",
        file.to_str().unwrap(),
    ]);
    let mut page = Chromium::open(chromium, &format!("http://{}/", server.at));
    page.waits_for("document.getElementById('device')?.textContent === 'connected'");

    // a new device says what is wrong, and what to do
    page.waits_for("!!document.querySelector('[data-fault=NOT_CONFIGURED]')");
    let faults = page.text("faults");
    assert!(
        faults.contains("Remedy: ") && faults.contains("device configure"),
        "{faults}"
    );
    order(&mut page, "[data-mode=learn]", "Refused");
    configure(
        &mut page,
        &UNIT.replace("'stim300'", "'no-such'"),
        "unit.toml:4",
    );
    configure(&mut page, UNIT, "the unit bench is configured");
    page.waits_for("document.getElementById('unit').textContent === 'bench N25581'");
    page.waits_for("document.getElementById('mode').textContent === 'shadow'");

    // the page shows the values that were sent
    let sensor = Sensor::start(&sensor_port);
    page.waits_for("document.getElementById('corrected-5').textContent !== ''");
    for axis in 0..6 {
        for side in ["raw", "corrected"] {
            let shown = number(&mut page, &format!("{side}-{axis}"));
            assert!(
                (shown - sent(axis)).abs() < 6e-6,
                "{side} {axis}: {shown}, {}",
                sent(axis)
            );
        }
    }
    corrections_are_shown(&mut page);

    // silence is a fault; the frames counted until then are those that the device reports after the
    // server has ended
    sensor.end();
    page.waits_for("!!document.querySelector('[data-fault=SILENT]')");
    let count = "document.querySelector('[data-counter=frames] td').textContent";
    page.waits_for(
        "document.querySelector('[data-counter=frames] td:last-child').textContent === '0.0'",
    );
    let frames = ungrouped(page.value(count).as_str().unwrap()) as u32;
    alignment_is_ordered(&mut page);
    lost_and_found(&mut board, &mut page);
    mode(&mut page, "bypass");
    drop(page);
    assert_eq!(server.interrupt(), Some(0));
    let mut link = Link::open("--port", &command, 0).unwrap();
    assert_eq!(link.health().unwrap().mode, Mode::Bypass);
    assert_eq!(link.counters().unwrap().frames, frames);
    is_recorded(&file, frames);
}

/// In mode frozen the networks correct: the page shows the correction, and still the raw values
/// that were sent.
fn corrections_are_shown(page: &mut Chromium) {
    mode(page, "frozen");
    page.waits_for("Number(document.getElementById('difference-0').textContent) !== 0");
    page.waits_for("document.getElementById('acts').textContent === 'corrections act now'");
    for axis in 0..6 {
        // a corrected value cannot hold parts of a count, the next one carries them; and the page
        // knows the correction twice a second, which counts while it fades in
        let within = COUNT[axis / 3] * RATE;
        let shown = format!("Number(document.getElementById('raw-{axis}').textContent)");
        page.waits_for(&format!("Math.abs({shown} - {}) < {within}", sent(axis)));
    }
    mode(page, "shadow");
    page.waits_for("document.getElementById('acts').textContent === 'no correction acts'");
}

/// While the navigation computer aligns itself, a device takes no configuration.
fn alignment_is_ordered(page: &mut Chromium) {
    order(page, "#align-started", "the alignment has begun");
    let other = UNIT.replace("N25581", "N25582");
    give(page, &other);
    asked(page, "#configure", &["Lost: ", "begins again"], "alignment");
    order(page, "#align-finished", "the alignment is done");
    order(page, "#heading", "Refused");
}

fn lost_and_found(board: &mut Listening, page: &mut Chromium) {
    board.stands_still(true).unwrap();
    page.waits_for("document.getElementById('device').textContent === 'lost'");
    let problem = page.text("problem");
    assert!(problem.contains("remedy: "), "{problem}");
    assert_eq!(
        page.value("document.getElementById('store').disabled"),
        true
    );
    board.stands_still(false).unwrap();
    page.waits_for("document.getElementById('device').textContent === 'connected'");
    assert_eq!(
        page.value("document.getElementById('problem').hidden"),
        true
    );
}

/// The file has every frame but those in which the format was detected, and the log of events.
fn is_recorded(file: &std::path::Path, frames: u32) {
    let topics = topics(file);
    let recorded = topics["/imu/corrected"];
    assert!(
        u64::from(frames).abs_diff(recorded) <= 10,
        "{recorded} of {frames}"
    );
    let first = messages(file, "/imu/corrected").swap_remove(0);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let [rate, force] = ["rate", "force"].map(|of| first[of][name].as_f64().unwrap());
        assert!((rate - sent(axis)).abs() < 1e-9, "{first}");
        assert!((force - sent(axis + 3)).abs() < 1e-9, "{first}");
    }
    assert!(topics["/log"] >= 12, "{topics:?}");
}

/// The five steps with their bars, the orientation, and no counter that is 0 outside of its fold.
fn the_way_is_shown(page: &mut Chromium) {
    page.waits_for("document.querySelectorAll('#way progress').length === 5");
    page.waits_for("document.querySelector('[data-step=aligned]').className === 'done'");
    let bar = "document.querySelector('[data-step=aligned] progress').value";
    assert_eq!(page.value(bar), 1);
    page.waits_for("/ of 100/.test(document.querySelector('[data-step=proof] .says').textContent)");
    let attitude = page.text("attitude-now");
    let shown = attitude.starts_with("roll ") && attitude.contains(", heading ");
    assert!(shown, "{attitude}");
    let turned = "document.getElementById('needle').getAttribute('transform')";
    let turned = page.value(turned);
    assert!(turned.as_str().unwrap().starts_with("rotate("), "{turned}");
    let zeros = "[...document.querySelectorAll('#counters td:nth-child(2)')].some((cell) => cell.textContent === '0')";
    assert_eq!(page.value(zeros), false);
    let folded = page.text("zeros");
    assert!(
        folded.contains("counters are 0") && folded.contains("sensor restarts"),
        "{folded}"
    );
}

#[test]
fn a_simulated_device_is_shown_at_any_width() {
    let Some(chromium) = here_or_skip() else {
        return;
    };
    let server = Server::start(&["--simulate", "--rate", "250", "--speed", "30"]);
    let mut page = Chromium::open(chromium, &format!("http://{}/", server.at));
    page.waits_for("/ m\\/s$/.test(document.getElementById('place')?.textContent)");
    the_way_is_shown(&mut page);
    let sigma = page.text("gyro-now");
    assert!(
        sigma.contains(" \u{b1} ") && sigma.ends_with("deg/h"),
        "{sigma}"
    );
    // a few rehearsals have ended, and the harm check of a candidate has moved
    page.waits_for(
        "(([proof, check]) => proof?.textContent > 0 && check.textContent !== '1.00')\
         (document.querySelectorAll('[data-candidate=biases] td'))",
    );
    page.waits_for(
        "/proof \\d+ of 100, |100 of 100/.test(document.getElementById('says').textContent)",
    );
    assert_eq!(
        page.value("document.querySelectorAll('#trials tbody tr').length"),
        8
    );
    let bound = page.value("document.querySelectorAll('#bound td')[4].textContent");
    assert!(ungrouped(bound.as_str().unwrap()) > 0.0, "{bound}");
    if std::env::var_os("LRNN_PICTURES").is_some() {
        page.waits_for("/proved/.test(document.getElementById('trials').textContent)");
    }
    // nothing is corrected before the next power-on, and each sample is compared with itself
    for _ in 0..20 {
        for axis in 0..6 {
            assert_eq!(
                number(&mut page, &format!("difference-{axis}")),
                0.0,
                "{axis}"
            );
        }
    }
    for (width, height) in [(1280, 2100), (390, 3900)] {
        page.resize(width, height);
        let fits = "document.documentElement.scrollWidth <= innerWidth";
        page.waits_for(fits);
        // every curve has the width of its panel
        page.waits_for(
            "[...document.querySelectorAll('.plot')].every((panel) => \
             Math.abs(panel.querySelector('.uplot').offsetWidth - panel.clientWidth) < 2)",
        );
        page.picture(&format!("live-{width}.png"));
    }
    let colours = "getComputedStyle(document.body).backgroundColor";
    assert_eq!(page.value(colours), "rgb(255, 255, 255)");
    page.dark();
    page.waits_for(&format!("{colours} !== 'rgb(255, 255, 255)'"));
    page.picture("live-dark.png");
}
