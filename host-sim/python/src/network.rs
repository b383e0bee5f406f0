//! `Network`: weights, state and sensitivities of one network, any activation and feedback.
use crate::arrays::{few_f32, given, named, table};
use crate::errors::refused;
use crate::long::in_pieces;
use crate::step::Step;
use lrnn_nostd::image::{self, IMAGE_LEN};
use lrnn_nostd::{
    Activation, Cubic, Diagonal, Feedback, Full, Identity, Net, Normalisation, PARAMS, Rational,
    Sensitivities, State, Tanh, Weights,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// The activation of the hidden layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hidden {
    Rational,
    Tanh,
    Cubic,
}

/// Names of the activations.
pub const HIDDEN: [(&str, Hidden); 3] = [
    ("rational", Hidden::Rational),
    ("tanh", Hidden::Tanh),
    ("cubic", Hidden::Cubic),
];
/// Names of the kinds of feedback; whether full.
pub const FEEDBACK: [(&str, bool); 2] = [("full", true), ("diagonal", false)];

/// What a network of any type can do.
trait Any: Send + Sync {
    fn step(&mut self, input: [f32; 3]) -> lrnn_nostd::Step;
    fn step_gradient(&mut self, input: [f32; 3]) -> lrnn_nostd::Step;
    fn descend(&mut self, input: [f32; 3], target: &[f32; 3], rate: f32) -> lrnn_nostd::Step;
    /// Steps over all inputs and adds the errors. Gives the number of faults.
    fn run(&mut self, inputs: &[[f32; 3]], errors: &mut Vec<[f32; 3]>) -> u64;
    fn gradient(&self) -> [[f32; PARAMS]; 3];
    fn state(&self) -> &State;
    fn reset(&mut self);
    fn weights(&self) -> Weights;
    fn set_weights(&mut self, weights: &Weights);
    fn image(&self) -> [u8; IMAGE_LEN];
    fn clone_box(&self) -> Box<dyn Any>;
}

#[derive(Clone)]
struct TypedNetwork<H: Activation, F: Feedback> {
    net: Net<H, Identity, F>,
    state: State,
    sens: Sensitivities,
}

impl<H: Activation + Send + Sync, F: Feedback + Send + Sync> Any for TypedNetwork<H, F> {
    fn step(&mut self, input: [f32; 3]) -> lrnn_nostd::Step {
        self.net.step(&mut self.state, input)
    }

    fn step_gradient(&mut self, input: [f32; 3]) -> lrnn_nostd::Step {
        self.net
            .step_gradient(&mut self.state, &mut self.sens, input)
    }

    fn descend(&mut self, input: [f32; 3], target: &[f32; 3], rate: f32) -> lrnn_nostd::Step {
        let Self { net, state, sens } = self;
        net.step_descend(state, sens, input, target, rate)
    }

    fn run(&mut self, inputs: &[[f32; 3]], errors: &mut Vec<[f32; 3]>) -> u64 {
        let (mut state, mut faults) = (self.state, 0);
        errors.extend(inputs.iter().map(|input| {
            let step = self.net.step(&mut state, *input);
            faults += u64::from(step.fault.is_some());
            step.error
        }));
        self.state = state;
        faults
    }

    fn gradient(&self) -> [[f32; PARAMS]; 3] {
        self.sens.output()
    }

    fn state(&self) -> &State {
        &self.state
    }

    fn reset(&mut self) {
        self.state.reset();
        self.sens.reset();
    }

    fn weights(&self) -> Weights {
        self.net.weights
    }

    fn set_weights(&mut self, weights: &Weights) {
        self.net.weights = *weights;
    }

    fn image(&self) -> [u8; IMAGE_LEN] {
        image::encode(&self.net)
    }

    fn clone_box(&self) -> Box<dyn Any> {
        Box::new(self.clone())
    }
}

/// A locally recurrent network: three inputs, three layers of three neurons, 63 weights.
///
/// weights: (63,), for each layer W row by row, R row by row, b; by default 0.
/// activation: of the hidden layers, "rational" (the device's), "tanh" or "cubic".
/// feedback: "full" or "diagonal" (each neuron to itself).
/// input_offset, input_scale, output_scale: (3,); u = (input - offset) * scale, and
/// error = output * output_scale. It has a state, so one object belongs to one run.
#[pyclass(module = "lrnn_imu")]
pub struct Network {
    any: Box<dyn Any>,
    pub hidden: Hidden,
    /// Whether every unit of a layer feeds back to every other.
    pub full: bool,
    pub normalisation: Normalisation,
    /// Number of steps with a fault since the start or reset().
    #[pyo3(get)]
    faults: u64,
}

