//! The error model by itself, what makes a filter unhealthy, and its likelihood of extreme values.

use super::super::deferred::Deferred;
use super::*;

type Model<L, const N: usize> = ErrorModel<L, N, Rational, f64>;

fn inputs() -> [[f64; NEURONS]; TRIADS] {
    [[0.3, -0.2, 0.9], [1.0, 0.1, -0.4]]
}

/// A model that has learnt something in every parameter.
fn learnt<L: ParameterSet, const N: usize>(numbers: &mut Numbers) -> Model<L, N> {
    let mut model = Model::new(nets(numbers));
    model.set_rest([numbers.row(), numbers.row()]);
    model.step(inputs());
    model.subtract(&numbers.row().map(|value| 0.2 * value));
    model
}

fn mapped(maps: &Maps<f64>, rest: &[[f64; NEURONS]; TRIADS]) -> Vec<f64> {
    let rows = maps.iter().zip(rest);
    rows.flat_map(|(map, u)| map.iter().map(|row| row::dot(row, u)))
        .collect()
}

/// A model that begins anew in place is a new one, but for what it feels at rest.
#[test]
fn a_model_that_begins_in_place_is_a_new_one() {
    let numbers = &mut Numbers(12);
    let nets = nets(numbers);
    let mut model = learnt::<UnitMap, 30>(numbers);
    model.init(&nets);
    let mut new = Model::<UnitMap, 30>::new(nets);
    assert_ne!(model, new);
    model.set_rest([[0.0; NEURONS]; TRIADS]);
    new.set_rest([[0.0; NEURONS]; TRIADS]);
    assert_eq!(model, new);
}

/// At power-on the estimate is the biases, the map of what is felt at rest, and the biases of an
/// output layer that has no other input.
#[test]
fn at_power_on_the_estimate_is_what_was_learnt_of_constants() {
    let numbers = &mut Numbers(11);
    let mut model = learnt::<UnitMap, 30>(numbers);
    for rest in [[numbers.row(), numbers.row()], [[0.0, 0.1, 9.8]; 2]] {
        model.set_rest(rest);
        let (soon, felt) = (*model.estimate(), mapped(model.maps(), &rest));
        let derivatives = model.jacobian().map(|rows| rows.values.to_vec());
        model.reset();
        assert_eq!(
            model.jacobian().map(|rows| rows.values.to_vec()),
            derivatives
        );
        let nets = model.unit_nets();
        for output in 0..OUTPUTS {
            let (k, j) = (output / 3, output % 3);
            let unit = nets[k].normalisation.output_scale[j] * nets[k].weights.layers[2].b[j];
            let expected = model.biases()[k][j] + unit + felt[output];
            near(model.estimate()[output], expected, "after a reset");
            near(soon[output], expected, "after the change");
        }
        // the unit's network has nothing but these biases, so a step changes nothing
        let before = *model.estimate();
        for (now, before) in model.step(inputs()).iter().zip(before) {
            near(*now, before, "after a step");
        }
        assert!(model.is_healthy());
    }
}

/// Networks that run in a compensator, with the biases in their output layers, give the model's
/// estimate; so does a model that begins again.
#[test]
fn the_networks_of_a_compensator_give_the_estimate() {
    fn check<L: ParameterSet, const N: usize>(seed: u32) {
        let numbers = &mut Numbers(seed);
        let mut model = learnt::<L, N>(numbers);
        let (mut nets, mut states) = (model.nets(), *model.states());
        for step in 0..3 {
            let inputs = inputs().map(|input| input.map(|value| value * f64::from(step)));
            let estimate = model.step(inputs);
            for k in 0..TRIADS {
                let error = nets[k].step(&mut states[k], inputs[k]).error;
                for j in 0..NEURONS {
                    near(error[j], estimate[NEURONS * k + j], "a compensator");
                }
            }
        }
        nets[0].normalisation.output_scale[1] = 0.0;
        let mut flat = Model::<L, N>::new(nets);
        flat.subtract(&[0.1; N]);
        assert!(
            flat.nets()[0].weights.is_finite(),
            "an output without scale"
        );
    }
    check::<Biases, 6>(21);
    check::<UnitOutput, 30>(22);
    check::<UnitBiases, 12>(23);
}

/// Networks that begin in their steady state repeat it; without networks nothing happens. A reset
/// leads back to power-on.
#[test]
fn a_settled_model_stays() {
    let numbers = &mut Numbers(31);
    let mut filter: Filter<FixedWeights, 0, 0> =
        Filter::new(Model::new(nets(numbers)), prior(numbers));
    let fresh = filter.clone();
    filter.settle(inputs());
    filter.step(inputs());
    let first = *filter.model().estimate();
    filter.step(inputs());
    for (now, first) in filter.model().estimate().iter().zip(first) {
        assert!((now - first).abs() < 1e-6, "{now}, {first}");
    }
    assert!(first.iter().all(|value| value.abs() > 1e-3));
    filter.reset_networks();
    assert_eq!(filter, fresh);

    let maps = [numbers.rows(), numbers.rows()];
    filter.set_rest(inputs());
    filter.set_maps(&maps);
    assert_eq!(filter.model().maps(), &maps);
    for (own, felt) in filter
        .model()
        .estimate()
        .iter()
        .zip(mapped(&maps, &inputs()))
    {
        near(*own, felt, "given maps");
    }
    let mut none = Model::<Biases, 6>::new(nets(numbers));
    let before = none.clone();
    none.settle(inputs());
    assert_eq!(none, before);
}

