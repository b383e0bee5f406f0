//! Small vectors and quaternions, f64 and f32. A quaternion is `[w, x, y, z]`; `q_bn` turns body
//! vectors into north-east-down.

use lrnn_nostd::Real;

/// Three numbers, f64.
pub type V = [f64; 3];
/// Three numbers, f32.
pub type V32 = [f32; 3];
/// Quaternion, scalar first.
pub type Q = [f64; 4];

pub fn add<T: Real>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [a + x, b + y, c + z]
}

pub fn scale<T: Real>([a, b, c]: [T; 3], k: T) -> [T; 3] {
    [a * k, b * k, c * k]
}

pub fn cross<T: Real>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

pub fn dot<T: Real>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> T {
    a * x + b * y + c * z
}

pub fn narrow([a, b, c]: V) -> V32 {
    [a as f32, b as f32, c as f32]
}

pub fn widen([a, b, c]: V32) -> V {
    [f64::from(a), f64::from(b), f64::from(c)]
}

/// Whether all are numbers and finite.
pub fn finite(v: &[f64]) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// Quaternion of a rotation vector in rad; exact to f64 for any size.
pub fn from_rotvec(phi: V) -> Q {
    let n2 = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2];
    // cos(n/2) and sin(n/2)/n: the series is exact to f64 below 0.06 rad, where nearly all pieces
    // lie
    let (w, s) = if n2 < 3.6e-3 {
        (
            1.0 - n2 * (1.0 / 8.0) * (1.0 - n2 * (1.0 / 48.0) * (1.0 - n2 * (1.0 / 120.0))),
            0.5 - n2 * (1.0 / 48.0) * (1.0 - n2 * (1.0 / 80.0) * (1.0 - n2 * (1.0 / 168.0))),
        )
    } else {
        let n = libm::sqrt(n2);
        let (s, c) = libm::sincos(0.5 * n);
        (c, s / n)
    };
    let [x, y, z] = scale(phi, s);
    [w, x, y, z]
}

/// Quaternion product.
pub fn product([aw, ax, ay, az]: Q, [bw, bx, by, bz]: Q) -> Q {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

/// Brings a quaternion of nearly unit length to unit length: one Newton step.
pub fn renormalised([w, x, y, z]: Q) -> Q {
    let k = 1.5 - 0.5 * (w * w + x * x + y * y + z * z);
    [w * k, x * k, y * k, z * k]
}

/// `v` turned by `q`: `v + 2 q x (q x v + w v)`.
pub fn rotated([w, x, y, z]: Q, v: V) -> V {
    let axis = [x, y, z];
    let t = add(cross(axis, v), scale(v, w));
    let t = cross(axis, t);
    [v[0] + 2.0 * t[0], v[1] + 2.0 * t[1], v[2] + 2.0 * t[2]]
}

/// Rotation matrix, rows first.
pub fn matrix32([w, x, y, z]: [f32; 4]) -> [[f32; 3]; 3] {
    let (x2, y2, z2) = (x + x, y + y, z + z);
    [
        [1.0 - (y * y2 + z * z2), x * y2 - w * z2, x * z2 + w * y2],
        [x * y2 + w * z2, 1.0 - (x * x2 + z * z2), y * z2 - w * x2],
        [x * z2 - w * y2, y * z2 + w * x2, 1.0 - (x * x2 + y * y2)],
    ]
}
