//! `Recording`: samples and fixes as their files hold them, or from arrays.

use crate::arrays::{array, few, given, named, table, triples};
use crate::errors::{raised, refused};
use crate::long::interruptible;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::DEG;
use host_estimation::analysis::doubts::{Field, FixFields, Says};
use host_io::recordings::InitialAttitude;
use host_io::recordings::generic::{self, NamedUnit};
use host_io::recordings::kfgins;
use host_io::recordings::record::{Kind, NOT_MEASURED, Record, TimedFix};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Samples and fixes as their files hold them, or from arrays.
///
/// time: (n,), s. gyro, accel: (n, 3), body axes; kind "rate": rad/s and m/s2, kind
/// "increment": rad and m/s over the time up to theirs. fix_time: (m,), s, on the same clock.
/// fix_position: (m, 3), rad, rad, m. fix_sigma: (m, 6), of position, m, and velocity, m/s;
/// inf: not measured. fix_velocity: (m, 3), m/s, north-east-down.
/// standstill_s: seconds for which the vehicle stands at the first fix, 90 or more; or
/// attitude_deg: roll, pitch, heading at the first fix. Without both it is found in motion.
/// lever_arm_m: from the IMU to the antenna, (3,), forward, right, down.
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Recording {
    /// As its files hold it.
    pub record: Record,
    /// Statements of the recording about itself: units, start, latency.
    pub says: Says,
    /// The unit that it names.
    pub unit: Option<host_unit::Unit>,
    /// Name of the form, for reports.
    pub form: &'static str,
}

/// Names of the kinds of samples.
const KINDS: [(&str, Kind); 2] = [("rate", Kind::Rate), ("increment", Kind::Increment)];
/// An example of axes.
const RIGHT_FORWARD_UP: &str = "'y x -z' for right-forward-up";

fn says_fixed(file: &str) -> Says {
    Says {
        file: file.into(),
        gyro: Field::fixed("gyro"),
        accel: Field::fixed("accel"),
        axes: ("gyro, accel".into(), "forward-right-down".into()),
        rate: None,
        fixes: FixFields::default(),
    }
}

