//! Tests of the machine: pausing, fuel, jumps, loops, calls, faults.

use super::*;
use crate::request::{Channel, Path};
use crate::tree::Expression;
use crate::value::Value;
use crate::{LanguageOptions, compile, compile_call, compile_direct};
use std::string::ToString;
use std::vec;

mod numbers;
mod reference;
mod resets;

struct World {
    din: u16,
    motion: f64,
}

impl Inputs for World {
    fn din(&self, line: u16) -> bool {
        line == self.din
    }
    fn dout(&self, line: u16) -> bool {
        line == 2
    }
    fn motion_percent(&self) -> f64 {
        self.motion
    }
    fn here(&self) -> Position {
        Position {
            coords: [9.0; 8],
            ..Position::default()
        }
    }
    fn mode(&self) -> i32 {
        3
    }
}

const STILL: World = World {
    din: 1,
    motion: 100.0,
};

fn start(body: &str) -> (Machine, Memory) {
    let compilation = compile(body, &LanguageOptions::default());
    let program = compilation
        .program
        .unwrap_or_else(|| panic!("{:?}", compilation.diagnostics));
    (Machine::main(Arc::clone(&program)), Memory::new(&program))
}

/// Runs to the end, answering every PRINT; returns the text printed on TP, or the last pause.
fn printed(body: &str) -> Result<String, Pause> {
    let (mut machine, mut memory) = start(body);
    let mut text = String::new();
    let mut fuel = 10_000;
    loop {
        match machine.run(&mut memory, &STILL, &mut fuel) {
            Pause::Request(Request::Print { data, .. }) => {
                text.push_str(
                    &String::from_utf8(data)
                        .unwrap()
                        .replace('\r', "|")
                        .replace("  ", ""),
                );
                machine.answer(&mut memory, Answer::Done).unwrap();
            }
            Pause::Ended => return Ok(text),
            pause => return Err(pause),
        }
    }
}

fn main_of(lines: &str) -> Result<String, Pause> {
    printed(&format!("PROGRAM M\n{lines}\nEND\n"))
}

fn fault_of(lines: &str) -> FaultKind {
    match main_of(lines) {
        Err(Pause::Fault(fault)) => fault.kind,
        other => panic!("{other:?}"),
    }
}

#[test]
fn one_unit_of_fuel_is_one_statement() {
    let (mut machine, mut memory) = start(
        "PROGRAM M\n\n' c\nL:\nA=1\nIF A==1 THEN B=2 ELSE B=3\nSUB(B)\nEND\nPROGRAM SUB(X)\nX=X+1\nEND\n",
    );
    let mut lines = Vec::new();
    for _ in 0..10 {
        lines.push(machine.line());
        if machine.run(&mut memory, &STILL, &mut 1) == Pause::Ended {
            break;
        }
    }
    assert_eq!(lines, vec![5, 6, 7, 10, 11, 8]);
    assert_eq!(machine.run(&mut memory, &STILL, &mut 1), Pause::Ended);
    machine.restart();
    assert_eq!(machine.run(&mut memory, &STILL, &mut 0), Pause::Fuel);
    assert_eq!(machine.line(), 5);
}

#[test]
fn a_request_stays_until_it_is_answered() {
    let (mut machine, mut memory) = start("PROGRAM M\nPRINT COM1,\"A\"\nSTOP\nDELAY 0.5\nEND\n");
    let mut fuel = 1;
    let first = machine.run(&mut memory, &STILL, &mut fuel);
    assert_eq!(
        first,
        Pause::Request(Request::Print {
            channel: Channel::Com1,
            data: b"A".to_vec(),
            cut: 0,
        })
    );
    assert_eq!(machine.run(&mut memory, &STILL, &mut fuel), first);
    assert!(machine.answer(&mut memory, Answer::Values(vec![])).is_err());
    machine.answer(&mut memory, Answer::Done).unwrap();
    assert!(machine.answer(&mut memory, Answer::Done).is_err());
    assert_eq!(machine.run(&mut memory, &STILL, &mut fuel), Pause::Fuel);
    assert_eq!(
        machine.run(&mut memory, &STILL, &mut 1),
        Pause::Request(Request::Stop)
    );
    assert_eq!(machine.pending(), Some(&Request::Stop));
    machine.skip();
    assert_eq!(machine.pending(), None);
    assert_eq!(
        machine.run(&mut memory, &STILL, &mut 1),
        Pause::Request(Request::Delay { seconds: 0.5 })
    );
}

