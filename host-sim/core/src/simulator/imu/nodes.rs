//! Temperatures of three nodes: the electronics that give the heat, the block with the sensors, and
//! the case in the air.
//!
//! ```text
//! C_e dT_e/dt = P - G_eb (T_e - T_b)
//! C_b dT_b/dt = H + G_eb (T_e - T_b) - G_bc (T_b - T_c)
//! C_c dT_c/dt =     G_bc (T_b - T_c) - G_ca (T_c - T_a)
//! ```
//!
//! This is the usual network of lumped capacities and conductances (Incropera and DeWitt,
//! Fundamentals of Heat and Mass Transfer, chapter 5). P is the power of the electronics, H that of
//! the thermostat's heater, T_a the ambient. All temperatures are differences from the calibration
//! temperature. P and H are constant within a second, so the matrix exponential makes the step of a
//! second exact. While the unit is off, P and H are zero and the state continues: this makes the
//! difference between a hot and a cold start.

use super::draws::normal3;
use super::world::{Ambient, History};
use crate::inertial::session::Temperature;
use crate::inertial::units::DEG;
use nalgebra::{Matrix3, SMatrix, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Interval of the stored temperatures before power-on, s.
pub(super) const TRAIL_S: f64 = 60.0;
/// Fastest rate at which a node follows its neighbours, 1/s. Temperatures are taken once a second.
const FASTEST_PER_S: f64 = 1e4;

/// Three nodes of temperature instead of the single one of `block`: plain values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodesSpec {
    /// Heat capacity of the electronics, J/K, > 0.
    pub electronics_jpk: f64,
    /// Heat capacity of the block with the sensors, J/K, > 0.
    pub block_jpk: f64,
    /// Heat capacity of the case, J/K, > 0.
    pub case_jpk: f64,
    /// Conductance from the electronics to the block, W/K, > 0.
    pub electronics_block_wpk: f64,
    /// Conductance from the block to the case, W/K, > 0.
    pub block_case_wpk: f64,
    /// Conductance from the case to the air and the mounting plate, W/K, > 0.
    pub case_ambient_wpk: f64,
    /// Power of the electronics from power-on, W.
    pub power_w: f64,
    /// Further power of a load that is switched on and off at random, W.
    #[serde(default)]
    pub load_w: f64,
    /// Mean duration of the load's times on and off, s, > 0.
    #[serde(default = "load_time")]
    pub load_time_s: f64,
    /// Further power by the mean magnitude of the rate, W/(deg/s).
    #[serde(default)]
    pub rate_wpdps: f64,
    /// Power of the thermostat's heater at the block, W. Zero: no thermostat.
    #[serde(default)]
    pub heater_w: f64,
    /// Set temperature of the thermostat, above the calibration temperature, K.
    #[serde(default)]
    pub heater_set_k: f64,
    /// The heater goes on half of this below, and off half of this above, K.
    #[serde(default)]
    pub heater_band_k: f64,
    /// Position of each sensor between electronics and case: its temperature is that of the block
    /// plus a share of the difference. Standard deviation of the share over units and axes.
    #[serde(default)]
    pub axis_share_ratio: f64,
}

fn load_time() -> f64 {
    600.0
}

impl NodesSpec {
    /// An IMU with laser gyros of 12 W in a case of some 2 kg of aluminium (assumed).
    #[must_use]
    pub fn typical() -> Self {
        Self {
            electronics_jpk: 300.0,
            block_jpk: 1200.0,
            case_jpk: 1800.0,
            electronics_block_wpk: 2.0,
            block_case_wpk: 2.5,
            case_ambient_wpk: 1.2,
            power_w: 12.0,
            load_w: 2.0,
            load_time_s: load_time(),
            rate_wpdps: 0.0,
            heater_w: 0.0,
            heater_set_k: 0.0,
            heater_band_k: 0.0,
            axis_share_ratio: 0.1,
        }
    }

