//! `Session`: samples, fixes and truth as arrays; what learns from a whole session.

use crate::arrays::{array, table, triples};
use crate::compensator::Compensator;
use crate::errors::{raised, refused};
use crate::experiment::Scenario;
use crate::long::interruptible;
use crate::navigator::quaternion;
use crate::network::Network;
use crate::unit::{Unit, UnitOrName};
use firmware::learn::bank::{NAMES, ZERO_CORRECTION};
use firmware::sample::Counts;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{self, EPOCH_S};
use host_core::inertial::sins::{Increment, NavState};
use host_estimation::learning::device::{Device, course};
use host_estimation::learning::fit::{Use, fit};
use host_estimation::learning::teacher::Assumptions;
use host_estimation::learning::window::compensator;
use host_io::recordings::generic;
use host_io::recordings::record::{Record, TimedFix};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;

/// One turn-on of one IMU: samples, fixes, truth. Epoch k is k seconds after power-on.
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Session {
    /// Samples, reference, fixes of the epochs.
    pub session: session::Session,
    /// Fixes, and when they arrive.
    pub fixes: Vec<(f64, Fix)>,
    /// The unit that measured.
    pub unit: host_unit::Unit,
}

type Table<'py> = PyResult<Bound<'py, PyArray2<f64>>>;

impl Session {
    fn increments(&self, pick: impl Fn(&Increment) -> [f64; 3]) -> Vec<[f64; 3]> {
        let each = self.session.counts.each();
        each.map(|c| pick(&session::to_si(&c, &self.session.lsb)))
            .collect()
    }

    fn counts(&self, pick: impl Fn(&Counts) -> [i32; 3]) -> Vec<[i32; 3]> {
        self.session.counts.each().map(|c| pick(&c)).collect()
    }

    fn reference<const N: usize>(&self, pick: impl Fn(&NavState) -> [f64; N]) -> Vec<[f64; N]> {
        self.session.reference.iter().map(pick).collect()
    }

    fn fix<const N: usize>(&self, pick: impl Fn(&TimedFix) -> [f64; N]) -> Vec<[f64; N]> {
        self.timed_fixes().iter().map(pick).collect()
    }

    fn timed_fixes(&self) -> Vec<TimedFix> {
        let all = self.fixes.iter();
        all.map(|(time, fix)| TimedFix::arrived(*time, fix))
            .collect()
    }

    fn record(&self) -> Record {
        Record {
            fixes: self.timed_fixes(),
            ..Record::from_session(&self.session)
        }
    }
}

