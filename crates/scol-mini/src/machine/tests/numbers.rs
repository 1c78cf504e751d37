//! Instructions that compute with numbers beside the operations of their steps: whatever can be seen of a run is the same.
//! What the operations do is tested elsewhere.

use super::*;
use crate::code::Op;
use crate::compile::lower;
use std::format;
use std::vec::Vec;

/// Everything that can be seen of a run in portions of `portion` statements: pauses, lines, values, fuel.
fn history(program: &Arc<Program>, portion: u32) -> Vec<String> {
    let (mut machine, mut memory) = (Machine::main(Arc::clone(program)), Memory::new(program));
    let mut seen = Vec::new();
    for _ in 0..600 {
        let mut fuel = portion;
        let pause = machine.run(&mut memory, &STILL, &mut fuel);
        let values: Vec<Option<Value>> = (0..program.symbols.cells).map(|at| memory.value(at)).collect();
        seen.push(format!(
            "{pause:?} left {fuel} line {} frames {:?} loops {:?} arguments {:?} {values:?}",
            machine.line(),
            machine.frames,
            machine.loops,
            machine.arguments
        ));
        match pause {
            Pause::Request(Request::Input { expected, .. }) => {
                let numbers = (0..expected).map(|n| Number::Real(n as f32 + 1.5)).collect();
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

/// Statements at the edges of what instructions do, each a whole body of a program.
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
    "I = NOT 0\nJ = NOT 2.5\nK = I AND J OR 0\nL = 1 < 2\nL = I < 2\nX = 1.5\nL = X <> 1.5\nPRINT I, J, K, L\nK = 2 ^ 3\nX = 2 ^ -1\nX = -2.0 ^ 0.5\nK = 10 ^ 10",
    "X = SQRT(2)\nX = SQRT(-1)\nX = SIN(30)\nK = INT(-2.9)\nK = INT(3E9)\nK = SGN(-3.5)\nX = ATAN2(1, 1)\nX = MAX(1, 2.5)\nK = MIN(4, 2)\n\
     X = LN(0)\nX = REAL(3)\nX = EXP(100)\nPRINT X, K",
    // Products and sums: integers, reals, both, undefined, too large; arrays at their ends.
    "I = 3\nJ = I + I * 4\nJ = J - I * 2\nX = 1.5\nX = X + X * 2.0\nX = X - X * X\nJ = J + X * 2\nX = X + J * 2\nJ = U + I * 2\n\
     J = I + 46341 * 46341\nJ = 2147483647 + I * I\nX = X + 2E38 * 4.0\nX = 3E38 + 3E38 * 1.0\nU = I + I * I\nU = U + I * 0.6\nPRINT U, X, J",
    "DIM A(4) AS INTEGER, B(4), C(2,2) AS REAL, D(4)\nFOR I = 1 TO 5\nA(I) = A(I - 1) + I\nB(I) = A(I) * 2\nS = S + A(I)\nS = 1\nS = S + A(I)\nNEXT I\n\
     K = A(I - 1)\nK = A(K + 9)\nK = A(-1 + I)\nK = A(2 + 1)\nK = A(K - 2147483647)\nA(2) = A(2) + 2147483647\nA(2) = A(2) - 1.9\nA(3) = 5 - A(2)\nA(4) = A(3) * A(2)\n\
     C(1,1) = C(1,1) + 1\nC(1,2) = C(1,1) + 0.5\nD(1) = D(0) + 1\nD(0) = 1\nD(1) = D(0) + 1\nX = D(1 + 0) - 2\nA(X) = A(X + 1) + 1\nI = A(5 - 1) - A(1)",
    "IF I > 1 THEN I = I + 1\nI = 1\nIF I > 0 THEN I = I + 1\nIF I > 9 THEN I = I - 1\nIF I > 9 THEN I = J\nIF I < 9 THEN J = I\nIF J < 9 THEN J = 7.9\n\
     I = 2147483647\nIF J > 99 THEN I = I + 1\nIF J < 99 THEN I = I + 1\nX = 3E38\nIF X > 4 THEN X = X + X\nIF X < 4 THEN X = X + X\nIF X > 4 THEN X = X - 1E38\n\
     IF X > 4 THEN X = X - 1\nIF X < J THEN X = X - 1.0 ELSE J = J + 1\nIF I <> J THEN I = I - 2\nIF I == X THEN J = 0\nIF X >= X THEN X = 2.5\nIF P > 1 THEN I = I + 1\nP = POINT(1)\nIF P > 1 THEN I = I + 1\nPRINT I, J, X",
    "X = 2.0\nY = 1.0\nX = X + SQRT(Y)\nX = SQRT(X) * 2.0\nX = SIN(X) - 1.0\nX = 3.0 - COS(Y)\nX = X + SQRT(-1.0)\nX = X * SQRT(U)\nX = Y - SIN(4000.0)\n\
     X = SIN(180.0) + Y\nX = COS(90.0) + 0.0\nI = 4\nI = I + SIN(30.0)\nX = SQRT(I) + I\nX = SIN(I) + COS(I)\nX = SIN(Y) * COS(Y)\nPRINT X, I\nU = 1",
    "X = 2.0\nR = 3.0\nA = 40.0\nX = X + R * COS(A)\nX = X - SIN(A) * R\nX = SQRT(R) * 0.5 + X\nX = SQRT(R) * A - X\nX = X + R * COS(J)\nJ = 1\nX = X + J * SIN(A)\n\
     X = X + R * SIN(J)\nX = J - R * SQRT(R)\nJ = X + R * COS(A)\nX = X + 3E38 * SQRT(A)\nX = X - SQRT(0 - R) * R\nX = R * COS(A)\nX = 3E38 + 3E38 * COS(0.5)\nPRINT X, J",
    "TOP:\nIF I > 3 THEN GOTO OUT\nI = I + 1\nIF I == 2 THEN PRINT I ELSE GOTO TOP\nIF I < 2 THEN IF J > 1 THEN GOTO TOP\nGOTO TOP\nOUT:\nI = 0\nJ = J + 1\n\
     FOR I = 1 TO 2\nGOTO BACK\nIN:\nIF I < J THEN J = J - 1\nNEXT I\nGOTO END1\nBACK:\nIF I > 0 THEN GOTO IN\nEND1:\nI = 0\nAGAIN:\nI = I + 1\nIF I < 4 THEN GOTO AGAIN",
    // Calls: by value, by reference, what has no value or is no number; RETURN in the middle; loops, monitors and calls
    // around it.
    "SHORT(I, 2)\nI = 5\nSHORT(I, 2)\nSHORT(I, I)\nSHORT(J, I + 0.5)\nSHORT(I, J)\nSHORT(X, 1.5)\nSHORT(X, X)\nX = 2.5\nSHORT(X, X)\nSHORT(I, X)\nSHORT(I * 2, X + 1)\n\
     P = POINT(1)\nSHORT(P, 1)\nSHORT(I, P)\nSHORT(I, 2147483647)\nSHORT(2, U)\nPRINT I, J, X",
    "FOR I = 1 TO 3\nFOR J = 1 TO 2\nSPIN(I, K)\nNEXT J\nNEXT I\nIF I < 9 THEN K = +I * 2\nIF I > 9 THEN K = +I * 3\nPRINT K",
    "FOR I = 1 TO 3\nFOR J = 1 TO 2\nPICK(I + J - 1, K)\nPRINT I, J, K\nNEXT J\nNEXT I\nPICK(1, Z)\nPICK(7, K)\nPICK(K, K)\nPRINT K",
    "DOWN(14)\nDOWN(15)\nDOWN(16)\nPRINT 1",
    "ON I > 2 DO GOTO OUT\nFOR J = 1 TO 3\nSHORT(I, J)\nNEXT J\nOUT:\nPRINT I",
    "K = 0\nAGAIN:\nK = K + 1\nIF K < 5 THEN GOTO AGAIN ELSE PRINT K\nIF K THEN IF K - 5 THEN PRINT 1 ELSE PRINT 2\nIF X THEN PRINT 3\nX = 1",
    "WAIT DIN(1)\nWAIT MOTION >= 100\nI = DIN(2)\nON I == 1 DO HALF(J)\nJ = 4\nI = 1\nPRINT J\nINPUT I, Z\nPRINT I, Z",
    // Which of two faults is found; loops with reals, and with what is no number.
    "FOR X = U TO 1/0\nNEXT X\nFOR X = 1 TO P STEP 1/0\nNEXT X\nP = POINT(1)\nFOR X = P TO 2\nNEXT X\nFOR P = 1 TO 2\nNEXT P\nX = P / (1/0)\nX = U + 1/0\n\
     X = P + 1/0\nX = U * (P + 1)\nI = 1\nFOR X = 0 TO 1 STEP 0.1\nI = I + 1\nNEXT X\nFOR I = 1 TO 3\nX = I * 0.5\nNEXT I\nU = 1",
    "DIM A(3) AS INTEGER\nSHORT(1/0, U)\nSHORT(U, 1/0)\nSHORT(DIN(0), 1/0)\nSHORT((U), 1)\nI = 4\nSHORT((I), 1)\nSHORT(A(9), 1/0)\nSHORT(A(1), 2)\nSHORT(A(I), 2)\n\
     PRINT A(1)\nSHORT(DIN(2), I)\nA(1/0) = U\nA(9) = U\nA(U) = 1\nA(1) = U\nU = 1",
    "X = SIN(45)\nX = TAN(45)\nX = TAN(90)\nX = SIN(1E7)\nX = COS(-1E9)\nX = TAN(3E38)\nI = 720\nX = SIN(I)\nX = COS(I) + SIN(-I)\nX = ABS(-X)\nX = INT(X)\n\
     X = SGN(X)\nX = LOG10(X)\nX = ASIN(I)\nX = ATAN2(X, I)\nX = MAX(X, I)\nI = SQRT(I)\nI = EXP(I)\nX = REAL(I)",
];

#[test]
fn instructions_do_what_the_operations_of_their_steps_do() {
    const REST: &str = "\nPRINT \"END\"\nEND\nPROGRAM HALF(N)\nN = N / 2\nPRINT N\nFOR L = 1 TO 2\nIF N > 2 THEN RETURN\nNEXT L\nEND\n\
        PROGRAM DEEP(N)\nN = N + 1\nDEEP(N)\nEND\nPROGRAM OUTER(N)\nHALF(N)\nHALF(N * 2.0)\nN = 2.5\nEND\n\
        PROGRAM SHORT(N, M)\nT = N + M\nIF T > 9 THEN RETURN\nN = T\nM = N + M * 2\nEND\n\
        PROGRAM PICK(N, M)\nGOTO(N) ONE, TWO\nM = 3\nRETURN\nONE:\nM = 10\nRETURN\nTWO:\nIF N == 2 THEN M = 20 ELSE M = 30\nGOTO ONE\nEND\n\
        PROGRAM SPIN(N, M)\nM = 0\nFOR L = 1 TO N\nM = M + L\nNEXT L\nEND\nPROGRAM DOWN(N)\nIF N > 0 THEN DOWN(N - 1)\nPICK(1, Z)\nEND\n";
    let (mut count, mut seen) = (0, String::new());
    for body in EDGES {
        for (int_division, equal_within) in [
            (crate::IntDivision::Truncate, 0.0),
            (crate::IntDivision::Real, 0.0),
            (crate::IntDivision::Truncate, 0.75),
        ] {
            let options = LanguageOptions {
                int_division,
                equal_within,
                ..LanguageOptions::default()
            };
            let source = format!("GLOBAL\nZ = 2.5\nEND\nPROGRAM M\n{body}{REST}");
            let compilation = compile(&source, &options);
            let program = compilation
                .program
                .unwrap_or_else(|| panic!("{source}\n{:?}", compilation.diagnostics));
            let ops = program.code.instructions.iter().map(|i| i.op);
            count += ops.clone().filter(|op| *op != Op::Step).count();
            ops.for_each(|op| seen.push_str(&format!("{op:?} ")));
            let plain = Arc::new(Program {
                code: lower::plain(&program.steps),
                ..Program::clone(&program)
            });
            for portion in [1, 2, 3, 7, 1_000] {
                let (expected, found) = (history(&plain, portion), history(&program, portion));
                assert!(expected.len() > 1, "{source}");
                for (expected, found) in expected.iter().zip(&found) {
                    assert_eq!(found, expected, "portions of {portion}:\n{source}");
                }
                assert_eq!(expected.len(), found.len());
            }
        }
    }
    assert!(count > 400, "only {count} instructions");
    // All instructions, the ones of the list that follow among them.
    let names = [
        "Step", "Jump", "Call", "Return", "Next", "Copy", "Add", "Subtract", "Multiply", "Binary", "Unary",
        "Branch", "Truth", "Function", "Load", "Store", "Flatten", "Fetch", "Put", "Choose",
    ];
    for name in names {
        assert!(seen.contains(name), "{name} in none of the programs");
    }
}

/// A generator of numbers with a fixed seed.
struct Rng(u32);

impl Rng {
    fn below(&mut self, sides: usize) -> usize {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as usize % sides
    }

    fn choose<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }

    fn operand(&mut self) -> String {
        match self.below(12) {
            0 => format!("A({} - 1)", self.choose(&["I", "J"])),
            1 => format!("B({} + {})", self.choose(&["I", "J"]), self.below(3)),
            2 => format!(
                "{}({})",
                self.choose(&["SQRT", "SIN", "COS"]),
                self.choose(&["X", "Y", "I"])
            ),
            3 => format!("{}.5", self.below(400)),
            4 | 5 => format!("{}", self.below(5)),
            _ => self.choose(&["I", "J", "K", "X", "Y", "U"]).into(),
        }
    }

    fn target(&mut self) -> &'static str {
        self.choose(&["I", "J", "K", "X", "Y", "U", "A(I)", "A(J)", "B(K)", "I", "X"])
    }

    fn assignment(&mut self) -> String {
        let (to, mut value) = (self.target(), self.operand());
        for _ in 0..self.below(3) {
            value = match self.below(2) {
                0 => format!(
                    "{value} {} {}",
                    self.choose(&["+", "-", "*", "+", "-", "/"]),
                    self.operand()
                ),
                _ => format!("{} {} {value}", self.operand(), self.choose(&["+", "-", "*"])),
            };
        }
        // Many a program does this.
        match self.below(3) {
            0 => format!("{to} = {to} {} {value}", self.choose(&["+", "-"])),
            _ => format!("{to} = {value}"),
        }
    }

    fn statement(&mut self, number: usize) -> String {
        let label = self.below(12);
        match self.below(12) {
            0 => format!("GOTO L{label}"),
            1 => format!("GOTO(K) L{label}, L{number}"),
            2 | 3 => format!("LEAF({}, {})", self.operand(), self.operand()),
            4 => {
                let relation = self.choose(&["<", ">", "==", "<>", "<=", ">="]);
                format!(
                    "IF {} {relation} {} THEN GOTO L{label}",
                    self.operand(),
                    self.operand()
                )
            }
            5..=7 => {
                let relation = self.choose(&["<", ">", "==", "<>"]);
                let to = self.target();
                let value = match self.below(2) {
                    0 => self.operand(),
                    _ => format!("{to} {} {}", self.choose(&["+", "-"]), self.operand()),
                };
                format!(
                    "IF {} {relation} {} THEN {to} = {value}",
                    self.operand(),
                    self.operand()
                )
            }
            _ => self.assignment(),
        }
    }

    fn program(&mut self) -> String {
        let mut source = String::from("PROGRAM M\nDIM A(3) AS INTEGER, B(4)\nI = 1\nX = 1.5\n");
        for number in 0..12 {
            source += &format!("L{number}:\n{}\n", self.statement(number));
            if number == 5 {
                source += "FOR J = 0 TO 3\n";
            }
        }
        let leaf = |rng: &mut Rng| {
            let (to, sign) = (rng.choose(&["N", "M", "T"]), rng.choose(&["+", "-", "*"]));
            let (a, b) = (
                rng.choose(&["N", "M", "T", "2"]),
                rng.choose(&["N", "M", "3", "0.5"]),
            );
            format!("{to} = {a} {sign} {b} * 2\n")
        };
        source += "NEXT J\nI = 1\nJ = 1\nK = 1\nX = 1\nY = 1\nU = 1\nEND\nPROGRAM LEAF(N, M)\n";
        (0..3).for_each(|_| source += &leaf(self));
        source + "IF N > M THEN RETURN\nT = N + M * 2\nM = T\nEND\n"
    }
}

#[test]
fn random_programs_run_the_same_in_both_forms() {
    let (mut rng, mut run) = (Rng(7), 0);
    for number in 0..150_u8 {
        let source = rng.program();
        // Every other program compares with a difference that its numbers meet.
        let options = LanguageOptions {
            equal_within: f32::from(number % 2) * 0.5,
            ..LanguageOptions::default()
        };
        let Some(program) = compile(&source, &options).program else {
            continue;
        };
        run += 1;
        let plain = Arc::new(Program {
            code: lower::plain(&program.steps),
            ..Program::clone(&program)
        });
        for portion in [1, 3, 50] {
            let (expected, found) = (history(&plain, portion), history(&program, portion));
            for (expected, found) in expected.iter().zip(&found) {
                assert_eq!(found, expected, "portions of {portion}:\n{source}");
            }
            assert_eq!(expected.len(), found.len());
        }
    }
    assert!(run > 100, "only {run} programs compile");
}

#[cfg(feature = "serde")]
#[test]
fn a_memory_that_was_restored_has_the_registers_of_the_program() {
    let (machine, mut memory) = start("PROGRAM M\nI = 1\nJ = I * 7 + 2\nEND\n");
    let written = serde_json::to_string(&memory).unwrap();
    let mut restored: Memory = serde_json::from_str(&written).unwrap();
    restored.relink(&machine.program).unwrap();
    assert_eq!(restored.registers(), memory.registers());
}
