//! The content of the device's store between two drives.

use firmware::learn::prior::{Datasheet, Shapes};
use firmware::learn::unit;
use firmware::model::Nets;
use host_unit::prior::Prior;

/// The content of the device's store for a unit.
#[derive(Debug, Clone, Default)]
pub struct Stored {
    /// Networks that act from power-on.
    pub nets: Option<Nets>,
    /// The memory of the unit: [`firmware::learn::unit`]. Empty if nothing is known.
    pub memory: Vec<u8>,
}

impl Stored {
    /// The content of a device's store before the first drive of a unit whose type has a prior from
    /// a fleet: networks of the type's shape with zero output, and the variation between units.
    #[must_use]
    pub fn of_type(prior: &Prior, sheet: &Datasheet) -> Self {
        let mut nets = prior.nets();
        for net in [&mut nets.gyro, &mut nets.accel] {
            let [_, _, top] = &mut net.weights.layers;
            *top = lrnn_nostd::Layer::default();
        }
        let spread = [prior.gyro.spread(), prior.accel.spread()];
        let shapes = Shapes::new(&[nets.gyro, nets.accel], sheet, &prior.networks().inputs());
        let unit = unit::Unit::of_type(&shapes, sheet, &spread);
        let mut memory = vec![0; unit::LEN];
        unit.write(0, &mut memory);
        Self {
            nets: Some(nets),
            memory,
        }
    }
}