/// The attitude at the first fix.
fn start(
    standstill_s: Option<usize>,
    attitude: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<InitialAttitude>> {
    let known = attitude
        .map(|value| few::<3>("attitude_deg", value))
        .transpose()?;
    match (standstill_s, known) {
        (Some(_), Some(_)) => {
            let problem = "both are given";
            Err(refused(
                "standstill_s, attitude_deg",
                problem,
                "give one of them",
            ))
        }
        (Some(s), None) if !(90..=86_400).contains(&s) => Err(refused(
            "standstill_s",
            format!("is {s}"),
            "give 90 to 86400 s",
        )),
        (Some(s), None) => Ok(Some(InitialAttitude::Standstill(s))),
        (None, Some(angles)) if angles.iter().any(|a| !(-360.0..=360.0).contains(a)) => {
            let remedy = "give roll, pitch and heading in degrees, -360 to 360";
            Err(refused("attitude_deg", format!("is {angles:?}"), remedy))
        }
        (None, Some([r, p, h])) => Ok(Some(InitialAttitude::Known(from_euler(
            r * DEG,
            p * DEG,
            h * DEG,
        )))),
        (None, None) => Ok(None),
    }
}

/// Fixes from arrays.
fn fixes(
    time: &Bound<'_, PyAny>,
    position: &Bound<'_, PyAny>,
    velocity: Option<&Bound<'_, PyAny>>,
    sigma: &Bound<'_, PyAny>,
) -> PyResult<Vec<TimedFix>> {
    let time = given::<f64>("fix_time", time)?;
    let position = given::<f64>("fix_position", position)?;
    let velocity = velocity
        .map(|v| given::<f64>("fix_velocity", v))
        .transpose()?;
    let sigma = given::<f64>("fix_sigma", sigma)?;
    let (places, sigmas) = (
        position.rows_like::<3, _>(&time)?,
        sigma.rows_like::<6, _>(&time)?,
    );
    let velocities = velocity
        .as_ref()
        .map(|v| v.rows_like::<3, _>(&time))
        .transpose()?;
    let time = time.flat()?;
    if !time.is_sorted_by(|a, b| a < b) {
        return Err(refused(
            "fix_time",
            "does not rise",
            "sort the fixes by their times",
        ));
    }
    let mut out = Vec::with_capacity(time.len());
    for (k, ((time, position), sigmas)) in time.iter().zip(places).zip(sigmas).enumerate() {
        let [lat, lon, height_m] = *position;
        let mut sigmas = *sigmas;
        if velocities.is_none() {
            sigmas[3..].fill(NOT_MEASURED);
        }
        let all = [*time, lat, lon, height_m];
        if !(all.iter().all(|x| x.is_finite()) && sigmas.iter().all(|s| *s > 0.0)) {
            let problem =
                format!("row {k} has a value that is not finite, or a sigma of 0 or less");
            return Err(refused(
                "fixes",
                problem,
                "leave it out; inf in fix_sigma: not measured",
            ));
        }
        out.push(TimedFix {
            time: *time,
            lat_deg: lat / DEG,
            lon_deg: lon / DEG,
            height_m,
            velocity: velocities.map_or([0.0; 3], |v| v[k]),
            sigmas,
        });
    }
    Ok(out)
}

/// Samples from arrays, with their rate.
fn samples(
    time: &Bound<'_, PyAny>,
    gyro: &Bound<'_, PyAny>,
    accel: &Bound<'_, PyAny>,
) -> PyResult<(Vec<f64>, Vec<Increment>, usize)> {
    let time = given::<f64>("time", time)?;
    let (gyro, accel) = (given::<f64>("gyro", gyro)?, given::<f64>("accel", accel)?);
    let (g, a) = (
        gyro.rows_like::<3, _>(&time)?,
        accel.rows_like::<3, _>(&time)?,
    );
    let time = time.flat()?;
    if time.len() < 2 || !time.is_sorted_by(|a, b| a < b) || !time.iter().all(|t| t.is_finite()) {
        return Err(refused(
            "time",
            "does not rise",
            "give at least two samples, sorted",
        ));
    }
    if let Some(k) = (0..g.len()).find(|k| g[*k].iter().chain(&a[*k]).any(|x| !x.is_finite())) {
        return Err(refused(
            "gyro, accel",
            format!("row {k} is not finite"),
            "leave it out",
        ));
    }
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let rate = (1.0 / step).round();
    if !(1.0..=20_000.0).contains(&rate) {
        let problem = format!("its usual step is {step} s");
        return Err(refused(
            "time",
            problem,
            "give seconds, with 1 to 20000 samples a second",
        ));
    }
    let pairs = g.iter().zip(a).map(|(g, a)| Increment {
        dtheta: Vector3::from(*g),
        dv: Vector3::from(*a),
    });
    Ok((time.to_vec(), pairs.collect(), rate as usize))
}

#[pymethods]
impl Recording {
    #[new]
    #[pyo3(signature = (
        time, gyro, accel, *, kind, fix_time, fix_position, fix_sigma, fix_velocity=None,
        standstill_s=None, attitude_deg=None, lever_arm_m=None
    ))]
    fn new(
        time: &Bound<'_, PyAny>,
        gyro: &Bound<'_, PyAny>,
        accel: &Bound<'_, PyAny>,
        kind: &str,
        fix_time: &Bound<'_, PyAny>,
        fix_position: &Bound<'_, PyAny>,
        fix_sigma: &Bound<'_, PyAny>,
        fix_velocity: Option<&Bound<'_, PyAny>>,
        standstill_s: Option<usize>,
        attitude_deg: Option<&Bound<'_, PyAny>>,
        lever_arm_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let kind = named("kind", kind, &KINDS)?;
        let (time, samples, rate_hz) = samples(time, gyro, accel)?;
        let arm = lever_arm_m
            .map(|arm| few::<3>("lever_arm_m", arm))
            .transpose()?;
        let record = Record {
            file: "arrays".into(),
            time: time.into(),
            samples: samples.into(),
            kind,
            rate_hz,
            fixes: fixes(fix_time, fix_position, fix_velocity, fix_sigma)?,
            lever_arm_m: arm,
            initial_attitude: start(standstill_s, attitude_deg)?,
            ..Record::default()
        };
        Ok(Self {
            record,
            says: says_fixed("arrays"),
            unit: None,
            form: "arrays",
        })
    }

    /// Samples per second, to the nearest whole number.
    #[getter]
    fn rate_hz(&self) -> usize {
        self.record.rate_hz
    }

    /// Kind of the samples: "rate" or "increment".
    #[getter]
    fn kind(&self) -> &'static str {
        let found = KINDS.iter().find(|(_, kind)| *kind == self.record.kind);
        found.map_or("", |(name, _)| name)
    }

    /// Times of the samples, (n,), s.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.record.time.each().collect())
    }

    /// Gyro samples, (n, 3), rad/s or rad, body axes.
    #[getter]
    fn gyro<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(
            py,
            self.record
                .samples
                .each()
                .map(|s| s.dtheta.into())
                .collect(),
        )
    }

    /// Accelerometer samples, (n, 3), m/s2 or m/s, body axes.
    #[getter]
    fn accel<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(
            py,
            self.record.samples.each().map(|s| s.dv.into()).collect(),
        )
    }

    /// Times of validity of the fixes, (m,), s, on the clock of the IMU.
    #[getter]
    fn fix_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.record.fixes.iter().map(|fix| fix.time).collect())
    }

    /// Latitude, longitude, height of the fixes, (m, 3): rad, rad, m.
    #[getter]
    fn fix_position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let of = |fix: &TimedFix| [fix.lat_deg * DEG, fix.lon_deg * DEG, fix.height_m];
        table(py, self.record.fixes.iter().map(of).collect())
    }

    /// Velocity of the fixes, (m, 3), m/s, north-east-down.
    #[getter]
    fn fix_velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let all: Vec<Vector3<f64>> = self
            .record
            .fixes
            .iter()
            .map(|f| f.velocity.into())
            .collect();
        table(py, triples(all.iter()))
    }

    /// Standard deviations of position, m, and velocity, m/s, (m, 6); inf: not measured.
    #[getter]
    fn fix_sigma<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.record.fixes.iter().map(|fix| fix.sigmas).collect())
    }

    /// Writes imu.csv, gnss.csv and the header.toml that describes them.
    fn write(&self, py: Python<'_>, directory: PathBuf) -> PyResult<()> {
        let written = py.detach(|| generic::write(&self.record, self.unit.as_ref(), &directory));
        written.map_err(raised)
    }

    fn __len__(&self) -> usize {
        self.record.samples.len()
    }

    fn __repr__(&self) -> String {
        let (n, rate) = (self.record.samples.len(), self.record.rate_hz);
        let (kind, fixes) = (self.kind(), self.record.fixes.len());
        format!("Recording({n} samples at {rate} Hz, kind='{kind}', {fixes} fixes)")
    }
}

