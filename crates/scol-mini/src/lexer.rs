//! Cuts a line into tokens.
//!
//! Numbers get their value here; what words mean is left to the parser. A line that cannot be cut is one problem. `lines` cuts
//! the file into lines before.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use crate::diagnostic::{Problem, Span};
use crate::lines::Line;

/// A word, a number, a text or a sign.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Token {
    /// Name or keyword in upper case.
    Word(String),
    /// Digits; up to 2147483648, which only a minus sign makes valid.
    Integer(i64),
    /// Digits with a point or an exponent.
    Real(f32),
    /// The text between double quotes.
    Text(String),
    /// An operator or punctuation.
    Sign(Sign),
}

/// Operators and punctuation; an operator of two characters is one sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sign {
    Open,
    Close,
    OpenBrace,
    CloseBrace,
    Comma,
    Dot,
    Colon,
    Plus,
    Minus,
    Star,
    Slash,
    Caret,
    Assign,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

/// The spellings of the signs, longer ones first.
pub(crate) const SIGNS: &[(&str, Sign)] = &[
    ("==", Sign::Equal),
    ("<>", Sign::NotEqual),
    ("><", Sign::NotEqual),
    ("!=", Sign::NotEqual),
    ("<=", Sign::LessEqual),
    ("=<", Sign::LessEqual),
    (">=", Sign::GreaterEqual),
    ("=>", Sign::GreaterEqual),
    ("(", Sign::Open),
    (")", Sign::Close),
    ("{", Sign::OpenBrace),
    ("}", Sign::CloseBrace),
    (",", Sign::Comma),
    (".", Sign::Dot),
    (":", Sign::Colon),
    ("+", Sign::Plus),
    ("-", Sign::Minus),
    ("*", Sign::Star),
    ("/", Sign::Slash),
    ("^", Sign::Caret),
    ("=", Sign::Assign),
    ("<", Sign::Less),
    (">", Sign::Greater),
];

/// A token and its place in the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lexeme {
    pub token: Token,
    pub span: Span,
}

/// Cuts one line into tokens; a comment is left out.
pub(crate) fn tokens(source: &str, line: Line, longest: usize) -> Result<Vec<Lexeme>, Problem> {
    check_characters(source, line, longest)?;
    let mut list = Vec::new();
    let mut at = line.span.start;
    while at < line.span.end {
        let rest = source.get(at..line.span.end).unwrap_or_default();
        let first = rest.as_bytes().first().copied().unwrap_or(b' ');
        if first == b' ' {
            at += 1;
            continue;
        }
        if first == b'\'' {
            break;
        }
        let (token, length) = token(rest, at)?;
        if token == Token::Word("REMARK".into()) {
            break;
        }
        list.push(Lexeme {
            token,
            span: Span {
                start: at,
                end: at + length,
            },
        });
        at += length;
    }
    Ok(list)
}

fn check_characters(source: &str, line: Line, longest: usize) -> Result<(), Problem> {
    let text = source.get(line.span.start..line.span.end).unwrap_or_default();
    if text.len() > longest {
        let message = format!("at most {longest} characters expected, {} found", text.len());
        return Err(Problem::new("E0005", line.span, message));
    }
    for (at, c) in text.char_indices() {
        let start = line.span.start + at;
        let span = Span {
            start,
            end: start + c.len_utf8(),
        };
        if c == '\t' {
            return Err(Problem::new("E0003", span, "a file holds no tab codes").help("use blanks"));
        }
        if !c.is_ascii() {
            let message = format!("expected an ASCII character, found \"{c}\"");
            return Err(Problem::new("E0004", span, message));
        }
        if c.is_ascii_control() {
            let message = format!("expected a printable character, found code {:02X}", u32::from(c));
            return Err(Problem::new("E0002", span, message));
        }
    }
    Ok(())
}

