//! Text output of `host-sim device`.

use firmware::error_bound::TIMES_S;
use host_core::words::{counted, thousands};
use host_device::device::{
    Antenna, Event, Info, Learner, LineInfo, Memory, Protected, Start, Status, StoreState, Times,
    Updates,
};
use std::fmt::Write;

/// Prints the description of a device.
pub(super) fn info(info: &Info) {
    println!("firmware       {}", info.firmware);
    println!(
        "versions       command link {}, weight image {}, configuration schema {}",
        info.link, info.image, info.schema
    );
    let stores = if info.stores { "can" } else { "cannot" };
    println!(
        "board          {}, sets of pins: {}, {stores} store",
        info.board, info.pin_sets
    );
    println!("mode           {}", info.mode);
    println!("configuration  {}", configured(info));
    println!("security       {}", security(&info.security));
    println!("update         {}", updates(info.updates.as_ref()));
    if let Some(rate) = info.rate_hz {
        let format = info.format.unwrap_or("detected");
        let start = info.mode_at_start.unwrap_or("bypass");
        println!("sensor         format {format}, {rate} Hz; mode {start} at power-on");
    }
    for line in &info.lines {
        println!("{:14} {}", line.line, bit_rate(line));
    }
    print!("{}", teachers(info));
    if let Some(start) = &info.start {
        print!("{}", start_lines(start));
    }
}

/// Why and how the board started.
fn start_lines(start: &Start) -> String {
    let mut text = format!(
        "started        {:.0} s ago by {}\n",
        start.uptime_s,
        start.causes.join(", ")
    );
    let _ = writeln!(text, "clock          {}", start.clock);
    if let Some(crash) = &start.crash {
        let _ = writeln!(text, "CRASH          {crash}");
    }
    for warning in &start.warnings {
        let _ = writeln!(text, "WARNING        {warning}");
    }
    text
}

/// Who may change the device.
fn security(of: &Protected) -> String {
    let mut text = match of.state {
        "keyed" => "keyed: what changes the device needs its key".to_owned(),
        "open by choice" => "OPEN by choice: anybody at this line can change the device".to_owned(),
        _ => {
            "NOT PROVISIONED: anybody at this line can change the device; remedy: host-sim device \
              provision --key-file FILE"
                .to_owned()
        }
    };
    if of.state == "keyed" && !of.random {
        text.push_str("; NO RANDOM NUMBERS: a recorded session may be good again after a restart");
    }
    if of.forged > 0 {
        let _ = write!(text, "; requests with a wrong key, refused: {}", of.forged);
    }
    let _ = write!(text, "; records that may be stored now: {}", of.stores);
    text
}

/// The image that runs, and the updates it takes.
fn updates(of: Option<&Updates>) -> String {
    let Some(of) = of else {
        return "not over this link".to_owned();
    };
    let mut text = match of.running {
        "on trial" => "ON TRIAL: the next start goes back, unless it proves itself".to_owned(),
        "confirmed" => "this firmware is a confirmed update".to_owned(),
        _ => "this firmware was flashed by a probe".to_owned(),
    };
    let _ = match of.signer.as_str() {
        "development" => write!(
            text,
            "; takes what is signed with the DEVELOPMENT KEY, by anybody"
        ),
        key => write!(text, "; takes what is signed with the key {key}..."),
    };
    match (of.ready, of.received) {
        (true, _) => text.push_str("; an update is ready for the next start"),
        (false, Some(bytes)) => {
            let _ = write!(text, "; an update is under way, {bytes} bytes");
        }
        _ => {}
    }
    if let Some(version) = &of.failed {
        let _ = write!(text, "; firmware {version} was tried and FAILED");
    }
    text
}

