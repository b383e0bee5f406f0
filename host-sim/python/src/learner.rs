//! `Learner`: the learning rules over passes, for any network.

use crate::arrays::{few, few_f32, given, named};
use crate::errors::refused;
use crate::navigator::positive;
use crate::network::{Hidden, Network, weights_of};
use lrnn_nostd::learn::{self, GaussNewton, Guarded, Paper, Rule, StepSizes};
use lrnn_nostd::{
    Activation, Cubic, Diagonal, Feedback, Full, Identity, Net, PARAMS, Rational, Tanh, Weights,
};
use numpy::PyArray1;
use pyo3::prelude::*;

/// A learner of any kind.
trait Any: Send + Sync {
    fn begin_pass(&mut self);
    fn step(&mut self, input: [f32; 3], dt: f32) -> bool;
    fn reference(&mut self, sum: [f32; 3], weight: f32);
    fn skip(&mut self);
    fn end_pass(&mut self) -> learn::Pass;
    fn proposal(&self) -> Weights;
    fn candidate(&self) -> Weights;
}

impl<U, H, F> Any for learn::Learner<U, H, Identity, F>
where
    U: Rule<f32> + Send + Sync,
    H: Activation + Send + Sync,
    F: Feedback + Send + Sync,
{
    fn begin_pass(&mut self) {
        self.begin_pass();
    }

    fn step(&mut self, input: [f32; 3], dt: f32) -> bool {
        self.step(input, dt).fault.is_none()
    }

    fn reference(&mut self, sum: [f32; 3], weight: f32) {
        self.reference(sum, weight);
    }

    fn skip(&mut self) {
        self.skip();
    }

    fn end_pass(&mut self) -> learn::Pass {
        self.end_pass()
    }

    fn proposal(&self) -> Weights {
        self.proposal()
    }

    fn candidate(&self) -> Weights {
        *self.candidate()
    }
}

/// A learner that learns the weights of a copy of `network`.
fn learner<U: Rule<f32> + Send + Sync + 'static>(network: &Network, rule: U) -> Box<dyn Any> {
    fn of<U: Rule<f32> + Send + Sync + 'static, H, F>(network: &Network, rule: U) -> Box<dyn Any>
    where
        H: Activation + Send + Sync,
        F: Feedback + Send + Sync,
    {
        let net: Net<H, Identity, F> = Net::new(network.weights_of(), network.normalisation);
        Box::new(learn::Learner::new(&net, rule))
    }
    match (network.hidden, network.full) {
        (Hidden::Rational, true) => of::<U, Rational, Full>(network, rule),
        (Hidden::Rational, false) => of::<U, Rational, Diagonal>(network, rule),
        (Hidden::Tanh, true) => of::<U, Tanh, Full>(network, rule),
        (Hidden::Tanh, false) => of::<U, Tanh, Diagonal>(network, rule),
        (Hidden::Cubic, true) => of::<U, Cubic, Full>(network, rule),
        (Hidden::Cubic, false) => of::<U, Cubic, Diagonal>(network, rule),
    }
}

/// The result of a pass of a learner.
#[pyclass(module = "lrnn_imu", frozen, get_all)]
pub struct Pass {
    /// 1/2 sum weight r^2 of the weights that this pass was made with; (network units s)^2 where
    /// all weights are 1.
    cost: f32,
    /// Whether the rule took these weights as its new starting point.
    accepted: bool,
    /// Number of windows closed by a reference.
    windows: u32,
    /// Number of steps with a fault.
    faults: u32,
}

#[pymethods]
impl Pass {
    fn __repr__(&self) -> String {
        let Self {
            cost,
            windows,
            faults,
            ..
        } = self;
        let accepted = if self.accepted { "True" } else { "False" };
        format!("Pass(cost={cost}, accepted={accepted}, windows={windows}, faults={faults})")
    }
}

impl From<learn::Pass> for Pass {
    fn from(pass: learn::Pass) -> Self {
        let learn::Pass {
            cost,
            accepted,
            windows,
            faults,
        } = pass;
        Self {
            cost,
            accepted,
            windows,
            faults,
        }
    }
}

/// Learns the weights of a copy of a network in passes over a batch, by the exact gradient.
///
/// rule: "paper" (equations 7 to 13 as printed), "guarded" (a pass that raises the cost is
/// undone) or "gauss-newton".
/// steps: of paper and guarded, one number or (feedback, feed-forward, bias); default 0.01.
/// eps: of paper, likewise; default 0.1.
/// ridge: of gauss-newton, one number or (63,); default 0.001. prior: (63,), what the ridge
/// holds the weights to; default: those of the network.
#[pyclass(module = "lrnn_imu")]
pub struct Learner {
    any: Box<dyn Any>,
    /// Name of the rule.
    #[pyo3(get)]
    rule: String,
}

/// One number for all kinds of parameter, or one for each: feedback, feed-forward, bias.
fn step_sizes(name: &str, value: &Bound<'_, PyAny>) -> PyResult<StepSizes> {
    if let Ok(all) = value.extract::<f32>() {
        return Ok(StepSizes::uniform(all));
    }
    let [feedback, feed_forward, bias] = few::<3>(name, value)?.map(|x| x as f32);
    Ok(StepSizes {
        feedback,
        feed_forward,
        bias,
    })
}

/// Numbers of a rule, each finite and not below 0.
fn not_negative<const N: usize>(name: &str, values: [f32; N]) -> PyResult<()> {
    let wrong = |value: &f32| !(value.is_finite() && *value >= 0.0);
    match values.into_iter().find(wrong) {
        Some(value) => Err(refused(name, format!("is {value}"), "give 0 or more")),
        None => Ok(()),
    }
}

