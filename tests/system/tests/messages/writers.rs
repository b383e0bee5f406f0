//! Writes a simulated drive in every format.

use host_core::inertial::earth::Geodetic;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;
use std::path::Path;

/// Start position of the drive.
pub const ORIGIN: Geodetic = Geodetic {
    lat: 0.8,
    lon: 0.1,
    h: 300.0,
};

/// Six minutes with a tactical sensor, the first two at rest.
pub fn drive() -> Session {
    session(120.0, 240.0)
}

/// A tactical sensor at rest, and then in motion, for so many seconds.
pub fn session(standstill_s: f64, drive_s: f64) -> Session {
    let imu = ImuSpec::preset("tactical").unwrap();
    let config = SessionConfig {
        start: ORIGIN,
        heading: 0.4,
        ..SessionConfig::new(&imu, [standstill_s, drive_s], [1, 2, 3])
    };
    simulate(&config).0
}

/// A sample: its time in us from the start of the drive, and rates, forward-right-down.
pub type Sample = (i64, [f64; 3], [f64; 3]);

pub fn samples(session: &Session) -> Vec<Sample> {
    let step = (session.dt * 1e6).round() as i64;
    let increments = session.increments();
    let rate = |v: Vector3<f64>| (v / session.dt).into();
    let all = increments.iter().enumerate();
    all.map(|(k, i)| ((k as i64 + 1) * step, rate(i.dtheta), rate(i.dv)))
        .collect()
}

/// A fix: its time in us, latitude and longitude, deg, height, and velocity north, east, down.
pub type Fix = (i64, [f64; 3], [f64; 3]);

pub fn fixes(session: &Session) -> Vec<Fix> {
    let all = session.fixes.iter().enumerate();
    let fix = |(k, fix): (usize, &Option<host_core::inertial::gnss::Fix>)| {
        let fix = fix.as_ref()?;
        let p = fix.position;
        let position = [p.lat / DEG, p.lon / DEG, p.h];
        Some((k as i64 * 1_000_000, position, fix.velocity.into()))
    };
    all.filter_map(fix).collect()
}

/// Merges messages of several kinds, by time.
fn merged<T>(mut all: Vec<(i64, T)>) -> Vec<T> {
    all.sort_by_key(|(us, _)| *us);
    all.into_iter().map(|(_, message)| message).collect()
}

/// Writes `imu.csv`, `gnss.csv` and `header.toml`, with rates or increments.
pub fn csv(dir: &Path, session: &Session, rates: bool) {
    let mut imu = "t,gx,gy,gz,ax,ay,az\n".to_owned();
    let scale = if rates { 1.0 } else { session.dt };
    for (us, g, a) in samples(session) {
        write!(imu, "{}", us as f64 / 1e6).unwrap();
        for x in g.into_iter().chain(a) {
            write!(imu, ",{:?}", x * scale).unwrap();
        }
        imu.push('\n');
    }
    let mut gnss = "t,lat,lon,h,vn,ve,vd\n".to_owned();
    for (us, [lat, lon, h], [n, e, d]) in fixes(session) {
        let t = us as f64 / 1e6;
        writeln!(gnss, "{t},{lat:?},{lon:?},{h:?},{n:?},{e:?},{d:?}").unwrap();
    }
    let [gyro, accel] = if rates {
        ["rad/s", "m/s^2"]
    } else {
        ["rad", "m/s"]
    };
    let header = format!(
        "[imu]\nfile = 'imu.csv'\ntime = {{ column = 't', unit = 's' }}\n\
         gyro = {{ columns = ['gx', 'gy', 'gz'], unit = '{gyro}' }}\n\
         accel = {{ columns = ['ax', 'ay', 'az'], unit = '{accel}' }}\naxes = 'x y z'\n\
         [gnss]\nfile = 'gnss.csv'\ntime = {{ column = 't', unit = 's' }}\n\
         latitude = {{ column = 'lat', unit = 'deg' }}\n\
         longitude = {{ column = 'lon', unit = 'deg' }}\nheight = {{ column = 'h', unit = 'm' }}\n\
         velocity = {{ columns = ['vn', 've', 'vd'], unit = 'm/s', order = 'ned' }}\n\
         [start]\nstandstill_s = 120\n"
    );
    for (name, text) in [
        ("imu.csv", imu),
        ("gnss.csv", gnss),
        ("header.toml", header),
    ] {
        std::fs::write(dir.join(name), text).unwrap();
    }
}