#[test]
fn after_a_request_behind_then_the_next_statement_of_the_file_is_next() {
    let (mut machine, mut memory) = start("PROGRAM M\nIF 1 == 1 THEN DELAY 1 ELSE DELAY 2\nN = 1\nEND\n");
    let pause = machine.run(&mut memory, &STILL, &mut 1);
    assert!(
        matches!(pause, Pause::Request(Request::Delay { .. })),
        "{pause:?}"
    );
    machine.answer(&mut memory, Answer::Done).unwrap();
    assert_eq!(machine.line(), 3);
    assert!(machine.begins_statement());
    assert_eq!(machine.run(&mut memory, &STILL, &mut 1), Pause::Fuel);
    assert_eq!(machine.line(), 4);
}

/// The detail of each statement up to the first request or the end.
fn told(machine: &mut Machine, memory: &mut Memory) -> Vec<(u32, Vec<Effect>)> {
    let mut all = Vec::new();
    loop {
        let (line, mut effects) = (machine.line(), Vec::new());
        let pause = machine.run_told(memory, &STILL, &mut 1, &mut effects);
        all.push((line, effects));
        if pause != Pause::Fuel {
            return all;
        }
    }
}

fn assigned(name: &str, value: Value) -> Effect {
    let name = name.into();
    Effect::Assigned { name, value }
}

#[test]
fn a_statement_tells_what_it_does() {
    let source = "GLOBAL\nDIM A(3) AS REAL\nEND\nPROGRAM M\nI = 2\nA(I) = 1.5\nIF I > 9 THEN I = 7\n\
        IF I > 1 THEN I = 1 ELSE I = 0\nIF I > 1 THEN I = 5 ELSE I = 3\nFOR J = 1 TO 1\nS(I, 2)\nNEXT J\nSPEED = 50\n\
        P.X = 10\nMOVE P\nEND\nPROGRAM S(N, K)\nN = N + 1\nEND\nDATA\nPOINT P=1,2,3,4,5,6,7,8/11111\nEND\n";
    let (mut machine, mut memory) = start(source);
    let told = told(&mut machine, &mut memory);
    let (line, motion) = told.last().unwrap();
    assert!(
        matches!((line, motion.as_slice()), (15, [Effect::Target(Path::Ptp(position))]) if position.coords[0] == 10.0),
        "{motion:?}"
    );
    let expected = [
        (5, vec![assigned("I", Value::Integer(2))]),
        (6, vec![assigned("A(2)", Value::Real(1.5))]),
        (7, vec![Effect::Branch(Way::Neither)]),
        (
            8,
            vec![Effect::Branch(Way::Then), assigned("I", Value::Integer(1))],
        ),
        (
            9,
            vec![Effect::Branch(Way::Else), assigned("I", Value::Integer(3))],
        ),
        (10, vec![assigned("J", Value::Integer(1))]),
        (
            11,
            vec![assigned("N", Value::Integer(3)), assigned("K", Value::Integer(2))],
        ),
        (18, vec![assigned("N", Value::Integer(4))]),
        (19, vec![]),
        (12, vec![assigned("J", Value::Integer(2))]),
        (13, vec![assigned("SPEED", Value::Real(50.0))]),
        (14, vec![assigned("P.X", Value::Real(10.0))]),
    ];
    assert_eq!(told.split_last().unwrap().1, expected);
}

#[test]
fn an_element_is_named_by_the_subscript_before_its_assignment() {
    let (mut machine, mut memory) =
        start("GLOBAL\nDIM A(3) AS INTEGER\nEND\nPROGRAM M\nA(1) = 1\nA(A(1)) = 3\nEND\n");
    let told = told(&mut machine, &mut memory);
    assert_eq!(told[1], (6, vec![assigned("A(1)", Value::Integer(3))]));
}

#[test]
fn the_values_of_an_input_are_known_after_its_answer() {
    let (mut machine, mut memory) = start("PROGRAM M\nN = 1\nINPUT IP1, N, X\nEND\n");
    told(&mut machine, &mut memory);
    let recipients = machine.recipients();
    let numbers = [Number::Integer(4), Number::Real(2.5)];
    machine
        .answer(&mut memory, Answer::Values(numbers.into()))
        .unwrap();
    let received: Vec<Effect> = machine.received(&memory, &recipients).collect();
    assert_eq!(
        received,
        [assigned("N", Value::Integer(4)), assigned("X", Value::Real(2.5))]
    );
}