/// Names of the rules.
const RULES: [(&str, usize); 3] = [("paper", 0), ("guarded", 1), ("gauss-newton", 2)];

#[pymethods]
impl Learner {
    #[new]
    #[pyo3(signature = (
        network, rule="gauss-newton", *, steps=None, eps=None, ridge=None, prior=None
    ))]
    fn new(
        network: &Network,
        rule: &str,
        steps: Option<&Bound<'_, PyAny>>,
        eps: Option<&Bound<'_, PyAny>>,
        ridge: Option<&Bound<'_, PyAny>>,
        prior: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let unused = |name: &str, value: Option<&Bound<'_, PyAny>>| match value {
            Some(_) => Err(refused(
                name,
                format!("is of no use to rule '{rule}'"),
                "leave it out",
            )),
            None => Ok(()),
        };
        let sizes = |name: &str, value: Option<&Bound<'_, PyAny>>, usual: f32| {
            let sizes = value.map_or(Ok(StepSizes::uniform(usual)), |value| {
                step_sizes(name, value)
            })?;
            not_negative(name, [sizes.feedback, sizes.feed_forward, sizes.bias])?;
            Ok::<_, PyErr>(sizes)
        };
        let number = named("rule", rule, &RULES)?;
        if number == 2 {
            unused("steps", steps)?;
        } else {
            unused("ridge", ridge).and_then(|()| unused("prior", prior))?;
        }
        if number != 0 {
            unused("eps", eps)?;
        }
        let any = match number {
            0 => {
                let eps = sizes("eps", eps, 0.1)?;
                learner(network, Paper::new(sizes("steps", steps, 0.01)?, eps))
            }
            1 => learner(network, Guarded::new(sizes("steps", steps, 0.01)?)),
            _ => {
                let prior = prior.map_or(Ok(network.weights_of()), weights_of)?;
                let each = match ridge {
                    None => [1e-3; PARAMS],
                    Some(ridge) => match ridge.extract::<f32>() {
                        Ok(one) => [one; PARAMS],
                        Err(_) => few_f32("ridge", ridge)?,
                    },
                };
                not_negative("ridge", each)?;
                learner(network, GaussNewton::with_ridges(&prior, each))
            }
        };
        let rule = rule.to_owned();
        Ok(Self { any, rule })
    }

    /// Begins a pass: state, sensitivities and sums are 0.
    fn begin_pass(&mut self) {
        self.any.begin_pass();
    }

    /// One step; input: (3,), dt: s for which its output applies. False: it had a fault.
    fn step(&mut self, input: &Bound<'_, PyAny>, dt: f32) -> PyResult<bool> {
        Ok(self.any.step(few_f32("input", input)?, dt))
    }

    /// Closes a window. sum: (3,), the true error summed over it, in its unit times s.
    #[pyo3(signature = (sum, weight=1.0))]
    fn reference(&mut self, sum: &Bound<'_, PyAny>, weight: f32) -> PyResult<()> {
        self.any.reference(few_f32("sum", sum)?, weight);
        Ok(())
    }

    /// Drops the window since the last reference.
    fn skip(&mut self) {
        self.any.skip();
    }

    /// Ends the pass; the next one runs with new weights.
    fn end_pass(&mut self) -> Pass {
        self.any.end_pass().into()
    }

    /// A whole pass. inputs: (n, 3); a reference after each window of so many inputs.
    ///
    /// sums: (n // window, 3), as of reference(). weights: (n // window,), by default 1.
    /// A window with a fault is dropped.
    #[pyo3(signature = (inputs, sums, *, dt, window, weights=None))]
    fn run_pass<'py>(
        &mut self,
        py: Python<'py>,
        inputs: &Bound<'py, PyAny>,
        sums: &Bound<'py, PyAny>,
        dt: f32,
        window: usize,
        weights: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Pass> {
        let (inputs, sums) = (given::<f32>("inputs", inputs)?, given::<f32>("sums", sums)?);
        let weights = weights.map(|w| given::<f32>("weights", w)).transpose()?;
        let (inputs, sums) = (inputs.rows::<3>()?, sums.rows::<3>()?);
        let weights = weights.as_ref().map(|w| w.flat()).transpose()?;
        positive("dt", f64::from(dt))?;
        if window == 0 {
            return Err(refused("window", "is 0", "give 1 or more inputs"));
        }
        if inputs.len() / window != sums.len() {
            let problem = format!("has {} rows for {} inputs", sums.len(), inputs.len());
            return Err(refused(
                "sums",
                problem,
                "give one row for each whole window of inputs",
            ));
        }
        if weights.is_some_and(|weights| weights.len() != sums.len()) {
            return Err(refused(
                "weights",
                "are not one for each row of sums",
                "give (m,)",
            ));
        }
        self.any.begin_pass();
        // about as much time as a piece of a run without gradient
        let piece = (65_536 / window).max(1);
        for (from, sums) in (0..).step_by(piece).zip(sums.chunks(piece)) {
            let any = &mut self.any;
            py.detach(|| {
                for (k, sum) in (from..).zip(sums) {
                    let all = &inputs[k * window..(k + 1) * window];
                    let mut good = true;
                    all.iter().for_each(|input| good &= any.step(*input, dt));
                    if good {
                        any.reference(*sum, weights.map_or(1.0, |weights| weights[k]));
                    } else {
                        any.skip();
                    }
                }
            });
            py.check_signals()?;
        }
        Ok(self.any.end_pass().into())
    }

    /// The weights learnt so far, (63,).
    #[getter]
    fn proposal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.any.proposal().to_array())
    }

    /// The weights of the running or next pass, (63,).
    #[getter]
    fn candidate<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.any.candidate().to_array())
    }

    fn __repr__(&self) -> String {
        format!("Learner(rule='{}')", self.rule)
    }
}
