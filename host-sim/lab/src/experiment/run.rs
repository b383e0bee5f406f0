//! The paper's experiment: learn on one drive, judge on another, and report. The paper judged on
//! the drive it learnt from, which is also possible.

mod device;

use crate::experiment::results::{Curve, Curves, ErrorTrace, Report, Results, Row, SCHEMA};
use host_core::error::Error;
use host_core::inertial::free_inertial::{FreeInertial, aligned_free_inertial};
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::{DEG_PER_H, UG};
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate_drive};
use host_estimation::analysis::error_bound::error_bound;
use host_estimation::learning::baseline::LinearModel;
use host_estimation::learning::corrected::estimates;
use host_estimation::learning::device::Device;
use host_estimation::learning::fit::{FittedNetworks, fit};
use host_estimation::learning::teacher::Assumptions;
use host_estimation::learning::window::{compensate, compensator};
use host_unit::scenario::{DriveSpec, Scenario};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Minutes of free-inertial navigation at which the table is taken, as in the paper.
pub const TIMES_MIN: [u32; 5] = [5, 10, 15, 20, 22];

/// Options beside the scenario.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether to judge on the learning session, as in the paper.
    pub in_sample: bool,
}

/// The two sessions of a run, ready to be simulated.
pub struct Sessions<'a> {
    scenario: &'a Scenario,
    imu: ImuSpec,
    unit: u64,
    learn: [u64; 2],
    test: [u64; 2],
    /// Seeds of further earlier drives.
    more: Vec<[u64; 2]>,
}

/// Draws the seeds of the device and of turn-on and road of both sessions.
#[must_use]
pub fn sessions(scenario: &Scenario, seed: u64) -> Sessions<'_> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut next = || rng.random();
    let (unit, learn, test) = (next(), [next(), next()], [next(), next()]);
    let more = (1..device::most_drives())
        .map(|_| [next(), next()])
        .collect();
    Sessions {
        scenario,
        imu: scenario.imu_spec(),
        unit,
        learn,
        test,
        more,
    }
}

impl Sessions<'_> {
    /// Simulates the session to learn from, or the one to be judged on.
    #[must_use]
    pub fn simulate(&self, learning: bool) -> Session {
        self.simulate_with_fixes(learning).0
    }

    /// The same with all fixes and their times of arrival, s after power-on. A session has only one
    /// fix a second.
    #[must_use]
    pub fn simulate_with_fixes(&self, learning: bool) -> (Session, Vec<(f64, Fix)>) {
        if learning {
            self.drive(&self.scenario.learn, self.learn)
        } else {
            self.drive(&self.scenario.test, self.test)
        }
    }

    fn drive(&self, drive: &DriveSpec, [turn_on, road]: [u64; 2]) -> (Session, Vec<(f64, Fix)>) {
        let s = self.scenario;
        let gnss = s.receiver();
        let config = SessionConfig {
            imu: &self.imu,
            gnss: &gnss,
            start: s.start(),
            heading: s.heading_deg.to_radians(),
            standstill_s: f64::from(drive.standstill_s),
            drive_s: f64::from(drive.drive_s),
            segments: (!drive.segment.is_empty()).then_some(&drive.segment),
            vibration: s.vibration,
            unit: self.unit,
            turn_on,
            drive: road,
        };
        let (mut session, drive) = simulate_drive(&s.vehicle(), &config);
        if let Some(wheels) = &s.wheels {
            let mut rng = ChaCha8Rng::seed_from_u64(road);
            rng.set_stream(OF_WHEELS);
            let speeds = wheels.speeds(&drive.truth.epochs, &mut rng);
            session.wheels = Some(speeds.into_iter().map(Some).collect());
        }
        let fixes = drive.timed_fixes(&gnss).into_iter();
        let fixes = fixes.filter_map(|(time, fix)| Some((time, fix?)));
        (session, fixes.collect())
    }
}

/// Number of the random stream of the wheels, beside that of the road.
const OF_WHEELS: u64 = 1;

