//! Formats a source: one indentation, one spacing, words in upper case. Comments, texts and the spelling of numbers and
//! operators stay.
//!
//! A line is left as it is when its tokens would differ afterwards, when it cannot be cut into tokens, or when it would become
//! too long. So formatting never changes the meaning of a program. Start with [`format`].

use crate::prelude::*;

use crate::diagnostic::Span;
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::lines::{line_end, lines};
use crate::outline::{sign, word};
use crate::{MAX_FOR_NESTING, MAX_LINE, MAX_SOURCE};

/// Blanks of one level.
const INDENT: usize = 2;

/// Formats a source; its line ends become that of its first line (LF, CR or CR LF). Formatting is idempotent.
///
/// A file that is longer than [`MAX_SOURCE`], or would become so, is returned unchanged.
///
/// ```
/// let tidy = scol_mini::format("program t\nfor i=1 to 3\nprint i,cr 'count\nnext\nend\n");
/// assert_eq!(tidy, "PROGRAM T\n  FOR I = 1 TO 3\n    PRINT I, CR 'count\n  NEXT\nEND\n");
/// ```
pub fn format(source: &str) -> String {
    if source.len() > MAX_SOURCE {
        return source.into();
    }
    let (_, end) = line_end(source, 0);
    let mut layout = Layout::default();
    let mut text = String::new();
    let mut blank = true;
    for line in lines(source) {
        let laid = layout.line(source, line.span);
        // One empty line separates; more say nothing, nor do those at the beginning.
        if laid.is_empty() && blank {
            continue;
        }
        blank = laid.is_empty();
        text.push_str(&laid);
        text.push_str(end);
    }
    if blank && !text.is_empty() {
        text.truncate(text.len() - end.len());
    }
    // What follows the code 1A is no part of the file and is not touched.
    let behind = source.find('\u{1A}').and_then(|at| source.get(at..));
    text.push_str(behind.unwrap_or_default());
    if text.len() > MAX_SOURCE {
        return source.into();
    }
    text
}

/// The state of the layout.
#[derive(Default)]
struct Layout {
    /// Inside GLOBAL, PROGRAM or DATA.
    block: bool,
    data: bool,
    loops: usize,
}

impl Layout {
    fn line(&mut self, source: &str, line: Span) -> String {
        let text = line.text(source);
        let Ok(tokens) = lexer::tokens(source, line, MAX_LINE) else {
            return text.into();
        };
        if tokens.windows(2).any(stuck) {
            return text.into();
        }
        let depth = self.depth(&tokens);
        let mut laid = " ".repeat(depth * INDENT);
        laid.push_str(&self.spaced(source, &tokens));
        let end = tokens.last().map_or(line.start, |last| last.span.end);
        let tail = Span::new(end, line.end).text(source);
        let comment = tail.trim_matches(' ');
        if !comment.is_empty() {
            if !tokens.is_empty() {
                // The blanks before a comment stay, because people line comments up. There is at least one.
                let blanks = tail.len() - tail.trim_start_matches(' ').len();
                laid.push_str(&" ".repeat(blanks.max(1)));
            }
            laid.push_str(&upper_remark(comment));
        }
        let laid = laid.trim_end_matches(' ');
        let fits = laid.len() <= MAX_LINE && same(laid, &tokens);
        if fits { laid.into() } else { text.into() }
    }

    /// The depth of a line; goes into and out of blocks and loops with it.
    fn depth(&mut self, tokens: &[Lexeme]) -> usize {
        let alone = tokens.len() == 1;
        let labelled = sign(tokens.get(1)) == Some(Sign::Colon);
        let head = word(tokens.get(if labelled { 2 } else { 0 }));
        match head {
            "END" if alone || (labelled && tokens.len() == 3) => {
                *self = Layout::default();
                return 0;
            }
            "GLOBAL" | "DATA" | "PROGRAM" if !labelled && (alone || head == "PROGRAM") => {
                *self = Layout {
                    block: true,
                    data: head == "DATA",
                    loops: 0,
                };
                return 0;
            }
            "NEXT" => self.loops = self.loops.saturating_sub(1),
            _ => {}
        }
        let depth = usize::from(self.block) + self.loops;
        if head == "FOR" && self.block {
            self.loops = (self.loops + 1).min(MAX_FOR_NESTING);
        }
        // A label is not indented, so that the target of a jump is seen.
        if labelled { 0 } else { depth }
    }

    /// The words of a line with one spacing.
    fn spaced(&self, source: &str, tokens: &[Lexeme]) -> String {
        let mut text = String::new();
        for (at, lexeme) in tokens.iter().enumerate() {
            if self.parted(tokens, at) {
                text.push(' ');
            }
            let spelling = lexeme.span.text(source);
            if let Token::Text(_) = lexeme.token {
                text.push_str(spelling);
            } else {
                text.push_str(&spelling.to_ascii_uppercase());
            }
        }
        text
    }

