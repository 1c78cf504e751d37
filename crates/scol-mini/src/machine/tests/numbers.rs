//! Computing with numbers: at the edges against what is written here, in random programs against `reference`.

use super::reference::{Reference, Step};
use super::*;
use std::format;
use std::vec::Vec;

/// Statements that are run of a program that does not end, and events that are compared.
const MOST_STATEMENTS: u32 = 400;
const MOST_EVENTS: usize = 20;

/// Statements at the edges of numbers, each the body of a main program, and what comes of them: what is printed, the faults
/// with their lines, and at the end the variables.
const EDGES: &[(&str, &str)] = &[
    (
        "I = 2147483647\nI = I + 1\nPRINT I",
        "Overflow@2 2147483647 END Z=2.5 I=2147483647",
    ),
    (
        "I = -2147483647\nI = I - 1\nJ = I / -1\nJ = I MOD -1\nPRINT J\nI = I * 2\nI = -I\nI = ABS(I)",
        "Overflow@3 0 Overflow@6 Overflow@7 Overflow@8 END Z=2.5 I=-2147483648 J=0",
    ),
    (
        "I = 7\nI = 2.9\nPRINT I\nI = 1E20\nPRINT I\nX = 1.5\nX = 3\nPRINT X, X / 2\nX = 3E38\nX = X * 10\nX = X + X\nX = -X - X",
        "2 Overflow@4 2 3.000,1.500 Overflow@10 Overflow@11 Overflow@12 END Z=2.5 I=2 X=3e38",
    ),
    (
        "I = 1 / 0\nI = 1.0 / 0\nI = 0 / 0.0\nI = 5 MOD 0\nI = MOD(5.0, 0.0)\nX = MOD(7.5, 2)\nPRINT X",
        "DivisionByZero@1 DivisionByZero@2 DivisionByZero@3 DivisionByZero@4 DivisionByZero@5 1.500 END \
         Z=2.5 X=1.5",
    ),
    (
        "X = 7.5\nY = 2.0\nZ = X MOD Y\nPRINT Z\nZ = -X MOD Y\nPRINT Z\nI = 7\nJ = 4\nK = I MOD J\nPRINT K\nZ = X - Y\nZ = X * Y\nZ = Y / X\nPRINT Z",
        "1.500 -1.500 3 0.267 END Z=0.26666668 X=7.5 Y=2.0 I=7 J=4 K=3",
    ),
    (
        "IF A > 1 THEN B = 1\nB = A\nA = 1\nB = A + C\nC = 1",
        "Undefined@1 Undefined@2 Undefined@4 END Z=2.5 A=1 C=1",
    ),
    (
        "P = POINT(1,2,3)\nQ = P + P\nIF P > 1 THEN I = 1\nI = 1\nI = P\nP = 1\nX = P.Y\nPRINT X",
        "Type@3 Type@5 Type@6 2.000 END Z=2.5 P=Position Q=Position I=1 X=2.0",
    ),
    (
        "FOR I = 1 TO 3 STEP 0\nNEXT I",
        "Range@1 NextWithoutFor@2 END Z=2.5",
    ),
    (
        "FOR I = 3 TO 1\nPRINT I\nNEXT I\nFOR I = 3 TO 1 STEP -1\nPRINT I\nNEXT I\nFOR X = 0 TO 1 STEP 0.25\nPRINT X\nNEXT X",
        "3 2 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 Z=2.5 I=0 X=0",
    ),
    (
        "I = 1\nFOR I = 1.5 TO 4 STEP 1.5\nPRINT I\nNEXT I\nX = 0.5\nFOR X = 1 TO 3\nPRINT X\nNEXT X",
        "1 2 3 4 1.000 2.000 3.000 END Z=2.5 I=5 X=4.0",
    ),
    (
        "FOR I = 2147483645 TO 2147483647\nPRINT I\nNEXT I",
        "2147483645 2147483646 2147483647 Overflow@3 END Z=2.5 I=2147483647",
    ),
    (
        "FOR I = 1 TO 3\nFOR J = 1 TO 3\nIF J == 2 THEN GOTO OUT\nNEXT J\nOUT:\nPRINT I, J\nNEXT I\nGOTO IN\nFOR K = 1 TO 2\nIN:\nNEXT K",
        "1,2 2,2 3,2 NextWithoutFor@11 END Z=2.5 I=4 J=2",
    ),
    // The loop that was left is over once another one begins outside it.
    (
        "FOR J = 1 TO 9\nGOTO OUT\nIN:\nNEXT J\nGOTO LAST\nOUT:\nFOR K = 1 TO 1\nNEXT K\nGOTO IN\nLAST:\nPRINT J",
        "NextWithoutFor@4 1 END Z=2.5 J=1 K=2",
    ),
    (
        "DIM A(3) AS INTEGER, B(2,3), C(1,1,1) AS REAL\nA(1) = 2.7\nA(A(1)) = 9\nPRINT A(2)\nA(4) = 1\nA(-1) = 1\nX = 1.0\nA(X) = 5\n\
     PRINT B(0,0)\nB(2,3) = 1.5\nB(1,1) = 2\nPRINT B(1,1)\nB(3,0) = 1\nB(0,4) = 1\nI = B(2,-1)\nC(1,1,1) = 4\nPRINT C(1,1,1) + B(2,3)",
        "9 Subscript@5 Subscript@6 Undefined@9 2.000 Subscript@13 Subscript@14 Subscript@15 5.500 END \
         Z=2.5 X=1.0",
    ),
    (
        "FOR K = -1 TO 4\nGOTO(K) ONE, TWO\nPRINT K\nGOTO BACK\nONE:\nPRINT 100\nGOTO BACK\nTWO:\nPRINT 200\nBACK:\nNEXT K\nX = 1.9\nGOTO(X) TWO",
        "-1 0 100 200 3 4 200 NextWithoutFor@11 200 NextWithoutFor@11 200 NextWithoutFor@11 200 \
         NextWithoutFor@11 200 NextWithoutFor@11 200 NextWithoutFor@11 200 NextWithoutFor@11 Z=2.5 K=5 \
         X=1.9",
    ),
    (
        "I = 3\nHALF(I)\nPRINT I\nHALF(7)\nHALF(I + 1)\nX = 5.0\nHALF(X)\nPRINT X\nHALF(U)\nP = POINT(1)\nHALF(P)\nDEEP(1)\nOUTER(I)\nOUTER(I + 1)",
        "1 1 3 1 2.500 2.500 Undefined@18 Undefined@19 Undefined@21 Undefined@21 Type@18 Type@19 Type@21 \
         Type@21 Nesting@26 0 0.000 1 1.000 END Z=2.5 I=2 X=2.5 P=Position L=3",
    ),
    (
        "K = 7\nX = 0.5\nX = K / 2\nPRINT X, K / 2\nK = K / 2\nPRINT K",
        "3.000,3 3 END Z=2.5 K=3 X=3.0",
    ),
    (
        "DIM A(3) AS INTEGER, D(2,3) AS INTEGER\nK = 4\nA(K) = 1\nPRINT D(0,0), A(K)\nD(1,0) = 6\nD(0,K) = 5\nPRINT D(1,0)\nK = D(0,K)\nD(2,K) = 1",
        "Subscript@3 Subscript@4 Subscript@6 6 Subscript@8 Subscript@9 END Z=2.5 K=4",
    ),
    (
        "I = NOT 0\nJ = NOT 2.5\nK = I AND J OR 0\nL = 1 < 2\nL = I < 2\nX = 1.5\nL = X <> 1.5\nPRINT I, J, K, L\nK = 2 ^ 3\nX = 2 ^ -1\nX = -2.0 ^ 0.5\nK = 10 ^ 10",
        "1,0,0,0 Domain@11 Overflow@12 END Z=2.5 I=1 J=0 K=8 L=0 X=0.5",
    ),
    (
        "X = SQRT(2)\nX = SQRT(-1)\nX = SIN(30)\nK = INT(-2.9)\nK = INT(3E9)\nK = SGN(-3.5)\nX = ATAN2(1, 1)\nX = MAX(1, 2.5)\nK = MIN(4, 2)\n\
     X = LN(0)\nX = REAL(3)\nX = EXP(100)\nPRINT X, K",
        "Domain@2 Overflow@5 Domain@10 Overflow@12 3.000,2 END Z=2.5 X=3.0 K=2",
    ),
    // Products and sums: integers, reals, both, undefined, too large; arrays at their ends.
    (
        "I = 3\nJ = I + I * 4\nJ = J - I * 2\nX = 1.5\nX = X + X * 2.0\nX = X - X * X\nJ = J + X * 2\nX = X + J * 2\nJ = U + I * 2\n\
     J = I + 46341 * 46341\nJ = 2147483647 + I * I\nX = X + 2E38 * 4.0\nX = 3E38 + 3E38 * 1.0\nU = I + I * I\nU = U + I * 0.6\nPRINT U, X, J",
        "Undefined@9 Overflow@10 Overflow@11 Overflow@12 Overflow@13 13,-59.750,-22 END Z=2.5 I=3 J=-22 \
         X=-59.75 U=13",
    ),
    (
        "DIM A(4) AS INTEGER, B(4), C(2,2) AS REAL, D(4)\nFOR I = 1 TO 5\nA(I) = A(I - 1) + I\nB(I) = A(I) * 2\nS = S + A(I)\nS = 1\nS = S + A(I)\nNEXT I\n\
     K = A(I - 1)\nK = A(K + 9)\nK = A(-1 + I)\nK = A(2 + 1)\nK = A(K - 2147483647)\nA(2) = A(2) + 2147483647\nA(2) = A(2) - 1.9\nA(3) = 5 - A(2)\nA(4) = A(3) * A(2)\n\
     C(1,1) = C(1,1) + 1\nC(1,2) = C(1,1) + 0.5\nD(1) = D(0) + 1\nD(0) = 1\nD(1) = D(0) + 1\nX = D(1 + 0) - 2\nA(X) = A(X + 1) + 1\nI = A(5 - 1) - A(1)",
        "Undefined@5 Subscript@3 Subscript@4 Subscript@5 Subscript@7 Subscript@9 Undefined@10 \
         Subscript@11 Subscript@13 Overflow@14 Undefined@20 END Z=2.5 I=3 S=1 K=6 X=0",
    ),
    (
        "IF I > 1 THEN I = I + 1\nI = 1\nIF I > 0 THEN I = I + 1\nIF I > 9 THEN I = I - 1\nIF I > 9 THEN I = J\nIF I < 9 THEN J = I\nIF J < 9 THEN J = 7.9\n\
     I = 2147483647\nIF J > 99 THEN I = I + 1\nIF J < 99 THEN I = I + 1\nX = 3E38\nIF X > 4 THEN X = X + X\nIF X < 4 THEN X = X + X\nIF X > 4 THEN X = X - 1E38\n\
     IF X > 4 THEN X = X - 1\nIF X < J THEN X = X - 1.0 ELSE J = J + 1\nIF I <> J THEN I = I - 2\nIF I == X THEN J = 0\nIF X >= X THEN X = 2.5\nIF P > 1 THEN I = I + 1\nP = POINT(1)\nIF P > 1 THEN I = I + 1\nPRINT I, J, X",
        "Undefined@1 Overflow@10 Overflow@12 Undefined@20 Type@22 2147483645,8,2.500 END Z=2.5 \
         I=2147483645 J=8 X=2.5 P=Position",
    ),
    (
        "X = 2.0\nY = 1.0\nX = X + SQRT(Y)\nX = SQRT(X) * 2.0\nX = SIN(X) - 1.0\nX = 3.0 - COS(Y)\nX = X + SQRT(-1.0)\nX = X * SQRT(U)\nX = Y - SIN(4000.0)\n\
     X = SIN(180.0) + Y\nX = COS(90.0) + 0.0\nI = 4\nI = I + SIN(30.0)\nX = SQRT(I) + I\nX = SIN(I) + COS(I)\nX = SIN(Y) * COS(Y)\nPRINT X, I\nU = 1",
        "Domain@7 Undefined@8 0.017,4 END Z=2.5 X=0.017449748 Y=1.0 I=4 U=1",
    ),
    (
        "X = 2.0\nR = 3.0\nA = 40.0\nX = X + R * COS(A)\nX = X - SIN(A) * R\nX = SQRT(R) * 0.5 + X\nX = SQRT(R) * A - X\nX = X + R * COS(J)\nJ = 1\nX = X + J * SIN(A)\n\
     X = X + R * SIN(J)\nX = J - R * SQRT(R)\nJ = X + R * COS(A)\nX = X + 3E38 * SQRT(A)\nX = X - SQRT(0 - R) * R\nX = R * COS(A)\nX = 3E38 + 3E38 * COS(0.5)\nPRINT X, J",
        "Undefined@8 Overflow@14 Domain@15 Overflow@17 2.298,-1 END Z=2.5 X=2.2981334 R=3.0 A=40.0 J=-1",
    ),
    (
        "TOP:\nIF I > 3 THEN GOTO OUT\nI = I + 1\nIF I == 2 THEN PRINT I ELSE GOTO TOP\nIF I < 2 THEN IF J > 1 THEN GOTO TOP\nGOTO TOP\nOUT:\nI = 0\nJ = J + 1\n\
     FOR I = 1 TO 2\nGOTO BACK\nIN:\nIF I < J THEN J = J - 1\nNEXT I\nGOTO END1\nBACK:\nIF I > 0 THEN GOTO IN\nEND1:\nI = 0\nAGAIN:\nI = I + 1\nIF I < 4 THEN GOTO AGAIN",
        "Undefined@2 Undefined@3 Undefined@4 Undefined@5 Undefined@2 Undefined@3 Undefined@4 Undefined@5 \
         Undefined@2 Undefined@3 Undefined@4 Undefined@5 Undefined@2 Undefined@3 Undefined@4 Undefined@5 \
         Undefined@2 Undefined@3 Undefined@4 Undefined@5 Z=2.5",
    ),
    // Calls: by value, by reference, what has no value or is no number; RETURN in the middle; loops, monitors and calls
    // around it.
    (
        "SHORT(I, 2)\nI = 5\nSHORT(I, 2)\nSHORT(I, I)\nSHORT(J, I + 0.5)\nSHORT(I, J)\nSHORT(X, 1.5)\nSHORT(X, X)\nX = 2.5\nSHORT(X, X)\nSHORT(I, X)\nSHORT(I * 2, X + 1)\n\
     P = POINT(1)\nSHORT(P, 1)\nSHORT(I, P)\nSHORT(I, 2147483647)\nSHORT(2, U)\nPRINT I, J, X",
        "Undefined@38 Undefined@39 Undefined@40 Undefined@41 Undefined@38 Undefined@38 Undefined@38 \
         Undefined@38 Type@38 Type@38 Overflow@38 Undefined@38 Undefined@18 END Z=2.5 I=7 X=15.0 \
         P=Position T=30",
    ),
    (
        "FOR I = 1 TO 3\nFOR J = 1 TO 2\nSPIN(I, K)\nNEXT J\nNEXT I\nIF I < 9 THEN K = +I * 2\nIF I > 9 THEN K = +I * 3\nPRINT K",
        "8 END Z=2.5 I=4 J=3 K=8 L=4",
    ),
    (
        "FOR I = 1 TO 3\nFOR J = 1 TO 2\nPICK(I + J - 1, K)\nPRINT I, J, K\nNEXT J\nNEXT I\nPICK(1, Z)\nPICK(7, K)\nPICK(K, K)\nPRINT K",
        "1,1,10 1,2,10 2,1,10 2,2,3 3,1,3 3,2,3 3 END Z=10.0 I=4 J=3 K=3",
    ),
    (
        "DOWN(14)\nDOWN(15)\nDOWN(16)\nPRINT 1",
        "Nesting@48 Nesting@47 Nesting@48 1 END Z=10.0",
    ),
    (
        "ON I > 2 DO GOTO OUT\nFOR J = 1 TO 3\nSHORT(I, J)\nNEXT J\nOUT:\nPRINT I",
        "Undefined@1 Undefined@26 Undefined@27 Undefined@28 Undefined@29 Undefined@26 Undefined@27 \
         Undefined@28 Undefined@29 Undefined@26 Undefined@27 Undefined@28 Undefined@29 Undefined@6 END \
         Z=2.5 J=4",
    ),
    (
        "K = 0\nAGAIN:\nK = K + 1\nIF K < 5 THEN GOTO AGAIN ELSE PRINT K\nIF K THEN IF K - 5 THEN PRINT 1 ELSE PRINT 2\nIF X THEN PRINT 3\nX = 1",
        "5 2 Undefined@6 END Z=2.5 K=5 X=1",
    ),
    (
        "WAIT DIN(1)\nWAIT MOTION >= 100\nI = DIN(2)\nON I == 1 DO HALF(J)\nJ = 4\nI = 1\nPRINT J\nINPUT I, Z\nPRINT I, Z",
        "4 INPUT 2 1,2.500 END Z=2.5 I=1 J=4",
    ),
    // Which of two faults is found; loops with reals, and with what is no number.
    (
        "FOR X = U TO 1/0\nNEXT X\nFOR X = 1 TO P STEP 1/0\nNEXT X\nP = POINT(1)\nFOR X = P TO 2\nNEXT X\nFOR P = 1 TO 2\nNEXT P\nX = P / (1/0)\nX = U + 1/0\n\
     X = P + 1/0\nX = U * (P + 1)\nI = 1\nFOR X = 0 TO 1 STEP 0.1\nI = I + 1\nNEXT X\nFOR I = 1 TO 3\nX = I * 0.5\nNEXT I\nU = 1",
        "DivisionByZero@1 NextWithoutFor@2 Undefined@3 NextWithoutFor@4 Type@6 NextWithoutFor@7 Type@8 \
         NextWithoutFor@9 Type@10 Undefined@11 DivisionByZero@12 Undefined@13 Z=2.5 X=0 P=Position I=194",
    ),
    (
        "DIM A(3) AS INTEGER\nSHORT(1/0, U)\nSHORT(U, 1/0)\nSHORT(DIN(0), 1/0)\nSHORT((U), 1)\nI = 4\nSHORT((I), 1)\nSHORT(A(9), 1/0)\nSHORT(A(1), 2)\nSHORT(A(I), 2)\n\
     PRINT A(1)\nSHORT(DIN(2), I)\nA(1/0) = U\nA(9) = U\nA(U) = 1\nA(1) = U\nU = 1",
        "DivisionByZero@2 DivisionByZero@3 Range@4 Undefined@5 Subscript@8 Subscript@10 2 Undefined@13 \
         Undefined@14 Undefined@15 Undefined@16 END Z=2.5 U=1 I=12 T=4",
    ),
    (
        "X = SIN(45)\nX = TAN(45)\nX = TAN(90)\nX = SIN(1E7)\nX = COS(-1E9)\nX = TAN(3E38)\nI = 720\nX = SIN(I)\nX = COS(I) + SIN(-I)\nX = ABS(-X)\nX = INT(X)\n\
     X = SGN(X)\nX = LOG10(X)\nX = ASIN(I)\nX = ATAN2(X, I)\nX = MAX(X, I)\nI = SQRT(I)\nI = EXP(I)\nX = REAL(I)",
        "Domain@3 Domain@14 Overflow@18 END Z=2.5 X=26.0 I=26",
    ),
];