/// Runs as `run` does: the same pauses, the same memory.
#[test]
fn telling_changes_nothing() {
    let source = "PROGRAM M\nFOR I = 1 TO 9\nIF I MOD 2 == 0 THEN S(I) ELSE PRINT I, CR\nL: IF I > 7 THEN WAIT I > 9\n\
        NEXT I\nEND\nPROGRAM S(N)\nN = N + 0\nIF N == 4 THEN RETURN\nDELAY 0.1\nEND\n";
    let ((mut quiet, mut first), (mut loud, mut second)) = (start(source), start(source));
    for _ in 0..60 {
        let pause = quiet.run(&mut first, &STILL, &mut 1);
        assert_eq!(loud.run_told(&mut second, &STILL, &mut 1, &mut vec![]), pause);
        assert_eq!((&quiet, &first), (&loud, &second));
        match pause {
            Pause::Request(_) => {
                quiet.answer(&mut first, Answer::Done).unwrap();
                loud.answer(&mut second, Answer::Done).unwrap();
            }
            Pause::Waiting => return,
            Pause::Fuel | Pause::Ended | Pause::Fault(_) => {}
        }
    }
    panic!("it waits on line 4");
}

#[test]
fn a_call_runs_instead_of_the_main_program() {
    let compiled = compile(
        "GLOBAL\nTOTAL = 5\nEND\nPROGRAM M\nTOTAL = 99\nEND\nPROGRAM ADD(N, X)\nTOTAL = TOTAL + N\nX = 0.0\nEND\n",
        &LanguageOptions::default(),
    );
    let base = compiled.program.unwrap();
    let run = |call: &str| {
        let program = compile_call(call, &base).map_err(|found| found[0].message.clone())?;
        let mut memory = Memory::new(&program);
        let mut machine = Machine::main(Arc::clone(&program));
        assert_eq!(machine.run(&mut memory, &STILL, &mut 100), Pause::Ended);
        assert_eq!(machine.line(), 0);
        machine.restart();
        assert!(machine.begins_statement());
        Ok::<_, String>(memory.global(&program, "TOTAL", &[]).unwrap())
    };
    assert_eq!(run("ADD(2, 30.5)"), Ok(Value::Integer(7)));
    assert_eq!(run(" add(total, 1 + 1)"), Ok(Value::Integer(10)));
    for (call, reason) in [
        ("ADD(2)", "ADD takes 2 arguments, found 1"),
        ("AD(2, 3)", "this file has no program AD"),
        ("ADD(NOPE, 3)", "NOPE is never given a value"),
        ("", "expected a call such as PLACE(2, 30.5), found nothing"),
        (
            "DELAY 1",
            "expected a call such as PLACE(2, 30.5), found another statement",
        ),
    ] {
        assert_eq!(run(call), Err(reason.to_string()), "{call}");
    }
}

#[test]
fn a_statement_at_fault_is_tried_again_or_skipped_whole() {
    let (mut machine, mut memory) = start("PROGRAM M\nA=0\nIF 1/A > 0 THEN B=2 ELSE B=3\nC=4\nEND\n");
    let fault = |pause| {
        matches!(
            pause,
            Pause::Fault(Fault {
                kind: FaultKind::DivisionByZero,
                line: 3,
                ..
            })
        )
    };
    assert!(fault(machine.run(&mut memory, &STILL, &mut 9)));
    assert!(fault(machine.run(&mut memory, &STILL, &mut 9)));
    machine.skip();
    assert_eq!(machine.line(), 4);
    assert_eq!(machine.run(&mut memory, &STILL, &mut 9), Pause::Ended);
}

#[test]
fn wait_looks_again_without_fuel() {
    let (mut machine, mut memory) = start("PROGRAM M\nWAIT MOTION >= 100\nA=1\nEND\n");
    let mut fuel = 1;
    let half = World { din: 0, motion: 50.0 };
    assert_eq!(machine.run(&mut memory, &half, &mut fuel), Pause::Waiting);
    assert_eq!(machine.run(&mut memory, &half, &mut fuel), Pause::Waiting);
    assert_eq!(machine.line(), 2);
    let mut other = machine.clone();
    other.skip();
    assert_eq!(other.line(), 3);
    assert_eq!(machine.run(&mut memory, &STILL, &mut fuel), Pause::Fuel);
    assert_eq!(machine.line(), 3);
}