impl Network {
    /// A network of these weights, with state 0.
    pub fn of(hidden: Hidden, full: bool, weights: Weights, normalisation: Normalisation) -> Self {
        fn any<H: Activation + Send + Sync, F: Feedback + Send + Sync>(
            weights: Weights,
            normalisation: Normalisation,
        ) -> Box<dyn Any> {
            Box::new(TypedNetwork::<H, F> {
                net: Net::new(weights, normalisation),
                state: State::new(),
                sens: Sensitivities::new(),
            })
        }
        let make = match (hidden, full) {
            (Hidden::Rational, true) => any::<Rational, Full>,
            (Hidden::Rational, false) => any::<Rational, Diagonal>,
            (Hidden::Tanh, true) => any::<Tanh, Full>,
            (Hidden::Tanh, false) => any::<Tanh, Diagonal>,
            (Hidden::Cubic, true) => any::<Cubic, Full>,
            (Hidden::Cubic, false) => any::<Cubic, Diagonal>,
        };
        Self {
            any: make(weights, normalisation),
            hidden,
            full,
            normalisation,
            faults: 0,
        }
    }

    /// From the kind that the device has.
    pub fn from_net(net: &Net) -> Self {
        Self::of(Hidden::Rational, true, net.weights, net.normalisation)
    }

    /// The weights.
    pub fn weights_of(&self) -> Weights {
        self.any.weights()
    }

    /// As the device has it.
    ///
    /// # Errors
    /// It is of another kind.
    pub fn net(&self, name: &str) -> PyResult<Net> {
        if self.hidden != Hidden::Rational || !self.full {
            let remedy = "the device has networks with activation='rational', feedback='full'";
            return Err(refused(
                name,
                "is of another kind than the device's",
                remedy,
            ));
        }
        Ok(Net::new(self.any.weights(), self.normalisation))
    }

    fn count(&mut self, step: lrnn_nostd::Step) -> Step {
        self.faults += u64::from(step.fault.is_some());
        Step(step)
    }
}

/// The weights of an array of shape (63,).
pub fn weights_of(value: &Bound<'_, PyAny>) -> PyResult<Weights> {
    Ok(Weights::from_array(&few_f32::<PARAMS>("weights", value)?))
}