#[pymethods]
impl Session {
    /// Sample period, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.session.dt
    }

    /// Seconds at the start during which the vehicle stands.
    #[getter]
    fn standstill_s(&self) -> usize {
        self.session.standstill
    }

    /// Angle of a count, rad.
    #[getter]
    fn gyro_lsb_rad(&self) -> f64 {
        self.session.lsb.rad
    }

    /// Velocity of a count, m/s.
    #[getter]
    fn accel_lsb_mps(&self) -> f64 {
        self.session.lsb.mps
    }

    /// The unit that measured.
    #[getter]
    fn unit(&self) -> Unit {
        self.unit.clone().into()
    }

    /// End of each sample, (n,), s.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let times = (1..=self.session.counts.len()).map(|k| k as f64 * self.session.dt);
        array(py, times.collect())
    }

    /// Angle increments, (n, 3), rad, body axes.
    #[getter]
    fn dtheta<'py>(&self, py: Python<'py>) -> Table<'py> {
        table(py, self.increments(|i| i.dtheta.into()))
    }

    /// Velocity increments, (n, 3), m/s, body axes.
    #[getter]
    fn dv<'py>(&self, py: Python<'py>) -> Table<'py> {
        table(py, self.increments(|i| i.dv.into()))
    }

    /// Angle increments, (n, 3), counts.
    #[getter]
    fn dtheta_counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        table(py, self.counts(|c| c.dtheta))
    }

    /// Velocity increments, (n, 3), counts.
    #[getter]
    fn dv_counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        table(py, self.counts(|c| c.dv))
    }

    /// Times of the epochs, (k,), s.
    #[getter]
    fn epoch_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let times = (0..self.session.reference.len()).map(|k| k as f64 * EPOCH_S);
        array(py, times.collect())
    }

    /// True latitude, longitude, height of the epochs, (k, 3): rad, rad, m.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Table<'py> {
        let of = |s: &NavState| [s.position.lat, s.position.lon, s.position.h];
        table(py, self.reference(of))
    }

    /// True velocity of the epochs, (k, 3), m/s, north-east-down.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Table<'py> {
        table(py, self.reference(|s| s.velocity.into()))
    }

    /// True attitude of the epochs, (k, 4): quaternion w, x, y, z from body to navigation.
    #[getter]
    fn q_bn<'py>(&self, py: Python<'py>) -> Table<'py> {
        table(py, self.reference(|s| quaternion(&s.q_bn)))
    }

    /// True systematic error of the gyros in each second, (s, 3), rad/s.
    #[getter]
    fn gyro_error<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let errors = self.session.systematic.as_ref();
        errors
            .map(|all| table(py, triples(all.iter().map(|e| &e.dtheta))))
            .transpose()
    }

    /// True systematic error of the accelerometers in each second, (s, 3), m/s2.
    #[getter]
    fn accel_error<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let errors = self.session.systematic.as_ref();
        errors
            .map(|all| table(py, triples(all.iter().map(|e| &e.dv))))
            .transpose()
    }

    /// Readings of the thermometers of the axes in each second, (s, 3), degrees C.
    #[getter]
    fn temperature<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let readings = self.session.readings.as_ref();
        readings
            .map(|all| table(py, triples(all.iter().map(|r| &r.axes))))
            .transpose()
    }

    /// Times of validity of the fixes, (m,), s.
    #[getter]
    fn fix_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.timed_fixes().iter().map(|fix| fix.time).collect())
    }

    /// Latitude, longitude, height of the fixes, (m, 3): rad, rad, m.
    #[getter]
    fn fix_position<'py>(&self, py: Python<'py>) -> Table<'py> {
        let of = |(_, fix): &(f64, Fix)| [fix.position.lat, fix.position.lon, fix.position.h];
        table(py, self.fixes.iter().map(of).collect())
    }

    /// Velocity of the fixes, (m, 3), m/s, north-east-down.
    #[getter]
    fn fix_velocity<'py>(&self, py: Python<'py>) -> Table<'py> {
        table(py, self.fix(|fix| fix.velocity))
    }

    /// Standard deviations of position, m, and velocity, m/s, (m, 6); inf: not measured.
    #[getter]
    fn fix_sigma<'py>(&self, py: Python<'py>) -> Table<'py> {
        table(py, self.fix(|fix| fix.sigmas))
    }

    /// Writes the files that `host-sim simulate` writes, with the same bytes.
    #[pyo3(signature = (directory))]
    fn write(&self, py: Python<'_>, directory: PathBuf) -> PyResult<()> {
        let written = py.detach(|| {
            generic::write(&self.record(), Some(&self.unit), &directory)?;
            generic::write_truth(&self.session, &directory.join("truth.csv"))?;
            generic::write_readings(&self.session, &directory.join("temperature.csv"))
        });
        written.map_err(raised)
    }

    /// Networks of the desktop (`rnn`), learnt from the fixes of the whole session.
    ///
    /// scenario: how they are taught. unit: what is assumed of the sensor.
    #[pyo3(signature = (scenario=None, *, unit=None))]
    fn fit(
        &self,
        py: Python<'_>,
        scenario: Option<&Scenario>,
        unit: Option<UnitOrName>,
    ) -> PyResult<Learnt> {
        let unit = unit.map_or(Ok(self.unit.clone()), UnitOrName::unit)?;
        let spec = scenario.map_or_else(Default::default, |s| s.scenario.network.clone());
        let session = self.session.clone();
        let fitted = interruptible(py, move || {
            let all = session.increments();
            fit(
                &session,
                &all,
                Assumptions::of(&unit),
                &spec,
                session.epochs(),
                true,
            )
        })?;
        let fitted = fitted.ok_or_else(no_attitude)?;
        let evidence = fitted.evidence.iter();
        let evidence = evidence.map(|(of, ratio)| (in_use(*of).to_owned(), *ratio));
        let evidence = evidence.collect();
        let [gyro, accel] = fitted.nets;
        Ok(Learnt {
            gyro,
            accel,
            assumptions: fitted.assumptions,
            running: in_use(fitted.promoted).into(),
            evidence,
            note: fitted.verdict(),
        })
    }

    fn __len__(&self) -> usize {
        self.session.counts.len()
    }

    fn __repr__(&self) -> String {
        let (n, dt) = (self.session.counts.len(), self.session.dt);
        let (unit, fixes) = (&self.unit.name, self.fixes.len());
        format!("Session({n} samples of {dt} s, {fixes} fixes, unit='{unit}')")
    }
}

