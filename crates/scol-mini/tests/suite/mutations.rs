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
        for fix in checked
            .diagnostics
            .iter()
            .filter_map(|remark| remark.fix.as_ref())
        {
            let inside = source.get(fix.span.start..fix.span.end).is_some();
            assert!(inside && fix.apply(&source) != source, "{source:?}: {fix:?}");
            assert!(!fix.title(&source).is_empty());
        }
        assert_eq!(checked.program.is_some(), compilation.program.is_some());
        let formatted = format(&source);
        assert_eq!(format(&formatted), formatted, "{source:?}");
        // Tabs are errors that formatting removes, except from lines that it leaves as they are.
        if !formatted.contains('\t') {
            let (before, after) = (
                compile(&source.replace('\t', " "), &options),
                compile(&formatted, &options),
            );
            assert_eq!(said(&after), said(&before), "{source:?}\n{formatted:?}");
        }
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

/// Column of the comment after a statement, `None` where that is in doubt.
fn comment_column(line: &str) -> Option<usize> {
    let (mut column, mut in_text, mut has_statement) = (0, false, false);
    if line.to_ascii_uppercase().contains("REMARK") {
        return None;
    }
    for c in line.chars() {
        match c {
            '\'' if !in_text => return has_statement.then_some(column),
            '\t' if in_text => return None,
            '\t' => column = (column / 8 + 1) * 8,
            ' '..='~' => {
                in_text ^= c == '"';
                has_statement |= c != ' ';
                column += 1;
            }
            _ => return None,
        }
    }
    None
}

/// Lines with a comment of their own, at one of a few columns that changes now and then, after blanks or tabs.
fn commented(source: &str, random: &mut Random) -> String {
    let (mut column, mut text) = (16, String::new());
    for line in source.lines() {
        if random.next(4) == 0 {
            column = 8 * (1 + random.next(4));
        }
        let tabs = "\t".repeat((column / 8).saturating_sub(line.len() / 8));
        let blanks = " ".repeat(column.saturating_sub(line.len()));
        let pad = if random.next(2) == 0 { tabs } else { blanks };
        let note = if random.next(6) == 0 { "" } else { "' note" };
        text += &std::format!("{line}{pad}{note}\n");
    }
    text
}

#[test]
fn comments_of_neighbours_stay_in_one_column() {
    let mut random = Random(0x7AB5_7AB5_7AB5_7AB5);
    let sources: Vec<String> = ["ok", "run", "err"]
        .into_iter()
        .flat_map(programs)
        .map(|(_, source)| source)
        .collect();
    let (mut together, mut moved) = (0, 0);
    for round in 0..1_500 {
        let base = &sources[round % sources.len()];
        let source = commented(&mutate(base, &mut random), &mut random);
        let formatted = format(&source);
        assert_eq!(format(&formatted), formatted, "{source:?}");
        // A long comment may leave its column, and what follows the code 1A is not formatted.
        if source.contains(['\x1a', '\r']) || source.lines().any(|line| line.len() > 150) {
            continue;
        }
        let is_blank = |line: &&str| line.trim_matches([' ', '\t']).is_empty();
        let before: Vec<&str> = source.lines().skip_while(is_blank).collect();
        let mut after = formatted.lines().filter(|line| !is_blank(line));
        let after: Vec<Option<&str>> = before
            .iter()
            .map(|line| if is_blank(line) { None } else { after.next() })
            .collect();
        for (before, after) in before.windows(2).zip(after.windows(2)) {
            let ([first, second], [Some(first_after), Some(second_after)]) = (before, after) else {
                continue;
            };
            // A line that stays as it is may be one that cannot be formatted.
            let is_kept = |before: &str, after: &str| before.trim_end() == after;
            let kept = is_kept(first, first_after) || is_kept(second, second_after);
            let column = comment_column(first);
            if column.is_none() || column != comment_column(second) || kept {
                continue;
            }
            let found = comment_column(first_after);
            let pair = [first, second, first_after, second_after];
            assert!(found >= column, "{pair:#?}");
            assert_eq!(found, comment_column(second_after), "{pair:#?}");
            together += 1;
            moved += usize::from(found != column);
        }
    }
    assert!(
        together > 1_000 && moved > 100,
        "{together} neighbours, {moved} of them moved: the test proves little"
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