/// The same with a division of integers that is real.
const REAL_DIVISION: &[(&str, &str)] = &[
    (
        "I = -2147483647\nI = I - 1\nJ = I / -1\nJ = I MOD -1\nPRINT J\nI = I * 2\nI = -I\nI = ABS(I)",
        "0.000 Overflow@6 Overflow@7 Overflow@8 END Z=2.5 I=-2147483648 J=0.0",
    ),
    (
        "K = 7\nX = 0.5\nX = K / 2\nPRINT X, K / 2\nK = K / 2\nPRINT K",
        "3.500,3.500 3 END Z=2.5 K=3 X=3.5",
    ),
];

/// The programs that the edges call.
const REST: &str = "\nPRINT \"END\"\nEND\nPROGRAM HALF(N)\nN = N / 2\nPRINT N\nFOR L = 1 TO 2\nIF N > 2 THEN RETURN\nNEXT L\nEND\n\
        PROGRAM DEEP(N)\nN = N + 1\nDEEP(N)\nEND\nPROGRAM OUTER(N)\nHALF(N)\nHALF(N * 2.0)\nN = 2.5\nEND\n\
        PROGRAM SHORT(N, M)\nT = N + M\nIF T > 9 THEN RETURN\nN = T\nM = N + M * 2\nEND\n\
        PROGRAM PICK(N, M)\nGOTO(N) ONE, TWO\nM = 3\nRETURN\nONE:\nM = 10\nRETURN\nTWO:\nIF N == 2 THEN M = 20 ELSE M = 30\nGOTO ONE\nEND\n\
        PROGRAM SPIN(N, M)\nM = 0\nFOR L = 1 TO N\nM = M + L\nNEXT L\nEND\nPROGRAM DOWN(N)\nIF N > 0 THEN DOWN(N - 1)\nPICK(1, Z)\nEND\n";