// clause: INP-05 INP-09 INP-10 INP-15 NPC-01
#[test]
fn input_fills_variables_in_their_kind_and_cancelled_ones_are_0() {
    let source = "GLOBAL\nN=7\nX=0.0\nM\nEND\nPROGRAM P\nINPUT COM1,N,X,M\nEND\n";
    let (mut machine, mut memory) = start(source);
    let program = compile(source, &LanguageOptions::default()).program.unwrap();
    let run = |machine: &mut Machine, memory: &mut Memory, answer: Answer| {
        machine.restart();
        let asked = Pause::Request(Request::Input {
            channel: Channel::Com1,
            expected: 3,
        });
        assert_eq!(machine.run(memory, &STILL, &mut 1), asked);
        machine.answer(memory, answer)
    };
    let three = vec![Number::Real(2.7), Number::Integer(3), Number::Real(4.5)];
    assert!(run(&mut machine, &mut memory, Answer::Values(three[..2].to_vec())).is_err());
    assert!(run(&mut machine, &mut memory, Answer::Done).is_err());
    run(&mut machine, &mut memory, Answer::Values(three)).unwrap();
    assert_eq!(memory.global(&program, "N", &[]), Ok(Value::Integer(2)));
    assert_eq!(memory.global(&program, "X", &[]), Ok(Value::Real(3.0)));
    assert_eq!(memory.global(&program, "M", &[]), Ok(Value::Real(4.5)));
    run(
        &mut machine,
        &mut memory,
        Answer::Cancelled(vec![Number::Integer(5)]),
    )
    .unwrap();
    assert_eq!(memory.global(&program, "N", &[]), Ok(Value::Integer(5)));
    assert_eq!(memory.global(&program, "X", &[]), Ok(Value::Real(0.0)));
    assert_eq!(memory.global(&program, "M", &[]), Ok(Value::Real(0.0)));
    assert_eq!(machine.line(), 8);
    run(
        &mut machine,
        &mut memory,
        Answer::Values(vec![Number::Real(1.5); 3]),
    )
    .unwrap();
    let too_large = vec![Number::Real(3E9), Number::Integer(3), Number::Real(4.5)];
    let fault = run(&mut machine, &mut memory, Answer::Values(too_large)).unwrap_err();
    assert_eq!((fault.kind, fault.line), (FaultKind::Overflow, 7));
    assert_eq!(memory.global(&program, "N", &[]), Ok(Value::Integer(0)));
    assert_eq!(memory.global(&program, "X", &[]), Ok(Value::Real(0.0)));
    assert_eq!(memory.global(&program, "M", &[]), Ok(Value::Real(0.0)));
}

#[test]
fn precedence_is_that_of_the_language() {
    for (expression, value) in [
        ("1+2*3", "7"),
        ("(1+2)*3", "9"),
        ("-2^2", "4"),
        ("2^3^2", "64"),
        ("10-3-2", "5"),
        ("7/2", "3"),
        ("-7/2", "-3"),
        ("7.0/2", "3.500"),
        ("7 MOD 4", "3"),
        ("MOD(-7,4)", "-3"),
        ("1+1==2", "1"),
        ("2>1 AND 1>2 OR 1=<1", "1"),
        ("NOT 0", "1"),
        ("NOT 1 OR 1", "1"),
        ("3 <> 3.0", "0"),
        ("INT(2.7)+INT(-2.7)", "0"),
        ("SIN(30)", "0.500"),
        ("ATAN2(1,-1)", "135.000"),
        ("SQRT(2)", "1.414"),
        ("MAX(1,2.5,2)", "2.500"),
        ("MIN(3,1,2)", "1"),
        ("ABS(-3)+SGN(-0.5)", "2"),
        ("LOG10(1000)", "3.000"),
        ("-2147483648", "-2147483648"),
        ("POINT(1,2,3).Z+HERE.X", "12.000"),
        ("DIN(1)+DIN(-2)+DIN(1,2)", "2"),
        ("DOUT(2)-DOUT(1)", "1"),
        ("LEFTY+BELOW", "12000"),
        ("LAFSS", "11211"),
        ("ON*MODE", "3"),
    ] {
        assert_eq!(
            main_of(&format!("PRINT {expression}")).map(|t| t.trim().to_string()),
            Ok(value.into()),
            "{expression}"
        );
    }
}

#[test]
fn integer_division_may_be_real() {
    let options = LanguageOptions {
        int_division: crate::IntDivision::Real,
        ..Default::default()
    };
    let program = compile("PROGRAM M\nPRINT 7/2\nEND\n", &options).program.unwrap();
    let mut memory = Memory::new(&program);
    let Pause::Request(Request::Print { data, .. }) = Machine::main(program).run(&mut memory, &STILL, &mut 9)
    else {
        panic!()
    };
    assert_eq!(data, b"       3.500");
}