/// Standard deviations stand where the parameters are that they belong to.
#[test]
fn sigmas_are_in_the_order_of_the_parameters() {
    fn check<L: ParameterSet, const N: usize>() {
        let bias = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]];
        let maps = core::array::from_fn(|k| {
            core::array::from_fn(|i| core::array::from_fn(|j| (100 * k + 10 * i + j) as f64))
        });
        let weights = [1e3, 2e3].map(|first| Weights::from_fn(|i| first + i as f64));
        let sigmas = Model::<L, N>::sigmas(bias, &maps, &weights);
        // parameters are taken off, so a change of minus the sigmas puts them into the model
        let mut model =
            Model::<L, N>::new([Net::new(Weights::zero(), Normalisation::identity()); 2]);
        model.subtract(&sigmas.map(|sigma| -sigma));
        if L::BIASES {
            assert_eq!(model.biases(), &bias);
        }
        if L::MAP > 0 {
            assert_eq!(model.maps(), &maps);
        }
        for (net, given) in model.unit_nets().iter().zip(&weights) {
            for ((i, weight), given) in net.weights.iter().enumerate().zip(given.iter()) {
                assert_eq!(weight, if L::is_learnt(i) { given } else { 0.0 }, "{i}");
            }
        }
        let learnt = (0..N).filter(|&i| Model::<L, N>::is_weight(i));
        assert_eq!(learnt.count(), TRIADS * L::WEIGHTS);
    }
    check::<NoParameters, 0>();
    check::<Biases, 6>();
    check::<UnitBiases, 12>();
    check::<OutputWeights, 24>();
    check::<UnitMap, 30>();
    check::<UnitOutput, 30>();
    check::<DiagonalWeights, 96>();
    check::<AllWeights, 132>();
}

/// A filter is given up when a network has overflowed or any of its numbers is not finite.
#[test]
fn a_number_that_is_none_makes_the_filter_unhealthy() {
    type Six = Filter<UnitBiases, 12, 78>;
    let begun = || {
        let numbers = &mut Numbers(41);
        Six::new(Model::new(nets(numbers)), prior(numbers))
    };
    type Harm = fn(&mut Six);
    let harms: [(&str, Harm); 5] = [
        ("nothing", |_| ()),
        ("error", |filter| filter.feedback(&[f64::INFINITY; X])),
        ("likelihood", |filter| filter.believe(f64::NAN)),
        ("variance", |filter| filter.inflate(&[f64::INFINITY; X])),
        ("estimate", |filter| {
            filter.set_maps(&[[[1e300; NEURONS]; NEURONS]; TRIADS]);
            filter.set_rest([[1e300; NEURONS]; TRIADS]);
        }),
    ];
    for (name, harm) in harms {
        let mut filter = begun();
        filter.step(inputs());
        harm(&mut filter);
        filter.finish_update();
        assert_eq!(filter.is_healthy(), name == "nothing", "{name}");
        filter.finish_update();
        assert_eq!(
            filter.is_healthy(),
            name == "nothing",
            "{name}: it stays so"
        );
    }
    // an input that is none is the sensor's fault; a network that overflows is the hypothesis's
    for (input, healthy) in [(f64::NAN, true), (1e308, false)] {
        let mut nets = nets(&mut Numbers(42));
        nets[0].weights.layers[0].w = [[1e10; NEURONS]; NEURONS];
        let mut model = Model::<AllWeights, 132>::new(nets);
        model.step([[input; NEURONS], [0.0; NEURONS]]);
        model.step(inputs());
        assert_eq!(model.is_healthy(), healthy, "{input}");
    }
}

/// Densities far beyond the range of a product of several have their logarithms all the same, and
/// an outlier counts as the cap.
#[test]
fn extreme_densities_are_counted() {
    for variance in [1e-150, 1e150, 1e-250, 1e250] {
        let mut filter: Filter<NoParameters, 0, 0> =
            Filter::new(Model::new(nets(&mut Numbers(51))), prior(&mut Numbers(52)));
        let value = variance.sqrt();
        let mut expected = 0.0;
        for _ in 0..5 {
            filter.score(
                Innovation {
                    value: 3.0 * value,
                    variance,
                },
                4.0,
            );
            expected -= 0.5 * (4.0 + (core::f64::consts::TAU * variance).ln());
            near(filter.log_likelihood(), expected, "so far");
        }
        let innovation = Innovation {
            value: 3.0 * value,
            variance,
        };
        near(innovation.squared_ratio(), 9.0, "squared ratio");
    }
}

/// Changes that wait are equal when they are the same changes, whatever was there before.
#[test]
fn waiting_changes_are_compared() {
    let of = |changes: &[([f64; 2], f64)]| {
        let mut deferred = Deferred::<2, f64>::ZEROED;
        for (column, weight) in changes {
            assert!(deferred.hold(column, *weight));
        }
        deferred
    };
    let one = of(&[([1.0, 2.0], 0.5)]);
    assert_eq!(one, of(&[([1.0, 2.0], 0.5)]));
    assert_ne!(one, of(&[([1.0, 2.5], 0.5)]));
    assert_ne!(one, of(&[([1.0, 2.0], 0.6)]));
    assert_ne!(one, of(&[([1.0, 2.0], 0.5), ([0.0, 0.0], 0.0)]));
}