/// Reads CSV files, plain or gzipped, with a TOML header that says what the columns mean.
#[pyfunction]
#[pyo3(signature = (header, files=Vec::new(), *, truth=None))]
pub fn read_csv(
    py: Python<'_>,
    header: PathBuf,
    files: Vec<PathBuf>,
    truth: Option<PathBuf>,
) -> PyResult<Recording> {
    let read = interruptible(py, move || {
        let record = generic::read_with_truth(&header, &files, truth.as_deref())?;
        let [gyro, accel] = generic::units(&header, 1.0 / record.rate_hz as f64)?;
        let field = |name: &str, (given, units): (NamedUnit, Vec<NamedUnit>)| Field {
            name: name.into(),
            named: Some(given),
            units,
        };
        let says = Says {
            gyro: field("imu.gyro.unit", gyro),
            accel: field("imu.accel.unit", accel),
            axes: ("imu.axes".into(), RIGHT_FORWARD_UP.into()),
            rate: None,
            fixes: FixFields::default(),
            file: header.clone(),
        };
        let unit = generic::unit(&header)?;
        Ok(Recording {
            record,
            says,
            unit,
            form: "csv",
        })
    })?;
    read.map_err(raised)
}

/// Reads the text form of KF-GINS.
#[pyfunction]
#[pyo3(signature = (imu, gnss, *, standstill_s=None, attitude_deg=None))]
pub fn read_kf_gins(
    py: Python<'_>,
    imu: PathBuf,
    gnss: PathBuf,
    standstill_s: Option<usize>,
    attitude_deg: Option<&Bound<'_, PyAny>>,
) -> PyResult<Recording> {
    let attitude = start(standstill_s, attitude_deg)?;
    let says = Says {
        file: imu.clone(),
        gyro: Field::fixed("dtheta in rad"),
        accel: Field::fixed("dv in m/s"),
        axes: ("axes".into(), "forward-right-down, those of KF-GINS".into()),
        rate: None,
        fixes: FixFields::default(),
    };
    let record = interruptible(py, move || kfgins::read(&imu, &gnss, attitude))?;
    Ok(Recording {
        record: record.map_err(raised)?,
        says,
        unit: None,
        form: "kf-gins",
    })
}
