//! Snapshots: a run that is written down at a statement and read back goes on as if nothing had happened, and what
//! was tampered with is refused or runs, but never panics.

#![expect(
    clippy::unwrap_used,
    reason = "a snapshot that cannot be taken or read fails the test"
)]

use std::collections::VecDeque;
use std::sync::Arc;

use crate::common::{World, answers, compiled, describe, programs};
use scol_mini::{Answer, Machine, Memory, Number, Pause, Program, Request, RestoreError};
use serde_json::Value as Json;

/// Most statements of a program that are run.
const STATEMENTS: usize = 1_500;
/// Most places of a program at which a snapshot is taken.
const SNAPSHOTS: usize = 120;

/// A run, one statement at a time.
#[derive(Clone)]
struct Play {
    machine: Machine,
    memory: Memory,
    answers: VecDeque<Answer>,
    lines: Vec<String>,
    over: bool,
}

impl Play {
    fn new(program: &Arc<Program>, source: &str) -> Play {
        Play {
            machine: Machine::main(Arc::clone(program)),
            memory: Memory::new(program),
            answers: answers(source),
            lines: Vec::new(),
            over: false,
        }
    }

    /// Runs one statement, or answers the request of one.
    fn step(&mut self) {
        let line = self.machine.line();
        if let Some(request) = self.machine.pending() {
            let answer = match request {
                Request::Task { .. } => Some(Answer::Values(vec![Number::Integer(2)])),
                Request::Input { expected, .. } => {
                    let filled = || Answer::Cancelled(vec![Number::Real(1.5); (*expected).min(1)]);
                    Some(self.answers.pop_front().unwrap_or_else(filled))
                }
                _ => Some(Answer::Done),
            };
            if let Some(Err(fault)) = answer.map(|answer| self.machine.answer(&mut self.memory, answer)) {
                self.lines.push(format!("FAULT {fault}"));
                self.machine.skip();
            }
            return;
        }
        match self.machine.run(&mut self.memory, &World, &mut 1) {
            Pause::Request(request) => self.lines.push(format!("{line} {}", describe(&request))),
            Pause::Fuel => self.lines.push(format!("{line}")),
            Pause::Waiting => {
                self.lines.push(format!("{line} WAITING"));
                self.machine.skip();
            }
            Pause::Fault(fault) => {
                self.lines.push(format!("FAULT {fault}"));
                self.machine.skip();
            }
            Pause::Ended => self.over = true,
        }
    }

    fn finish(&mut self, steps: usize) {
        for _ in 0..steps {
            if self.over {
                return;
            }
            self.step();
        }
    }

    fn written(&self) -> (String, String) {
        let machine = serde_json::to_string(&self.machine).unwrap();
        (machine, serde_json::to_string(&self.memory).unwrap())
    }

    /// The same, from paper.
    fn read(&self, program: &Arc<Program>) -> Play {
        let (machine, memory) = self.written();
        let mut machine: Machine = serde_json::from_str(&machine).unwrap();
        let mut memory: Memory = serde_json::from_str(&memory).unwrap();
        machine.relink(Arc::clone(program)).unwrap();
        memory.relink(program).unwrap();
        Play {
            machine,
            memory,
            ..self.clone()
        }
    }
}

#[test]
fn a_run_goes_on_from_every_statement_as_the_whole_run() {
    let mut taken = 0;
    for (path, source) in programs("run") {
        // A second compilation: a state does not hang on one program in memory.
        let (program, again) = (compiled(&source), compiled(&source));
        let mut whole = Play::new(&program, &source);
        whole.finish(STATEMENTS);
        let every = whole.lines.len().div_ceil(SNAPSHOTS).max(1);
        let mut play = Play::new(&program, &source);
        for step in 0..STATEMENTS {
            if play.over {
                break;
            }
            if step % every == 0 {
                let mut restored = play.read(&again);
                assert_eq!(restored.written(), play.written());
                restored.finish(STATEMENTS - step);
                assert_eq!(restored.lines, whole.lines, "{} from step {step}", path.display());
                assert_eq!(restored.written(), whole.written(), "{}", path.display());
                taken += 1;
            }
            play.step();
        }
    }
    assert!(taken > 1_000, "only {taken} snapshots");
}

