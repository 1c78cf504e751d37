//! GLOBAL and DATA seen from outside: what a host reads and writes with MR and MW.

#![expect(clippy::panic, reason = "a helper of a test fails the test")]

use crate::common;
use std::sync::Arc;

use scol_mini::{
    AccessError, Arm, LanguageOptions, Memory, Payload, Program, Trans, Value, ValueKind, VariableInfo,
    compile,
};

const SIX: LanguageOptions = LanguageOptions {
    arm: Arm::SixAxis,
    sticky_work: false,
    data_copy: false,
    int_division: scol_mini::IntDivision::Truncate,
    equal_within: 0.0,
};

fn with(globals: &str, data: &str, options: &LanguageOptions) -> (Arc<Program>, Memory) {
    let source = format!("GLOBAL\n{globals}\nEND\nPROGRAM M\nLOCAL=1\nEND\nDATA\n{data}\nEND\n");
    let compilation = compile(&source, options);
    let Some(program) = compilation.program else {
        panic!("{:?}", compilation.diagnostics)
    };
    let memory = Memory::new(&program);
    (program, memory)
}

/// The numbers of a datum as MR lists them.
fn listed(data: &str, name: &str, options: &LanguageOptions) -> Vec<f64> {
    let (program, memory) = with("", data, options);
    match memory.global(&program, name, &[]) {
        Ok(Value::Position(value)) => value.listed(options.arm),
        Ok(Value::Coordinate(value)) => value.listed(options.arm),
        Ok(Value::Load(value)) => value.listed(options.arm),
        other => panic!("{other:?}"),
    }
}

// clause: DATA-02 DATA-03 DATA-04 DATA-05 MR-01
#[test]
fn positions_have_eight_numbers_and_a_configuration() {
    let whole = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 12111.0];
    assert_eq!(listed("POINT P1=1,2,3,4,5,6,7,8/12111", "P1", &SIX), whole);
    assert_eq!(
        listed("point p2 = 1,,3/", "P2", &SIX),
        [1.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    );
    assert_eq!(listed("POINT A1=400,0,200,0,0,0,0,0/", "a1", &SIX)[8], 0.0);
    assert_eq!(listed("POINT A=-1.5,+2.25E1/LBNSS", "A", &SIX)[..2], [-1.5, 22.5]);
    assert_eq!(listed("POINT A=0/LBNSS", "A", &SIX)[8], 12111.0);
    assert_eq!(listed("POINT A=123456.789", "A", &SIX)[0], 123_456.789);
}

// clause: DATA-02 S30
#[test]
fn a_line_that_begins_with_a_name_is_a_position_and_blanks_do_not_count() {
    let scara = LanguageOptions {
        arm: Arm::Scara,
        ..SIX
    };
    let line = "POINT A1 = 203.346, 390.635, 94.252, 30.261, 0.000 / LEFTY";
    let numbers = [203.346, 390.635, 94.252, 30.261, 0.0, 1.0];
    assert_eq!(listed(line, "A1", &scara), numbers);
    assert_eq!(listed(&line.replace("POINT ", ""), "A1", &scara), numbers);
    assert_eq!(
        listed("A2=523.123,-234.567,180.945,45.345,0.0/LEFTY", "A2", &scara),
        [523.123, -234.567, 180.945, 45.345, 0.0, 1.0]
    );
    assert_eq!(
        listed("A2 = , 1,, / ", "A2", &scara),
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    );
    assert_eq!(listed("A2=1,2,3,4,5,6/LANSS", "A2", &SIX)[8], 11111.0);
    for bad in ["A2 1", "SPEED=1", "MOVE=1", "A2=1 2", "A2"] {
        let source = format!("PROGRAM M\nEND\nDATA\n{bad}\nEND\n");
        assert!(compile(&source, &scara).program.is_none(), "{bad}");
    }
}

