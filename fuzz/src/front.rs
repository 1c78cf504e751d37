//! Fuzzes the compiler front end: any bytes as the source of a program, which is compiled, checked and formatted.
//!
//! Nothing panics, diagnostics stay bounded and can be rendered, and formatting is idempotent and keeps the meaning.
//! The machine that runs programs is fuzzed by `run.rs`.
use scol_mini::{
    Arm, Compilation, IntDivision, LanguageOptions, MAX_DIAGNOSTICS, Program, Value, compile, compile_direct,
    format, print_channels, rewrite_value,
};

fn messages(compilation: &Compilation) -> Vec<(&'static str, String)> {
    let diagnostics = compilation.diagnostics.iter();
    let mut list: Vec<_> = diagnostics
        .map(|d| (d.code, d.message.to_ascii_uppercase()))
        .collect();
    list.sort();
    list
}

pub fn check(data: &[u8]) {
    let (choice, data) = data.split_first().unwrap_or((&0, data));
    let options = LanguageOptions {
        arm: if choice & 1 == 0 { Arm::SixAxis } else { Arm::Scara },
        sticky_work: choice & 2 != 0,
        data_copy: choice & 8 != 0,
        int_division: if choice & 4 == 0 {
            IntDivision::Truncate
        } else {
            IntDivision::Real
        },
        equal_within: if choice & 16 == 0 { 0.0 } else { 0.001 },
    };
    let source = String::from_utf8_lossy(data).into_owned();
    let compilation = compile(&source, &options);
    let checked = scol_mini::check(&source, &options);
    assert_eq!(checked.program.is_some(), compilation.program.is_some());
    for found in [&compilation, &checked] {
        assert!(found.diagnostics.len() <= MAX_DIAGNOSTICS);
        for diagnostic in &found.diagnostics {
            assert!(diagnostic.line >= 1 && diagnostic.column >= 1);
            assert!(diagnostic.render(&source, "M").len() < 4_000);
        }
    }
    let formatted = format(&source);
    assert_eq!(format(&formatted), formatted);
    // Tabs are errors that formatting removes, except from lines that it leaves as they are.
    if !formatted.contains('\t') {
        let before = compile(&source.replace('\t', " "), &options);
        let after = compile(&formatted, &options);
        assert_eq!(messages(&after), messages(&before), "{formatted:?}");
    }
    assert!(print_channels(&source).len() <= 4);
    let empty = Program::empty(&options);
    let base = compilation.program.as_ref().unwrap_or(&empty);
    for line in source.lines().take(8) {
        let _ = compile_direct(line, base);
    }
    for name in ["P1", "A", "N", "HOME", "T"] {
        if let Ok(written) = rewrite_value(&source, base, name, &[], &Value::Integer(-7)) {
            assert!(compile(&written, &options).program.is_some(), "{written:?}");
        }
    }
}
