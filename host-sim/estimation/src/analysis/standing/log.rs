//! A recording of sensors that were put down somewhere: increments at a constant rate.

use super::super::allan::{Column, Kind};
use host_core::error::Error;
use host_core::inertial::earth::{Geodetic, Local};
use host_core::inertial::sins::Increment;
use host_core::list::{IN_MEMORY, List};
use host_io::recordings::gaps::gaps;
use host_io::recordings::pace::{Pace, nearly_whole};
use host_io::recordings::record::{Kind as Samples, Record};
use nalgebra::Vector3;

/// A recording of one power-on, or a part of one.
#[derive(Debug, Clone)]
pub struct Log {
    /// Its name in messages.
    pub name: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Increments, rad and m/s.
    pub samples: List<Increment>,
    /// Number and time, s, of the first sample, and of each one before which others are missing.
    pub begins: Vec<(usize, f64)>,
    /// The site, if the recording knows it.
    pub site: Option<Geodetic>,
    /// Temperature of the sensor, if it is known.
    pub temperature: Option<Temperature>,
    /// Notes of its reader.
    pub notes: Vec<String>,
}

/// Temperature of a sensor over a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Temperature {
    /// The same throughout, degrees C.
    Constant(f64),
    /// At the end of each second from this time on, degrees C.
    Seconds(f64, Vec<f64>),
}

impl Temperature {
    /// The temperature at a time, degrees C.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<f64> {
        match self {
            Self::Constant(celsius) => Some(*celsius),
            Self::Seconds(begin, all) => {
                let second = ((time - begin).floor().max(0.0) as usize).min(all.len().max(1) - 1);
                all.get(second).copied()
            }
        }
    }
}

impl Log {
    /// The samples of a recording.
    #[must_use]
    pub fn of_record(record: &Record) -> Self {
        let time = &record.time;
        let gaps = gaps(time, record.kind, &Pace::of(time));
        let mut begins: Vec<(usize, f64)> = time.start().map(|t| (0, t)).into_iter().collect();
        let at = |k: usize| time.block(k..k + 1).first().copied().unwrap_or_default();
        begins.extend(gaps.iter().map(|gap| (gap.next, at(gap.next))));
        // between the gaps
        let ends = time.end().zip(time.start());
        let all = ends.map_or(f64::NAN, |(end, start)| end - start);
        let across = gaps.iter().map(|gap| at(gap.next) - gap.from);
        let step = (all - across.sum::<f64>()) / (time.len() as f64 - begins.len() as f64);
        let scale = match record.kind {
            Samples::Increment => 1.0,
            Samples::Rate => step,
        };
        let each = record.samples.each();
        let scaled = each.map(|sample| Increment {
            dtheta: sample.dtheta * scale,
            dv: sample.dv * scale,
        });
        Self {
            name: record.file.display().to_string(),
            rate_hz: nearly_whole(1.0 / step),
            samples: List::collected(scaled, IN_MEMORY),
            begins,
            site: record.fixes.first().map(|fix| fix.position()),
            temperature: None,
            notes: record.notes.clone(),
        }
    }

    /// The samples of six columns, gyros and accelerometers, each x, y, z.
    ///
    /// # Errors
    /// There are others, or they cannot be read from their temporary files.
    pub fn of_columns(
        name: String,
        columns: Vec<Column>,
        notes: Vec<String>,
    ) -> Result<Self, Error> {
        let of = |kind| columns.iter().filter(|c| c.kind == kind).count();
        if [of(Kind::Gyro), of(Kind::Accel)] != [3, 3] {
            let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
            return Err(Error::Option {
                option: name,
                problem: format!(
                    "has the sensor columns {}, and three gyros and three accelerometers are \
                     needed",
                    names.join(", ")
                ),
                remedy: "describe the file by a header.toml (docs/your-data.md)".into(),
            });
        }
        let rate_hz = columns.first().map_or(f64::NAN, |c| c.rate_hz);
        let (gyros, accels): (Vec<_>, Vec<_>) =
            columns.into_iter().partition(|c| c.kind == Kind::Gyro);
        let mut lists = Vec::new();
        for column in gyros.into_iter().chain(accels) {
            lists.push((column.scale, column.values.finish()?));
        }
        let mut each: Vec<_> = lists.iter().map(|(s, list)| (*s, list.each())).collect();
        let mut next = || {
            let mut values = each.iter_mut().map(|(s, each)| each.next().map(|x| x * *s));
            let mut three = || {
                let mut one = || values.next().flatten();
                Some(Vector3::new(one()?, one()?, one()?))
            };
            Some(Increment {
                dtheta: three()?,
                dv: three()?,
            })
        };
        let samples = List::collected(std::iter::from_fn(&mut next), IN_MEMORY);
        samples.check()?;
        Ok(Self {
            name,
            rate_hz,
            samples,
            begins: vec![(0, 1.0 / rate_hz)],
            site: None,
            temperature: None,
            notes,
        })
    }

    /// Time at the end of a sample, s.
    #[must_use]
    pub fn time(&self, sample: usize) -> f64 {
        let after = self.begins.partition_point(|(first, _)| *first <= sample);
        let (first, time) = self.begins[..after].last().copied().unwrap_or_default();
        time + (sample - first) as f64 / self.rate_hz
    }

    /// Gravity at the site and its standard deviation, m/s2: the ellipsoid's, from which the real
    /// one differs by some 50 mGal; without a site anywhere on the Earth.
    #[must_use]
    pub fn gravity(&self) -> [f64; 2] {
        gravity(self.site.as_ref())
    }
}

/// Gravity of the ellipsoid at the equator and at the poles, m/s2.
const EVERYWHERE: [f64; 2] = [9.7803, 9.8322];
/// Standard deviation of gravity around the ellipsoid's, m/s2 (50 mGal).
const ANOMALY: f64 = 5e-4;

/// Gravity at a site and its standard deviation, m/s2; without a site, that of all latitudes.
#[must_use]
pub fn gravity(site: Option<&Geodetic>) -> [f64; 2] {
    match site {
        Some(site) => [Local::at(site.lat, site.h).gravity().z, ANOMALY],
        None => {
            let [least, most] = EVERYWHERE;
            [0.5 * (least + most), (most - least) / 12.0_f64.sqrt()]
        }
    }
}
