//! The thermal state of one IMU at one turn-on: the air, the block or the nodes, the thermometers.

use super::nodes::{Nodes, TRAIL_S};
use super::spec::ImuSpec;
use super::thermal::Block;
use super::thermometer::Thermometers;
use super::world::{Ambient, History};
use crate::inertial::session::Temperature;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Random streams of the turn-on: ambient of the unit's file, load of the nodes. 9 is the history.
const AMBIENT: u64 = 5;
const LOAD: u64 = 10;
/// Random streams of the unit: thermometers, positions of the sensors.
const THERMOMETERS: u64 = 9;
const SHARES: u64 = 10;

/// Thermal state of one IMU.
#[derive(Debug, Clone)]
pub(super) struct Heat {
    ambient: Ambient,
    block: Block,
    /// The nodes, which replace the block where the unit has them.
    nodes: Option<Nodes>,
    thermometers: Thermometers,
    history: History,
    start_height: Option<f64>,
    climbed: f64,
    /// Number of samples of the present second, and sum of the magnitudes of their angles. Only
    /// used where the power depends on the rate.
    turned: Option<(f64, f64)>,
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

impl Heat {
    /// The state at power-on.
    pub fn new(spec: &ImuSpec, unit: u64, turn_on: u64) -> Self {
        let history = spec.world.power.history_of(turn_on);
        let ambient = spec.world.ambient.clone();
        let outside = ambient.at(0.0, 0.0);
        let block = Block::new(
            &spec.block,
            &mut stream(turn_on, AMBIENT),
            outside,
            history.left(spec.block.heating_time_s),
        );
        let nodes = spec.nodes.as_ref().map(|nodes| {
            Nodes::new(
                nodes,
                (&ambient, block.ambient(0.0)),
                history,
                &mut stream(unit, SHARES),
                stream(turn_on, LOAD),
            )
        });
        let axes = axes(&block, nodes.as_ref());
        let thermometers = Thermometers::new(
            &spec.thermometer,
            &axes,
            (
                outside + block.ambient(0.0),
                history.left(spec.thermometer.processor_time_s),
            ),
            &mut stream(unit, THERMOMETERS),
        );
        let by_rate = spec.nodes.as_ref().is_some_and(|n| n.rate_wpdps > 0.0);
        Self {
            ambient,
            block,
            nodes,
            thermometers,
            history,
            start_height: None,
            climbed: 0.0,
            turned: by_rate.then_some((0.0, 0.0)),
        }
    }

    /// The history before this power-on.
    pub fn history(&self) -> History {
        self.history
    }

    /// Temperatures of the axes until power-on, K: cold, at the power-off, now. After a long soak
    /// there is only the last one.
    pub fn turning_points(&self) -> Vec<Vector3<f64>> {
        let now = self.axes();
        if self.history.is_cold() {
            return vec![now];
        }
        let before = match &self.nodes {
            Some(nodes) => nodes.turning_points(),
            None => self.block_turning_points().map(Vector3::repeat),
        };
        vec![before[0], before[1], now]
    }

    /// Temperatures of the axes in steps of a minute: time, s before power-on (negative),
    /// ascending, the last one 0. Empty after a long soak.
    pub fn trail(&self) -> Vec<(f64, Vector3<f64>)> {
        if self.history.is_cold() {
            return Vec::new();
        }
        if let Some(nodes) = &self.nodes {
            return nodes.trail().to_vec();
        }
        let (on, soak) = (self.history.on_s, self.history.soak_s);
        let [cold, _] = self.block_turning_points();
        let of = |t: f64| {
            let until = History {
                on_s: (on + soak + t).min(on),
                soak_s: (soak + t).max(0.0),
                ..self.history
            };
            (t, Vector3::repeat(cold + self.block.heated(&until)))
        };
        let steps = ((on + soak) / TRAIL_S) as u32;
        let mut times: Vec<f64> = (0..=steps).map(|k| -TRAIL_S * f64::from(k)).collect();
        times.extend([-soak, -on - soak]);
        times.sort_by(f64::total_cmp);
        times.into_iter().map(of).collect()
    }