#[pymethods]
impl Network {
    #[new]
    #[pyo3(signature = (
        weights=None, *, activation="rational", feedback="full", input_offset=None,
        input_scale=None, output_scale=None
    ))]
    fn new(
        weights: Option<&Bound<'_, PyAny>>,
        activation: &str,
        feedback: &str,
        input_offset: Option<&Bound<'_, PyAny>>,
        input_scale: Option<&Bound<'_, PyAny>>,
        output_scale: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let three = |name, value: Option<&Bound<'_, PyAny>>, usual| {
            value.map_or(Ok(usual), |value| few_f32::<3>(name, value))
        };
        let identity = Normalisation::identity();
        let normalisation = Normalisation {
            input_offset: three("input_offset", input_offset, identity.input_offset)?,
            input_scale: three("input_scale", input_scale, identity.input_scale)?,
            output_scale: three("output_scale", output_scale, identity.output_scale)?,
        };
        let weights = weights.map_or(Ok(Weights::zero()), weights_of)?;
        let hidden = named("activation", activation, &HIDDEN)?;
        let full = named("feedback", feedback, &FEEDBACK)?;
        Ok(Self::of(hidden, full, weights, normalisation))
    }

    /// The network of a weight image, as devices send and store it.
    #[staticmethod]
    fn from_bytes(image: &[u8]) -> PyResult<Self> {
        let bad = |e: image::ImageError| {
            refused(
                "image",
                e.to_string(),
                "give the bytes that to_bytes() gave",
            )
        };
        let first: Result<Net, _> = image::decode(image);
        if let Ok(net) = first {
            return Ok(Self::from_net(&net));
        }
        macro_rules! try_as {
            ($($hidden:ident $feedback:ident $full:literal),*) => {$(
                let net: Result<Net<$hidden, Identity, $feedback>, _> = image::decode(image);
                if let Ok(net) = net {
                    let Net { weights, normalisation, .. } = net;
                    return Ok(Self::of(Hidden::$hidden, $full, weights, normalisation));
                }
            )*};
        }
        try_as!(Tanh Full true, Cubic Full true, Rational Diagonal false, Tanh Diagonal false,
            Cubic Diagonal false);
        first.map(|net| Self::from_net(&net)).map_err(bad)
    }

    /// The weight image, as devices send and store it.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.any.image())
    }

    /// Name of the activation of the hidden layers.
    #[getter]
    fn activation(&self) -> &'static str {
        let found = HIDDEN.iter().find(|(_, hidden)| *hidden == self.hidden);
        found.map_or("", |(name, _)| name)
    }

    /// Name of the kind of feedback.
    #[getter]
    fn feedback(&self) -> &'static str {
        if self.full { "full" } else { "diagonal" }
    }

    /// The weights, (63,): a copy. Assign to change them; the state stays.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.any.weights().to_array())
    }

    #[setter]
    fn set_weights(&mut self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.any.set_weights(&weights_of(value)?);
        Ok(())
    }

    /// Subtracted from the input, (3,).
    #[getter]
    fn input_offset<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.normalisation.input_offset)
    }

    /// Network units per unit of the input, (3,).
    #[getter]
    fn input_scale<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.normalisation.input_scale)
    }

    /// Units of the error per network unit, (3,).
    #[getter]
    fn output_scale<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.normalisation.output_scale)
    }

    /// Outputs of the three layers in the last step, (3, 3).
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        table(py, self.any.state().layers().to_vec())
    }

    /// Exact dy_3/dweights of the last step with gradient, (3, 63), through all steps.
    #[getter]
    fn sensitivities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        table(py, self.any.gradient().to_vec())
    }

    /// State and sensitivities as before the first step; the weights stay.
    fn reset(&mut self) {
        self.any.reset();
        self.faults = 0;
    }

    /// A network with the same weights and state.
    fn copy(&self) -> Self {
        Self {
            any: self.any.clone_box(),
            ..*self
        }
    }

    /// One step. input: (3,), in physical units (rad/s or m/s2).
    fn step(&mut self, input: &Bound<'_, PyAny>) -> PyResult<Step> {
        let step = self.any.step(few_f32("input", input)?);
        Ok(self.count(step))
    }

    /// One step, and the exact sensitivities. input: (3,).
    fn step_gradient(&mut self, input: &Bound<'_, PyAny>) -> PyResult<Step> {
        let step = self.any.step_gradient(few_f32("input", input)?);
        Ok(self.count(step))
    }

    /// One step, and a descent along the exact gradient.
    ///
    /// target: (3,), in network units. rate: step size for 1/2 |y_3 - target|^2.
    fn step_descend(
        &mut self,
        input: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
        rate: f32,
    ) -> PyResult<Step> {
        let (input, target) = (few_f32("input", input)?, few_f32("target", target)?);
        let step = self.any.descend(input, &target, rate);
        Ok(self.count(step))
    }

    /// Steps over all inputs, (n, 3). Gives the estimated errors, (n, 3).
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        inputs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let inputs = given::<f32>("inputs", inputs)?;
        let rows = inputs.rows::<3>()?;
        let mut errors = Vec::with_capacity(rows.len());
        let Self { any, faults, .. } = self;
        in_pieces(py, rows, |piece| *faults += any.run(piece, &mut errors))?;
        table(py, errors)
    }

    /// step_descend over all inputs, (n, 3), and targets, (n, 3). Gives the outputs, (n, 3).
    fn descend<'py>(
        &mut self,
        py: Python<'py>,
        inputs: &Bound<'py, PyAny>,
        targets: &Bound<'py, PyAny>,
        rate: f32,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let (inputs, targets) = (
            given::<f32>("inputs", inputs)?,
            given::<f32>("targets", targets)?,
        );
        let wanted = targets.rows_like::<3, _>(&inputs)?;
        let mut targets = wanted.iter();
        let mut outputs = Vec::with_capacity(wanted.len());
        let Self { any, faults, .. } = self;
        in_pieces(py, inputs.rows::<3>()?, |piece| {
            outputs.extend(piece.iter().zip(targets.by_ref()).map(|(input, target)| {
                let step = any.descend(*input, target, rate);
                *faults += u64::from(step.fault.is_some());
                step.output
            }));
        })?;
        table(py, outputs)
    }

    fn __repr__(&self) -> String {
        let (activation, feedback) = (self.activation(), self.feedback());
        format!(
            "Network(activation='{activation}', feedback='{feedback}', faults={})",
            self.faults
        )
    }
}