    /// `true` when a blank belongs before the token `at`.
    fn parted(&self, tokens: &[Lexeme], at: usize) -> bool {
        let before = at.checked_sub(1).and_then(|at| tokens.get(at));
        let earlier = at.checked_sub(2).and_then(|at| tokens.get(at));
        let (left, right) = (sign(before), sign(tokens.get(at)));
        match (left, right) {
            _ if at == 0 => false,
            (_, Some(Sign::Comma | Sign::Close | Sign::CloseBrace | Sign::Colon | Sign::Dot)) => false,
            (Some(Sign::Open | Sign::OpenBrace | Sign::Dot), _) => false,
            // Data is written closely, as the controller does it.
            _ if self.data && (left.is_some() || right.is_some()) => false,
            (Some(Sign::Comma | Sign::Colon), _) => true,
            (Some(Sign::Minus | Sign::Plus), _) if is_value(earlier).is_none() => false,
            (_, Some(Sign::Slash)) if at + 1 == tokens.len() => false,
            (None, Some(Sign::Open)) => {
                // MOD between two values is an operator, elsewhere a function.
                let operator = word(before) == "MOD" && is_value(earlier).is_some();
                is_value(before) != Some(true) || operator
            }
            _ => true,
        }
    }
}

/// Whether a token ends a value: `Some(true)` for a name, which is a function when a parenthesis follows, `Some(false)`
/// for any other value, `None` if it ends none.
fn is_value(lexeme: Option<&Lexeme>) -> Option<bool> {
    const JOINTS: &[&str] = &[
        "IF", "THEN", "ELSE", "WAIT", "MOVE", "MOVES", "MOVEC", "MOVEA", "MOVEI", "MOVEJ", "PRINT", "INPUT",
        "DELAY", "TO", "STEP", "AND", "OR", "NOT", "WITH", "DO", "ON", "KILL", "AS",
    ];
    match &lexeme?.token {
        Token::Word(word) if JOINTS.contains(&word.as_str()) => None,
        Token::Word(_) => Some(true),
        Token::Integer(_) | Token::Real(_) | Token::Text(_) => Some(false),
        Token::Sign(Sign::Close | Sign::CloseBrace) => Some(false),
        Token::Sign(_) => None,
    }
}

/// `remark` in upper case, its text as it is.
fn upper_remark(comment: &str) -> String {
    match comment.split_at_checked(6) {
        Some((word, text)) if word.eq_ignore_ascii_case("REMARK") => word.to_ascii_uppercase() + text,
        _ => comment.into(),
    }
}

/// `7CHECK`: a number directly before a name is not a statement; only the author knows where to divide them.
fn stuck(pair: &[Lexeme]) -> bool {
    let wordy = |lexeme: &Lexeme| matches!(lexeme.token, Token::Word(_) | Token::Integer(_) | Token::Real(_));
    match pair {
        [a, b] => a.span.end == b.span.start && wordy(a) && wordy(b),
        _ => false,
    }
}

/// Whether a formatted line has the words of the line before.
fn same(laid: &str, tokens: &[Lexeme]) -> bool {
    let again = lexer::tokens(laid, Span::new(0, laid.len()), MAX_LINE);
    again.is_ok_and(|again| again.iter().map(|l| &l.token).eq(tokens.iter().map(|l| &l.token)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacing() {
        for (from, to) in [
            ("n=-1+ - 2*(a-b)", "N = -1 + -2 * (A - B)"),
            (
                "if(a==1)and not(b<2)then stop",
                "IF (A == 1) AND NOT (B < 2) THEN STOP",
            ),
            ("goto (k)a,b", "GOTO(K) A, B"),
            (
                "move point (1 ,-2)+p . x with speed=5",
                "MOVE POINT(1, -2) + P.X WITH SPEED = 5",
            ),
            ("print ip1,\"a  b\" , -x,cr", "PRINT IP1, \"a  b\", -X, CR"),
            ("x=mod(a,2)+a mod(2)", "X = MOD(A, 2) + A MOD (2)"),
            ("dout(1,-2)", "DOUT(1, -2)"),
            ("movec p1 p2", "MOVEC P1 P2"),
            ("a=1 .x", "A = 1 .X"),
            ("p={1,2}", "P = {1, 2}"),
            ("remark  Keep  This", "REMARK  Keep  This"),
            ("a=1   ' Aligned", "A = 1   ' Aligned"),
        ] {
            let found = format(from);
            let found = found.trim_end();
            // Where the words would change, the line stays as it was.
            let expected = if from == "a=1 .x" { from } else { to };
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn blocks_labels_data_and_line_ends() {
        let source = "\r\n\r\nprogram t\r\nlast:\r\n    stop\r\n\r\n\r\n out: goto last\r\nend\r\ndata\r\npoint p1 = 1, -2 ,,3/\r\nend\r\n\r\n\x1Arest\r\n";
        assert_eq!(
            format(source),
            "PROGRAM T\r\nLAST:\r\n  STOP\r\n\r\nOUT: GOTO LAST\r\nEND\r\nDATA\r\n  POINT P1=1,-2,,3/\r\nEND\r\n\x1Arest\r\n"
        );
        let broken = "PROGRAM T\n\tX  = 1\n   é\n INPUT 7A\n";
        assert_eq!(format(broken), broken);
    }
}
