//! `Compensator`: the firmware's own, over arrays of counts.

use crate::arrays::{given, table};
use crate::errors::refused;
use crate::long::PIECE;
use crate::network::Network;
use firmware::compensator::{self, Limit, State};
use firmware::sample::{Counts, Lsb};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

/// The firmware's compensator: counts in, corrected counts out.
///
/// gyro, accel: the two networks, of the device's kind. Lengths of a count in rad and m/s.
/// block_samples: samples between steps of the networks. Limits: largest correction.
#[pyclass(module = "lrnn_imu")]
pub struct Compensator {
    compensator: compensator::Compensator,
    state: State,
    /// Samples in the block in progress.
    in_block: usize,
}

impl Compensator {
    /// At power-on.
    pub fn of(compensator: compensator::Compensator) -> Self {
        let state = compensator.power_on(false);
        Self {
            compensator,
            state,
            in_block: 0,
        }
    }
}

/// Corrected counts of both triads, and the estimates of each block.
type Corrected<'py> = (
    Bound<'py, PyArray2<i32>>,
    Bound<'py, PyArray2<i32>>,
    Bound<'py, PyArray3<f32>>,
);

#[pymethods]
impl Compensator {
    #[new]
    #[pyo3(signature = (
        gyro, accel, *, gyro_lsb_rad, accel_lsb_mps, sample_period_s, block_samples,
        gyro_limit_radps, accel_limit_mps2
    ))]
    fn new(
        gyro: &Network,
        accel: &Network,
        gyro_lsb_rad: f64,
        accel_lsb_mps: f64,
        sample_period_s: f64,
        block_samples: u16,
        gyro_limit_radps: f32,
        accel_limit_mps2: f32,
    ) -> PyResult<Self> {
        let lsb = Lsb {
            rad: gyro_lsb_rad,
            mps: accel_lsb_mps,
        };
        let limit = Limit {
            gyro: gyro_limit_radps,
            accel: accel_limit_mps2,
        };
        let (gyro, accel) = (gyro.net("gyro")?, accel.net("accel")?);
        let made =
            compensator::Compensator::new(gyro, accel, lsb, sample_period_s, block_samples, limit);
        let remedy = "give a value in range";
        made.map(Self::of)
            .map_err(|e| refused("Compensator", e.to_string(), remedy))
    }

    /// Corrects counts, (n, 3) each.
    ///
    /// temperature: readings of three thermometers, (blocks, 3), degrees C, a row for each block
    /// that begins in this call, for networks that temperature drives.
    ///
    /// Gives corrected counts, (n, 3) each, and the estimates at the end of each block,
    /// (blocks, 2, 3): rad/s and m/s2. The next call goes on where this one ended.
    #[pyo3(signature = (dtheta, dv, temperature=None))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        dtheta: &Bound<'py, PyAny>,
        dv: &Bound<'py, PyAny>,
        temperature: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Corrected<'py>> {
        let (dtheta, dv) = (given::<i32>("dtheta", dtheta)?, given::<i32>("dv", dv)?);
        let forces = dv.rows_like::<3, _>(&dtheta)?;
        let angles = dtheta.rows::<3>()?;
        let temperature = temperature
            .map(|t| given::<f64>("temperature", t))
            .transpose()?;
        let temperature = temperature.as_ref().map(|t| t.rows::<3>()).transpose()?;
        let block = usize::from(self.block_samples());
        let mut number = self.in_block;
        let begin = (number + angles.len()).div_ceil(block) - number.div_ceil(block);
        if let Some(t) = temperature.filter(|t| t.len() < begin) {
            let problem = format!("has {} rows where {begin} blocks begin", t.len());
            return Err(refused("temperature", problem, "give one for each block"));
        }
        self.in_block = (number + angles.len()) % block;
        let mut readings = temperature.unwrap_or_default().iter();
        let (mut a, mut b) = (
            Vec::with_capacity(angles.len()),
            Vec::with_capacity(angles.len()),
        );
        let mut blocks: Vec<[f32; 3]> = Vec::new();
        let Self {
            compensator, state, ..
        } = self;
        for (angles, forces) in angles.chunks(PIECE).zip(forces.chunks(PIECE)) {
            py.detach(|| {
                for (dtheta, dv) in angles.iter().zip(forces) {
                    if number.is_multiple_of(block)
                        && let Some(axes) = readings.next()
                    {
                        state.read_temperature(Vector3::from(*axes).mean() as f32);
                    }
                    number += 1;
                    let sample = Counts {
                        dtheta: *dtheta,
                        dv: *dv,
                    };
                    let (out, block) = compensator.process(state, sample);
                    a.push(out.dtheta);
                    b.push(out.dv);
                    blocks.extend(
                        block
                            .into_iter()
                            .flat_map(|b| [b.rate_error, b.force_error]),
                    );
                }
            });
            py.check_signals()?;
        }
        let shape = [blocks.len() / 2, 2, 3];
        let blocks = PyArray1::from_vec(py, blocks.into_flattened()).reshape(shape)?;
        Ok((table(py, a)?, table(py, b)?, blocks))
    }

    /// A reading of the sensor's thermometer, degrees C, in the block in progress.
    fn read_temperature(&mut self, celsius: f32) {
        self.state.read_temperature(celsius);
    }

    /// State as at power-on.
    fn power_on(&mut self) {
        self.state = self.compensator.power_on(false);
        self.in_block = 0;
    }

    /// The correction in force, (2, 3): rad/s and m/s2.
    #[getter]
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        table(py, self.state.estimate().to_vec())
    }

    /// Samples in a block.
    #[getter]
    fn block_samples(&self) -> u16 {
        self.compensator.scale().block_samples
    }

    /// Blocks in which a network had a fault.
    #[getter]
    fn faults(&self) -> u32 {
        self.state.faults
    }

    /// Blocks in which a correction was clipped.
    #[getter]
    fn clipped(&self) -> u32 {
        self.state.clipped
    }

    fn __repr__(&self) -> String {
        let [g, a] = self.state.estimate();
        format!("Compensator(estimate=[{g:?}, {a:?}])")
    }
}
