//! Faults in words, and what the optional features add.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use lrnn_nostd::Fault;

#[test]
fn a_fault_is_an_error_in_words() {
    let all = [
        Fault::NonFiniteInput,
        Fault::Overflow,
        Fault::SensitivityOverflow,
    ];
    let words = all.map(|fault| Box::<dyn std::error::Error>::from(fault).to_string());
    for (k, text) in words.iter().enumerate() {
        assert!(text.len() > 20 && !words[..k].contains(text), "{text}");
    }
    assert!(words[0].starts_with("an input is infinite or NaN"));
}

#[cfg(feature = "serde")]
mod serde {
    use lrnn_nostd::{Net, Normalisation, State, Step, Weights};

    /// Weights, scales and a state that are read back go on with the same bits.
    #[test]
    fn a_run_goes_on_after_a_round_trip() {
        let scales = Normalisation {
            output_scale: [1e-5; 3],
            ..Normalisation::identity()
        };
        let net: Net = Net::new(Weights::from_fn(|i| 0.01 * i as f32 - 0.3), scales);
        let mut state = State::new();
        let _ = net.step(&mut state, [0.3, -0.2, 0.1]);
        let mut bytes = [0; 512];
        let kept =
            postcard::to_slice(&(net.weights, net.normalisation, state), &mut bytes).unwrap();
        let (weights, scales, mut again): (Weights, Normalisation, State) =
            postcard::from_bytes(kept).unwrap();
        let other: Net = Net::new(weights, scales);
        let step = net.step(&mut state, [0.1; 3]);
        assert_eq!(other.step(&mut again, [0.1; 3]), step);
        let kept = postcard::to_slice(&step, &mut bytes).unwrap();
        assert_eq!(postcard::from_bytes::<Step>(kept).unwrap(), step);
    }

    #[test]
    fn a_state_that_is_not_finite_is_refused() {
        let mut bytes = [0; 36];
        assert!(postcard::from_bytes::<State>(&bytes).is_ok());
        bytes[16..20].copy_from_slice(&f32::INFINITY.to_le_bytes());
        assert!(postcard::from_bytes::<State>(&bytes).is_err());
    }
}
