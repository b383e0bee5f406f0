//! The Epson bursts as a wire format: [`ImuProtocol`] and [`LaidOut`].

use super::layout::{Field, Layout};
use super::model::{Model, units};
use super::{Frame, Repr, scan, seal};
use crate::sample::{Axes, RawSample};
use crate::units::{DEGREE, G};
use crate::wire::protocol::{Change, Fields, ImuProtocol, LaidOut, Simulated};
use crate::wire::sequence::{Rule, Sequence, Stream};
use crate::wire::{Error, Reading, Scan};
use serde::{Deserialize, Serialize};

/// Settings that the bursts do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// BURST_CTRL1 and BURST_CTRL2 of the sensor.
    pub layout: Layout,
    /// The model, by which the scales go.
    pub model: Model,
    /// The larger accelerometer range is on (A_RANGE_CTRL), where the model has two.
    pub high_range: bool,
    /// DLTA_RANGE_CTRL, 0 to 15: a count of the angle increments is 2 to this power times as large.
    pub angle_range: u8,
    /// DLTV_RANGE_CTRL, 0 to 15: the same for the velocity increments.
    pub velocity_range: u8,
    /// Step of COUNT from one burst to the next. 0: not known, or COUNT is reset by the EXT pin.
    /// Then damage and silence alone show a gap.
    pub count_step: u16,
}

/// Seiko Epson IMUs at a UART.
#[derive(Debug)]
pub struct Protocol;

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings {
        layout: Layout::USUAL,
        model: Model::G366,
        high_range: false,
        angle_range: 12,
        velocity_range: 12,
        count_step: 0,
    };
    const NAME: &'static str = "epson";
    /// One byte.
    const HAS_START_MARK: bool = false;
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    fn scan(bytes: &[u8]) -> Scan {
        scan(Layout::USUAL, bytes)
    }

    /// The rate is the configured one: the bursts do not contain it.
    fn stream(settings: &Settings, _content: u8, rate: f64) -> Option<Stream> {
        Some(Stream {
            units: units(settings)?,
            rate,
            sequence: match settings.count_step {
                0 => Sequence::None,
                step => Sequence::Counter(Rule::new(0x1_0000, step.into())),
            },
        })
    }

    fn read(frame: &[u8]) -> Option<Reading> {
        <Protocol as LaidOut>::read(Layout::USUAL, frame)
    }

    fn change(frame: &mut [u8], change: &Change, settings: &Settings) -> Option<Axes> {
        <Protocol as LaidOut>::change(Layout::USUAL, frame, change, settings)
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

impl LaidOut for Protocol {
    type Layout = Layout;

    #[inline(always)]
    fn scan(layout: Layout, bytes: &[u8]) -> Scan {
        scan(layout, bytes)
    }

    #[inline(never)] // not in the code of all formats
    fn read(layout: Layout, frame: &[u8]) -> Option<Reading> {
        Frame::over(layout, frame).map(|frame| frame.reading())
    }

    #[inline(never)] // likewise
    fn change(layout: Layout, frame: &mut [u8], change: &Change, _: &Settings) -> Option<Axes> {
        let RawSample::Counts { gyro, accel } = *change.sample else {
            return None;
        };
        Some(Frame::over(layout, frame)?.change(gyro, accel))
    }
}

/// Registers of the simulated sensors: rates and increments of 32 bits, and the 16-bit example of
/// the M-G362's data sheet.
const RATES: [u16; 2] = [0xF003, 0x7000];
const INCREMENTS: [u16; 2] = [0xCC03, 0x4C00];
const NARROW: [u16; 2] = [0xF007, 0x0000];

const fn layout([burst_ctrl1, burst_ctrl2]: [u16; 2]) -> Layout {
    match Layout::new(burst_ctrl1, burst_ctrl2) {
        Ok(layout) => layout,
        Err(_) => Layout::USUAL,
    }
}

const fn simulated(
    name: &'static str,
    rate: u32,
    unit: [f64; 2],
    settings: fn(&mut crate::wire::Settings),
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate,
        count: unit,
        unit,
        bits: 32,
        rest: 0,
        has_accel: true,
        has_status: true,
        settings,
        emit,
        introduction: None,
    }
}

/// deg/s and mg to rad and m/s of a sample of this time, s.
const fn unit(dps: f64, mg: f64, time: f64) -> [f64; 2] {
    [dps * time * DEGREE, mg * time * G / 1000.0]
}

const SIMULATED: [Simulated; 3] = [
    simulated(
        "epson M-G366 rates",
        1000,
        unit(1.0 / 66.0 / 65_536.0, 0.25 / 65_536.0, 1e-3),
        |settings| settings.epson.count_step = 1,
        |fields, buffer| burst(RATES, fields, buffer),
    ),
    simulated(
        "epson M-G370PDF1 increments",
        500,
        unit(1.0 / 66.0 / 65_536.0, 0.4 / 65_536.0, 8e-3),
        |settings| {
            settings.epson = Settings {
                layout: layout(INCREMENTS),
                model: Model::G370Pdf1,
                angle_range: 3,
                velocity_range: 3,
                count_step: 1,
                ..settings.epson
            };
        },
        |fields, buffer| burst(INCREMENTS, fields, buffer),
    ),
    Simulated {
        bits: 16,
        ..simulated(
            "epson M-G320 rates of 16 bits",
            250,
            unit(0.008, 0.2, 4e-3),
            |settings| {
                settings.epson = Settings {
                    layout: layout(NARROW),
                    model: Model::G320,
                    count_step: 1,
                    ..settings.epson
                };
            },
            |fields, buffer| burst(NARROW, fields, buffer),
        )
    },
];

fn burst(registers: [u16; 2], fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let triad = |[x, y, z]: [i32; 3]| [x, y, z, 0];
    let rest = [fields.rest.cast_signed(), 0, 0, 0];
    let layout = layout(registers);
    let mut numbers = [rest; 10];
    for (field, numbers) in Field::ALL.into_iter().zip(&mut numbers) {
        match field {
            Field::Flags => *numbers = [0xFE00, 0, 0, 0],
            Field::Gyro | Field::DeltaAngle => *numbers = triad(fields.gyro),
            Field::Accel | Field::DeltaVelocity => *numbers = triad(fields.accel),
            Field::Count => *numbers = [fields.index.cast_signed(), 0, 0, 0],
            _ => {}
        }
    }
    Repr { layout, numbers }.emit(buffer)
}
