//! Takes a source apart into code, comments and string literals, in each language of the repository.
//!
//! It is a lexer for the tests of words (`words.rs`, `prose.rs`), not a parser: a template of JavaScript ends at the next
//! back quote, so that one inside its `${}` splits it into two. Neither loses a word.

use std::path::Path;

/// How a language writes comments and strings.
pub struct Language {
    line_comment: &'static str,
    block_comment: Option<(&'static str, &'static str)>,
    /// The end of the string that begins here, with what stands before it to tell its prefix.
    string: fn(before: &str, rest: &str) -> Option<usize>,
    /// The length of another literal, in which a quote opens nothing: a character, a regular expression.
    other: fn(before: &str, rest: &str) -> Option<usize>,
}

const C_BLOCK: Option<(&str, &str)> = Some(("/*", "*/"));

pub const RUST: Language = Language {
    line_comment: "//",
    block_comment: C_BLOCK,
    string: |before, rest| {
        let hashes = before.len() - before.trim_end_matches('#').len();
        if before[..before.len() - hashes].ends_with('r') {
            return until(rest, "\"", &format!("\"{}", "#".repeat(hashes)));
        }
        escaped(rest, "\"")
    },
    other: character,
};

const JAVASCRIPT: Language = Language {
    line_comment: "//",
    block_comment: C_BLOCK,
    string: |_, rest| ["\"", "'", "`"].iter().find_map(|quote| escaped(rest, quote)),
    other: regular_expression,
};

const PYTHON: Language = Language {
    line_comment: "#",
    block_comment: None,
    string: |_, rest| {
        let quotes = ["\"\"\"", "'''", "\"", "'"];
        quotes.iter().find_map(|quote| escaped(rest, quote))
    },
    other: |_, _| None,
};

const C_SHARP: Language = Language {
    line_comment: "//",
    block_comment: C_BLOCK,
    string: |before, rest| {
        // A verbatim string has no escapes; `""` in it splits it in two.
        if before.ends_with('@') || before.ends_with("@$") {
            return until(rest, "\"", "\"");
        }
        escaped(rest, "\"")
    },
    other: character,
};

const CPP: Language = Language {
    line_comment: "//",
    block_comment: C_BLOCK,
    string: |before, rest| {
        if before.ends_with('R') {
            let name = &rest.strip_prefix('"')?[..rest.find('(')? - 1];
            return until(rest, "\"", &format!("){name}\""));
        }
        escaped(rest, "\"")
    },
    other: character,
};

const LUA: Language = Language {
    line_comment: "--",
    block_comment: Some(("--[[", "]]")),
    string: |_, rest| {
        let long = until(rest, "[[", "]]");
        long.or_else(|| ["\"", "'"].iter().find_map(|quote| escaped(rest, quote)))
    },
    other: |_, _| None,
};

/// The extensions of sources that are read, and their languages.
pub const LANGUAGES: [(&str, &Language); 7] = [
    ("rs", &RUST),
    ("js", &JAVASCRIPT),
    ("ts", &JAVASCRIPT),
    ("py", &PYTHON),
    ("cs", &C_SHARP),
    ("hpp", &CPP),
    ("lua", &LUA),
];

/// The length of a string with escapes that `rest` begins with.
fn escaped(rest: &str, quote: &str) -> Option<usize> {
    let inside = rest.strip_prefix(quote)?;
    let mut from = 0;
    while let Some(found) = inside[from..].find(quote) {
        let upto = &inside[..from + found];
        let backslashes = upto.len() - upto.trim_end_matches('\\').len();
        if backslashes.is_multiple_of(2) {
            return Some(2 * quote.len() + upto.len());
        }
        from += found + 1;
    }
    Some(rest.len())
}

/// The length of a string without escapes that `rest` begins with.
fn until(rest: &str, open: &str, close: &str) -> Option<usize> {
    let inside = rest.strip_prefix(open)?;
    let length = inside.find(close).unwrap_or(inside.len() - close.len());
    Some(open.len() + length + close.len())
}

/// The length of a character, as against a lifetime or a separator of digits: `'"'`, `'\''`.
fn character(_: &str, rest: &str) -> Option<usize> {
    let mut inside = rest.strip_prefix('\'')?.chars();
    let first = inside.next()?;
    if first == '\\' {
        let escape = 2 + inside.next()?.len_utf8();
        return Some(escape + rest[escape..].find('\'')? + 1);
    }
    (inside.next() == Some('\'')).then(|| 2 + first.len_utf8())
}