    /// Final temperature of the block above the ambient, with the electronics' power alone, K.
    #[must_use]
    pub fn final_rise_k(&self) -> f64 {
        self.power_w * (1.0 / self.case_ambient_wpk + 1.0 / self.block_case_wpk)
    }

    /// Checks that the rates of the nodes can be computed.
    ///
    /// # Errors
    /// A heat capacity that is far too small for the conductances beside it, with its key.
    pub(super) fn check(&self) -> Result<(), String> {
        let [eb, bc, ca] = [
            self.electronics_block_wpk,
            self.block_case_wpk,
            self.case_ambient_wpk,
        ];
        let nodes = [
            ("electronics_jpk", self.electronics_jpk, eb),
            ("block_jpk", self.block_jpk, eb + bc),
            ("case_jpk", self.case_jpk, bc + ca),
        ];
        for (key, capacity, beside) in nodes {
            let least = beside / FASTEST_PER_S;
            if capacity < least {
                return Err(format!(
                    "nodes.{key} = {capacity}: must be at least {least} beside {beside} W/K"
                ));
            }
        }
        Ok(())
    }

    /// Matrix of the three equations: from the three temperatures, and from P, H, T_a.
    fn dynamics(&self) -> (Matrix3<f64>, Matrix3<f64>) {
        let [eb, bc, ca] = [
            self.electronics_block_wpk,
            self.block_case_wpk,
            self.case_ambient_wpk,
        ];
        let [e, b, c] = [self.electronics_jpk, self.block_jpk, self.case_jpk];
        let own = Matrix3::new(
            -eb / e,
            eb / e,
            0.0, //
            eb / b,
            -(eb + bc) / b,
            bc / b, //
            0.0,
            bc / c,
            -(bc + ca) / c,
        );
        let input = Matrix3::from_diagonal(&Vector3::new(1.0 / e, 1.0 / b, ca / c));
        (own, input)
    }
}

/// The nodes of one unit at one turn-on.
#[derive(Debug, Clone)]
pub struct Nodes {
    spec: NodesSpec,
    /// Electronics, block, case, K.
    state: Vector3<f64>,
    /// Derivatives: by the state and by the inputs, 1/s.
    dynamics: (Matrix3<f64>, Matrix3<f64>),
    /// The matrices of a step of a whole second.
    step: (Matrix3<f64>, Matrix3<f64>),
    share: Vector3<f64>,
    heats: bool,
    loaded: bool,
    rate_of_block: f64,
    /// Temperatures of the axes before the last operation, and at its end, K.
    turning_points: [Vector3<f64>; 2],
    /// Temperatures of the axes from there to now: s before power-on (negative).
    trail: Vec<(f64, Vector3<f64>)>,
    rng: ChaCha8Rng,
}

impl Nodes {
    /// At power-on after `history` in `ambient`, which is `drawn` K warmer at this turn-on. `unit`
    /// draws the positions of the sensors, `turn_on` the load.
    #[must_use]
    pub fn new(
        spec: &NodesSpec,
        (ambient, drawn): (&Ambient, f64),
        history: History,
        unit: &mut ChaCha8Rng,
        mut turn_on: ChaCha8Rng,
    ) -> Self {
        let (own, input) = spec.dynamics();
        let mut all = SMatrix::<f64, 6, 6>::zeros();
        all.fixed_view_mut::<3, 3>(0, 0).copy_from(&own);
        all.fixed_view_mut::<3, 3>(0, 3).copy_from(&input);
        let all = all.exp();
        let mut nodes = Self {
            spec: spec.clone(),
            state: Vector3::repeat(ambient.at(0.0, 0.0) + drawn),
            dynamics: (own, input),
            step: (
                all.fixed_view::<3, 3>(0, 0).into_owned(),
                all.fixed_view::<3, 3>(0, 3).into_owned(),
            ),
            share: normal3(unit) * spec.axis_share_ratio,
            heats: false,
            loaded: turn_on.random_bool(0.5),
            rate_of_block: 0.0,
            turning_points: [Vector3::zeros(); 2],
            trail: Vec::new(),
            rng: turn_on,
        };
        if !history.is_cold() {
            nodes.live_through(history, |t| ambient.at(t, 0.0) + drawn);
        }
        nodes.heats = nodes.wants_heat();
        nodes.rate_of_block = nodes.derivative(ambient.at(0.0, 0.0) + drawn, 0.0);
        nodes
    }