fn prefixed(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// An MCAP file without chunks: magic, records of code, length and content, magic.
pub fn bag(session: &Session) -> Vec<u8> {
    bag_of(session, ["/imu", "/fix", "/vel"])
}

/// An MCAP file with the names of its topics: samples, fixes, velocities.
pub fn bag_of(session: &Session, [imu, fix, velocity]: [&str; 3]) -> Vec<u8> {
    const START: i64 = 1_700_000_000;
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let record = |code: u8, content: &[u8]| -> Vec<u8> {
        [&[code], &(content.len() as u64).to_le_bytes()[..], content].concat()
    };
    let cdr = |us: i64, head: &[u8], numbers: &[f64], tail: &[u8]| -> Vec<u8> {
        let second = (START + us / 1_000_000) as i32;
        let rest = (us % 1_000_000 * 1000) as u32;
        let mut body = [
            second.to_le_bytes(),
            rest.to_le_bytes(),
            1_u32.to_le_bytes(),
        ]
        .concat();
        body.push(0); // an empty name of the frame
        body.extend(head);
        body.resize(body.len().next_multiple_of(8), 0);
        body.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        [&[0, 1, 0, 0], &body[..], tail].concat()
    };
    let message = |channel: u16, us: i64, data: Vec<u8>| {
        let time = (START as u64 * 1_000_000 + us as u64) * 1000;
        let head = [
            &channel.to_le_bytes()[..],
            &[0; 4],
            &time.to_le_bytes(),
            &[0; 8],
        ]
        .concat();
        (us, record(5, &[head, data].concat()))
    };
    let mut all = Vec::new();
    for (us, [gx, gy, gz], [ax, ay, az]) in samples(session) {
        let mut numbers = vec![0.0; 37];
        // forward-left-up
        numbers[13..16].copy_from_slice(&[gx, -gy, -gz]);
        numbers[25..28].copy_from_slice(&[ax, -ay, -az]);
        all.push(message(1, us, cdr(us, &[], &numbers, &[])));
    }
    for (us, position, [n, e, d]) in fixes(session) {
        let mut numbers = position.to_vec();
        numbers.extend([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.25]);
        all.push(message(2, us, cdr(us, &[0, 1, 0], &numbers, &[2])));
        let twist = [e, n, -d, 0.0, 0.0, 0.0];
        all.push(message(3, us, cdr(us, &[], &twist, &[])));
    }
    let mut out = [
        MAGIC,
        &record(1, &[prefixed("ros2"), prefixed("")].concat()),
    ]
    .concat();
    for (id, topic, kind) in [
        (1_u16, imu, "sensor_msgs/msg/Imu"),
        (2, fix, "sensor_msgs/msg/NavSatFix"),
        (3, velocity, "geometry_msgs/msg/TwistStamped"),
    ] {
        let id = id.to_le_bytes();
        let schema = [
            &id[..],
            &prefixed(kind),
            &prefixed("ros2msg"),
            &prefixed(""),
        ]
        .concat();
        let channel = [&id[..], &id, &prefixed(topic), &prefixed("cdr"), &[0; 4]].concat();
        out.extend([record(3, &schema), record(4, &channel)].concat());
    }
    out.extend(merged(all).concat());
    [&out[..], &record(15, &[0; 4]), &record(2, &[0; 20]), MAGIC].concat()
}

/// A log of PX4 with increments.
pub fn ulog(session: &Session) -> Vec<u8> {
    const START: i64 = 7_000_000;
    let raw = |kind: u8, content: &[u8]| {
        [&(content.len() as u16).to_le_bytes()[..], &[kind], content].concat()
    };
    let floats = |values: &[f64]| -> Vec<u8> {
        values
            .iter()
            .flat_map(|x| (*x as f32).to_le_bytes())
            .collect()
    };
    let mut all = Vec::new();
    for (us, g, a) in samples(session) {
        let length = ((session.dt * 1e6).round() as u32).to_le_bytes();
        let values = g.into_iter().chain(a).map(|x| x * session.dt);
        let time = (START + us).to_le_bytes();
        let values = floats(&values.collect::<Vec<_>>());
        let parts = [&[0; 2], &time[..], &time, &values, &length, &length];
        all.push((us, raw(b'D', &parts.concat())));
    }
    for (us, [lat, lon, h], v) in fixes(session) {
        let time = (START + us).to_le_bytes();
        let position: Vec<u8> = [lat, lon, h].iter().flat_map(|x| x.to_le_bytes()).collect();
        // accuracies of two, one and three axes
        let values = [&[0.05 * 3.0_f64.sqrt(), 2.0_f64.sqrt(), 1.5], &v[..]].concat();
        let parts = [&[1, 0], &time[..], &position, &floats(&values), &[3, 1]];
        all.push((us, raw(b'D', &parts.concat())));
    }
    let mut out = b"\x55\x4C\x6F\x67\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    out.extend(raw(b'B', &[0; 40]));
    for (id, format) in [
        "vehicle_imu:uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;\
         float[3] delta_velocity;uint32_t delta_angle_dt;uint32_t delta_velocity_dt;",
        "vehicle_gps_position:uint64_t timestamp;double latitude_deg;double longitude_deg;\
         double altitude_ellipsoid_m;float s_variance_m_s;float eph;float epv;float vel_n_m_s;\
         float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;bool vel_ned_valid;",
    ]
    .iter()
    .enumerate()
    {
        out.extend(raw(b'F', format.as_bytes()));
        let topic = format.split(':').next().unwrap();
        all.insert(
            id,
            (
                -9,
                raw(b'A', &[&[0, id as u8, 0], topic.as_bytes()].concat()),
            ),
        );
    }
    out.extend(merged(all).concat());
    out
}

/// A UBX message.
fn message(class: u8, id: u8, payload: &[u8]) -> Vec<u8> {
    let body = [
        &[class, id],
        &(payload.len() as u16).to_le_bytes()[..],
        payload,
    ]
    .concat();
    let (mut a, mut b) = (0_u8, 0_u8);
    for byte in &body {
        a = a.wrapping_add(*byte);
        b = b.wrapping_add(a);
    }
    [&[0xB5, 0x62], &body[..], &[a, b]].concat()
}

/// Fixes of a receiver in UBX at GPS seconds of week from `week_s` on.
pub fn pvts(session: &Session, week_s: i64) -> Vec<(i64, Vec<u8>)> {
    let pvt = |(us, [lat, lon, h], v): Fix| {
        let mut payload = [0; 92];
        let whole = |x: f64| (x.round() as i32).to_le_bytes();
        let mut put = |at: usize, bytes: [u8; 4]| payload[at..at + 4].copy_from_slice(&bytes);
        put(0, ((week_s * 1000 + us / 1000) as u32).to_le_bytes());
        put(20, [3, 1, 0, 12]);
        put(24, whole(lon * 1e7));
        put(28, whole(lat * 1e7));
        put(32, whole(h * 1e3));
        put(40, whole(1414.0));
        put(44, whole(1500.0));
        for (axis, v) in v.into_iter().enumerate() {
            put(48 + 4 * axis, whole(v * 1e3));
        }
        put(68, whole(87.0));
        (us, message(1, 7, &payload))
    };
    fixes(session).into_iter().map(pvt).collect()
}

/// A log of a receiver with an IMU, whose clock ticks 25 600 times a second.
pub fn ubx(session: &Session) -> Vec<u8> {
    let mut all = Vec::new();
    for (us, [gx, gy, gz], [ax, ay, az]) in samples(session) {
        let tag = (us * 256 / 10_000) as u32;
        let counts = |x: f64, count: f64| (x / count).round() as i32;
        let gyro = |x: f64| counts(x, DEG / 4096.0);
        let accel = |x: f64| counts(x, 1.0 / 1024.0);
        // forward-left-up
        let values = [
            (14, gyro(gx)),
            (13, gyro(-gy)),
            (5, gyro(-gz)),
            (16, accel(ax)),
            (17, accel(-ay)),
            (18, accel(-az)),
        ];
        let mut payload = vec![0; 4];
        for (kind, value) in values {
            let data = u32::from_le_bytes(value.to_le_bytes()) & 0xFF_FFFF | kind << 24;
            payload.extend([data.to_le_bytes(), tag.to_le_bytes()].concat());
        }
        all.push((us, message(0x10, 3, &payload)));
    }
    all.extend(pvts(session, 100_000));
    merged(all).concat()
}

/// Writes `mav0`, with x of the room as north, y as west, and the axes of the MAV.
pub fn euroc(dir: &Path, session: &Session) {
    const START: i64 = 1_400_000_000_000_000_000;
    let mut imu = "#timestamp [ns],wx,wy,wz,ax,ay,az\n".to_owned();
    for (us, [gx, gy, gz], [ax, ay, az]) in samples(session) {
        // x up, y right, z forward
        let (gyro, accel) = ([-gz, gy, gx], [-az, ay, ax]);
        write!(imu, "{}", START + us * 1000).unwrap();
        gyro.into_iter()
            .chain(accel)
            .for_each(|x| write!(imu, ",{x:?}").unwrap());
        imu.push('\n');
    }
    let mut truth = "#timestamp,px,py,pz,qw,qx,qy,qz,vx,vy,vz\n".to_owned();
    let half = std::f64::consts::FRAC_PI_2;
    let x_down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 2.0 * half);
    // forward-right-down in axes of the MAV: x goes to z and z to -x
    let mav = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -half);
    for (k, state) in session.reference.iter().enumerate() {
        let ns = START + k as i64 * 1_000_000_000;
        let p = x_down * state.position.ned_from(&ORIGIN);
        let v = x_down * state.velocity;
        let q = x_down * state.q_bn * mav.inverse();
        write!(truth, "{ns}").unwrap();
        let numbers = [p.x, p.y, p.z, q.w, q.i, q.j, q.k, v.x, v.y, v.z];
        numbers
            .iter()
            .for_each(|x| write!(truth, ",{x:?}").unwrap());
        truth.push('\n');
    }
    for (name, text) in [("imu0", imu), ("state_groundtruth_estimate0", truth)] {
        let folder = dir.join("mav0").join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("data.csv"), text).unwrap();
    }
}
