//! Simulations without `[ambient]` and `[power]` stay the same, bit for bit.

use super::imu::ImuSpec;
use super::session::{SessionConfig, simulate};

/// FNV-1a over the samples and the systematic errors of a drive of two minutes.
fn digest(preset: &str) -> u64 {
    let imu = ImuSpec::preset(preset).unwrap();
    let config = SessionConfig {
        heading: 0.3,
        ..SessionConfig::new(&imu, [30.0, 90.0], [11, 12, 13])
    };
    let (session, _) = simulate(&config);
    let counts = session.counts.iter().flat_map(|c| {
        let all = c.dtheta.into_iter().chain(c.dv);
        all.map(|x| u64::from(x as u32)).collect::<Vec<_>>()
    });
    let errors = session.systematic.iter().flatten().flat_map(|e| {
        let all = e.dtheta.iter().chain(&e.dv);
        all.map(|x| x.to_bits()).collect::<Vec<_>>()
    });
    counts.chain(errors).fold(0xcbf2_9ce4_8422_2325, |hash, x| {
        (hash ^ x).wrapping_mul(0x0100_0000_01b3)
    })
}

#[test]
fn the_old_presets_keep_every_bit() {
    let got = ["medium", "nav", "tactical"].map(digest);
    // of the Earth by series; the simulation is that before `[ambient]` and `[power]`
    let before = [
        0x5dc7_0fcc_80a4_de7f,
        0x2c01_e906_a292_5c1d,
        0xb1ee_7543_3df0_2931,
    ];
    assert_eq!(got, before, "{got:#x?}");
}