/// Runs the experiment. `progress` is called with each stage.
///
/// # Errors
/// A scenario without a standstill, or whose standstill gives no attitude.
pub fn run(
    scenario: &Scenario,
    options: &Options,
    progress: &dyn Fn(&str),
) -> Result<Report, Error> {
    scenario.stands_first()?;
    scenario.one_fix_a_second("run")?;
    let sessions = sessions(scenario, options.seed);
    let imu = &sessions.imu;
    progress("simulating the drives");
    let (learn, test) = if options.in_sample {
        (sessions.simulate(true), None)
    } else {
        let (learn, test) = rayon::join(|| sessions.simulate(true), || sessions.simulate(false));
        (learn, Some(test))
    };
    progress("learning from the first drive");
    let assumptions = Assumptions::of(scenario.unit());
    let learnt = fit(
        &learn,
        &learn.increments(),
        assumptions,
        &scenario.network,
        learn.epochs(),
        !options.in_sample,
    )
    .ok_or_else(|| scenario.no_attitude())?;
    progress("navigating the second drive");
    let judged_on = test.as_ref().unwrap_or(&learn);
    let mut judged = judge(judged_on, &learnt).ok_or_else(|| scenario.no_attitude())?;
    let (mut in_force, mut course) = (vec![], None);
    if test.is_some() {
        progress("the device on earlier drives");
        for after in device::after_drives(&sessions, &learn, judged_on)? {
            judged.add(after.scheme, after.free);
            in_force.push(after.in_force);
            course = Some(after.course);
        }
    }
    let test = judged_on;

    let mut set_up = set_up(scenario, imu, options);
    let device = Device::of_unit(scenario.unit())?;
    let limit = device.configuration().correction.limit;
    set_up.push(("error bound".into(), error_bound(test, limit).1));
    let mut report = Report {
        title: title(scenario, options),
        results: Results {
            schema: SCHEMA,
            scenario: scenario.name.clone(),
            seed: options.seed,
            rows: judged.rows(),
            device: course,
        },
        set_up,
        notes: notes(&learnt, options)
            .into_iter()
            .chain(in_force)
            .collect(),
        curves: Curves {
            track: judged.tracks(test),
            error_over_time: judged.errors(),
            learning: learning_curves(&learnt),
            traces: traces(&learn, &learnt),
        },
        bench: None,
    };
    report.notes.push(
        "The vertical channel is damped with the reference height (a perfect barometer) in every scheme; the table is horizontal.".into(),
    );
    Ok(report)
}

/// All schemes on one session.
pub struct Judged {
    solutions: Vec<(&'static str, FreeInertial)>,
}

/// Self-alignment and free-inertial navigation with every scheme. Each corrects from power-on.
#[must_use]
pub fn judge(session: &Session, learnt: &FittedNetworks) -> Option<Judged> {
    let raw = session.increments();
    let linear = |m: &LinearModel| {
        raw.iter()
            .map(|w| m.correct(w, session.dt))
            .collect::<Vec<Increment>>()
    };
    let net = || {
        compensate(
            session,
            &compensator(session, &learnt.nets, &learnt.assumptions),
        )
        .session
        .increments()
    };
    let go = |increments: &[Increment]| aligned_free_inertial(session, increments);
    let ((a, b), (c, d)) = rayon::join(
        || rayon::join(|| go(&raw), || go(&linear(&learnt.bias))),
        || rayon::join(|| go(&linear(&learnt.linear)), || go(&net())),
    );
    Some(Judged {
        solutions: vec![("raw", a?), ("ls-bias", b?), ("ls-3x3", c?), ("rnn", d?)],
    })
}

impl Judged {
    /// Adds a scheme with its navigation over the same time.
    pub fn add(&mut self, scheme: &'static str, free: FreeInertial) {
        self.solutions.push((scheme, free));
    }

    /// The table's rows, as far as the free-inertial part lasts.
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let at = |t: u32| {
            self.solutions
                .iter()
                .filter_map(move |(scheme, c)| Row::of(c, scheme, 60 * t))
        };
        TIMES_MIN.iter().flat_map(|t| at(*t)).collect()
    }

    /// Horizontal error of a scheme at a time, m.
    #[must_use]
    pub fn horizontal(&self, scheme: &str, t_min: u32) -> Option<f64> {
        let (_, free) = self.solutions.iter().find(|(s, _)| *s == scheme)?;
        Row::of(free, scheme, 60 * t_min).map(|r| r.horizontal_m)
    }

    /// Horizontal error over minutes.
    #[must_use]
    pub fn errors(&self) -> Vec<Curve> {
        self.solutions
            .iter()
            .map(|(scheme, c)| {
                curve(
                    scheme,
                    c.position
                        .iter()
                        .enumerate()
                        .map(|(k, p)| (k as f64 / 60.0, p.xy().norm())),
                )
            })
            .collect()
    }

    /// Tracks, the reference first.
    #[must_use]
    pub fn tracks(&self, session: &Session) -> Vec<Curve> {
        let first = session.standstill;
        let origin = session.reference[first].position;
        let truth = session.reference[first..]
            .iter()
            .map(|s| s.position.ned_from(&origin))
            .map(|p| (p.y, p.x));
        let mut out = vec![curve("reference", truth)];
        out.extend(
            self.solutions
                .iter()
                .map(|(scheme, c)| curve(scheme, c.track.iter().map(|p| (p[1], p[0])))),
        );
        out
    }
}

