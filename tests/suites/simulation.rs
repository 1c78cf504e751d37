//! Cells of robots under random traffic and failures: no plan breaks a rule of the crate `ts3100-simulation`.

use ts3100_controller::Port;
use ts3100_simulation::{Figures, Rule, shrunk, simulate};
use ts3100_tests::Robot;

const SEEDS: std::ops::Range<u64> = 0..40;
/// Seeds that have broken a rule: a jog or a motion begun while the arm slowed, also that of a locked machine.
const FOUND: [u64; 3] = [1_568, 2_930, 67_047];

// clause: TRN-01 TRN-02 SU-12 CMD-SP-07 CMD-LST-02
#[test]
fn whatever_hosts_and_operators_do() {
    let mut figures = Figures::default();
    for seed in SEEDS.chain(FOUND) {
        if let Err(failure) = simulate(seed, None, &mut figures) {
            panic!("{}", shrunk(*failure, None));
        }
    }
    for (rule, name, ..) in Rule::ALL {
        assert!(
            figures.checks.contains_key(&rule) || rule == Rule::SameBytes,
            "{name}"
        );
    }
    let told = figures.to_string();
    let mut counts = told
        .lines()
        .map(|line| line.trim_start().split_once(' ').unwrap());
    assert_eq!(counts.find(|(count, _)| *count == "0"), None, "{told}");
}

// clause: CMD-RN-06
#[test]
fn an_empty_program_in_continuous_mode_does_not_hold_up_the_controller() {
    for program in [
        "PROGRAM P\nEND\n",
        "PROGRAM P\nRCYCLE:\nEND\n",
        "PROGRAM P\nREMARK nothing\nEND\n",
    ] {
        let mut robot = Robot::ready(program);
        robot.command(Port::Ip0, "EC,MODE CONT");
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(1_000);
        assert_eq!(robot.total(Port::Ip0)[2], 1, "{program}");
        robot.command(Port::Ip0, "SP");
        robot.advance_ms(100);
        assert_ne!(robot.total(Port::Ip0)[2], 1, "{program}");
    }
}