#[test]
fn another_program_or_version_is_refused_with_words() {
    let (one, other) = (
        compiled("PROGRAM A\nI = 1\nEND\n"),
        compiled("PROGRAM A\nI = 2\nEND\n"),
    );
    let (mut machine, mut memory) = (Machine::main(Arc::clone(&one)), Memory::new(&one));
    let error = machine.relink(Arc::clone(&other)).unwrap_err();
    assert_eq!(
        error,
        RestoreError::Program {
            expected: other.fingerprint(),
            found: one.fingerprint()
        }
    );
    assert!(
        error.to_string().starts_with("expected a state of the program "),
        "{error}"
    );
    assert_eq!(memory.relink(&other).unwrap_err(), error);
    let mut json = serde_json::to_value(&memory).unwrap();
    json["version"] = 2.into();
    let error = serde_json::from_value::<Memory>(json).unwrap_err();
    assert_eq!(error.to_string(), RestoreError::Version(2).to_string());
}

/// A program whose state has something of everything.
const RICH: &str = "GLOBAL\nDIM T(3) AS INTEGER, Q(2) AS POINT\nG = 1.5\nEND\nPROGRAM M\nP = POINT(1,2,3)\nW1 = TRANS(1)\n\
    ON DIN(3) DO GOTO OUT\nFOR I = 1 TO 3\nFOR X = 0.5 TO 2\nSUB(I, I + 1, P + P)\nNEXT X\nNEXT I\nOUT:\nMOVE Q1 WITH SPEED = 50\n\
    INPUT I, T(2)\nDELAY 0.5\nTASK(\"OTHER\")\nPAYLOAD = L1\nPRINT I\nMOVEA 2, 10\nPULOUT(3, 1)\nTIMER = 2\nEND\n\
    PROGRAM SUB(A, B, C)\nFOR K = 1 TO 2\nA = A + 0\nB = B + 1\nQ(1) = C\nDEEP(A, B, C)\nNEXT K\nEND\n\
    PROGRAM DEEP(A, B, C)\nB = B - 1\nPRINT A, B\nEND\nPROGRAM OTHER\nEND\n\
    DATA\nTRANS W=1,2,3,0,0,90\nWORK W\nPOINT Q1=1,2,3,4,5,6,7,8/12111\nPAYLOAD L1=1,2,3,4,5,6,7\nEND\n";

/// xorshift64*: small, seeded, the same everywhere.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % bound.max(1)
    }
}

/// Changes one place of a value.
fn tamper(json: &mut Json, random: &mut Random) {
    let inner = random.below(8) > 0;
    match json {
        Json::Array(list) if !list.is_empty() => {
            let at = random.below(list.len());
            match random.below(10) {
                0 => drop(list.remove(at)),
                1 => list.push(list[at].clone()),
                _ => tamper(&mut list[at], random),
            }
        }
        Json::Object(fields) if inner && !fields.is_empty() => {
            let at = random.below(fields.len());
            if let Some((_, field)) = fields.iter_mut().nth(at) {
                tamper(field, random);
            }
        }
        other => {
            let numbers = [0.0, 1.0, 2.0, -1.0, 3.0, 17.0, 255.0, 4e9, 1e300, 0.5];
            *other = match random.below(14) {
                0 => Json::Null,
                1 => Json::Bool(random.below(2) == 0),
                2 => u64::MAX.into(),
                3 => usize::MAX.into(),
                4 => serde_json::json!({ "Vector": random.below(4) }),
                5 => serde_json::json!({ "Integer": random.below(4) }),
                6 => ["Ready", "Waiting", "Faulted", "Ended", "Nothing", "Stop"][random.below(6)].into(),
                _ => {
                    let number = numbers[random.below(numbers.len())];
                    if number == f64::trunc(number) && number.abs() < 1e10 {
                        (number as i64).into()
                    } else {
                        number.into()
                    }
                }
            };
        }
    }
}

