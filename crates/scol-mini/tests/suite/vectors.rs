//! Vector values as hosts and programs write them: configurations by number, word, letters and list; elements that
//! are left out; elements between braces.

#![expect(clippy::panic, reason = "a helper of a test fails the test")]

use crate::common;
use std::sync::Arc;

use scol_mini::{
    Arm, LanguageOptions, Machine, Memory, Motion, Path, Pause, Position, Program, Request, compile_direct,
};

/// The motion a statement of DO asks for, or the code of its first error.
fn motion(arm: Arm, statement: &str) -> Result<Motion, String> {
    let base = Program::empty(&LanguageOptions {
        arm,
        ..LanguageOptions::default()
    });
    let program = compile_direct(statement, &base).map_err(|found| found[0].code.to_string())?;
    let (mut machine, mut memory) = (Machine::direct(program), Memory::new(&base));
    match machine.run(&mut memory, &common::World, &mut 1) {
        Pause::Request(Request::Move(motion)) => Ok(*motion),
        Pause::Fault(fault) => Err(format!("{:?}", fault.kind)),
        other => panic!("{statement}: {other:?}"),
    }
}

fn target(motion: Motion) -> Position {
    match motion.path {
        Path::Ptp(to) | Path::Line(to) | Path::Arc { end: to, .. } | Path::Arch { end: to, .. } => to,
        other => panic!("{other:?}"),
    }
}

/// The configuration of the target.
fn posture(arm: Arm, last: &str) -> Result<i64, String> {
    let before = match arm {
        Arm::SixAxis => "300,0,700,0,0,0,0,0",
        Arm::Scara => "300,100,20,0,0",
    };
    motion(arm, &format!("MOVE POINT({before},{last})")).map(|motion| target(motion).config.number_on(arm))
}

// clause: DATA-04
#[test]
fn the_configuration_of_a_point_may_be_letters_of_which_x_is_open() {
    for (last, number) in [
        ("LAFSS", 11_211),
        ("lanss", 11_111),
        ("LAxxx", 11_000),
        ("xxNxx", 100),
        ("xxxxx", 0),
        ("XXXXX", 0),
        ("rbFdD", 22_222),
        ("LEFTY", 10_000),
        ("LEFTY + ABOVE", 11_000),
        ("12111", 12_111),
        ("FREE", 0),
    ] {
        assert_eq!(posture(Arm::SixAxis, last), Ok(number), "{last}");
    }
    for (last, number) in [("lefty", 1), ("RIGHTY", 2), ("FREE", 0), ("0", 0), ("2", 2)] {
        assert_eq!(posture(Arm::Scara, last), Ok(number), "{last}");
    }
    for wrong in ["AXLXX", "xxxx", "xxxxxx", "xxxxx + 1"] {
        assert_eq!(posture(Arm::SixAxis, wrong), Err("E0201".into()), "{wrong}");
    }
    assert_eq!(posture(Arm::Scara, "xxxxx"), Err("E0201".into()));
    // Elsewhere these letters are a name like any other.
    let source = "PROGRAM M\nXXXXX = 5\nPRINT XXXXX, POINT(1,2,3,4,5,6,7,8,XXXXX).X\nEND\n";
    let lines = common::play(&common::compiled(source), Default::default(), 10);
    assert_eq!(lines[0], "PRINT Tp \"           5       1.000\"");
}