#[test]
fn loops_run_as_often_as_they_say() {
    for (body, text) in [
        ("FOR K=1 TO 3\nPRINT \"a\"\nNEXT K", "aaa"),
        ("FOR K=1 TO 0\nPRINT \"a\"\nNEXT K", ""),
        ("FOR K=3 TO 1 STEP -1\nPRINT \"a\"\nNEXT", "aaa"),
        ("FOR K=0.0 TO 1 STEP 0.5\nPRINT \"a\"\nNEXT", "aaa"),
        ("FOR K=1 TO 2\nFOR J=1 TO 2\nPRINT \"a\"\nNEXT J\nNEXT K", "aaaa"),
        (
            "N=0\nL:\nN=N+1\nFOR K=1 TO 5\nIF N<40 THEN GOTO L\nPRINT \"a\"\nNEXT",
            "aaaaa",
        ),
        (
            "FOR K=1 TO 2\nFOR J=1 TO 9\nPRINT \"a\"\nGOTO X\nNEXT J\nX:\nNEXT K",
            "aa",
        ),
    ] {
        assert_eq!(main_of(body).as_deref(), Ok(text), "{body}");
    }
}

#[test]
fn a_loop_left_by_goto_is_over() {
    let body = "N=1\nL:\nN=N+1\nFOR K=1 TO N\nIF N==2 THEN GOTO L\nPRINT \"a\"\nNEXT";
    assert_eq!(main_of(body).as_deref(), Ok("aaa"));
    // So is one whose own FOR is reached again: when the new one has ended, nothing is left for a NEXT.
    let body = "N=0\nL:\nN=N+1\nFOR K=1 TO 2\nIF N<3 THEN GOTO L\nA: PRINT \"a\"\nNEXT K\nIF N==9 THEN GOTO X\nN=9\nGOTO A\nX:";
    assert_eq!(fault_of(body), FaultKind::NextWithoutFor);
}

#[test]
fn calls_nest_sixteen_deep() {
    let source = "GLOBAL\nD=0\nEND\nPROGRAM M\nR\nEND\nPROGRAM R\nD=D+1\nR\nEND\n";
    let (mut machine, mut memory) = start(source);
    let Pause::Fault(fault) = machine.run(&mut memory, &STILL, &mut 999) else {
        panic!()
    };
    assert_eq!((fault.kind, fault.line), (FaultKind::Nesting, 9));
    let program = Arc::clone(&machine.program);
    assert_eq!(memory.global(&program, "D", &[]), Ok(Value::Integer(16)));
}

#[test]
fn open_calls_have_their_lines() {
    let source = "PROGRAM M\nA=1\nFIRST\nEND\nPROGRAM FIRST\nSECOND\nEND\nPROGRAM SECOND\nDELAY 1\nEND\n";
    let (mut machine, mut memory) = start(source);
    assert_eq!(machine.calls().collect::<Vec<_>>(), [("M", 2)]);
    let pause = machine.run(&mut memory, &STILL, &mut 999);
    assert!(
        matches!(pause, Pause::Request(Request::Delay { .. })),
        "{pause:?}"
    );
    let calls: Vec<_> = machine.calls().collect();
    assert_eq!(calls, [("M", 3), ("FIRST", 6), ("SECOND", 9)]);
}

// clause: EXAMPLE-04
#[test]
fn a_computed_goto_falls_through_outside_its_list() {
    for (k, text) in [(0, "f"), (1, "1"), (2, "2"), (3, "f"), (-1, "f")] {
        let body = format!("GOTO({k}) A,B\nPRINT \"f\"\nGOTO C\nA: PRINT \"1\"\nGOTO C\nB: PRINT \"2\"\nC:");
        assert_eq!(main_of(&body).as_deref(), Ok(text));
    }
}

#[test]
fn arguments_are_references_when_they_can_be() {
    let source = "GLOBAL\nDIM T(3) AS INTEGER\nEND\nPROGRAM M\nA=1\nADD(A,5)\nADD(T(2),A)\nADD(A+1,1)\nB=A\n\
        PRINT A,T(2),CR\nTWICE(A)\nPRINT A\nRETURN\nPRINT \"no\"\nEND\n\
        PROGRAM ADD(X,Y)\nX=X+Y\nEND\nPROGRAM TWICE(Z)\nADD(Z,Z)\nEND\n";
    assert_eq!(printed(source).unwrap().replace(' ', ""), "66|12");
}