/// Events of a run in portions of `portion` statements, and the number of statements it takes.
fn events(program: &Arc<Program>, portion: u32) -> (String, u32) {
    let (mut machine, mut memory) = (Machine::main(Arc::clone(program)), Memory::new(program));
    let (mut events, mut used) = (Vec::new(), 0);
    let mut is_over = false;
    // The first line of the body is line 5 of the file.
    let line = |line: u32| line - 4;
    while used < MOST_STATEMENTS && !is_over {
        let given = portion.min(MOST_STATEMENTS - used);
        let mut fuel = given;
        let pause = machine.run(&mut memory, &STILL, &mut fuel);
        used += given - fuel;
        match pause {
            Pause::Request(Request::Print { data, .. }) => {
                let text = String::from_utf8(data).unwrap();
                let fields: Vec<&str> = text.split_whitespace().collect();
                events.push(fields.join(","));
                machine.answer(&mut memory, Answer::Done).unwrap();
            }
            Pause::Request(Request::Input { expected, .. }) => {
                let numbers = (0..expected).map(|n| Number::Real(n as f32 + 1.5));
                events.push(format!("INPUT {expected}"));
                machine
                    .answer(&mut memory, Answer::Values(numbers.collect()))
                    .unwrap();
            }
            Pause::Request(other) => panic!("{other:?}"),
            Pause::Fault(fault) => {
                events.push(format!("{:?}@{}", fault.kind, line(fault.line)));
                machine.skip();
            }
            Pause::Waiting => {
                events.push(format!("WAIT@{}", line(machine.line())));
                machine.skip();
            }
            Pause::Fuel => {}
            Pause::Ended => is_over = true,
        }
    }
    events.truncate(MOST_EVENTS);
    let slots = program.symbols.slots.iter();
    for slot in slots.filter(|slot| slot.bounds.is_none()) {
        events.extend(memory.value(slot.base).map(|value| match value {
            Value::Integer(value) => format!("{}={value}", slot.name),
            Value::Real(value) => format!("{}={value:?}", slot.name),
            other => format!("{}={:?}", slot.name, other.kind()),
        }));
    }
    (events.join(" "), used)
}