// clause: DATA-04
#[test]
fn config_in_with_takes_a_number_words_letters_or_a_list() {
    let config = |arm, value: &str| {
        let statement = match arm {
            Arm::SixAxis => format!("MOVE POINT(300,0,700) with SPEED=50.000,Config={value}, ACCEL=20"),
            Arm::Scara => format!("MOVE POINT(300,100) with Config={value},SPEED=50"),
        };
        motion(arm, &statement).map(|motion| motion.conditions.config.number_on(arm))
    };
    for (value, number) in [
        ("{Lefty,Above,Nflip,Single4,Single6}", 11_111),
        ("{RIGHTY, BELOW, FLIP, DOUBLE4, DOUBLE6}", 22_222),
        ("{flip,lefty}", 10_200),
        ("{Free,Above,Free,Free,Free}", 1_000),
        ("{1,2,1,0,0}", 12_100),
        ("{1,,2}", 10_200),
        ("{}", 0),
        ("12111", 12_111),
        ("lefty", 10_000),
        ("Lefty + Below", 12_000),
        ("LAxxx", 11_000),
        ("lanss", 11_111),
        ("Free", 0),
    ] {
        assert_eq!(config(Arm::SixAxis, value), Ok(number), "{value}");
    }
    for (value, number) in [
        ("1", 1),
        ("2", 2),
        ("0", 0),
        ("Lefty", 1),
        ("{Righty}", 2),
        ("{1}", 1),
    ] {
        assert_eq!(config(Arm::Scara, value), Ok(number), "{value}");
    }
    for (arm, value, code) in [
        (Arm::SixAxis, "{Lefty,Righty}", "E0205"),
        (Arm::SixAxis, "{1,1,1,1,1,1}", "E0206"),
        (Arm::SixAxis, "{1,3}", "E0101"),
        (Arm::SixAxis, "{COARSE}", "E0101"),
        (Arm::SixAxis, "{LAFSS}", "E0101"),
        (Arm::SixAxis, "13111", "Range"),
        (Arm::Scara, "{Lefty,Above}", "E0206"),
        (Arm::Scara, "{Above}", "E0101"),
        (Arm::Scara, "3", "Range"),
    ] {
        assert_eq!(config(arm, value), Err(code.into()), "{value}");
    }
}

// clause: DATA-04
#[test]
fn the_statement_config_and_data_take_the_same_words() {
    let source = "PROGRAM M\nCONFIG = {LEFTY, ABOVE}\nPRINT CONFIG\nCONFIG = xxNxx\nPRINT CONFIG\n\
        MOVE A\nEND\nDATA\nPOINT A=1/LAXXX\nEND\n";
    let lines = common::play(&Arc::clone(&common::compiled(source)), Default::default(), 10);
    assert_eq!(lines[0], "PRINT Tp \"       11000\"");
    assert_eq!(lines[1], "PRINT Tp \"         100\"");
    assert!(lines[2].contains("/11000 "), "{}", lines[2]);
}

// clause: S30
#[test]
fn elements_left_out_are_0_and_braces_make_what_the_statement_takes() {
    let six = |statement: &str| motion(Arm::SixAxis, statement).map(target).map(|to| to.coords);
    let at = |x, y, z| Ok([x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for (statement, expected) in [
        ("MOVE POINT()", at(0.0, 0.0, 0.0)),
        ("MOVE POINT(,, 200)", at(0.0, 0.0, 200.0)),
        ("MOVE POINT(1,,3,)", at(1.0, 0.0, 3.0)),
        (
            "MOVE {200,100,50,0,0,1}",
            Ok([200.0, 100.0, 50.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        ),
        ("MOVES {1,2,3} WITH PAYLOAD={2,30}", at(1.0, 2.0, 3.0)),
        ("MOVEC {1,2,3} {4,5,6}", at(4.0, 5.0, 6.0)),
        ("MOVEC {1,2,3}, {4,5,,} with speed=5", at(4.0, 5.0, 0.0)),
        ("MOVEJ {1,2,3} {10,50,5}", at(1.0, 2.0, 3.0)),
        ("MOVE POINT(1,2,3) + {,,10}", at(1.0, 2.0, 13.0)),
        ("MOVE POINT(1,2,3) * TRANS(,,10)", at(1.0, 2.0, 13.0)),
    ] {
        assert_eq!(six(statement), expected, "{statement}");
    }
    for (arm, statement, code) in [
        (Arm::SixAxis, "MOVE POINT(,,,,,,,,,)", "E0206"),
        (Arm::SixAxis, "MOVE {1,2,3,4,5,6,7,8,0,0}", "E0206"),
        (Arm::SixAxis, "MOVE POINT(1,2) WITH SPEED={1}", "E0207"),
        (Arm::SixAxis, "MOVEA 1, DIN(,2)", "E0101"),
        (Arm::Scara, "BASE = {1,2,3,4,5}", "E0206"),
        (Arm::Scara, "MOVE {1,2,3,4,5,1,1}", "E0206"),
    ] {
        assert_eq!(
            motion(arm, statement).map(|_| ()),
            Err(code.into()),
            "{statement}"
        );
    }
    let frame = motion(Arm::Scara, "MOVE {1,2,3,4,5,righty} WITH WORK={1,2,,90}").unwrap();
    assert_eq!(
        frame.conditions.work.trans.coords,
        [1.0, 2.0, 0.0, 0.0, 0.0, 90.0]
    );
    assert_eq!(target(frame).listed(Arm::Scara), [1.0, 2.0, 3.0, 4.0, 5.0, 2.0]);
}