    /// The block's temperature before it was switched on, and when it was switched off, K.
    fn block_turning_points(&self) -> [f64; 2] {
        let ambient = self.ambient.at(0.0, 0.0) + self.block.ambient(0.0);
        let warm = History {
            soak_s: 0.0,
            ..self.history
        };
        [ambient, ambient + self.block.heated(&warm)]
    }

    /// Sets the height of the vehicle, m. The first call sets the height of the start.
    pub fn set_height(&mut self, height: f64) {
        self.climbed = height - *self.start_height.get_or_insert(height);
    }

    /// Adds the angle of a sample, rad.
    pub fn turn(&mut self, angle: &Vector3<f64>) {
        if let Some((samples, sum)) = &mut self.turned {
            *samples += 1.0;
            *sum += angle.norm();
        }
    }

    /// Advances by `dt` s, a second, to the time `t` after power-on.
    pub fn step(&mut self, t: f64, dt: f64) {
        let outside = self.ambient.at(t, self.climbed);
        self.block.step(t, dt, outside);
        let ambient = outside + self.block.ambient(t);
        if let Some(nodes) = &mut self.nodes {
            let turned = self.turned.as_mut().map(std::mem::take);
            let (samples, sum) = turned.unwrap_or_default();
            let rate = if samples > 0.0 { sum / dt } else { 0.0 };
            nodes.second(ambient, rate);
        }
        let axes = axes(&self.block, self.nodes.as_ref());
        self.thermometers.step(dt, &axes, ambient);
    }

    /// Temperature of the block.
    pub fn now(&self) -> Temperature {
        let nodes = self.nodes.as_ref();
        nodes.map_or_else(|| self.block.now(), Nodes::now)
    }

    /// Temperature of the sensor of each axis, K above the calibration.
    pub fn axes(&self) -> Vector3<f64> {
        axes(&self.block, self.nodes.as_ref())
    }

    /// The thermometers.
    pub fn thermometers(&self) -> &Thermometers {
        &self.thermometers
    }
}

fn axes(block: &Block, nodes: Option<&Nodes>) -> Vector3<f64> {
    nodes.map_or_else(|| Vector3::repeat(block.now().offset), Nodes::axes)
}

#[cfg(test)]
mod tests {
    use super::super::tests::perfect;
    use super::super::world::{Power, StartName, Step};
    use super::super::{BlockSpec, Group, Imu, NodesSpec};
    use super::*;
    use crate::inertial::sins::Increment;

    fn second(imu: &mut Imu, rate_hz: u32) {
        (0..rate_hz).for_each(|_| {
            imu.measure(&Increment::default());
        });
    }

    fn nodes() -> NodesSpec {
        toml::from_str(
            "electronics_jpk = 40\nblock_jpk = 300\ncase_jpk = 500\nelectronics_block_wpk = 0.8\n\
             block_case_wpk = 1.5\ncase_ambient_wpk = 0.9\npower_w = 12",
        )
        .unwrap()
    }

    /// Ambient, nodes and thermometers change no random number of an error: an IMU whose errors do
    /// not follow the temperature measures the same in any world.
    #[test]
    fn the_world_changes_no_bit_of_what_does_not_follow_it() {
        let medium = ImuSpec::preset("medium").unwrap();
        let plain = medium.scaled(|group| match group {
            Group::Thermal => 0.0,
            _ => 1.0,
        });
        let mut rich = plain.clone();
        rich.nodes = Some(nodes());
        rich.thermometer.per_axis = true;
        rich.world.ambient = Ambient {
            day_k: 9.0,
            lapse_kpkm: 6.5,
            ..Ambient::default()
        };
        rich.world.power = Power {
            start: StartName::Warm,
            ..Power::default()
        };
        let [mut a, mut b] = [&plain, &rich].map(|spec| Imu::new(spec, 5, 6));
        for k in 0..2000 {
            let step = Increment {
                dtheta: Vector3::repeat(1e-4 * f64::from(k % 7)),
                dv: Vector3::new(0.0, 0.01, -0.049),
            };
            b.set_height(60.0 + f64::from(k));
            assert_eq!(a.measure(&step), b.measure(&step));
        }
        assert_ne!(a.surroundings().temperature, b.surroundings().temperature);
    }