/// The token at the beginning of `rest` and its length in bytes.
fn token(rest: &str, at: usize) -> Result<(Token, usize), Problem> {
    let first = rest.chars().next().unwrap_or(' ');
    if first.is_ascii_alphabetic() {
        return word(rest, at);
    }
    let fraction = first == '.' && rest.as_bytes().get(1).is_some_and(u8::is_ascii_digit);
    if first.is_ascii_digit() || fraction {
        return number(rest, at);
    }
    if first == '"' {
        let Some(length) = rest.get(1..).and_then(|tail| tail.find('"')) else {
            let span = Span {
                start: at,
                end: at + rest.len(),
            };
            return Err(Problem::new(
                "E0006",
                span,
                "a text ends with a double quote, found the end of the line",
            ));
        };
        return Ok((
            Token::Text(rest.get(1..=length).unwrap_or_default().to_string()),
            length + 2,
        ));
    }
    if let Some((spelling, sign)) = SIGNS.iter().find(|(spelling, _)| rest.starts_with(spelling)) {
        return Ok((Token::Sign(*sign), spelling.len()));
    }
    let span = Span {
        start: at,
        end: at + 1,
    };
    Err(Problem::new(
        "E0002",
        span,
        format!("the character \"{first}\" has no meaning here"),
    ))
}

fn word(rest: &str, at: usize) -> Result<(Token, usize), Problem> {
    let length = rest
        .find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
        .unwrap_or(rest.len());
    let text = rest.get(..length).unwrap_or_default().to_ascii_uppercase();
    if rest.as_bytes().get(length) == Some(&b'$') {
        let span = Span {
            start: at,
            end: at + length + 1,
        };
        let problem = Problem::new("E0107", span, format!("{text}$: there are no string variables"));
        return Err(problem.help("a text can only stand between double quotes in a PRINT"));
    }
    Ok((Token::Word(text), length))
}

fn number(rest: &str, at: usize) -> Result<(Token, usize), Problem> {
    let bytes = rest.as_bytes();
    let digits = |from: usize| bytes.iter().skip(from).take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    let mut real = false;
    if bytes.get(length) == Some(&b'.') {
        real = true;
        length += 1;
        length += digits(length);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            real = true;
            length += 1 + sign + exponent;
        }
    }
    let text = rest.get(..length).unwrap_or_default();
    let span = Span {
        start: at,
        end: at + length,
    };
    if real {
        return match text.parse::<f32>() {
            Ok(value) if value.is_finite() => Ok((Token::Real(value), length)),
            _ => Err(Problem::new(
                "E0007",
                span,
                format!("{text} is too large for a real"),
            )),
        };
    }
    match text.parse::<i64>() {
        Ok(value) if value <= -i64::from(i32::MIN) => Ok((Token::Integer(value), length)),
        _ => Err(too_large(text, span)),
    }
}

/// The problem of an integer beyond 32 bits.
pub(crate) fn too_large(text: &str, span: Span) -> Problem {
    Problem::new(
        "E0007",
        span,
        format!("{text} is too large for an integer of 32 bits"),
    )
    .help("write it with a decimal point to make it a real")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn tokens_of(text: &str) -> Vec<Token> {
        let line = Line {
            number: 1,
            span: Span {
                start: 0,
                end: text.len(),
            },
        };
        tokens(text, line, crate::MAX_LINE)
            .unwrap()
            .into_iter()
            .map(|l| l.token)
            .collect()
    }

    #[test]
    fn numbers_words_and_signs() {
        assert_eq!(tokens_of("00000"), vec![Token::Integer(0)]);
        assert_eq!(tokens_of("1.5E+2"), vec![Token::Real(150.0)]);
        assert_eq!(
            tokens_of("p1.x"),
            vec![
                Token::Word("P1".into()),
                Token::Sign(Sign::Dot),
                Token::Word("X".into())
            ]
        );
        assert_eq!(
            tokens_of("=< ><"),
            vec![Token::Sign(Sign::LessEqual), Token::Sign(Sign::NotEqual)]
        );
        assert_eq!(tokens_of("\"it's\" ' rest"), vec![Token::Text("it's".into())]);
        assert_eq!(tokens_of("A REMARK \" % ~"), vec![Token::Word("A".into())]);
    }
}