#[test]
fn locals_are_kept_over_the_end_of_a_cycle_and_belong_to_their_program() {
    let (mut machine, mut memory) =
        start("PROGRAM M\nIF MODE==3 THEN GOTO L\nN=5\nL:\nS\nEND\nPROGRAM S\nN=1\nEND\n");
    assert_eq!(machine.run(&mut memory, &STILL, &mut 99), Pause::Ended);
    let program = Arc::clone(&machine.program);
    assert!(matches!(
        memory.global(&program, "N", &[]),
        Err(crate::AccessError::NotGlobal(_))
    ));
    assert!(matches!(
        memory.global(&program, "Q", &[]),
        Err(crate::AccessError::Unknown(_))
    ));
    let (mut machine, mut memory) = start("PROGRAM M\nGOTO L\nN=0\nL:\nPRINT N\nEND\n");
    assert!(
        matches!(machine.run(&mut memory, &STILL, &mut 99), Pause::Fault(f) if f.kind == FaultKind::Undefined)
    );
}

#[test]
fn a_number_that_does_not_fit_is_told_in_full() {
    let Err(Pause::Fault(fault)) = main_of("A=INT(2147483648.0)") else {
        panic!("it fits");
    };
    assert_eq!(fault.message, "2147483648 does not fit an integer of 32 bits");
}

#[test]
fn faults_name_kind_and_line() {
    for (body, kind) in [
        ("PRINT 1/0", FaultKind::DivisionByZero),
        ("PRINT 1.0/0.0", FaultKind::DivisionByZero),
        ("PRINT MOD(1,0)", FaultKind::DivisionByZero),
        ("GOTO L\nA=1\nL: PRINT A", FaultKind::Undefined),
        ("A=1\nMOVE A", FaultKind::Type),
        ("A=1\nA=POINT(1)", FaultKind::Type),
        ("A=POINT(1)\nA=1", FaultKind::Type),
        ("A=POINT(1)\nINPUT A", FaultKind::Type),
        ("SPEED=0", FaultKind::Range),
        ("SPEED=101", FaultKind::Range),
        ("CONFIG=13000", FaultKind::Range),
        ("DOUT(0)", FaultKind::Range),
        ("DELAY -1", FaultKind::Range),
        ("MOVEA 9,1", FaultKind::Range),
        ("A=POINT(0,0,0,0,0,0,0,0,3)", FaultKind::Range),
        ("FOR I=1 TO 2 STEP 0\nNEXT", FaultKind::Range),
        ("DIM T(2) AS REAL\nA=3\nT(A)=1", FaultKind::Subscript),
        ("M", FaultKind::Nesting),
        ("A=2147483647\nA=A+1", FaultKind::Overflow),
        ("A=3.0E38\nB=A*10", FaultKind::Overflow),
        ("A=POINT(-3.0E38)\nB=A+A", FaultKind::Overflow),
        ("A=TRANS(3.0E38)\nB=POINT(3.0E38)*A", FaultKind::Overflow),
        ("A=1\nA=3.0E10", FaultKind::Overflow),
        ("A=POINT(0,3.0E38)\nA=A+A", FaultKind::Overflow),
        ("A=TRANS(-3.0E38)\nB=A-TRANS(3.0E38)", FaultKind::Overflow),
        (
            "A=TRANS(3.0E38,0,0,0,0,90)\nB=A*TRANS(0,-3.0E38)",
            FaultKind::Overflow,
        ),
        (
            "A=POINT(0,0,-3.0E38)\nMOVE A*TRANS(0,0,-3.0E38)",
            FaultKind::Overflow,
        ),
        ("GOTO L\nFOR I=1 TO 2\nL:\nNEXT", FaultKind::NextWithoutFor),
        ("A=SQRT(-1)", FaultKind::Domain),
        ("A=LN(0)", FaultKind::Domain),
        ("A=(-1.0)^0.5", FaultKind::Domain),
    ] {
        if body.contains("INPUT") {
            let (mut machine, mut memory) = start(&format!("PROGRAM M\n{body}\nEND\n"));
            machine.run(&mut memory, &STILL, &mut 9);
            let fault = machine
                .answer(&mut memory, Answer::Values(vec![Number::Integer(1)]))
                .unwrap_err();
            assert_eq!((fault.kind, fault.line), (kind, 3));
        } else {
            assert_eq!(fault_of(body), kind, "{body}");
        }
    }
}

