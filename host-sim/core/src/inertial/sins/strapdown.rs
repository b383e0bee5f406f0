//! The strapdown step, of one navigator or of several side by side: for increments that are
//! compensated already.

use crate::inertial::earth::{Geodetic, Local};
use crate::inertial::lane::{
    Lane, Q, V3, add, after, at, cross, in_start_axes, minus, rotation, scaled, size_squared, sub,
    turned,
};
use crate::inertial::sins::{HeightLoop, Increment, NavState, Sins, outside};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// The [`NavState`] of each navigator.
#[derive(Clone, Copy)]
pub(in crate::inertial) struct States<L: Lane> {
    /// Latitude and longitude, rad, and height, m.
    pub(in crate::inertial) position: V3<L>,
    pub(in crate::inertial) velocity: V3<L>,
    pub(in crate::inertial) q_bn: Q<L>,
}

impl<L: Lane> States<L> {
    /// `state(l)` is that of navigator number `l`.
    #[inline(always)]
    pub(in crate::inertial) fn of<'a>(
        kind: L::Kind,
        state: impl Fn(usize) -> &'a NavState,
    ) -> Self {
        let coords = |i: usize| L::of(kind, |l| state(l).q_bn.coords[i]);
        Self {
            position: L::gathered(kind, |l| {
                let at = state(l).position;
                Vector3::new(at.lat, at.lon, at.h)
            }),
            velocity: L::gathered(kind, |l| state(l).velocity),
            q_bn: [coords(0), coords(1), coords(2), coords(3)],
        }
    }

    /// The state of navigator `l`.
    #[inline(always)]
    pub(in crate::inertial) fn state(&self, l: usize) -> NavState {
        let [lat, lon, h] = at(&self.position, l).into();
        let [i, j, k, w] = self.q_bn;
        let q = Quaternion::new(w.at(l), i.at(l), j.at(l), k.at(l));
        NavState {
            position: Geodetic { lat, lon, h },
            velocity: at(&self.velocity, l),
            q_bn: UnitQuaternion::new_unchecked(q),
        }
    }

    /// Subtracts the errors `e` (attitude, velocity, position).
    #[inline(always)]
    pub(in crate::inertial) fn displace(&mut self, e: &[L]) {
        let q = after(&rotation(&[e[0], e[1], e[2]]), &self.q_bn);
        self.q_bn = renormalised(&q);
        let [lat, lon, h] = self.position;
        let here = Local::at(lat, h);
        self.position = [
            lat + -e[6] * here.lat_per_m,
            lon + -e[7] * here.lon_per_m,
            h - -e[8],
        ];
        self.velocity = sub(&self.velocity, &[e[3], e[4], e[5]]);
    }

    /// [`Sins::damp_height`] of each navigator. `heights`: those of the barometer, m.
    #[inline(always)]
    pub(in crate::inertial) fn damp_height(&mut self, loop_: &HeightLoop, heights: L, dt: f64) {
        let error = self.position[2] - heights;
        self.position[2] -= error * (2.0 / loop_.time_s) * dt;
        self.velocity[2] += error * dt / (loop_.time_s * loop_.time_s);
    }
}

/// One navigator, or several side by side.
pub(in crate::inertial) struct Strapdown<L: Lane> {
    pub(in crate::inertial) nav: States<L>,
    half_change: V3<L>,
    earth: Local<L>,
    /// Navigators that have come too close to a pole, one bit each.
    polar: u8,
}

