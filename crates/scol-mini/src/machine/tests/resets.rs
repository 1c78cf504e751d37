//! Tests of what RS does to a machine and its memory: the label RCYCLE, variables of the programs that begin again.

use super::*;

#[test]
fn rcycle_is_a_place_to_go_on_from() {
    let (mut machine, mut memory) = start("PROGRAM M\nA=0\nRCYCLE:\nA=A+1\nEND\n");
    assert_eq!(machine.run(&mut memory, &STILL, &mut 99), Pause::Ended);
    assert!(machine.go_to_rcycle());
    assert_eq!(machine.line(), 4);
    assert_eq!(machine.run(&mut memory, &STILL, &mut 1), Pause::Fuel);
    let (mut machine, _) = start("PROGRAM M\nEND\n");
    assert!(!machine.go_to_rcycle());
}

/// Runs to the end; returns the kind of the fault that ends it before.
fn ends(machine: &mut Machine, memory: &mut Memory) -> Option<FaultKind> {
    match machine.run(memory, &STILL, &mut 1_000) {
        Pause::Ended => None,
        Pause::Fault(fault) => Some(fault.kind),
        pause => panic!("{pause:?}"),
    }
}

// clause: T10
#[test]
fn variables_of_programs_can_begin_again() {
    let source = "GLOBAL\nF = 0\nG = 1\nR = 0\nEND\nPROGRAM M\nDIM T(2) AS INTEGER\nIF F == 1 THEN GOTO AGAIN\n\
        N = 5\nP = POINT(1,2,3)\nT(1) = 4\nG = 2\nD.X = 9\nSPEED = 40\nSUB\nF = 1\nGOTO OUT\n\
        AGAIN: R = T(1)\nG = 3\nR = N\nOUT:\nEND\nPROGRAM SUB\nK = 6\nEND\nDATA\nPOINT D = 1,2,3\nEND\n";
    let compilation = compile(source, &LanguageOptions::default());
    let program = compilation.program.unwrap();
    let global = |memory: &Memory, name: &str| memory.global(&program, name, &[]).unwrap();
    for is_reset in [false, true] {
        let mut memory = Memory::new(&program);
        let mut machine = Machine::main(Arc::clone(&program));
        assert_eq!(ends(&mut machine, &mut memory), None);
        let conditions = memory.conditions().clone();
        let datum = global(&memory, "D");
        if is_reset {
            memory.reset_locals(&program);
        }
        assert_eq!(memory.conditions(), &conditions);
        assert_eq!(global(&memory, "D"), datum);
        assert_eq!(global(&memory, "G"), Value::Integer(2));
        machine.restart();
        let (fault, left) = match is_reset {
            // The array begins as zeros, as in a task that begins; N has no value.
            true => (Some(FaultKind::Undefined), 0),
            false => (None, 5),
        };
        assert_eq!(ends(&mut machine, &mut memory), fault);
        assert_eq!(global(&memory, "G"), Value::Integer(3));
        assert_eq!(global(&memory, "R"), Value::Integer(left));
    }
}

#[test]
fn variables_that_begin_again_give_their_places_back() {
    let source = "PROGRAM M\nP = POINT(1,2,3)\nQ = POINT(4,5,6)\nEND\n";
    let (mut machine, mut memory) = start(source);
    let program = compile(source, &LanguageOptions::default()).program.unwrap();
    let mut places = Vec::new();
    for _ in 0..3 {
        assert_eq!(ends(&mut machine, &mut memory), None);
        places.push(memory.clone());
        memory.reset_locals(&program);
        machine.restart();
    }
    // Places are given back in order and taken again from the end.
    assert_eq!(places[0], places[2], "nothing piles up");
}
