//! Checks kinematics and motion of all models at full scale and prints the results; exit code 1 when a bound is
//! exceeded. The checks are in `ts3100_tests::kinematics`.
//!
//! `cargo run --release -p ts3100-tests --bin kinematics [POSES]`

use std::process::ExitCode;
use std::time::Instant;
use ts3100_controller::model::ArmModel;
use ts3100_tests::kinematics::{LINE, POSE, configurations, verify};

const POSES: u32 = 100_000;

fn main() -> ExitCode {
    let poses = match std::env::args().nth(1).map(|text| text.parse()) {
        None => POSES,
        Some(Ok(poses)) => poses,
        Some(Err(_)) => {
            eprintln!("kinematics: expected a number of poses");
            return ExitCode::from(2);
        }
    };
    let mut holds = true;
    for (model, seed) in [
        (ArmModel::tv800(), 11),
        (ArmModel::thl400(), 12),
        (ArmModel::thl400_four_axes(), 13),
        (ArmModel::thl300(), 14),
        (ArmModel::scara_600(), 15),
    ] {
        let start = Instant::now();
        let report = verify(&model, seed, poses);
        println!(
            "{}: {} poses, {} postures in {} of {} configurations: worst {:.1e} mm, {:.1e} degrees \
             (allowed {POSE:.0e}), {} wrong; {} lines: worst {:.1e} mm off (allowed {LINE:.0e}); {} timed: worst \
             {:.1e} s from the closed form; {} answers that depend on the polling; {:.1} s",
            model.name,
            report.poses,
            report.postures,
            report.configurations,
            configurations(&model.kind).len(),
            report.worst_mm,
            report.worst_degrees,
            report.wrong,
            report.lines,
            report.worst_line,
            report.timed,
            report.worst_seconds,
            report.polled,
            start.elapsed().as_secs_f64(),
        );
        holds &= report.holds();
    }
    if holds {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
