//! Fuzzes the SCOL machine alone: a program and, after a zero byte, the choices for signals, answers, cancellations and
//! skips.
//!
//! The machine never panics, uses no more fuel than it is given, and a copy of it behaves the same at any statement. The
//! whole controller is fuzzed by `cell.rs`.
use super::shared::{Choices, text_and_choices};
use scol_mini::{
    Answer, Arm, Inputs, LanguageOptions, Machine, Memory, MonitorAction, Number, Pause, Position, Request,
    compile,
};
use std::sync::Arc;

/// Statements of one run.
const FUEL: u32 = 3_000;
/// Times the machine is resumed in one run.
const ROUNDS: u32 = 2_000;

struct World(u8);

impl Inputs for World {
    fn din(&self, line: u16) -> bool {
        self.0 >> (line % 8) & 1 == 1
    }
    fn dout(&self, line: u16) -> bool {
        self.0 >> (line % 7) & 1 == 1
    }
    fn motion_percent(&self) -> f64 {
        f64::from(self.0)
    }
    fn here(&self) -> Position {
        Position::default()
    }
    fn mode(&self) -> i32 {
        i32::from(self.0)
    }
}

fn number(choices: &mut Choices<'_>) -> Number {
    let value = i32::from(choices.word()) << (choices.byte() % 17);
    if value & 1 == 0 {
        Number::Integer(value)
    } else {
        Number::Real(f32::from_bits(value as u32 ^ 0x4000_0000))
    }
}

fn answer(machine: &mut Machine, memory: &mut Memory, request: &Request, choices: &mut Choices<'_>) {
    let choice = choices.byte();
    let answer = match request {
        _ if choice % 16 == 15 => {
            machine.skip();
            return;
        }
        Request::Input { expected, .. } if choice % 4 == 3 => {
            let some = usize::from(choice) % (expected + 1);
            Answer::Cancelled((0..some).map(|_| number(choices)).collect())
        }
        Request::Input { expected, .. } => Answer::Values((0..*expected).map(|_| number(choices)).collect()),
        Request::Task { .. } => Answer::Values(vec![Number::Integer(2)]),
        _ => Answer::Done,
    };
    // A value that cannot be stored is a fault, on which the controller skips the statement.
    if machine.answer(memory, answer).is_err() {
        machine.skip();
    }
}

pub fn check(data: &[u8]) {
    let (source, mut choices) = text_and_choices(data);
    let arm = if source.contains("SCARA") {
        Arm::Scara
    } else {
        Arm::SixAxis
    };
    let options = LanguageOptions {
        arm,
        ..LanguageOptions::default()
    };
    let Some(program) = compile(&source, &options).program else {
        return;
    };
    let mut memory = Memory::new(&program);
    let mut machine = Machine::main(Arc::clone(&program));
    let mut fuel = FUEL;
    for _ in 0..ROUNDS {
        let world = World(choices.byte());
        if let Ok(Some(MonitorAction::Handler(mut handler))) = machine.check_monitors(&mut memory, &world) {
            for _ in 0..8 {
                match handler.run(&mut memory, &world, &mut 50) {
                    Pause::Request(request) => answer(&mut handler, &mut memory, &request, &mut choices),
                    Pause::Ended => break,
                    Pause::Fuel | Pause::Waiting | Pause::Fault(_) => handler.skip(),
                }
            }
        }
        let before = fuel;
        let mut slice = fuel.min(u32::from(choices.byte()) + 1);
        let fuel_slice = slice;
        let copy = (machine.clone(), memory.clone());
        let pause = machine.run(&mut memory, &world, &mut slice);
        fuel -= fuel_slice - slice;
        assert!(fuel <= before && slice <= fuel_slice);
        if choices.byte() == 77 {
            // The same again from the copy: a snapshot is worth as much as the machine.
            let (mut other, mut its_memory) = copy;
            let mut again = fuel_slice;
            let repeated = other.run(&mut its_memory, &world, &mut again);
            assert_eq!(format!("{repeated:?}"), format!("{pause:?}"));
            assert_eq!(again, slice);
        }
        match pause {
            Pause::Request(request) => answer(&mut machine, &mut memory, &request, &mut choices),
            Pause::Fault(fault) => {
                assert!(fault.line >= 1 && !fault.message.is_empty());
                machine.skip();
            }
            Pause::Waiting => machine.skip(),
            Pause::Fuel if fuel == 0 => return,
            Pause::Fuel => {}
            Pause::Ended if choices.is_empty() => return,
            Pause::Ended => {
                if !machine.go_to_rcycle() {
                    machine.restart();
                }
            }
        }
    }
}
