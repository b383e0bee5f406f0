//! Logs of receivers, written after the documentation of each protocol. Each has 20 epochs, a
//! second apart, of a vehicle that drives east at 10 m/s.

/// Epochs.
pub const EPOCHS: u32 = 20;
/// First epoch: Friday 27 November 2026, 12:00:00 UTC, as s of the GPS week.
pub const START: u32 = 5 * 86_400 + 43_200 + 18;
/// Place at the start, deg and m above the ellipsoid; 47 m of it is the geoid.
pub const PLACE: [f64; 3] = [47.5, 8.5, 448.0];
pub const EAST_MPS: f64 = 10.0;
const GEOID: f64 = 47.0;

/// Longitude after so many seconds, deg.
pub fn longitude(epoch: u32) -> f64 {
    let radius = 6_378_137.0 / (1.0 - 0.006_694_379_990_141 * square()).sqrt();
    let across = (radius + PLACE[2]) * PLACE[0].to_radians().cos();
    PLACE[1] + (EAST_MPS * f64::from(epoch) / across).to_degrees()
}

fn square() -> f64 {
    PLACE[0].to_radians().sin().powi(2)
}

/// Position and velocity in Earth-centred axes.
fn cartesian(epoch: u32) -> ([f64; 3], [f64; 3]) {
    let (lat, lon) = (PLACE[0].to_radians(), longitude(epoch).to_radians());
    let e2 = 0.006_694_379_990_141;
    let radius = 6_378_137.0 / (1.0 - e2 * square()).sqrt();
    let across = (radius + PLACE[2]) * lat.cos();
    let along = (radius * (1.0 - e2) + PLACE[2]) * lat.sin();
    let place = [across * lon.cos(), across * lon.sin(), along];
    (place, [-EAST_MPS * lon.sin(), EAST_MPS * lon.cos(), 0.0])
}

/// An epoch after another.
pub fn log(epoch: impl Fn(u32) -> Vec<u8>) -> Vec<u8> {
    (0..EPOCHS).flat_map(epoch).collect()
}

fn ms(epoch: u32) -> u32 {
    1000 * (START + epoch)
}

pub fn ubx(id: u8, payload: &[u8]) -> Vec<u8> {
    let mut message = vec![0xB5, 0x62, 1, id];
    message.extend((payload.len() as u16).to_le_bytes());
    message.extend(payload);
    let sum = message[2..].iter().fold([0u8; 2], |[a, b], byte| {
        let a = a.wrapping_add(*byte);
        [a, b.wrapping_add(a)]
    });
    message.extend(sum);
    message
}

/// A payload of `len` bytes with numbers at places.
fn payload(len: usize, numbers: &[(usize, i64)]) -> Vec<u8> {
    let mut bytes = vec![0; len];
    for (at, number) in numbers {
        bytes[*at..at + 4].copy_from_slice(&(*number as i32).to_le_bytes());
    }
    bytes
}

fn e7(degrees: f64) -> i64 {
    (degrees * 1e7).round() as i64
}

/// NAV-PVT of 92 bytes, or of 84.
pub fn pvt(epoch: u32, len: usize) -> Vec<u8> {
    let height = (PLACE[2] * 1e3) as i64;
    let mut body = payload(
        len,
        &[
            (0, ms(epoch).into()),
            (24, e7(longitude(epoch))),
            (28, e7(PLACE[0])),
            (32, height),
            (40, 1000),
            (44, 1500),
            (52, 10_000),
            (68, 100),
        ],
    );
    (body[20], body[21], body[23]) = (3, 1, 12);
    ubx(7, &body)
}

/// NAV-SAT, NAV-SIG or another long message.
pub fn long(id: u8, len: usize, epoch: u32) -> Vec<u8> {
    let mut body = payload(len, &[(0, ms(epoch).into())]);
    let rest = body[8..].iter_mut().enumerate();
    rest.for_each(|(at, byte)| *byte = (at * 37 + epoch as usize) as u8);
    ubx(id, &body)
}

pub fn posllh(epoch: u32) -> Vec<u8> {
    let height = (PLACE[2] * 1e3) as i64;
    let (lon, lat) = (e7(longitude(epoch)), e7(PLACE[0]));
    let at = [
        (0, ms(epoch).into()),
        (4, lon),
        (8, lat),
        (12, height),
        (20, 1000),
        (24, 1500),
    ];
    ubx(2, &payload(28, &at))
}

pub fn velned(epoch: u32) -> Vec<u8> {
    ubx(
        0x12,
        &payload(36, &[(0, ms(epoch).into()), (8, 1000), (28, 10)]),
    )
}