/// The receiver, the antenna, and the learner.
fn teachers(info: &Info) -> String {
    let mut text = String::new();
    let receiver = &info.receiver;
    let _ = write!(
        text,
        "fixes          {} configured, {} on the line",
        receiver.configured.unwrap_or("no protocol"),
        receiver.protocol.unwrap_or("nothing")
    );
    if let Some(time) = receiver.fix_time_s {
        let _ = write!(text, ", the last one of {time:.1} s of the week");
    }
    if let Some(age) = receiver.fix_age_ms {
        let _ = write!(text, ", {age:.0} ms old by the time pulse");
    }
    text.push('\n');
    for what in &receiver.missing {
        let _ = writeln!(text, "MISSING        {what}");
    }
    learner_lines(&mut text, &info.learner);
    text.push_str(&memory_line(&info.memory));
    text.push_str(&store_line(&info.store));
    if let Some(antenna) = &info.antenna {
        antenna_line(&mut text, antenna);
    }
    time_line(&mut text, &info.times);
    error_bound_line(&mut text, info.error_bound_m);
    text
}

/// The device's memory of the unit.
fn memory_line(memory: &Memory) -> String {
    let acts = if memory.acts {
        "stored networks act"
    } else {
        "no stored networks act"
    };
    let mut text = match memory.drives {
        0 => "memory         none".to_owned(),
        drives => format!(
            "memory         {}, {:.1} h",
            counted(drives, "drive"),
            memory.hours
        ),
    };
    if let Some([least, most]) = memory.temperatures_degc {
        let _ = write!(text, ", {least} to {most} degC");
    }
    let _ = writeln!(text, "; {acts}");
    if memory.of_another {
        text.push_str(
            "MEMORY         of another sensor or other inputs was found and is not used; remedy: \
             give the serial and [networks] that it was learnt with, or let the device learn again\n",
        );
    }
    text
}

/// The device's store at its start.
fn store_line(store: &StoreState) -> String {
    let Some(number) = store.record else {
        return "store          nothing that is used\n".to_owned();
    };
    let [first, second] = store.erased;
    let mut text = format!(
        "store          record {number}; starts until then: {}, after a failure: {}, {:.1} h, slots \
         erased {first} and {second} times\n",
        store.starts, store.failures, store.hours
    );
    if store.damaged {
        text.push_str(
            "STORE          a newer record is damaged, and the one before is in use; remedy: look at \
             weights and configuration, then host-sim device store\n",
        );
    }
    if store.passed > 0 {
        let _ = writeln!(
            text,
            "STORE          newer records passed over: {}, because the device failed with them; \
             remedy: configure and store again",
            store.passed
        );
    }
    text
}

/// Whether a device is configured, and for what.
fn configured(info: &Info) -> String {
    let Some(name) = &info.name else {
        return "none: the device only passes bytes; remedy: host-sim device configure FILE".into();
    };
    let serial = match info.serial.as_deref() {
        None | Some("") => String::new(),
        Some(serial) => format!(", serial number {serial}"),
    };
    let stored = if info.stored {
        "stored"
    } else {
        "not stored: it is lost when the device is switched off"
    };
    format!("{name}{serial}; {stored}")
}

/// A line's bit rate, with its error.
fn bit_rate(line: &LineInfo) -> String {
    let mut text = match (line.configured, line.bit_rate) {
        (Some(nominal), Some(is)) => {
            format!("{nominal} bit/s configured, {is} bit/s in fact")
        }
        (Some(nominal), None) => format!("{nominal} bit/s configured"),
        (None, Some(is)) => format!("{is} bit/s"),
        (None, None) => "bit rate not known".into(),
    };
    if let Some(error) = line.error_percent {
        let _ = write!(text, " ({error:+.2} %)");
    }
    if let Some(clock) = line.clock_hz {
        let _ = write!(text, ", clock {:.3} MHz", f64::from(clock) / 1e6);
    }
    text
}

/// An event of a watch. `in_place`: on a terminal, where the status overwrites the one before it.
pub(super) fn event(event: &Event, in_place: bool) -> String {
    match event {
        Event::Status(report) if in_place => format!("\x1b[H\x1b[2J{}", status(report)),
        Event::Status(report) => status(report) + "\n",
        Event::Lost { problem, .. } => {
            format!("the device does not answer any more: {problem}\nlooking for it ...\n")
        }
        Event::Found { time_s } => format!("found again after {time_s:.0} s\n"),
    }
}

