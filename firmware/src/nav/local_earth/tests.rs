use super::*;

/// The quantities within the surroundings against [`Local::at`] at the very place, with what the
/// head of the module says is left out.
#[test]
fn slopes_hold_to_the_ends_of_the_way() {
    let deg = core::f64::consts::PI / 180.0;
    for latitude in [
        0.0, 0.3, 45.0, -45.0, 60.0, 80.0, -80.0, 86.0, -88.0, 89.9, 89.98,
    ] {
        for height in [-5e3, 0.0, 1e3, 4e4] {
            let at = [from_f64(latitude * deg, ANGLE), from_f64(height, LENGTH)];
            let place = LocalEarth::new(at[0], at[1]);
            for (d, h) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1)] {
                let to = [at[0] + d * place.north, at[1] + h * UP];
                let phi = to_f64(to[0], ANGLE);
                let exact = Local::at(phi, to_f64(to[1], LENGTH));
                let here = place.here(to[0], to[1]);
                let [m, n] = here.curvature.map(|x| to_f64(x, CURVATURE));
                let off = (m * exact.m_h - 1.0).abs().max((n * exact.n_h - 1.0).abs());
                assert!(off < 3e-10, "radii at {latitude} {height} {d} {h}: {off:e}");
                let by_latitude = if h == 0 { 3e-11 } else { 3e-10 };
                assert!(
                    off < by_latitude,
                    "radii at {latitude} {height} {d} {h}: {off:e}"
                );
                let rate = here.earth_rate.map(|x| to_f64(x, RATE));
                let [north, _, down] = exact.omega_ie();
                let off = (rate[0] - north).abs().max((rate[1] - down).abs());
                assert!(off < 1e-13, "Earth rate at {latitude}: {off:e}");
                let off = (to_f64(here.gravity, RATE) - exact.g).abs();
                let bound = if h == 0 { 1.5e-10 } else { 1e-8 };
                assert!(
                    off < bound,
                    "gravity at {latitude} {height} {d} {h}: {off:e}"
                );
                let off = (to_f64(here.secant, SECANT) * exact.cos - 1.0).abs();
                let bound = if latitude.abs() <= 80.0 {
                    3e-11
                } else {
                    1.1e-9
                };
                assert!(off < bound, "secant at {latitude}: {off:e}");
                let off = (to_f64(here.tangent, SECANT) - exact.sin / exact.cos).abs();
                assert!(off * exact.cos < 2e-9, "tangent at {latitude}: {off:e}");
            }
        }
    }
}

/// Beyond the bound of the latitude the quantities stay in the range of factors.
#[test]
fn no_place_is_out_of_range() {
    let pole = LATITUDE;
    for latitude in [-2 * pole, -pole - 1, -pole, pole, pole + 1, 2 * pole] {
        for height in [-(1 << 58), 0, 1 << 58] {
            let mut place = LocalEarth::new(latitude, height);
            for d in [-place.north, 0, place.north, 1 << 50, -(1 << 50)] {
                let here = place.here(latitude + d, height);
                let all = here.curvature.into_iter().chain(here.earth_rate);
                for x in all.chain([here.secant, here.tangent, here.gravity]) {
                    assert!(x.abs() < 1 << 61, "{here:?}");
                }
            }
            assert!(place.follow(0, 0) || height == 0 && latitude == 0);
            assert!(!place.follow(place.north, UP));
            assert!(place.follow(2 * place.north, UP));
        }
    }
}