#[test]
fn a_state_that_was_tampered_with_is_refused_or_runs_but_never_panics() {
    let program = compiled(RICH);
    let mut random = Random(0x7533_1001);
    let (mut refused, mut ran) = (0, 0);
    let mut play = Play::new(&program, RICH);
    while !play.over {
        for _ in 0..60 {
            let mut machine = serde_json::to_value(&play.machine).unwrap();
            let mut memory = serde_json::to_value(&play.memory).unwrap();
            for _ in 0..=random.below(3) {
                tamper(
                    if random.below(2) == 0 {
                        &mut machine
                    } else {
                        &mut memory
                    },
                    &mut random,
                );
            }
            let machine = serde_json::from_value::<Machine>(machine).ok();
            let memory = serde_json::from_value::<Memory>(memory).ok();
            let linked =
                |mut machine: Machine| machine.relink(Arc::clone(&program)).is_ok().then_some(machine);
            let machine = machine.and_then(linked);
            let memory = memory.and_then(|mut memory| memory.relink(&program).is_ok().then_some(memory));
            let Some((machine, memory)) = machine.zip(memory) else {
                refused += 1;
                continue;
            };
            ran += 1;
            let mut changed = Play {
                machine,
                memory,
                ..play.clone()
            };
            changed.memory.drop_tasks(&program);
            changed.finish(60);
            let _ = changed.machine.check_monitors(&mut changed.memory, &World);
            changed.machine.skip();
            changed.machine.restart();
            changed.finish(20);
        }
        play.step();
    }
    assert!(refused > 500 && ran > 200, "{refused} refused, {ran} ran");
}

#[test]
fn what_no_run_leads_to_is_refused() {
    let program = compiled(RICH);
    let mut play = Play::new(&program, RICH);
    while play.machine.pending().is_none() {
        play.step();
    }
    let refuse = |path: &str, value: Json| {
        let (memory, pointer) = match path.strip_prefix("memory") {
            Some(pointer) => (true, pointer),
            None => (false, path),
        };
        let mut json = if memory {
            serde_json::to_value(&play.memory).unwrap()
        } else {
            serde_json::to_value(&play.machine).unwrap()
        };
        *json
            .pointer_mut(pointer)
            .unwrap_or_else(|| panic!("{path} in {}", serde_json::json!(play.machine))) = value;
        let error = if memory {
            serde_json::from_value::<Memory>(json).unwrap().relink(&program)
        } else {
            let mut machine: Machine = serde_json::from_value(json).unwrap();
            machine.relink(Arc::clone(&program))
        };
        assert!(
            matches!(error, Err(RestoreError::Invalid(_))),
            "{path}: {error:?}"
        );
    };
    refuse("/at", 100_000.into());
    refuse("/frames/1/return_to", 100_000.into());
    refuse("/frames/1/arguments", 50.into());
    refuse("/frames", serde_json::json!([]));
    refuse("/loops/0/opener", 0.into());
    refuse("/loops/0/step", serde_json::json!({ "Integer": 0 }));
    refuse("/monitors/0/on", 0.into());
    refuse("/monitors/0/depth", 0.into());
    refuse("/arguments/0/Place/Cell/cell", 10_000.into());
    refuse("memory/cells", serde_json::json!([]));
    refuse("memory/cells/0", serde_json::json!({ "Real": 1.5 }));
    refuse("memory/kinds/0", "Real".into());
    refuse("memory/vectors/0", serde_json::json!({ "Integer": 1 }));
    refuse("memory/free", serde_json::json!([0]));
    refuse("memory/conditions/speed", 0.0.into());
    refuse("memory/conditions/gain/3", 101.0.into());
    // Q(1) and P hold different positions.
    let held = serde_json::to_value(&play.memory).unwrap();
    let cells = held["cells"].as_array().unwrap();
    let vector = |at: u64| cells.iter().position(|cell| cell["Vector"] == at).unwrap();
    let twice = serde_json::json!({ "Vector": 0 });
    let (first, second) = (vector(0), vector(1));
    assert_ne!(first, second);
    refuse(&format!("memory/cells/{second}"), twice);
}

#[test]
fn an_input_that_wants_more_numbers_than_it_has_variables_is_refused() {
    let program = compiled("PROGRAM M\nINPUT A, B\nEND\n");
    let (mut machine, mut memory) = (Machine::main(Arc::clone(&program)), Memory::new(&program));
    machine.run(&mut memory, &World, &mut 1);
    let mut json = serde_json::to_value(&machine).unwrap();
    let expected = json
        .pointer_mut("/state/Requested/request/Input/expected")
        .unwrap();
    assert_eq!(*expected, 2);
    *expected = usize::MAX.into();
    let mut machine: Machine = serde_json::from_value(json).unwrap();
    let error = machine.relink(program).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the state does not match the program: expected a variable for each number of INPUT"
    );
}
