//! Broken input: fixtures mutated by a seeded generator never panic, hang or grow without bound, whether they
//! compile, are executed directly, or run.

use crate::common::{options, play, programs};
use scol_mini::{
    Arm, Compilation, MAX_DIAGNOSTICS, Program, Value, check, compile, compile_direct, format, rewrite_value,
};

/// xorshift64*: small, seeded, the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let high = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33;
        high as usize % below.max(1)
    }
}

const PIECES: &[&str] = &[
    "(",
    ")",
    "{",
    "=",
    "==",
    "\"",
    "'",
    ",",
    "/",
    "-",
    "NOT ",
    "IF ",
    "THEN ",
    "ELSE ",
    "FOR I=1 TO 9\n",
    "NEXT\n",
    "END\n",
    "DATA\n",
    "GLOBAL\n",
    "PROGRAM X(A,B)\n",
    "GOTO L\n",
    "L:",
    "99999999999",
    "1E38",
    "\t",
    "\u{e9}",
    "\r",
    "\x1a",
    "DIM Q(9,9,9,9) AS POINT\n",
    ".X",
    "POINT(",
    "WORK W\n",
    "A=A*A\n",
    "X(1,2)\n",
    "INPUT A\n",
    "^",
    "MOD ",
];

fn mutate(source: &str, random: &mut Random) -> String {
    let mut bytes = source.as_bytes().to_vec();
    for _ in 0..=random.next(2) {
        let at = random.next(bytes.len() + 1);
        let length = random.next(12).min(bytes.len() - at);
        match random.next(13) {
            0..=2 => drop(bytes.drain(at..at + length)),
            3..=5 => {
                let piece = PIECES[random.next(PIECES.len())];
                bytes.splice(at..at, piece.bytes());
            }
            6..=8 => {
                let copy = bytes[at..at + length].to_vec();
                let to = random.next(bytes.len() + 1);
                bytes.splice(to..to, copy);
            }
            9..=11 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = b"0123456789ABXYZ,-"[random.next(17)];
                }
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Codes and words of the remarks; their columns differ between two layouts of one program.
fn said(compilation: &Compilation) -> Vec<(&'static str, String)> {
    let remarks = compilation.diagnostics.iter();
    let mut list: Vec<_> = remarks
        .map(|d| (d.code, d.message.to_ascii_uppercase()))
        .collect();
    list.sort();
    list
}

/// Two tests, which run side by side.
#[test]
fn mutated_programs_neither_panic_nor_hang() {
    survive(0x5C01_5C01_5C01_5C01);
}

#[test]
fn other_mutated_programs_do_not_either() {
    survive(0x0DDB_1A5E_5BAD_5EED);
}

fn survive(seed: u64) {
    let mut random = Random(seed);
    let sources: Vec<String> = ["ok", "run", "err"]
        .into_iter()
        .flat_map(programs)
        .map(|(_, source)| source)
        .collect();
    let right = programs("ok").len() + programs("run").len();
    let mut compiled = 0;
    for round in 0..3_000 {
        // Every other round starts from a program that is right, so that many mutants compile.
        let base = &sources[if round % 2 == 0 {
            round % right
        } else {
            round % sources.len()
        }];
        let source = mutate(base, &mut random);
        let mut options = options(base);
        if round % 5 == 0 {
            options.arm = Arm::Scara;
        }
        let compilation = compile(&source, &options);
        assert!(compilation.diagnostics.len() <= MAX_DIAGNOSTICS);
        for diagnostic in &compilation.diagnostics {
            assert!(diagnostic.render(&source, "M").len() < 2_000);
            assert!(diagnostic.line >= 1 && diagnostic.column >= 1);
        }
        let checked = check(&source, &options);
        assert!(checked.diagnostics.len() <= MAX_DIAGNOSTICS);
        assert_eq!(checked.program.is_some(), compilation.program.is_some());
        let formatted = format(&source);
        assert_eq!(format(&formatted), formatted, "{source:?}");
        let again = compile(&formatted, &options);
        assert_eq!(said(&again), said(&compilation), "{source:?}\n{formatted:?}");
        if let Some(program) = compilation.program {
            compiled += 1;
            let lines = play(&program, std::collections::VecDeque::new(), 2_000);
            assert!(lines.len() <= 2_001);
            for name in ["P1", "HOME", "LEVEL", "TABLE"] {
                let _ = rewrite_value(&source, &program, name, &[], &Value::Integer(round as i32));
            }
        }
        for line in source.lines().take(5) {
            let _ = compile_direct(line, &Program::empty(&options));
        }
    }
    assert!(
        compiled > 200,
        "only {compiled} mutants compiled: the test proves little"
    );
}

#[test]
fn deep_and_long_inputs_are_refused_with_a_message() {
    let deep = "(".repeat(200);
    let minus = "-".repeat(240);
    let long = "1+".repeat(200);
    let chain = format!("{}1", "1+".repeat(110));
    for (body, code) in [
        (format!("A={deep}"), "E0104"),
        (format!("A={minus}1"), "E0104"),
        (format!("A={long}1"), "E0005"),
    ] {
        let found = compile(&format!("PROGRAM M\n{body}\nEND\n"), &Default::default()).diagnostics;
        assert!(found.iter().any(|d| d.code == code), "{found:?}");
    }
    let program = compile(&format!("PROGRAM M\nA={chain}\nEND\n"), &Default::default())
        .program
        .unwrap();
    assert_eq!(play(&program, std::collections::VecDeque::new(), 9), ["ENDED"]);
    let loops = format!(
        "PROGRAM M\n{}{}END\n",
        "FOR I=1 TO 2\n".repeat(17),
        "NEXT\n".repeat(17)
    );
    assert!(
        compile(&loops, &Default::default())
            .diagnostics
            .iter()
            .any(|d| d.code == "E0104")
    );
    let huge = "X".repeat(100_000);
    assert_eq!(compile(&huge, &Default::default()).diagnostics[0].code, "E0001");
    let bad = "%\n".repeat(40_000);
    assert_eq!(
        compile(&bad, &Default::default()).diagnostics.len(),
        MAX_DIAGNOSTICS
    );
    let array = "GLOBAL\nDIM A(20000)\nEND\nPROGRAM M\nEND\n";
    assert_eq!(compile(array, &Default::default()).diagnostics[0].code, "E0214");
    let array = "GLOBAL\nDIM A(999999999,999999999,999999999)\nEND\nPROGRAM M\nEND\n";
    assert_eq!(compile(array, &Default::default()).diagnostics[0].code, "E0214");
}

#[test]
fn the_largest_file_compiles_in_linear_time() {
    let mut source = String::from("PROGRAM M\n");
    while source.len() < 99_900 {
        source.push_str(&format!("V{}=1\n", source.len()));
    }
    source.push_str("END\n");
    assert!(compile(&source, &Default::default()).program.is_some());
}