/// Which networks a fit uses, as a name.
fn in_use(of: Use) -> &'static str {
    match (of.gyro, of.accel) {
        (true, true) => "networks",
        (true, false) => "gyro network",
        (false, true) => "accelerometer network",
        (false, false) => "zero correction",
    }
}

pub fn no_attitude() -> PyErr {
    let remedy = "give a session that begins with at least 90 s of standstill";
    refused("session", "its standstill gives no attitude", remedy)
}

/// Networks that were learnt from a session.
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Learnt {
    gyro: lrnn_nostd::Net,
    accel: lrnn_nostd::Net,
    assumptions: Assumptions,
    /// Name of the hypothesis that has proved itself; of a fit: networks, gyro network,
    /// accelerometer network or zero correction.
    #[pyo3(get)]
    running: String,
    evidence: Vec<(String, f64)>,
    /// The verdict of the test on data that was not learnt from, or what the device did and waits
    /// for.
    #[pyo3(get)]
    note: String,
}

#[pymethods]
impl Learnt {
    /// The gyro network: rates in rad/s to rate errors.
    #[getter]
    fn gyro(&self) -> Network {
        Network::from_net(&self.gyro)
    }

    /// The accelerometer network: specific forces in m/s2 to their errors.
    #[getter]
    fn accel(&self) -> Network {
        Network::from_net(&self.accel)
    }

    /// The firmware's compensator with these networks, for the stream of a session.
    fn compensator(&self, session: &Session) -> Compensator {
        let nets = [self.gyro, self.accel];
        Compensator::of(compensator(&session.session, &nets, &self.assumptions))
    }

    /// Log-likelihood of each hypothesis, relative to that of the zero correction.
    #[getter]
    fn evidence(&self) -> Vec<(String, f64)> {
        self.evidence.clone()
    }

    fn __repr__(&self) -> String {
        format!("Learnt(running='{}')", self.running)
    }
}

/// The device, the firmware's own application, on a session and its fixes: from power-on to
/// power-off. The networks are those that act from the next power-on on.
#[pyfunction]
#[pyo3(signature = (session, *, unit=None))]
pub fn learn_from_fixes(
    py: Python<'_>,
    session: &Session,
    unit: Option<UnitOrName>,
) -> PyResult<Learnt> {
    let unit = unit.map_or(Ok(session.unit.clone()), UnitOrName::unit)?;
    let own = session.session.clone();
    let assumptions = Assumptions::of(&unit);
    let mut device = Device::of_unit(&unit).map_err(raised)?;
    let before = device.stored().0;
    let (drive, device) = interruptible(py, move || {
        let drive = device.drive_session(&own, own.epochs());
        (drive, device)
    })?;
    let proved = drive.diary.proved().map_or(ZERO_CORRECTION, |of| of.1);
    let evidence = NAMES.iter().zip(&drive.diary.candidates);
    let nets = device.stored().0;
    Ok(Learnt {
        gyro: nets.gyro,
        accel: nets.accel,
        assumptions,
        running: NAMES[proved].into(),
        evidence: evidence
            .map(|(name, of)| ((*name).to_owned(), of.evidence))
            .collect(),
        note: format!("the device {}", course(&drive, &device, &before).says),
    })
}
