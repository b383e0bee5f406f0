//! Names of columns that several formats share.

/// Increments of the IMU with the time of their end.
pub const IMU: [&str; 7] = [
    "t_s",
    "dtheta_x_rad",
    "dtheta_y_rad",
    "dtheta_z_rad",
    "dv_x_mps",
    "dv_y_mps",
    "dv_z_mps",
];
/// Position of a fix or state.
pub(crate) const POSITION: [&str; 4] = ["t_s", "lat_deg", "lon_deg", "height_m"];
/// Velocity of a fix or state.
pub(crate) const VELOCITY: [&str; 3] = ["v_north_mps", "v_east_mps", "v_down_mps"];
/// Standard deviations of position.
pub(crate) const SIGMA: [&str; 3] = ["sigma_north_m", "sigma_east_m", "sigma_down_m"];
/// Standard deviations of velocity.
pub(crate) const SIGMA_V: [&str; 3] = ["sigma_v_north_mps", "sigma_v_east_mps", "sigma_v_down_mps"];