// clause: DATA-06 DATA-07 DATA-08
#[test]
fn coordinates_and_loads() {
    let w1 = [400.0, 200.0, 50.0, 90.0, 0.0, 0.0];
    assert_eq!(listed("TRANS W1=400,200,50,90", "W1", &SIX), w1);
    let load = [3.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(listed("PAYLOAD H1={3,100}", "H1", &SIX), load);
    assert_eq!(listed("PAYLOAD H1=3,100", "H1", &SIX), load);
}

#[test]
fn a_scara_has_its_own_widths() {
    let scara = LanguageOptions {
        arm: Arm::Scara,
        ..SIX
    };
    assert_eq!(
        listed("POINT P=1,2,3,4,5/LEFTY", "P", &scara),
        [1.0, 2.0, 3.0, 4.0, 5.0, 1.0]
    );
    assert_eq!(
        listed("POINT P=1,2,3/", "P", &scara),
        [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]
    );
    assert_eq!(listed("TRANS W=1,2,3,90", "W", &scara), [1.0, 2.0, 3.0, 90.0]);
    assert_eq!(listed("PAYLOAD H=3,100", "H", &scara), [3.0, 100.0]);
    for bad in [
        "POINT P=1,2,3,4,5,6/",
        "POINT P=1/12111",
        "POINT P=1/FLIP",
        "TRANS W=1,2,3,4,5",
    ] {
        assert!(
            compile(&format!("PROGRAM M\nEND\nDATA\n{bad}\nEND\n"), &scara)
                .program
                .is_none(),
            "{bad}"
        );
    }
}

#[test]
fn a_program_that_assigns_to_a_datum_changes_it_for_all_or_its_own_copy() {
    let source = "PROGRAM M\nSIDE\nPRINT P.X\nSIDE\nP.Y = 3\nPRINT P.X, P.Y\nEND\nPROGRAM SIDE\nP.X = P.X + 1\n\
        PRINT P.X\nEND\nDATA\nPOINT P=5,6\nEND\n";
    for (data_copy, printed) in [
        (false, ["6.000", "6.000", "7.000", "7.000       3.000"]),
        (true, ["6.000", "5.000", "7.000", "5.000       3.000"]),
    ] {
        let options = LanguageOptions { data_copy, ..SIX };
        let program = compile(source, &options).program.unwrap();
        let mut memory = Memory::new(&program);
        let lines = common::play_on(&program, &mut memory, Default::default(), 100);
        let expected = printed.map(|text| format!("PRINT Tp {:?}", format!("       {text}")));
        assert_eq!(lines[..4], expected, "data_copy = {data_copy}");
        let left = if data_copy { 5.0 } else { 7.0 };
        assert!(
            matches!(memory.global(&program, "P", &[]), Ok(Value::Position(p)) if p.coords[0] == left),
            "a host reads the datum itself"
        );
    }
}

// clause: DATA-09 DATA-10
#[test]
fn work_holds_for_the_next_position_only_unless_it_is_sticky() {
    let data = "WORK W\nPOINT A=1\nPOINT B=1\nTRANS W=5";
    for (sticky_work, b) in [(false, None), (true, Some("W"))] {
        let (program, memory) = with("", data, &LanguageOptions { sticky_work, ..SIX });
        let work = |name: &str| match memory.global(&program, name, &[]) {
            Ok(Value::Position(position)) => position.work.and_then(|work| work.name.clone()),
            other => panic!("{other:?}"),
        };
        assert_eq!(work("A").as_deref(), Some("W"));
        assert_eq!(work("B").as_deref(), b);
    }
}

// clause: CMD-MR-01 CMD-MR-02 CMD-MR-03 CMD-MR-04 CMD-MR-06 RAM-07
#[test]
fn globals_are_found_by_name_and_kind() {
    let globals = "A = 10\nX = 1.5\nT = TRANS(1,2)\nL = {3,4}\nP = POINT(1,2,3,0,0,0,0,0,12111)\nB\n\
        ABCDEFGHIJ = -2147483648\nDIM N(2,3) AS INTEGER, Q(4)\nN(1,2) = 7\nF = 2*3+1.0";
    let (program, memory) = with(globals, "", &SIX);
    let get = |name: &str, subscripts: &[i32]| memory.global(&program, name, subscripts);
    assert_eq!(get("a", &[]), Ok(Value::Integer(10)));
    assert_eq!(get("X", &[]), Ok(Value::Real(1.5)));
    assert_eq!(get("F", &[]), Ok(Value::Real(7.0)));
    assert_eq!(get("ABCDEFGHIJ", &[]), Ok(Value::Integer(i32::MIN)));
    assert_eq!(
        get("T", &[]),
        Ok(Value::from(Trans {
            coords: [1.0, 2.0, 0.0, 0.0, 0.0, 0.0]
        }))
    );
    assert_eq!(
        get("L", &[]),
        Ok(Value::from(Payload {
            mass: 3.0,
            gravity: [4.0, 0.0, 0.0],
            ..Payload::default()
        }))
    );
    assert!(matches!(get("P", &[]), Ok(Value::Position(p)) if p.config.number() == 12111));
    assert_eq!(get("N", &[1, 2]), Ok(Value::Integer(7)));
    assert_eq!(get("N", &[2, 3]), Ok(Value::Integer(0)));
    assert_eq!(get("B", &[]), Err(AccessError::Undefined("B".into())));
    assert_eq!(get("Q", &[1]), Err(AccessError::Undefined("Q".into())));
    assert_eq!(get("N", &[3, 0]), Err(AccessError::Subscript("N".into())));
    assert_eq!(get("N", &[1]), Err(AccessError::Subscript("N".into())));
    assert_eq!(get("N", &[]), Err(AccessError::IsArray("N".into())));
    assert_eq!(get("A", &[1]), Err(AccessError::NotArray("A".into())));
    assert_eq!(get("LOCAL", &[]), Err(AccessError::NotGlobal("LOCAL".into())));
    assert_eq!(get("NOVAR", &[]), Err(AccessError::Unknown("NOVAR".into())));
    assert_eq!(
        program.variable("n"),
        Some(VariableInfo {
            kind: Some(ValueKind::Integer),
            array: true
        })
    );
    assert_eq!(
        program.variable("B"),
        Some(VariableInfo {
            kind: None,
            array: false
        })
    );
    assert_eq!(program.variable("LOCAL"), None);
    assert_eq!(program.program_lines(), [("M", 14)]);
}

// clause: CMD-MW-01 CMD-MW-03 CMD-MW-06
#[test]
fn writing_checks_kind_and_element() {
    let (program, mut memory) = with("A=1\nDIM N(2)\nB", "POINT P=1", &SIX);
    let mut set =
        |name: &str, subscripts: &[i32], value| memory.set_global(&program, name, subscripts, value);
    assert_eq!(set("A", &[], Value::Integer(25)), Ok(()));
    assert!(matches!(
        set("A", &[], Value::Real(1.0)),
        Err(AccessError::KindMismatch { .. })
    ));
    assert!(matches!(
        set("P", &[], Value::Integer(1)),
        Err(AccessError::KindMismatch { .. })
    ));
    assert_eq!(set("N", &[2], Value::Integer(9)), Ok(()));
    assert!(matches!(
        set("N", &[1], Value::Real(9.0)),
        Err(AccessError::KindMismatch { .. })
    ));
    assert_eq!(
        set("N", &[3], Value::Integer(9)),
        Err(AccessError::Subscript("N".into()))
    );
    assert_eq!(set("B", &[], Value::Real(9.0)), Ok(()));
    assert_eq!(memory.global(&program, "N", &[2]), Ok(Value::Integer(9)));
    assert_eq!(memory.global(&program, "a", &[]), Ok(Value::Integer(25)));
    assert_eq!(
        Memory::new(&program).global(&program, "A", &[]),
        Ok(Value::Integer(1))
    );
}