    /// 1000 m up at 6.5 K/km, slowly: the block follows the air late by its time constant.
    #[test]
    fn the_height_cools_by_the_lapse_rate() {
        let mut spec = perfect();
        spec.rate_hz = 10;
        spec.block = BlockSpec {
            heating_time_s: 100.0,
            ..Default::default()
        };
        spec.world.ambient.lapse_kpkm = 6.5;
        let mut imu = Imu::new(&spec, 1, 2);
        for t in 0..=2000 {
            imu.set_height(60.0 + 0.5 * f64::from(t));
            second(&mut imu, 10);
        }
        let want = -6.5 * (0.5 * 1900.0) / 1000.0;
        let got = imu.surroundings().temperature.offset;
        assert!((got - want).abs() < 0.01, "{got} {want}");
    }

    /// The single block of older files has warm starts and steps of the air, too.
    #[test]
    fn a_block_starts_hot_and_feels_a_tunnel() {
        let mut spec = perfect();
        spec.rate_hz = 10;
        spec.block = BlockSpec {
            self_heating_k: 20.0,
            ..BlockSpec::default()
        };
        spec.world.power = Power {
            start: StartName::Hot,
            soak_s: Some(450.0),
            ..Power::default()
        };
        let mut imu = Imu::new(&spec, 1, 2);
        second(&mut imu, 10);
        let left = (1.0 - (-8.0f64).exp()) * (-0.5f64).exp();
        let now = imu.surroundings().temperature;
        assert!((now.offset - 20.0 * left).abs() < 1e-9);
        assert!((now.rate - 20.0 * (1.0 - left) / 900.0).abs() < 1e-9);
        spec.world.power = Power::default();
        spec.world.ambient.step = vec![Step {
            at_s: 0.5,
            duration_s: 1e4,
            change_k: -10.0,
        }];
        let mut imu = Imu::new(&spec, 1, 2);
        (0..=900).for_each(|_| second(&mut imu, 10));
        let offset = imu.surroundings().temperature.offset;
        assert!(
            (offset - 10.0 * (1.0 - (-1.0f64).exp())).abs() < 1e-9,
            "{offset}"
        );
    }

    /// After a soak of `ln 2` time constants half of the warm-up is left.
    #[test]
    fn the_warm_up_of_a_restart_is_what_the_soak_has_cooled() {
        let mut spec = perfect();
        spec.gyro.warm_up_dph = 0.2;
        spec.gyro.warm_up_time_s = 900.0;
        let first = |spec: &ImuSpec| Imu::new(spec, 1, 2).measure(&Increment::default()).1.dtheta;
        let cold = first(&spec);
        spec.world.power = Power {
            start: StartName::Warm,
            soak_s: Some(900.0 * 2f64.ln()),
            on_before_s: 1e5,
            ..Power::default()
        };
        assert!((first(&spec) - cold * 0.5).norm() < 1e-9 * cold.norm() && cold.norm() > 0.0);
    }

    /// The readings of the unit come each second, delayed and rounded.
    #[test]
    fn readings_follow_the_axes() {
        let mut spec = perfect();
        spec.rate_hz = 10;
        spec.nodes = Some(NodesSpec {
            axis_share_ratio: 0.2,
            ..nodes()
        });
        spec.thermometer.per_axis = true;
        spec.thermometer.offset_k = 0.0;
        spec.thermometer.resolution_k = super::super::thermometer::STIM300_K;
        let mut imu = Imu::new(&spec, 1, 2);
        (0..1200).for_each(|_| second(&mut imu, 10));
        let (read, true_axes) = (imu.readings().axes, imu.surroundings().axes);
        let rate = imu.surroundings().temperature.rate;
        let lag = true_axes - read.add_scalar(-25.0);
        assert!(
            lag.iter().all(|x| (x / (5.0 * rate) - 1.0).abs() < 0.3),
            "{lag} {rate}"
        );
        assert!(read.x != read.y && read.y != read.z);
        assert_eq!((read * 256.0).map(f64::fract), Vector3::zeros());
    }
}