    /// The time on and the soak before power-on, from a state as warm as the air.
    fn live_through(&mut self, history: History, ambient: impl Fn(f64) -> f64) {
        let (on, soak) = (history.on_s.round(), history.soak_s.round());
        let mut t = -on - soak;
        self.state = Vector3::repeat(ambient(t));
        self.turning_points = [self.axes(); 2];
        self.trail.push((t, self.axes()));
        while t < 0.0 {
            self.heats = t < -soak && self.wants_heat();
            let power = if t < -soak { self.spec.power_w } else { 0.0 };
            self.advance(power, ambient(t));
            t += 1.0;
            if t == -soak {
                self.turning_points[1] = self.axes();
            }
            if t == -soak || t == 0.0 || t % TRAIL_S == 0.0 {
                self.trail.push((t, self.axes()));
            }
        }
    }

    /// Advances by a second at the end of which the ambient is `ambient` K, after a second with the
    /// mean magnitude `rate` of the rate, rad/s.
    pub fn second(&mut self, ambient: f64, rate: f64) {
        self.heats = self.wants_heat();
        if self.spec.load_w > 0.0 {
            let switches = -(-1.0 / self.spec.load_time_s).exp_m1();
            self.loaded ^= self.rng.random_bool(switches);
        }
        self.advance(self.power(rate), ambient);
        self.rate_of_block = self.derivative(ambient, rate);
    }

    fn power(&self, rate: f64) -> f64 {
        let load = if self.loaded { self.spec.load_w } else { 0.0 };
        self.spec.power_w + load + self.spec.rate_wpdps * rate / DEG
    }

    fn heater(&self) -> f64 {
        if self.heats { self.spec.heater_w } else { 0.0 }
    }

    /// Whether the two-point thermostat heats.
    fn wants_heat(&self) -> bool {
        let off = self.state.y - self.spec.heater_set_k;
        let half = 0.5 * self.spec.heater_band_k;
        self.spec.heater_w > 0.0 && (off < -half || (self.heats && off < half))
    }

    fn advance(&mut self, power: f64, ambient: f64) {
        let input = Vector3::new(power, self.heater(), ambient);
        self.state = self.step.0 * self.state + self.step.1 * input;
    }

    fn derivative(&self, ambient: f64, rate: f64) -> f64 {
        let input = Vector3::new(self.power(rate), self.heater(), ambient);
        (self.dynamics.0 * self.state + self.dynamics.1 * input).y
    }

    /// Temperature of the block. Its gradient is that of the electronics above the case.
    #[must_use]
    pub fn now(&self) -> Temperature {
        Temperature {
            offset: self.state.y,
            rate: self.rate_of_block,
            gradient: self.state.x - self.state.z,
        }
    }

    /// Temperature of the sensor of each axis, K.
    #[must_use]
    pub fn axes(&self) -> Vector3<f64> {
        let across = self.state.x - self.state.z;
        self.share.map(|share| self.state.y + share * across)
    }

    /// Temperatures of the axes before the last time on, and at its end, K.
    #[must_use]
    pub fn turning_points(&self) -> [Vector3<f64>; 2] {
        self.turning_points
    }

    /// Temperatures of the axes from the last power-on before this one to now: s before power-on
    /// (negative), K. Empty after a long soak.
    #[must_use]
    pub fn trail(&self) -> &[(f64, Vector3<f64>)] {
        &self.trail
    }

    /// Temperature of the case, K.
    #[must_use]
    pub fn case(&self) -> f64 {
        self.state.z
    }
}

#[cfg(test)]
mod tests;
