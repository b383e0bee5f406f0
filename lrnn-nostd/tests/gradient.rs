//! The exact gradient against differences of the output.
use lrnn_nostd::*;
#[test]
fn quick() {
    let w = Weights::<f64>::from_fn(|i| ((i * 7919 % 101) as f64 / 101.0 - 0.5) * 0.9);
    let n = Normalisation::identity();
    let run = |w: Weights<f64>| {
        let net = Net::<Tanh, Identity, Full, f64>::new(w, n);
        let mut s = State::new();
        let mut g = Sensitivities::new();
        for k in 0..200 {
            let t = k as f64 * 0.1;
            let _ = net.step_gradient(&mut s, &mut g, [t.sin(), (1.3 * t).cos(), 0.5]);
        }
        (s.output(), *g.output())
    };
    let (_, g) = run(w);
    for i in 0..63 {
        let h = 1e-5;
        let mut a = w;
        a.set(i, w.get(i).unwrap() + h);
        let mut b = w;
        b.set(i, w.get(i).unwrap() - h);
        for j in 0..3 {
            let fd = (run(a).0[j] - run(b).0[j]) / (2.0 * h);
            assert!((fd - g[j][i]).abs() < 1e-8, "{i} {j} {fd} {}", g[j][i]);
        }
    }
}
