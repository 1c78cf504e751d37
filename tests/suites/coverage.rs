//! Coverage of the permission tables: a host that walks the tables reaches every cell, and each answer is counted in its
//! cell.
//!
//! The tables themselves are checked in `permissions.rs`; the report that `--coverage` writes has unit tests in
//! `ts3100-emulator`.

use crate::permissions::{example, prepare};
use std::collections::BTreeSet;
use ts3100_controller::command_coverage::{CommandCoverage, PermissionCell, reachable};
use ts3100_controller::{Config, Dialect, Output, PanelAction, Port, Verdict};
use ts3100_simulation::manual::MANUAL;
use ts3100_tests::Robot;

fn coverage(robot: &Robot) -> CommandCoverage {
    let mut coverage = CommandCoverage::default();
    for output in &robot.outputs {
        if let Output::Event(event) = output {
            coverage.record(event);
        }
    }
    coverage
}

fn verdicts(robot: &mut Robot, commands: &[&str]) -> Vec<(&'static str, Verdict)> {
    robot.outputs.clear();
    for command in commands {
        robot.ask(Port::Ip0, command);
        robot.send(Port::Ip0, b"OK\r");
    }
    let coverage = coverage(robot);
    coverage
        .reached()
        .map(|(cell, _)| (cell.row(), cell.verdict))
        .collect()
}

#[test]
fn a_host_that_walks_the_tables_reaches_every_cell_of_the_manual() {
    let mut config = Config::new(Dialect::Field);
    config.options.extensions = false;
    let mut missing: BTreeSet<PermissionCell> = [Port::Host, Port::Ip0]
        .into_iter()
        .flat_map(|port| reachable(&config, port))
        .collect();
    assert_eq!(missing.len(), 2 * 116);
    for column in 0..5 {
        for running in [false, true] {
            let prepared = prepare(column, running);
            for (letters, ..) in MANUAL {
                for port in [Port::Host, Port::Ip0] {
                    let mut robot = prepared.clone();
                    robot.outputs.clear();
                    robot.ask(port, example(letters).0);
                    for (cell, _) in coverage(&robot).reached() {
                        missing.remove(cell);
                    }
                }
            }
        }
    }
    let missing: Vec<String> = missing
        .iter()
        .map(|cell| {
            format!(
                "{} {} {} {:?}",
                cell.port,
                cell.row(),
                cell.mode.as_str(),
                cell.verdict
            )
        })
        .collect();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn an_ng_of_the_tables_and_one_for_another_reason_are_told_apart() {
    let mut robot = prepare(4, false);
    assert_eq!(verdicts(&mut robot, &["ER,NONE"]), [("ER", Verdict::Refused)]);
    assert_eq!(verdicts(&mut robot, &["ER,OLD"]), [("ER", Verdict::Served)]);
    assert_eq!(verdicts(&mut robot, &["RS,ERR"]), [("RS,ERR", Verdict::Served)]);
    // What is no command, or a command with wrong operands, is in no table.
    assert_eq!(verdicts(&mut robot, &["XX", "ER"]), []);
    robot.panel(PanelAction::Servo(false));
    assert_eq!(verdicts(&mut robot, &["RN"]), [("RN", Verdict::Refused)]);
    let mut running = prepare(4, true);
    assert_eq!(verdicts(&mut running, &["UL,TEST"]), [("UL", Verdict::NotValid)]);
    assert_eq!(coverage(&running).ports(), [Port::Ip0]);
}