fn edge(body: &str, options: &LanguageOptions, expected: &str) {
    let source = format!("GLOBAL\nZ = 2.5\nEND\nPROGRAM M\n{body}{REST}");
    let compilation = compile(&source, options);
    let program = compilation
        .program
        .unwrap_or_else(|| panic!("{source}\n{:?}", compilation.diagnostics));
    let (found, used) = events(&program, 1);
    assert_eq!(found, expected, "{source}");
    for portion in [2, 3, 7, 1_000] {
        assert_eq!(
            events(&program, portion),
            (found.clone(), used),
            "portions of {portion}:\n{source}"
        );
    }
}

#[test]
fn numbers_are_computed_as_they_are_written_here() {
    for (body, expected) in EDGES {
        edge(body, &LanguageOptions::default(), expected);
    }
    let options = LanguageOptions {
        int_division: crate::IntDivision::Real,
        ..LanguageOptions::default()
    };
    for (body, expected) in REAL_DIVISION {
        edge(body, &options, expected);
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
                self.choose(&["SQRT", "ABS", "INT", "SGN", "-", "NOT "]),
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
                    self.choose(&["+", "-", "*", "/", "MOD", "AND", "OR", "<"]),
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
            match number {
                1 => source += "FOR H = 0 TO 2\n",
                3 => source += "NEXT H\n",
                _ => {}
            }
            if number == 5 {
                let counts = [
                    "0 TO 3",
                    "0 TO 3",
                    "3 TO 0 STEP -1",
                    "0 TO 2 STEP 0.5",
                    "U TO I STEP K",
                ];
                source += &format!("FOR J = {}\n", self.choose(&counts));
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

/// Runs a program one statement at a time beside the reference; returns how many statements and faults there were.
fn beside_the_reference(source: &str, program: &Arc<Program>) -> (u32, u32) {
    let (mut machine, mut memory) = (Machine::main(Arc::clone(program)), Memory::new(program));
    let mut reference = Reference::new(source, program.options);
    let (mut statements, mut faults) = (0, 0);
    while statements < 300 {
        statements += 1;
        let found = match machine.run(&mut memory, &STILL, &mut 1) {
            Pause::Fuel => Step::Done,
            Pause::Ended => Step::Ended,
            Pause::Fault(fault) => {
                assert_eq!(fault.line, reference.line(), "{source}");
                faults += 1;
                machine.skip();
                Step::Fault(fault.kind)
            }
            pause => panic!("{pause:?}"),
        };
        let line = reference.line();
        assert_eq!(found, reference.step(), "line {line} of\n{source}");
        assert_eq!(machine.line(), reference.line(), "after line {line} of\n{source}");
        for slot in &program.symbols.slots {
            for index in 0..slot.length() {
                let found = memory.value(slot.base + index);
                let expected = reference.value(&slot.name, index).map(Value::from);
                assert_eq!(
                    found, expected,
                    "{}({index}) after line {line} of\n{source}",
                    slot.name
                );
            }
        }
        if found == Step::Ended {
            break;
        }
    }
    (statements, faults)
}

#[test]
fn random_programs_run_as_in_the_reference() {
    let (mut rng, mut run, mut all, mut at_fault) = (Rng(7), 0, 0, 0);
    for number in 0..400_u32 {
        let source = rng.program();
        let options = LanguageOptions {
            // Every other program compares with a difference that its numbers meet.
            equal_within: (number % 2) as f32 * 0.5,
            int_division: match number % 3 {
                0 => crate::IntDivision::Real,
                _ => crate::IntDivision::Truncate,
            },
            ..LanguageOptions::default()
        };
        let Some(program) = compile(&source, &options).program else {
            continue;
        };
        run += 1;
        let (statements, faults) = beside_the_reference(&source, &program);
        all += statements;
        at_fault += faults;
    }
    assert!(run > 300, "only {run} programs compile");
    let enough = all > 10_000 && at_fault > 500;
    assert!(enough, "only {all} statements, {at_fault} at fault");
}

#[test]
fn a_memory_that_was_restored_has_the_constants_of_the_program() {
    let (mut machine, mut memory) = start("PROGRAM M\nI = 1\nJ = I * 7 + 2\nPRINT J\nEND\n");
    assert_eq!(machine.run(&mut memory, &STILL, &mut 1), Pause::Fuel);
    let written = serde_json::to_string(&memory).unwrap();
    let mut restored: Memory = serde_json::from_str(&written).unwrap();
    restored.relink(&machine.program).unwrap();
    assert_eq!(restored, memory);
    let mut other = machine.clone();
    assert_eq!(
        machine.run(&mut memory, &STILL, &mut 9),
        other.run(&mut restored, &STILL, &mut 9)
    );
    assert_eq!(restored, memory);
}