/// The length of a regular expression, as against a division: only after an operator or an opening bracket.
fn regular_expression(before: &str, rest: &str) -> Option<usize> {
    let last = before.trim_end().chars().next_back();
    if !rest.starts_with('/') || !last.is_none_or(|last| "(,=:[!&|?{};>".contains(last)) {
        return None;
    }
    let (mut in_class, mut is_escaped) = (false, false);
    for (at, character) in rest.char_indices().skip(1) {
        match character {
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            '[' => in_class = true,
            ']' => in_class = false,
            '\n' => return None,
            '/' if !in_class => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// A piece of a source and the line it begins on.
pub type Piece<'a> = (usize, &'a str);

/// What a source is made of.
#[derive(Default)]
pub struct Pieces<'a> {
    /// Without strings and comments.
    pub code: Vec<Piece<'a>>,
    pub comments: Vec<Piece<'a>>,
    /// With their quotes.
    pub strings: Vec<Piece<'a>>,
}

impl Language {
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?;
        let mut rows = LANGUAGES.iter();
        rows.find(|(known, _)| extension == *known)
            .map(|(_, language)| *language)
    }

    /// The length of the comment that `rest` begins with.
    fn comment(&self, rest: &str) -> Option<usize> {
        let block = self
            .block_comment
            .and_then(|(open, close)| until(rest, open, close));
        let line = || {
            rest.starts_with(self.line_comment)
                .then(|| rest.find('\n').unwrap_or(rest.len()))
        };
        block.or_else(line)
    }

    pub fn pieces<'a>(&self, source: &'a str) -> Pieces<'a> {
        let mut pieces = Pieces::default();
        let (mut at, mut line, mut code_from) = (0, 1, 0);
        let add_code = |code: &mut Vec<Piece<'a>>, line: usize, text: &'a str| {
            let first = line - text.matches('\n').count();
            code.extend((first..).zip(text.split('\n')));
        };
        while let Some(next) = source[at..].chars().next() {
            let (before, rest) = source.split_at(at);
            let (kind, length) = if let Some(length) = self.comment(rest) {
                (Some(&mut pieces.comments), length)
            } else if let Some(length) = (self.string)(before, rest) {
                (Some(&mut pieces.strings), length)
            } else if let Some(length) = (self.other)(before, rest) {
                (None, length)
            } else {
                line += usize::from(next == '\n');
                at += next.len_utf8();
                continue;
            };
            if let Some(kind) = kind {
                kind.push((line, &rest[..length]));
            }
            add_code(&mut pieces.code, line, &source[code_from..at]);
            line += rest[..length].matches('\n').count();
            at += length;
            code_from = at;
        }
        add_code(&mut pieces.code, line, &source[code_from..]);
        pieces
    }
}

#[test]
fn each_language_is_taken_apart() {
    let strings = |extension: &str, source: &str| -> Vec<String> {
        let language = Language::of(Path::new(&format!("a.{extension}"))).unwrap();
        let found = language.pieces(source).strings;
        found
            .into_iter()
            .map(|(line, text)| format!("{line} {text}"))
            .collect()
    };
    let rust = "// \"no\"\nfn f<'a>() -> '\\'' { '\"'; r#\"a \" b\"#; \"c \\\" d\" }";
    assert_eq!(strings("rs", rust), ["2 \"a \" b\"#", "2 \"c \\\" d\""]);
    let javascript = "/* \"no\n*/ x = y / 2; s.split(/[\"'/]/); 'it\\'s'; `a ${b}`";
    assert_eq!(strings("js", javascript), ["2 'it\\'s'", "2 `a ${b}`"]);
    let python = "# 'no'\n'''one \"quote\"\n'''\nf\"two\"";
    assert_eq!(strings("py", python), ["2 '''one \"quote\"\n'''", "4 \"two\""]);
    assert_eq!(
        strings("cs", "'\"'; @\"a\\\"; $\"b\\\"c\""),
        ["1 \"a\\\"", "1 \"b\\\"c\""]
    );
    assert_eq!(
        strings("hpp", "1'000; R\"x(a)\" b)x\"; \"c\""),
        ["1 \"x(a)\" b)x\"", "1 \"c\""]
    );
    assert_eq!(
        strings("lua", "--[[ \"no\" ]] [[a]] .. 'b' -- \"no\""),
        ["1 [[a]]", "1 'b'"]
    );
}
