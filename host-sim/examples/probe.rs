//! scratch
use host_sim::ekf::*;
use host_sim::session::*;
use host_sim::teacher::*;
use host_sim::units::*;
use host_sim::*;
fn main() {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|s| s.parse().ok())
        .unwrap_or(4);
    let preset = std::env::args().nth(2).unwrap_or("medium".into());
    let spec = imu::ImuSpec::preset(&preset).unwrap();
    let sc = scenario::Scenario::default();
    let mut all: Vec<Vec<f64>> = vec![];
    for seed in 0..runs {
        let t0 = std::time::Instant::now();
        let cfg = |turn_on, drive, drive_s| SessionConfig {
            imu: &spec,
            gnss: &sc.gnss,
            start: sc.start(),
            heading: 0.6,
            standstill_s: 300.0,
            drive_s,
            segments: None,
            vibration: 1.0,
            unit: 1000 + seed,
            turn_on,
            drive,
        };
        let (learn, test) = rayon::join(
            || simulate(&cfg(seed * 10 + 1, seed * 10 + 3, 1800.0)).0,
            || simulate(&cfg(seed * 10 + 2, seed * 10 + 4, 1320.0)).0,
        );
        let t1 = t0.elapsed();
        let noise = Noise {
            gyro: spec.gyro.angle_random_walk_dpsqrth * DEG_PER_SQRT_H,
            accel: spec.accel.velocity_random_walk_ugpsqrthz * UG,
        };
        let mut a = Assumptions {
            prior: Prior::of(&spec),
            noise,
        };
        if let Ok(q) = std::env::var("Q") {
            a.prior.walk_per_hour = q.parse().unwrap();
        }
        let mut ns = sc.network.clone();
        if let Ok(q) = std::env::var("WS") {
            ns.weight_sigma = q.parse().unwrap();
        }
        if let Ok(q) = std::env::var("CORR") {
            ns.correlation_s = q.parse().unwrap();
        }
        if let Ok(q) = std::env::var("NSEED") {
            ns.seed = q.parse().unwrap();
        }
        let st = study::study(&learn, a, &ns, learn.epochs(), true).unwrap();
        let t2 = t0.elapsed();
        // how well do teacher, ls, net know the truth in the learning session (last minute), deg/h and ug
        if runs <= 4 {
            let sys = learn.systematic.as_ref().unwrap();
            let lc = learning::compensate(&learn, &learning::compensator(&learn, &st.nets, &a));
            for r in st.references.iter().step_by(200) {
                let e = &sys[r.epoch];
                let n = lc.estimates[r.epoch];
                println!(
                    "{:5} gyro true {:6.3} {:6.3} {:6.3} teach {:6.3} {:6.3} {:6.3} net {:6.3} {:6.3} {:6.3} | acc true {:5.0} {:5.0} {:5.0} teach {:5.0} {:5.0} {:5.0} net {:5.0} {:5.0} {:5.0}",
                    r.epoch,
                    e.dtheta.x / DEG_PER_H,
                    e.dtheta.y / DEG_PER_H,
                    e.dtheta.z / DEG_PER_H,
                    r.error.dtheta.x / DEG_PER_H,
                    r.error.dtheta.y / DEG_PER_H,
                    r.error.dtheta.z / DEG_PER_H,
                    n[0][0] as f64 / DEG_PER_H,
                    n[0][1] as f64 / DEG_PER_H,
                    n[0][2] as f64 / DEG_PER_H,
                    e.dv.x / UG,
                    e.dv.y / UG,
                    e.dv.z / UG,
                    r.error.dv.x / UG,
                    r.error.dv.y / UG,
                    r.error.dv.z / UG,
                    n[1][0] as f64 / UG,
                    n[1][1] as f64 / UG,
                    n[1][2] as f64 / UG
                );
            }
            println!(
                "cost g {:?}\ncost a {:?}",
                st.taught[0].cost, st.taught[1].cost
            );
        }
        let raw = test.increments();
        let lin = |m: &baseline::LinearModel| {
            raw.iter()
                .map(|w| m.correct(w, test.dt))
                .collect::<Vec<_>>()
        };
        let net = learning::compensate(&test, &learning::compensator(&test, &st.nets, &a))
            .session
            .increments();
        let sysv = test.systematic.as_ref().unwrap();
        let n = test.words_per_epoch();
        let floor: Vec<_> = raw
            .iter()
            .enumerate()
            .map(|(k, w)| {
                let e = &sysv[k / n];
                sins::Increment {
                    dtheta: w.dtheta - e.dtheta * test.dt,
                    dv: w.dv - e.dv * test.dt,
                }
            })
            .collect();
        // only constant turn-on part unknown: mean systematic error of learn session as function of time since power-on
        let ls = learn.systematic.as_ref().unwrap();
        let smooth = |k: usize| {
            let a = (k.max(30)) - 30;
            let b = (k + 30).min(ls.len());
            let mut s = sins::Increment::default();
            for e in &ls[a..b] {
                s.dtheta += e.dtheta;
                s.dv += e.dv;
            }
            let m = (b - a) as f64;
            sins::Increment {
                dtheta: s.dtheta / m,
                dv: s.dv / m,
            }
        };
        let curve: Vec<_> = (0..test.epochs() + 1).map(smooth).collect();
        let timed: Vec<_> = raw
            .iter()
            .enumerate()
            .map(|(k, w)| {
                let e = &curve[k / n];
                sins::Increment {
                    dtheta: w.dtheta - e.dtheta * test.dt,
                    dv: w.dv - e.dv * test.dt,
                }
            })
            .collect();
        let mut res = vec![];
        for w in [&raw, &lin(&st.bias), &lin(&st.linear), &net, &floor, &timed] {
            let c = coast::align_and_coast(&test, w).unwrap();
            res.push(c.row("", 22).unwrap().horizontal_m);
        }
        println!(
            "seed {seed} 22min: raw {:6.0} bias {:6.0} 3x3 {:6.0} rnn {:6.0} floor {:6.0} timed {:6.0} {:?} {:?}  sim {:?} study {:?} all {:?}",
            res[0],
            res[1],
            res[2],
            res[3],
            res[4],
            res[5],
            st.promoted,
            st.evidence.iter().map(|e| e.1).collect::<Vec<_>>(),
            t1,
            t2 - t1,
            t0.elapsed()
        );
        all.push(res);
    }
    for i in 0..6 {
        let mut v: Vec<f64> = all.iter().map(|r| r[i]).collect();
        v.sort_by(f64::total_cmp);
        println!(
            "{} median {:.0} mean {:.0} max {:.0}",
            ["raw", "bias", "3x3", "rnn", "floor", "timed"][i],
            v[v.len() / 2],
            v.iter().sum::<f64>() / v.len() as f64,
            v[v.len() - 1]
        );
    }
}
