//! The frames around ADIS bursts as a wire format: [`ImuProtocol`].

use super::{INCREMENTS, LONGEST, at, scan, seal, wrap};
use crate::sample::Axes;
use crate::units::{DEGREE, G};
use crate::wire::adis::{Burst, Form, Model, counting};
use crate::wire::field::take;
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::Stream;
use crate::wire::{Error, Reading, Scan, power_of_two as two};
use serde::{Deserialize, Serialize};

/// Settings that the frames do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The sensor, by which the scales go.
    pub model: Model,
}

/// ADIS bursts in frames of their own.
#[derive(Debug)]
pub struct Protocol;

/// In [`ImuProtocol::content`]: increments. Lengths of bursts are less.
const CONTENT_INCREMENTS: u8 = 0x40;

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings {
        model: Model::Adis16505(2),
    };
    const NAME: &'static str = "adis-uart";
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    /// The length of the burst, and whether it holds increments.
    #[inline(always)]
    fn content(frame: &[u8]) -> u8 {
        let [length, flags] = take(frame, at::LENGTH);
        let increments = flags & INCREMENTS != 0;
        length | if increments { CONTENT_INCREMENTS } else { 0 }
    }

    /// The rate is the configured one: the bursts do not contain it. There are no units when the
    /// model sends no such burst.
    fn stream(settings: &Settings, content: u8, rate: f64) -> Option<Stream> {
        let model = settings.model;
        let length = usize::from(content & !CONTENT_INCREMENTS);
        let is_1649x = length == Form::Adis1649x.bytes();
        if is_1649x != (model.form() == Form::Adis1649x) {
            return None;
        }
        let wide = length != Form::Narrow.bytes();
        let units = if content & CONTENT_INCREMENTS == 0 {
            model.units(wide)
        } else {
            model.increments(wide)
        };
        Some(counting(units?, rate))
    }

    #[inline(always)]
    fn read(frame: &[u8]) -> Option<Reading> {
        super::read(frame)
    }

    #[inline(always)]
    fn change(frame: &mut [u8], change: &Change, _settings: &Settings) -> Option<Axes> {
        super::change(frame, change)
    }

    fn has_thermometer(settings: &Settings) -> bool {
        settings.model.form().has_thermometer()
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

const fn simulated(
    name: &'static str,
    unit: [f64; 2],
    settings: fn(&mut crate::wire::Settings),
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate: 1000,
        count: unit,
        unit,
        bits: 32,
        rest: 250,
        has_accel: true,
        has_status: true,
        settings,
        emit,
        introduction: None,
    }
}

const SIMULATED: [Simulated; 4] = [
    simulated(
        "adis-uart ADIS16505-2, 32 bits",
        [
            1e-3 * DEGREE / 40.0 * two(-16),
            1e-3 * 78.4 / 32_000.0 * two(-16),
        ],
        |_| {},
        |fields, buffer| framed(Form::Wide, 0, fields, buffer),
    ),
    simulated(
        "adis-uart ADIS16505-2, increments of 32 bits",
        [720.0 * DEGREE * two(-31), 100.0 * two(-31)],
        |_| {},
        |fields, buffer| framed(Form::Wide, INCREMENTS, fields, buffer),
    ),
    Simulated {
        bits: 16,
        ..simulated(
            "adis-uart ADIS16470, 16 bits",
            [1e-3 * 0.1 * DEGREE, 1e-3 * 1.25e-3 * G],
            |settings| settings.adis_uart.model = Model::Adis16470,
            |fields, buffer| framed(Form::Narrow, 0, fields, buffer),
        )
    },
    Simulated {
        has_status: false,
        ..simulated(
            "adis-uart ADIS16495-1",
            [
                1e-3 * DEGREE / 160.0 * two(-16),
                1e-3 * 0.25e-3 * G * two(-16),
            ],
            |settings| settings.adis_uart.model = Model::Adis16495(1),
            |fields, buffer| framed(Form::Adis1649x, 0, fields, buffer),
        )
    },
];

fn framed(form: Form, flags: u8, fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let burst = Burst {
        diagnosis: 0,
        gyro: fields.gyro,
        accel: fields.accel,
        temperature: fields.rest as i16,
        counter: fields.index as u16,
    };
    let mut frame = [0; LONGEST];
    let time_us = (fields.time * 1e6) as u64 as u32;
    let frame = match form {
        Form::Narrow => wrap(form, flags, time_us, &burst.emit16(), &mut frame),
        Form::Wide => wrap(form, flags, time_us, &burst.emit32(), &mut frame),
        Form::Adis1649x => wrap(form, flags, time_us, &burst.emit_1649x(false), &mut frame),
    }?;
    let place = buffer.get_mut(..frame.len()).ok_or(Error::Length)?;
    place.copy_from_slice(frame);
    Ok(frame.len())
}
