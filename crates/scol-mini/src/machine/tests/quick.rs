//! The quick form of a program beside its steps: whatever can be seen of a run is the same.

use super::*;
use crate::code::{Code, Instruction, Quick};
use std::format;
use std::vec::Vec;

/// Everything that can be seen of a run in portions of `portion` statements: pauses, lines, values, fuel.
fn history(program: &Arc<Program>, portion: u32) -> Vec<String> {
    let (mut machine, mut memory) = (Machine::main(Arc::clone(program)), Memory::new(program));
    let mut seen = Vec::new();
    for _ in 0..400 {
        let mut fuel = portion;
        let pause = machine.run(&mut memory, &STILL, &mut fuel);
        let values: Vec<Option<Value>> = (0..program.symbols.cells).map(|at| memory.value(at)).collect();
        seen.push(format!(
            "{pause:?} left {fuel} line {} loops {:?} arguments {:?} {values:?}",
            machine.line(),
            machine.loops,
            machine.arguments
        ));
        match pause {
            Pause::Request(Request::Input { wanted, .. }) => {
                let numbers = (0..wanted).map(|n| Number::Real(n as f32 + 1.5)).collect();
                let _ = machine.answer(&mut memory, Answer::Values(numbers));
            }
            Pause::Request(Request::Task { .. }) => {
                let _ = machine.answer(&mut memory, Answer::Values(vec![Number::Integer(2)]));
            }
            Pause::Request(_) => machine.answer(&mut memory, Answer::Done).unwrap(),
            Pause::Fuel => {}
            Pause::Ended => break,
            Pause::Fault(_) | Pause::Waiting => machine.skip(),
        }
    }
    seen
}

/// Statements at the edges of what the quick form does, each a whole body of a program.
const EDGES: &[&str] = &[
    "I = 2147483647\nI = I + 1\nPRINT I",
    "I = -2147483647\nI = I - 1\nJ = I / -1\nJ = I MOD -1\nPRINT J\nI = I * 2\nI = -I\nI = ABS(I)",
    "I = 7\nI = 2.9\nPRINT I\nI = 1E20\nPRINT I\nX = 1.5\nX = 3\nPRINT X, X / 2\nX = 3E38\nX = X * 10\nX = X + X\nX = -X - X",
    "I = 1 / 0\nI = 1.0 / 0\nI = 0 / 0.0\nI = 5 MOD 0\nI = MOD(5.0, 0.0)\nX = MOD(7.5, 2)\nPRINT X",
    "X = 7.5\nY = 2.0\nZ = X MOD Y\nPRINT Z\nZ = -X MOD Y\nPRINT Z\nI = 7\nJ = 4\nK = I MOD J\nPRINT K\nZ = X - Y\nZ = X * Y\nZ = Y / X\nPRINT Z",
    "IF A > 1 THEN B = 1\nB = A\nA = 1\nB = A + C\nC = 1",
    "P = POINT(1,2,3)\nQ = P + P\nIF P > 1 THEN I = 1\nI = 1\nI = P\nP = 1\nX = P.Y\nPRINT X",
    "FOR I = 1 TO 3 STEP 0\nNEXT I",
    "FOR I = 3 TO 1\nPRINT I\nNEXT I\nFOR I = 3 TO 1 STEP -1\nPRINT I\nNEXT I\nFOR X = 0 TO 1 STEP 0.25\nPRINT X\nNEXT X",
    "I = 1\nFOR I = 1.5 TO 4 STEP 1.5\nPRINT I\nNEXT I\nX = 0.5\nFOR X = 1 TO 3\nPRINT X\nNEXT X",
    "FOR I = 2147483645 TO 2147483647\nPRINT I\nNEXT I",
    "FOR I = 1 TO 3\nFOR J = 1 TO 3\nIF J == 2 THEN GOTO OUT\nNEXT J\nOUT:\nPRINT I, J\nNEXT I\nGOTO IN\nFOR K = 1 TO 2\nIN:\nNEXT K",
    "DIM A(3) AS INTEGER, B(2,3), C(1,1,1) AS REAL\nA(1) = 2.7\nA(A(1)) = 9\nPRINT A(2)\nA(4) = 1\nA(-1) = 1\nX = 1.0\nA(X) = 5\n\
     PRINT B(0,0)\nB(2,3) = 1.5\nB(1,1) = 2\nPRINT B(1,1)\nB(3,0) = 1\nB(0,4) = 1\nI = B(2,-1)\nC(1,1,1) = 4\nPRINT C(1,1,1) + B(2,3)",
    "FOR K = -1 TO 4\nGOTO(K) ONE, TWO\nPRINT K\nGOTO BACK\nONE:\nPRINT 100\nGOTO BACK\nTWO:\nPRINT 200\nBACK:\nNEXT K\nX = 1.9\nGOTO(X) TWO",
    "I = 3\nHALF(I)\nPRINT I\nHALF(7)\nHALF(I + 1)\nX = 5.0\nHALF(X)\nPRINT X\nHALF(U)\nP = POINT(1)\nHALF(P)\nDEEP(1)\nOUTER(I)\nOUTER(I + 1)",
    "K = 7\nX = 0.5\nX = K / 2\nPRINT X, K / 2\nK = K / 2\nPRINT K",
    "DIM A(3) AS INTEGER, D(2,3) AS INTEGER\nK = 4\nA(K) = 1\nPRINT D(0,0), A(K)\nD(1,0) = 6\nD(0,K) = 5\nPRINT D(1,0)\nK = D(0,K)\nD(2,K) = 1",
    "I = NOT 0\nJ = NOT 2.5\nK = I AND J OR 0\nL = 1 < 2\nL = 1.5 <> 1.5\nPRINT I, J, K, L\nK = 2 ^ 3\nX = 2 ^ -1\nX = -2.0 ^ 0.5\nK = 10 ^ 10",
    "X = SQRT(2)\nX = SQRT(-1)\nX = SIN(30)\nK = INT(-2.9)\nK = INT(3E9)\nK = SGN(-3.5)\nX = ATAN2(1, 1)\nX = MAX(1, 2.5)\nK = MIN(4, 2)\n\
     X = LN(0)\nX = REAL(3)\nX = EXP(100)\nPRINT X, K",
    "K = 0\nAGAIN:\nK = K + 1\nIF K < 5 THEN GOTO AGAIN ELSE PRINT K\nIF K THEN IF K - 5 THEN PRINT 1 ELSE PRINT 2\nIF X THEN PRINT 3\nX = 1",
    "WAIT DIN(1)\nWAIT MOTION >= 100\nI = DIN(2)\nON I == 1 DO HALF(J)\nJ = 4\nI = 1\nPRINT J\nINPUT I, Z\nPRINT I, Z",
];