/// NAV-STATUS: a fix in three dimensions.
pub fn status(epoch: u32) -> Vec<u8> {
    let mut body = payload(16, &[(0, ms(epoch).into())]);
    (body[4], body[5]) = (3, 1);
    ubx(3, &body)
}

/// NAV-POSECEF and NAV-VELECEF.
pub fn ecef(epoch: u32) -> Vec<u8> {
    let (place, velocity) = cartesian(epoch);
    let message = |id, xyz: [f64; 3], accuracy| {
        let cm = xyz.map(|v| (v * 100.0).round() as i64);
        let at = [
            (0, ms(epoch).into()),
            (4, cm[0]),
            (8, cm[1]),
            (12, cm[2]),
            (16, accuracy),
        ];
        ubx(id, &payload(20, &at))
    };
    [message(1, place, 173), message(0x11, velocity, 10)].concat()
}

pub fn hpposllh(epoch: u32) -> Vec<u8> {
    let lon = longitude(epoch);
    let whole = e7(lon);
    let rest = ((lon - whole as f64 * 1e-7) * 1e9).round() as i8;
    let height = (PLACE[2] * 1e3) as i64;
    let at = [
        (4, ms(epoch).into()),
        (8, whole),
        (12, e7(PLACE[0])),
        (16, height),
        (28, 140),
        (32, 210),
    ];
    let mut body = payload(36, &at);
    body[24] = rest as u8;
    ubx(0x14, &body)
}

/// A sentence with its checksum, without an end of the line.
pub fn sentence(text: &str) -> String {
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${text}*{sum:02X}")
}

/// Sentences of an epoch, without an end of the line.
pub fn nmea(epoch: u32, talker: &str, kinds: &[&str]) -> Vec<String> {
    let second = START - 18 + epoch;
    let (h, m, s) = (second / 3600 % 24, second / 60 % 60, second % 60);
    let time = format!("{h:02}{m:02}{s:02}.00");
    let angle = |degrees: f64| format!("{:.7}", degrees.trunc() * 100.0 + degrees.fract() * 60.0);
    let place = format!("{},N,00{},E", angle(PLACE[0]), angle(longitude(epoch)));
    let sentences = kinds.iter().map(|kind| match *kind {
        "GGA" => format!(
            "{talker}GGA,{time},{place},1,12,0.7,{:.3},M,{GEOID:.3},M,,",
            PLACE[2] - GEOID
        ),
        "RMC" => format!(
            "{talker}RMC,{time},A,{place},{:.3},90.00,271126,,,A",
            EAST_MPS * 3600.0 / 1852.0
        ),
        "GLL" => format!("{talker}GLL,{place},{time},A,A"),
        "VTG" => format!(
            "{talker}VTG,90.00,T,,M,{:.3},N,{:.3},K,A",
            EAST_MPS * 3600.0 / 1852.0,
            EAST_MPS * 3.6
        ),
        "ZDA" => format!("{talker}ZDA,{time},27,11,2026,00,00"),
        "GST" => format!("{talker}GST,{time},1.0,,,,0.7,0.7,1.2"),
        other => panic!("{other}"),
    });
    sentences.map(|text| sentence(&text)).collect()
}

/// These lines with an end.
pub fn lines(lines: &[String], end: &str) -> Vec<u8> {
    lines.iter().fold(Vec::new(), |mut bytes, line| {
        bytes.extend(line.bytes());
        bytes.extend(end.bytes());
        bytes
    })
}

fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |mut crc, &byte| {
        crc ^= u16::from(byte) << 8;
        for _ in 0..8 {
            crc = (crc << 1) ^ if crc & 0x8000 != 0 { 0x1021 } else { 0 };
        }
        crc
    })
}

pub fn sbf(id: u16, body: &[u8]) -> Vec<u8> {
    let len = (body.len() + 8).next_multiple_of(4);
    let mut rest = id.to_le_bytes().to_vec();
    rest.extend((len as u16).to_le_bytes());
    rest.extend(body);
    rest.resize(len - 4, 0);
    let mut block = b"$@".to_vec();
    block.extend(crc16(&rest).to_le_bytes());
    block.extend(rest);
    block
}