// clause: PRT-09 PRT-10 BUF-03 BUF-04 SER-03
#[test]
fn a_print_is_one_text() {
    let first = |line: &str| {
        let (mut machine, mut memory) = start(&format!("PROGRAM M\n{line}\nEND\n"));
        machine.run(&mut memory, &STILL, &mut 9)
    };
    let text = |channel, data: &[u8]| {
        Pause::Request(Request::Print {
            channel,
            data: data.to_vec(),
            cut: 0,
        })
    };
    let ten = b"INPUT DATA =    -333.333\r";
    assert_eq!(
        first("PRINT COM1,\"INPUT DATA =\",-1000.0/3,CR"),
        text(Channel::Com1, ten)
    );
    assert_eq!(
        first("print ip2,\"BUFFRESET\""),
        Pause::Request(Request::BufferReset {
            channel: Channel::Ip2
        })
    );
    assert_eq!(
        first("PRINT IP1,\"BUFFRESET\",CR"),
        text(Channel::Ip1, b"BUFFRESET\r")
    );
    assert_eq!(first("PRINT TP,\"BUFFRESET\""), text(Channel::Tp, b"BUFFRESET"));
    assert_eq!(first("PRINT CR"), text(Channel::Tp, b"\r"));
    let long = format!("PRINT \"{}\",1,1,1,1,1,CR", "x".repeat(200));
    for (line, end, lost) in [(long.clone(), b'\r', 5), (long.replace(",CR", ""), b' ', 4)] {
        let Pause::Request(Request::Print { data, cut, .. }) = first(&line) else {
            panic!()
        };
        assert_eq!((data.len(), cut), (crate::MAX_PRINT, lost));
        assert_eq!(data.last(), Some(&end), "a CR is never cut");
    }
}

#[test]
fn motions_carry_their_conditions() {
    let source = "PROGRAM M\nSPEED=20\nWORK=W1\nTOOL=TRANS(1,2)\nPAYLOAD=H1\n\
        MOVES P1-POINT(0,1) WITH ACCEL=60, config=12111\nFREELOAD\nMOVEC P1 P1\nMOVEC P1,P1 + P1\nMOVEA 1, 30.5 WITH SPEED=5\nMOVEI 2,-1\nMOVEJ P1 POINT(10,50,5) WITH SPEED=7\nREADY\n\
        P1.X=7\nMOVE P1\nEND\nDATA\nWORK W1\nPOINT P1=1,2,3/00100\nTRANS W1=5\nPAYLOAD H1=3\nEND\n";
    let (mut machine, mut memory) = start(source);
    let mut motions = Vec::new();
    loop {
        match machine.run(&mut memory, &STILL, &mut 99) {
            Pause::Request(Request::Move(motion)) => {
                motions.push(motion);
                machine.answer(&mut memory, Answer::Done).unwrap();
            }
            // HERE and DEST stand in another coordinate system from here on.
            Pause::Fuel => {}
            _ => break,
        }
    }
    let first = &motions[0].conditions;
    assert_eq!((first.speed, first.accel, first.decel), (20.0, 60.0, 100.0));
    assert_eq!(first.config.number(), 12111);
    assert_eq!(
        (first.work.name.as_deref(), first.work.trans.coords[0]),
        (Some("W1"), 5.0)
    );
    assert_eq!(
        (first.tool.name.as_deref(), first.tool.trans.coords[1]),
        (None, 2.0)
    );
    assert_eq!(first.payload.as_ref().unwrap().0.as_deref(), Some("H1"));
    let Path::Line(to) = &motions[0].path else {
        panic!()
    };
    assert_eq!((to.coords[1], to.config.number()), (1.0, 100));
    assert_eq!(to.work.as_ref().unwrap().name.as_deref(), Some("W1"));
    assert_eq!(motions[1].conditions.accel, 100.0);
    assert_eq!(motions[1].conditions.payload, None);
    assert!(matches!(&motions[2].path, Path::Arc { end, .. } if end.coords[0] == 2.0));
    assert_eq!(motions[3].path, Path::Axis { axis: 1, value: 30.5 });
    assert_eq!(motions[3].conditions.speed, 5.0);
    assert_eq!(motions[4].path, Path::AxisBy { axis: 2, delta: -1.0 });
    assert!(
        matches!(&motions[5].path, Path::Arch { retreat: 10.0, single_axis_1: 50.0, single_axis_2: 5.0, end } if end.coords[0] == 1.0)
    );
    assert_eq!(motions[5].conditions.speed, 7.0);
    assert_eq!(motions[6].path, Path::Ready);
    assert!(matches!(&motions[7].path, Path::Ptp(to) if to.coords[..2] == [7.0, 2.0]));
}