fn status(status: &Status) -> String {
    let mut text = format!("{:8.1} s  mode {}", status.time_s, status.mode);
    if let Some(busy) = status.busy_percent {
        let busiest = status.busiest_percent.unwrap_or(busy);
        let _ = write!(text, ", processor {busy:.1} % (at most {busiest:.1} %)");
    }
    text.push('\n');
    if status.faults.is_empty() {
        text.push_str("no faults\n");
    }
    for fault in &status.faults {
        let _ = writeln!(
            text,
            "FAULT {}: {}; remedy: {}",
            fault.name, fault.says, fault.remedy
        );
    }
    rates(&mut text, status);
    for step in &status.steps {
        let _ = writeln!(text, "{:14} {} {}", step.name, bar(step.share), step.says);
    }
    learner_lines(&mut text, &status.learner);
    for says in &status.says {
        let _ = writeln!(text, "               {says}");
    }
    if let Some(antenna) = &status.antenna {
        antenna_line(&mut text, antenna);
    }
    if let Some(times) = &status.times {
        time_line(&mut text, times);
    }
    error_bound_line(&mut text, status.error_bound_m);
    text
}

/// A bar of ten characters.
fn bar(share: f64) -> String {
    let full = (share * 10.0).floor() as usize;
    format!("[{}{}]", "#".repeat(full), ".".repeat(10 - full.min(10)))
}

/// The largest error that the corrections can add.
fn error_bound_line(text: &mut String, metres: [u32; 5]) {
    let each = metres.iter().zip(TIMES_S);
    let each: Vec<String> = each
        .map(|(m, t)| format!("{m} m within {} min", t / 60))
        .collect();
    let _ = writeln!(
        text,
        "error bound    corrections add at most {} of the alignment",
        each.join(", ")
    );
}

/// The learner and its alignment.
fn learner_lines(text: &mut String, learner: &Learner) {
    let navigates = if learner.navigates {
        "navigates"
    } else {
        "does not navigate"
    };
    let _ = writeln!(
        text,
        "learner        {navigates}, {} promoted, {} used, {} refused, {}, {} given up",
        match learner.winner {
            0 => "no hypothesis".to_owned(),
            winner => format!("hypothesis {winner}"),
        },
        counted(learner.used_fixes, "fix"),
        thousands(learner.refused_fixes),
        counted(learner.promotions, "promotion"),
        learner.rollbacks
    );
    let sigma = learner
        .heading_sigma_deg
        .map_or("unknown".into(), |deg| format!("to {deg:.2} deg"));
    let _ = writeln!(
        text,
        "alignment      heading by {}, {sigma}, residual {:.2} (1 is as expected), {} refused",
        learner.way, learner.residual, learner.refused_alignments
    );
    let now = match learner.rest_s {
        0 => String::new(),
        seconds => format!(", at rest for {seconds} s"),
    };
    let _ = writeln!(
        text,
        "rests          {} taught the gyros{now}",
        learner.rests
    );
}

/// Lever arm and delay with their standard deviations.
/// The receiver's time of the samples, where there is one.
fn time_line(text: &mut String, times: &Times) {
    if times.board_ppm.is_some() {
        let _ = writeln!(text, "time           {}", times.says());
    }
}

fn antenna_line(text: &mut String, antenna: &Antenna) {
    let [x, y, z] = antenna.lever_arm_m;
    let [dx, dy, dz] = antenna.lever_arm_sigma_m;
    let _ = writeln!(
        text,
        "antenna        {x:.2} {y:.2} {z:.2} m forward, right, down (+- {dx:.2} {dy:.2} {dz:.2}), \
         fixes {:.0} ms old (+- {:.0})",
        antenna.fix_delay_ms, antenna.fix_delay_sigma_ms
    );
}

/// The rates of frames and fixes, and of other counters that grow.
fn rates(text: &mut String, status: &Status) {
    let Some(rates) = &status.per_second else {
        let frames = status.counters.get("frames").copied().unwrap_or_default();
        let _ = writeln!(text, "frames         {frames} since power-on");
        return;
    };
    for (name, rate) in rates {
        let always = ["frames", "good_fixes"].contains(name);
        let own = *name == "requests"; // of the navigation computer: not shown
        if always || (*rate > 0.0 && !own) {
            let name = name.replace('_', " ");
            let _ = writeln!(text, "{name:14} {rate:.1} a second");
        }
    }
}