/// PVTGeodetic, or PVTCartesian, of revision 2.
pub fn pvt_block(epoch: u32, geodetic: bool) -> Vec<u8> {
    let mut body = ms(epoch).to_le_bytes().to_vec();
    body.extend([0x60, 9, 1, 0]);
    let (place, velocity) = match geodetic {
        true => {
            let angles = [
                PLACE[0].to_radians(),
                longitude(epoch).to_radians(),
                PLACE[2],
            ];
            (angles, [0.0, EAST_MPS, 0.0])
        }
        false => cartesian(epoch),
    };
    body.extend(place.iter().flat_map(|v| v.to_le_bytes()));
    body.extend(47.0_f32.to_le_bytes());
    body.extend(velocity.iter().flat_map(|v| (*v as f32).to_le_bytes()));
    body.extend((-2e10_f32).to_le_bytes());
    body.resize(80, 0);
    body.extend([200, 0, 200, 0, 44, 1, 0, 0]); // latency, 2 m, 3 m
    sbf(if geodetic { 4007 } else { 4006 } | 2 << 13, &body)
}

pub fn long_block(id: u16, len: usize, epoch: u32) -> Vec<u8> {
    let mut body = ms(epoch).to_le_bytes().to_vec();
    body.extend([0x60, 9]);
    body.extend((0..len).map(|at| (at * 41 + epoch as usize) as u8));
    sbf(id, &body)
}

fn crc32(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 }
        })
    })
}

/// A position and a velocity: BESTPOS and BESTVEL, or PSRPOS and PSRVEL. Name and fields.
fn novatel_logs(epoch: u32, solution: &str) -> [(String, String); 2] {
    let (lat, lon, sea) = (PLACE[0], longitude(epoch), PLACE[2] - GEOID);
    [
        (
            format!("{solution}POS"),
            format!(
                "SOL_COMPUTED,SINGLE,{lat:.11},{lon:.11},{sea:.4},{GEOID:.4},WGS84,0.7000,0.7000,1.2000,\"\",0.000,0.000,12,12,12,12,00,06,00,33"
            ),
        ),
        (
            format!("{solution}VEL"),
            format!("SOL_COMPUTED,DOPPLER_VELOCITY,0.000,0.000,{EAST_MPS:.4},90.000000,0.0000,0.0"),
        ),
    ]
}

/// A log in text.
fn novatel_text(epoch: u32, name: &str, fields: &str) -> String {
    let second = START + epoch;
    let log =
        format!("{name}A,COM1,0,60.5,FINESTEERING,2446,{second}.000,02000000,cdba,32768;{fields}");
    format!("#{log}*{:08x}\r\n", crc32(log.as_bytes()))
}

/// BESTPOSA and BESTVELA, or PSRPOSA and PSRVELA.
pub fn novatel(epoch: u32, solution: &str) -> Vec<u8> {
    let logs = novatel_logs(epoch, solution);
    let texts = logs.map(|(name, fields)| novatel_text(epoch, &name, &fields));
    texts.concat().into_bytes()
}

/// The same in abbreviated text.
pub fn abbreviated(epoch: u32) -> Vec<u8> {
    let second = START + epoch;
    let logs = novatel_logs(epoch, "BEST").map(|(name, fields)| {
        format!(
            "<{name} COM1 0 60.5 FINESTEERING 2446 {second}.000 02000000 cdba 32768\r\n<     {}\r\n",
            fields.replace(',', " ")
        )
    });
    logs.concat().into_bytes()
}

/// BESTXYZB.
pub fn bestxyz(epoch: u32) -> Vec<u8> {
    let (place, velocity) = cartesian(epoch);
    let mut log = vec![0xAA, 0x44, 0x12, 28, 241, 0, 0, 0x20, 112, 0, 0, 0, 0, 180];
    log.extend(2446_u16.to_le_bytes());
    log.extend(ms(epoch).to_le_bytes());
    log.resize(28, 0);
    for (at, kind) in [(place, 16_u32), (velocity, 8)] {
        log.extend([0; 4]);
        log.extend(kind.to_le_bytes());
        log.extend(at.iter().flat_map(|v| v.to_le_bytes()));
        log.extend([1.0_f32; 3].iter().flat_map(|v| v.to_le_bytes()));
    }
    log.resize(28 + 112, 0);
    log.extend(crc32(&log).to_le_bytes());
    log
}

/// BESTXYZA, which is longer than 256 bytes.
pub fn bestxyz_in_text(epoch: u32) -> Vec<u8> {
    let ([x, y, z], [vx, vy, vz]) = cartesian(epoch);
    let fields = format!(
        "SOL_COMPUTED,SINGLE,{x:.4},{y:.4},{z:.4},1.0000,1.0000,1.0000,SOL_COMPUTED,DOPPLER_VELOCITY,{vx:.4},{vy:.4},{vz:.4},0.1000,0.1000,0.1000,\"AAAA\",0.000,0.000,0.000,12,12,12,12,0,06,00,33"
    );
    novatel_text(epoch, "BESTXYZ", &fields).into_bytes()
}
