//! The fields of a configuration by the names that the document gives them.

use super::{Fields, Value, adis_models, numbers, table};
use firmware::configuration::{Configuration, Sensor};
use firmware::wire::FormatSettings;

/// The fields of a configuration, by their names.
pub(super) fn expected(of: &Configuration) -> Fields {
    let mut fields = Fields::new();
    let mut add = |name: &str, numbers: &[f64]| {
        fields.push((name.to_owned(), Value::Numbers(numbers.to_vec())));
    };
    let floats = |values: &[f32]| values.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    let lines = &of.lines;
    add("sensor_baud", &[lines.sensor_baud.into()]);
    add("parity", &[f64::from(lines.parity as u8)]);
    add("two_stop_bits", &[lines.two_stop_bits.into()]);
    add("receiver_baud", &[lines.receiver_baud.into()]);
    add("pins", &[lines.pins.into()]);
    sensor(of.sensor.as_ref(), &mut add);
    add("rate", &[of.rate]);
    add("mounting", &floats(&of.mounting));
    for (name, triad) in [("gyro", &of.gyro), ("accel", &of.accel)] {
        let parts = [
            ("bias_turn_on", triad.bias_turn_on),
            ("bias_in_run", triad.bias_in_run),
            ("white_noise", triad.white_noise),
            ("scale", triad.scale),
            ("misalignment", triad.misalignment),
            ("g_sensitivity", triad.g_sensitivity),
            ("range", triad.range),
        ];
        parts
            .iter()
            .for_each(|(part, value)| add(&format!("{name}.{part}"), &floats(&[*value])));
    }
    let receiver = &of.receiver;
    add("receiver.protocol", &[f64::from(receiver.protocol as u8)]);
    add("receiver.lever_arm", &floats(&receiver.lever_arm));
    add(
        "receiver.lever_arm_sigma",
        &floats(&[receiver.lever_arm_sigma]),
    );
    add("receiver.fix_delay", &floats(&[receiver.fix_delay]));
    add(
        "receiver.fix_delay_sigma",
        &floats(&[receiver.fix_delay_sigma]),
    );
    add("receiver.pulse", &[receiver.pulse.into()]);
    add(
        "receiver.heading_offset",
        &floats(&[receiver.heading_offset]),
    );
    add("vehicle.kind", &[f64::from(of.vehicle.kind as u8)]);
    add("vehicle.speed", &floats(&[of.vehicle.speed]));
    let correction = &of.correction;
    add("mode", &[f64::from(correction.mode as u8)]);
    add("activation", &[f64::from(correction.activation as u8)]);
    add("limit.gyro", &floats(&[correction.limit.gyro]));
    add("limit.accel", &floats(&[correction.limit.accel]));
    add("slew.gyro", &floats(&[correction.slew.gyro]));
    add("slew.accel", &floats(&[correction.slew.accel]));
    add("block", &floats(&[correction.block]));
    add("align", &floats(&[correction.align]));
    add("silence", &[correction.silence_us.into()]);
    add("mark", &[correction.mark.into()]);
    add("check_rate", &[correction.check_rate.into()]);
    let inputs = of.inputs.as_flattened().iter();
    let inputs: Vec<f64> = inputs.map(|source| f64::from(*source as u8)).collect();
    add("inputs", &inputs);
    add("cut_through", &[lines.cut_through.into()]);
    add("wheels", &[of.wheels.is_some().into()]);
    if let Some(wheels) = &of.wheels {
        add("wheels.lever_arm", &floats(&wheels.lever_arm));
        add("wheels.ahead", &floats(&[wheels.ahead]));
        add("wheels.scale", &floats(&[wheels.scale]));
        add("wheels.noise", &floats(&[wheels.noise]));
        add("wheels.delay", &floats(&[wheels.delay]));
    }
    let names = [
        ("name", of.identity.name.as_str()),
        ("serial", &of.identity.serial),
    ];
    let names = names.map(|(name, text)| (name.to_owned(), Value::Text(text.to_owned())));
    names.into_iter().chain(fields).collect()
}

/// The sensor's fields.
fn sensor(of: Option<&Sensor>, add: &mut impl FnMut(&str, &[f64])) {
    let format = match of {
        None => return add("sensor", &[0.0]),
        Some(Sensor::Spi(adis)) => {
            add("sensor", &[1.0, 1.0]);
            add("form", &[f64::from(adis.form as u8)]);
            for (name, unit) in [("gyro", adis.units.gyro), ("accel", adis.units.accel)] {
                let quantity = f64::from(unit.quantity as u8);
                add(&format!("{name}_quantity"), &[quantity]);
                add(&format!("{name}_count"), &[unit.lsb]);
            }
            return add("framed", &[adis.framed.into()]);
        }
        Some(Sensor::Stream(format)) => format,
    };
    let rows = table("(t: `sensor`)");
    let row = rows.iter().find(|row| row[1] == format.format().name());
    let row = row.expect("a row of the format");
    let begins: Vec<f64> = numbers(row[0]).into_iter().map(f64::from).collect();
    add("sensor", &begins);
    match format {
        FormatSettings::Stim300(stim300) => {
            add("config", &stim300.config.emit().map(f64::from));
            add("ask", &[stim300.ask.into()]);
            let answer = stim300.answer_us.map(f64::from);
            add("answer", answer.as_slice());
            let family = stim300.family.map(|family| f64::from(family as u8));
            add("family", family.as_slice());
        }
        FormatSettings::Kvh(kvh) => {
            add("delta", &[kvh.delta.into()]);
            add("degrees", &[kvh.degrees.into()]);
        }
        FormatSettings::Novatel(novatel) => add("imu_type", &[novatel.imu_type.0.into()]),
        FormatSettings::Epson(epson) => {
            let [first, second] = epson.layout.registers();
            add("burst_ctrl1", &[first.into()]);
            add("burst_ctrl2", &[second.into()]);
            add("model", &[f64::from(epson.model as u8)]);
            add("high_range", &[epson.high_range.into()]);
            add("angle_range", &[epson.angle_range.into()]);
            add("velocity_range", &[epson.velocity_range.into()]);
            add("count_step", &[epson.count_step.into()]);
        }
        FormatSettings::AdisUart(uart) => {
            let name = format!("{:?}", uart.model).to_lowercase();
            let (name, digit) = name.split_once('(').unwrap_or((&name, ")"));
            let models = adis_models();
            let number = models.iter().position(|(model, _)| model == name);
            let digit = digit.trim_end_matches(')').parse().ok();
            let number = number.expect("a model") as f64;
            add(
                "model",
                &[number].into_iter().chain(digit).collect::<Vec<_>>(),
            );
        }
        FormatSettings::VectorNav(nav) => add("values", &[f64::from(nav.values as u8)]),
        FormatSettings::Mavlink(mavlink) => {
            add("system", &[mavlink.imu.system.into()]);
            add("component", &[mavlink.imu.component.into()]);
            add("id", &[mavlink.imu.id.into()]);
        }
        FormatSettings::Hg4930(()) | FormatSettings::SbgEcom(()) | FormatSettings::Xsens(()) => {}
    }
}
