//! The commands of docs/your-data.md run as they are written, one after the other, on one drive in
//! the files that the page names.

use super::host_sim;
use crate::writers::{bag_of, csv, drive, euroc, ubx, ulog};
use std::path::Path;

const PAGE: &str = include_str!("../../../../docs/your-data.md");

/// The lines of the page that are commands.
fn commands() -> Vec<&'static str> {
    let indented = PAGE.lines().filter_map(|line| line.strip_prefix("    "));
    let known = ["replay ", "convert ", "simulate "];
    indented
        .filter(|line| known.iter().any(|name| line.starts_with(name)))
        .collect()
}

fn prepare(dir: &Path) {
    let session = drive();
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(dir.join(name), bytes).unwrap();
    csv(dir, &session, false);
    let topics = ["/imu/data_raw", "/gnss/fix", "/gnss/vel"];
    let bag = bag_of(&session, topics);
    std::fs::create_dir(dir.join("drive_bag")).unwrap();
    write("drive_bag/part.mcap", bag.clone());
    let metadata = "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  \
                    relative_file_paths:\n    - part.mcap\n";
    write("drive_bag/metadata.yaml", metadata.into());
    write("drive.mcap", bag);
    write("flight.ulg", ulog(&session));
    write("drive.ubx", ubx(&session));
    euroc(&dir.join("MH_01_easy"), &session);
    let unit = host_sim(dir, "unit show tactical").success();
    write("unit.toml", unit.get_output().stdout.clone());
    // the true states beside the CSV files, in the columns that a simulation writes
    let mut truth = "t_s,lat_deg,lon_deg,height_m,v_north_mps,v_east_mps,v_down_mps\n".to_owned();
    for (k, state) in session.reference.iter().enumerate() {
        let [lat, lon] = [state.position.lat, state.position.lon].map(f64::to_degrees);
        let (h, v) = (state.position.h, state.velocity);
        truth += &format!("{k},{lat},{lon},{h},{},{},{}\n", v.x, v.y, v.z);
    }
    write("truth.csv", truth.into());
    host_sim(dir, "convert csv --header header.toml --to kf-gins --out .").success();
}

#[test]
fn every_command_of_the_page_runs() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    prepare(dir);
    let commands = commands();
    assert!(commands.len() >= 14, "{commands:?}");
    for command in &commands {
        let out = host_sim(dir, command).success();
        let stdout = String::from_utf8_lossy(&out.get_output().stdout).into_owned();
        let stderr = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        let table = stdout.contains("| device ");
        assert!(
            table == command.starts_with("replay"),
            "{command}: {stdout}"
        );
        let corrected = stdout.contains(" holds the samples as ");
        assert_eq!(corrected, command.contains("--corrected"), "{command}");
        println!("{command}\n{stderr}");
    }
    for kind in ["csv", "kf-gins", "mcap", "ulog", "ubx", "euroc"] {
        let tried = commands
            .iter()
            .any(|c| c.starts_with(&format!("replay {kind} ")));
        assert!(tried, "replay {kind}");
    }
}