/// A named curve from points.
fn curve(name: &str, points: impl Iterator<Item = (f64, f64)>) -> Curve {
    let (x, y) = points.unzip();
    Curve {
        name: name.to_string(),
        x,
        y,
    }
}

/// Cost of each network over the passes.
#[must_use]
pub fn learning_curves(learnt: &FittedNetworks) -> Vec<Curve> {
    let points = |cost: &[f64]| {
        cost.iter()
            .enumerate()
            .map(|(k, c)| ((k + 1) as f64, *c))
            .collect::<Vec<_>>()
    };
    ["gyros", "accelerometers"]
        .iter()
        .zip(&learnt.taught)
        .map(|(name, t)| curve(&format!("{name}: learnt from"), points(&t.cost).into_iter()))
        .collect()
}

/// True error, references and network output of the session learnt from, six axes.
#[must_use]
pub fn traces(session: &Session, learnt: &FittedNetworks) -> Vec<ErrorTrace> {
    let compensator = compensator(session, &learnt.nets, &learnt.assumptions);
    let estimates = estimates(session, &compensator);
    let t_min: Vec<f64> = (0..estimates.len()).map(|k| k as f64 / 60.0).collect();
    let mut out = Vec::new();
    for (triad, unit, k) in [("gyro", "deg/h", 0), ("accelerometer", "ug", 1)] {
        let si = if k == 0 { DEG_PER_H } else { UG };
        let pick = |e: &Increment, axis: usize| {
            if k == 0 {
                e.dtheta[axis] / si
            } else {
                e.dv[axis] / si
            }
        };
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let mut teacher = vec![f64::NAN; t_min.len()];
            for r in &learnt.references {
                teacher[r.epoch] = pick(&r.error, axis);
            }
            out.push(ErrorTrace {
                axis: format!("{triad} {name}"),
                unit: unit.to_string(),
                t_min: t_min.clone(),
                truth: session.systematic.as_ref().map_or(Vec::new(), |s| {
                    let errors: Vec<f64> =
                        s.iter().take(t_min.len()).map(|e| pick(e, axis)).collect();
                    running_median(&errors)
                }),
                teacher,
                network: estimates
                    .iter()
                    .map(|e| f64::from(e[k][axis]) / si)
                    .collect(),
            });
        }
    }
    out
}

/// Median over a minute around each second. It shows the slow error without the spikes by scale
/// factor and misalignment in turns.
fn running_median(x: &[f64]) -> Vec<f64> {
    const HALF: usize = 30;
    (0..x.len())
        .map(|k| {
            let mut near = x[k.saturating_sub(HALF)..(k + HALF + 1).min(x.len())].to_vec();
            let middle = near.len() / 2;
            *near.select_nth_unstable_by(middle, f64::total_cmp).1
        })
        .collect()
}

fn title(scenario: &Scenario, options: &Options) -> String {
    let how = if options.in_sample {
        "judged on the drive it learnt from"
    } else {
        "learnt on one drive, judged on another"
    };
    format!(
        "Free-inertial errors with and without compensation: scenario {}, seed {}, {how}",
        scenario.name, options.seed
    )
}

fn set_up(scenario: &Scenario, imu: &ImuSpec, options: &Options) -> Vec<(String, String)> {
    let drive = |d: &DriveSpec| {
        format!(
            "{} s standstill, then {} s of driving",
            d.standstill_s,
            d.duration_s()
        )
    };
    let n = &scenario.network;
    let mut out = vec![
        (
            "IMU".to_string(),
            format!("{}, {} samples/s", scenario.unit().name, imu.rate_hz),
        ),
        ("vehicle".into(), scenario.vehicle_name.to_string()),
        ("learning session".into(), drive(&scenario.learn)),
    ];
    if !options.in_sample {
        out.push((
            "test session".into(),
            format!("{}; new turn-on, other road", drive(&scenario.test)),
        ));
    }
    out.extend([
        ("fixes".into(), scenario.fixes()),
        ("networks".into(), "two of 3x3x3x3, f32, one step a second".into()),
        ("learning".into(), format!("windows of {} s, at most {} Gauss-Newton passes, weight sigma {}", n.window_s, n.passes, n.weight_sigma)),
        ("alignment".into(), "self-alignment in the inertial frame over the standstill, with each scheme's own corrected samples".into()),
    ]);
    out
}

/// Notes for the reader on the learning.
#[must_use]
pub fn notes(learnt: &FittedNetworks, options: &Options) -> Vec<String> {
    if options.in_sample {
        return vec![
            "In-sample, the paper's own protocol: learning and judgement share drive and turn-on, so these figures flatter every \
             scheme that learns. Run without --in-sample for the honest ones."
                .into(),
        ];
    }
    vec![learnt.verdict()]
}