impl<L: Lane> Strapdown<L> {
    /// `navigator(l)` is the navigator number `l`.
    #[inline(always)]
    pub(in crate::inertial) fn of<'a>(
        kind: L::Kind,
        navigator: impl Fn(usize) -> &'a Sins,
    ) -> Self {
        let earth = |l: usize| &navigator(l).earth;
        let mut polar = 0;
        for l in 0..L::PLACES {
            polar |= u8::from(navigator(l).polar) << l;
        }
        Self {
            nav: States::of(kind, |l| &navigator(l).nav),
            half_change: L::gathered(kind, |l| navigator(l).half_change),
            earth: Local {
                sin_lat: L::of(kind, |l| earth(l).sin_lat),
                cos_lat: L::of(kind, |l| earth(l).cos_lat),
                m_h: L::of(kind, |l| earth(l).m_h),
                n_h: L::of(kind, |l| earth(l).n_h),
                lat_per_m: L::of(kind, |l| earth(l).lat_per_m),
                lon_per_m: L::of(kind, |l| earth(l).lon_per_m),
                g: L::of(kind, |l| earth(l).g),
            },
            polar,
        }
    }

    /// Writes navigator `l` back. `previous`: its last increments.
    #[inline(always)]
    pub(in crate::inertial) fn give(&self, l: usize, to: &mut Sins, previous: [Increment; 2]) {
        to.nav = self.nav.state(l);
        to.previous = previous;
        to.half_change = at(&self.half_change, l);
        to.earth = Local {
            sin_lat: self.earth.sin_lat.at(l),
            cos_lat: self.earth.cos_lat.at(l),
            m_h: self.earth.m_h.at(l),
            n_h: self.earth.n_h.at(l),
            lat_per_m: self.earth.lat_per_m.at(l),
            lon_per_m: self.earth.lon_per_m.at(l),
            g: self.earth.g.at(l),
        };
        to.polar = self.polar >> l & 1 == 1;
    }

    /// Advances each by an increment of `dt` seconds.
    #[inline(always)]
    pub(in crate::inertial) fn step(&mut self, dtheta: &V3<L>, dv: &V3<L>, dt: f64) {
        // Earth and velocity at the middle of the increment. The Earth is computed one increment
        // ahead, for a position that is wrong by acceleration times dt^2, some micrometres to
        // millimetres. So the value is ready when needed, and its computation overlaps with the
        // rest of the step.
        let States {
            position: [lat, lon, h],
            velocity,
            q_bn,
        } = self.nav;
        let mid = self.earth;
        self.earth = Local::at(
            lat + velocity[0] * (1.5 * dt) * mid.lat_per_m,
            h - velocity[2] * (1.5 * dt),
        );
        let v_mid = add(&velocity, &self.half_change);
        let omega_ie = mid.earth_rate();
        let omega_en = mid.transport_rate(&v_mid);
        let zeta = scaled(&add(&omega_ie, &omega_en), dt);
        let dv_n = turned(&q_bn, &in_start_axes(dtheta, dv));
        let dv_n = sub(&dv_n, &scaled(&cross(&zeta, &dv_n), 0.5));
        let whole = add(&scaled(&omega_ie, 2.0), &omega_en);
        let zero = L::all(mid.g.kind(), 0.0);
        let gravity = [zero, zero, mid.g];
        let gravity_coriolis = sub(&gravity, &cross(&whole, &v_mid));
        let change = add(&dv_n, &scaled(&gravity_coriolis, dt));
        let v_mean = add(&velocity, &scaled(&change, 0.5));
        self.nav.position = [
            lat + v_mean[0] * dt * mid.lat_per_m,
            lon + v_mean[1] * dt * mid.lon_per_m,
            h - v_mean[2] * dt,
        ];
        self.nav.velocity = add(&velocity, &change);
        let q = after(&rotation(&minus(&zeta)), &q_bn);
        self.nav.q_bn = renormalised(&after(&q, &rotation(dtheta)));
        self.half_change = scaled(&change, 0.5);
        for l in 0..L::PLACES {
            self.polar |= u8::from(outside(self.nav.position[0].at(l))) << l;
        }
    }
}

/// A quaternion of length one, made of one that is near it.
#[inline(always)]
fn renormalised<L: Lane>(q: &Q<L>) -> Q<L> {
    let by = (L::all(q[0].kind(), 3.0) - size_squared(q)) * 0.5;
    [q[0] * by, q[1] * by, q[2] * by, q[3] * by]
}