// clause: CMD-DO-01 CMD-DO-04 INP-12
#[test]
fn direct_statements_see_global_and_data_only() {
    let source = "GLOBAL\nA=1\nEND\nPROGRAM M\nL=1\nEND\nDATA\nPOINT P1=1\nEND\n";
    let base = compile(source, &LanguageOptions::default()).program.unwrap();
    let mut memory = Memory::new(&base);
    let outputs = compile_direct("DOUT(1,-2)", &base).unwrap();
    let mut machine = Machine::direct(outputs);
    let (mut fuel, asked) = (1, Pause::Request(Request::Outputs(vec![(1, true), (2, false)])));
    assert_eq!(machine.run(&mut memory, &STILL, &mut fuel), asked);
    machine.answer(&mut memory, Answer::Done).unwrap();
    assert_eq!(machine.run(&mut memory, &STILL, &mut fuel), Pause::Ended);
    let mut assign = Machine::direct(compile_direct("a = a + 41", &base).unwrap());
    assert_eq!(assign.run(&mut memory, &STILL, &mut 1), Pause::Ended);
    assert_eq!(memory.global(&base, "A", &[]), Ok(Value::Integer(42)));
    for good in [
        "MOVE P1 WITH SPEED=5",
        "INPUT COM1,A",
        "SPEED=10",
        "READY",
        "move point (1,2,3)",
        "PRINT TP,A",
        "GAIN={1,1,1,1,0}",
        "OPEN1",
        "TIMER=0",
        "PULOUT(1,0.5)",
        "BCDOUT(1,2,42)",
        "ENABLE NOWAIT",
    ] {
        assert!(compile_direct(good, &base).is_ok(), "{good}");
    }
    for bad in [
        "",
        "XYZZY 1",
        "XYZZY",
        "M",
        "L=2",
        "N=2",
        "PRINT Q",
        "GOTO L",
        "IF A THEN A=1",
        "FOR A=1 TO 2",
        "NEXT",
        "WAIT A",
        "RETURN",
        "END",
        "PROGRAM X",
        "GLOBAL",
        "DATA",
        "X: A=1",
        "MOVE A",
        "A=1\nA=2",
        "PRINT CRE",
        "ON A DO BREAK",
        "IGNORE",
        "ENABLE",
        "A = TASK(\"M\")",
        "SWITCH",
        "KILL 1",
        "DIM X(1)",
    ] {
        assert!(compile_direct(bad, &base).is_err(), "{bad}");
    }
    let empty = Program::empty(&LanguageOptions::default());
    assert!(compile_direct("DELAY 1", &empty).is_ok());
    assert_eq!(
        Machine::main(empty.clone()).run(&mut Memory::new(&empty), &STILL, &mut 1),
        Pause::Ended
    );
}

#[test]
fn a_condition_at_fault_leaves_the_statement_under_way() {
    let (mut machine, mut memory) =
        start("PROGRAM M\nDIM A(1) AS INTEGER\nI=1\nON A(I)==2 DO GOTO L\nI=9\nI=3\nL:\nEND\n");
    for _ in 0..3 {
        assert_eq!(machine.run(&mut memory, &STILL, &mut 1), Pause::Fuel);
    }
    let fault = machine.check_monitors(&mut memory, &STILL).unwrap_err();
    assert_eq!((fault.kind, fault.line), (FaultKind::Subscript, 4));
    assert_eq!(machine.line(), 6);
    assert_eq!(machine.run(&mut memory, &STILL, &mut 9), Pause::Ended);
}

// clause: DATA-09 CMD-MW-06
#[test]
fn positions_follow_their_coordinate_system() {
    let source = "PROGRAM M\nMOVE P1\nEND\nDATA\nWORK W\nPOINT P1=1\nTRANS W=5\nEND\n";
    let program = compile(source, &LanguageOptions::default()).program.unwrap();
    let mut memory = Memory::new(&program);
    let trans = crate::Trans { coords: [6.0; 6] };
    memory
        .set_global(&program, "w", &[], trans.clone().into())
        .unwrap();
    memory
        .set_global(&program, "P1", &[], Position::default().into())
        .unwrap();
    let Ok(Value::Position(p1)) = memory.global(&program, "P1", &[]) else {
        panic!()
    };
    assert_eq!(p1.work.unwrap().trans, trans);
    let wrong = memory.set_global(&program, "P1", &[], Value::Integer(1));
    assert!(matches!(wrong, Err(crate::AccessError::KindMismatch { .. })));
}