#[test]
fn the_quick_form_does_what_the_steps_do() {
    const REST: &str = "\nPRINT \"END\"\nEND\nPROGRAM HALF(N)\nN = N / 2\nPRINT N\nFOR L = 1 TO 2\nIF N > 2 THEN RETURN\nNEXT L\nEND\n\
        PROGRAM DEEP(N)\nN = N + 1\nDEEP(N)\nEND\nPROGRAM OUTER(N)\nHALF(N)\nHALF(N * 2.0)\nN = 2.5\nEND\n";
    let mut quick = 0;
    for body in EDGES {
        for division in [crate::IntDivision::Truncate, crate::IntDivision::Real] {
            let options = LanguageOptions {
                int_division: division,
                ..LanguageOptions::default()
            };
            let source = format!("GLOBAL\nZ = 2.5\nEND\nPROGRAM M\n{body}{REST}");
            let compilation = compile(&source, &options);
            let program = compilation
                .program
                .unwrap_or_else(|| panic!("{source}\n{:?}", compilation.diagnostics));
            let leaves = |i: &&Instruction| i.operation != Quick::Leave;
            quick += program.code.instructions.iter().filter(leaves).count();
            let slow = Arc::new(Program {
                code: Code::default(),
                ..Program::clone(&program)
            });
            for portion in [1, 2, 3, 7, 1_000] {
                let (expected, found) = (history(&slow, portion), history(&program, portion));
                assert!(expected.len() > 1, "{source}");
                for (expected, found) in expected.iter().zip(&found) {
                    assert_eq!(found, expected, "portions of {portion}:\n{source}");
                }
                assert_eq!(expected.len(), found.len());
            }
        }
    }
    assert!(quick > 400, "only {quick} instructions");
}

#[cfg(feature = "serde")]
#[test]
fn a_memory_that_was_restored_has_the_cells_of_the_quick_form() {
    let (machine, mut memory) = start("PROGRAM M\nI = 1\nJ = I * 7 + 2\nEND\n");
    let mut restored = Memory::restore(&machine.program, memory.state(&machine.program)).unwrap();
    assert_eq!(restored.registers(), memory.registers());
}
