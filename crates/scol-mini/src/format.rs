//! Formats a source: one indentation, one spacing, words in upper case, no tabs. Texts and the spelling of numbers and
//! operators stay, and trailing comments keep their column.
//!
//! A line that does not parse and a line outside all blocks only lose trailing blanks: only the author knows what they mean.
//! A line is left as it is when its tokens would differ afterwards, when a text holds a tab, or when it would become too
//! long. So formatting never changes the meaning of a program. Start with [`format`].

use crate::prelude::*;
use alloc::collections::BTreeMap;

use crate::diagnostic::{Sink, Span};
use crate::lexer::{self, Lexeme, Sign, Token};
use crate::lines::{BYTE_ORDER_MARK, line_end, lines};
use crate::options::{Arm, LanguageOptions};
use crate::outline::{Place, sign, word};
use crate::parser::{Unparsed, parse_file};
use crate::{MAX_FOR_NESTING, MAX_LINE, MAX_SOURCE};

/// Blanks of one level.
const INDENT: usize = 2;
/// Columns from one tab stop to the next, as terminals have them.
const TAB_STOP: usize = 8;

/// Formats a source; its line ends become that of its first line (LF, CR or CR LF). Formatting is idempotent.
///
/// A file that is longer than [`MAX_SOURCE`], or would become so, is returned unchanged. So is one that begins with a byte
/// order mark, which no controller reads.
///
/// ```
/// let tidy = scol_mini::format("program t\nfor i=1 to 3\nprint i,cr 'count\nnext\nend\n");
/// assert_eq!(tidy, "PROGRAM T\n  FOR I = 1 TO 3\n    PRINT I, CR 'count\n  NEXT\nEND\n");
/// ```
pub fn format(source: &str) -> String {
    if source.len() > MAX_SOURCE || source.starts_with(BYTE_ORDER_MARK) {
        return source.into();
    }
    let (_, end) = line_end(source, 0);
    let unparsed = unparsed(source);
    let mut layout = Layout::default();
    let mut rows: Vec<Row> = Vec::new();
    let mut blank = true;
    for line in lines(source) {
        let text = line.span.text(source);
        let row = match unparsed.get(&line.number) {
            Some(effect) => layout.unparsed_row(text, *effect),
            None => layout.row(text),
        };
        let is_empty = row.is_empty();
        // One empty line separates; more say nothing, nor do those at the beginning.
        if !(is_empty && blank) {
            rows.push(row);
        }
        blank = is_empty;
    }
    if blank {
        rows.pop();
    }
    align(&mut rows);
    let mut text = String::new();
    for row in &rows {
        row.write(&mut text);
        text.push_str(end);
    }
    // What follows the code 1A is no part of the file and is not touched.
    let after = source.find('\u{1A}').and_then(|at| source.get(at..));
    text.push_str(after.unwrap_or_default());
    if text.len() > MAX_SOURCE {
        return source.into();
    }
    text
}

/// Lines that do not parse, whichever arm the program is for.
fn unparsed(source: &str) -> BTreeMap<u32, Unparsed> {
    // Formatting removes tabs. With a blank for each of them all other characters are at the same places.
    let plain = source.replace('\t', " ");
    let of = |arm| {
        let options = LanguageOptions {
            arm,
            ..LanguageOptions::default()
        };
        parse_file(&plain, &options, &mut Sink::new(&plain)).unparsed
    };
    let (mut lines, scara) = (of(Arm::SixAxis), of(Arm::Scara));
    lines.retain(|line, _| scara.contains_key(line));
    lines
}

/// A line of the source and its formatted parts.
struct Row<'a> {
    /// The line of the source.
    source: &'a str,
    /// `None` for a line that stays as it is.
    parts: Option<Parts>,
}

/// The parts of a formatted line.
struct Parts {
    /// Column at which the line begins.
    indent: usize,
    /// Empty for a comment alone.
    statement: String,
    comment: Option<Comment>,
}

struct Comment {
    text: String,
    /// Column from 0: in the source, and after [`align`] in the result.
    column: usize,
}

impl Row<'_> {
    fn is_empty(&self) -> bool {
        match &self.parts {
            Some(parts) => parts.statement.is_empty() && parts.comment.is_none(),
            None => self.source.is_empty(),
        }
    }

    /// Column of a comment that follows a statement.
    fn trailing(&self) -> Option<usize> {
        let parts = self.parts.as_ref().filter(|parts| !parts.statement.is_empty())?;
        Some(parts.comment.as_ref()?.column)
    }

    /// Whether the line belongs to those above whose comments are in this column: its own is too, or it has none.
    fn continues(&self, column: usize) -> bool {
        let parts = self.parts.as_ref().filter(|_| !self.is_empty());
        parts.is_some_and(|parts| {
            let comment = parts.comment.as_ref();
            comment.is_none_or(|comment| comment.column == column)
        })
    }

    fn write(&self, out: &mut String) {
        let Some(parts) = &self.parts else {
            out.push_str(self.source);
            return;
        };
        if !parts.statement.is_empty() {
            out.push_str(&" ".repeat(parts.indent));
            out.push_str(&parts.statement);
        }
        if let Some(comment) = &parts.comment {
            out.push_str(&" ".repeat(comment.column.saturating_sub(parts.width())));
            out.push_str(&comment.text);
        }
    }
}

impl Parts {
    /// Columns of the statement with its indentation.
    fn width(&self) -> usize {
        match self.statement.is_empty() {
            true => 0,
            false => self.indent + self.statement.len(),
        }
    }

    /// Smallest column of a comment, with one blank before it.
    fn least(&self) -> usize {
        match self.statement.is_empty() {
            true => 0,
            false => self.width() + 1,
        }
    }
}

impl Comment {
    fn fits(&self, column: usize) -> bool {
        column + self.text.len() <= MAX_LINE
    }
}

/// Gives each comment its column. Comments of neighbouring lines that were in one column move right together, if a
/// statement has become too long for it. A comment alone that continues them moves too; any other is indented like a
/// statement. A line without a comment may be between them, an empty one may not.
///
/// Formatting again changes nothing: afterwards all statements leave room for the column of their comments, so no comment
/// moves, whichever lines are then neighbours.
fn align(rows: &mut [Row]) {
    let mut rest = rows;
    while let Some(row) = rest.first() {
        let length = row.trailing().map_or(1, |column| {
            let following = rest.iter().skip(1);
            1 + following.take_while(|row| row.continues(column)).count()
        });
        let (run, others) = rest.split_at_mut(length);
        place(run);
        rest = others;
    }
}

/// Gives the comments of a run their column, which is the same for all unless one of them would be too long then.
fn place(run: &mut [Row]) {
    let together = run.iter().find_map(Row::trailing);
    let commented = || run.iter().filter_map(|row| row.parts.as_ref());
    let least = commented()
        .filter(|parts| parts.comment.is_some())
        .map(Parts::least);
    let common = together.max(least.max());
    let comments = commented().filter_map(|parts| parts.comment.as_ref());
    let common =
        common.filter(|column| together.is_some() && comments.clone().all(|comment| comment.fits(*column)));
    for parts in run.iter_mut().filter_map(|row| row.parts.as_mut()) {
        let (least, is_alone, indent) = (parts.least(), parts.statement.is_empty(), parts.indent);
        if let Some(comment) = &mut parts.comment {
            let own = if is_alone {
                indent
            } else {
                comment.column.max(least)
            };
            comment.column = common.unwrap_or(own);
        }
    }
}

/// Text with each tab replaced by blanks to the next tab stop, if it begins at this column.
fn without_tabs(text: &str, mut column: usize) -> String {
    let mut plain = String::new();
    for c in text.chars() {
        let next = next_column(column, c);
        match c {
            '\t' => plain.push_str(&" ".repeat(next - column)),
            _ => plain.push(c),
        }
        column = next;
    }
    plain
}

/// Column after a character at this column.
fn next_column(column: usize, c: char) -> usize {
    match c {
        '\t' => (column / TAB_STOP + 1) * TAB_STOP,
        _ => column + 1,
    }
}

/// The state of the layout.
#[derive(Default)]
struct Layout {
    /// Inside GLOBAL, PROGRAM or DATA.
    block: bool,
    data: bool,
    loops: usize,
    /// After a line outside all blocks: the comments below may belong to it.
    astray: bool,
}

impl Layout {
    /// A line that does not parse; goes into and out of blocks and loops with it.
    fn unparsed_row<'a>(&mut self, source: &'a str, effect: Unparsed) -> Row<'a> {
        match effect {
            Unparsed::Inside => {}
            Unparsed::Outside => {
                *self = Layout {
                    astray: true,
                    ..Layout::default()
                }
            }
            Unparsed::Closes => *self = Layout::default(),
            Unparsed::Opens(place) => {
                *self = Layout {
                    block: true,
                    data: place == Place::Data,
                    ..Layout::default()
                }
            }
            Unparsed::BeginsLoop => self.loops = (self.loops + 1).min(MAX_FOR_NESTING),
            Unparsed::EndsLoop => self.loops = self.loops.saturating_sub(1),
        }
        // A line may be too long by its blanks alone, which would then be another error.
        let trimmed = source.trim_end_matches([' ', '\t']);
        Row {
            source: if source.len() > MAX_LINE { source } else { trimmed },
            parts: None,
        }
    }

    fn row<'a>(&mut self, source: &'a str) -> Row<'a> {
        let parts = self.parts(source);
        Row { source, parts }
    }

    /// The parts of a line; `None` if it has to stay as it is.
    fn parts(&mut self, line: &str) -> Option<Parts> {
        // The language has no tabs. With a blank for each of them the tokens are at the same places.
        let plain = line.replace('\t', " ");
        let tokens = lexer::tokens(&plain, Span::new(0, plain.len()), MAX_LINE).ok()?;
        // Only the author knows how many blanks a tab in a text means.
        let is_text = |lexeme: &&Lexeme| matches!(lexeme.token, Token::Text(_));
        let mut texts = tokens.iter().filter(is_text);
        let keeps_tab = texts.any(|text| text.span.text(line).contains('\t'));
        if keeps_tab || tokens.is_empty() && self.astray && !line.trim().is_empty() {
            return None;
        }
        let indent = self.depth(&tokens) * INDENT;
        let statement = self.spaced(&plain, &tokens);
        let end = tokens.last().map_or(0, |last| last.span.end);
        let (before, tail) = line.split_at_checked(end)?;
        let comment = tail.trim_matches([' ', '\t']);
        let blanks = tail.len() - tail.trim_start_matches([' ', '\t']).len();
        let before = before.chars().chain(tail.chars().take(blanks));
        let column = before.fold(0, next_column);
        let comment = (!comment.is_empty()).then(|| Comment {
            text: upper_remark(&without_tabs(comment, column)),
            column,
        });
        let parts = Parts {
            indent,
            statement,
            comment,
        };
        let fits = match &parts.comment {
            Some(comment) if parts.statement.is_empty() => comment.fits(indent),
            Some(comment) => comment.fits(column.max(parts.least())),
            None => parts.width() <= MAX_LINE,
        };
        (fits && same(&parts.statement, &tokens)).then_some(parts)
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
                    ..Layout::default()
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

/// Whether a formatted line has the words of the line before.
fn same(laid: &str, tokens: &[Lexeme]) -> bool {
    let again = lexer::tokens(laid, Span::new(0, laid.len()), MAX_LINE);
    again.is_ok_and(|again| again.iter().map(|l| &l.token).eq(tokens.iter().map(|l| &l.token)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of a program, formatted without its heading and its END.
    fn inside(lines: &str) -> String {
        let lines = lines.strip_suffix('\n').unwrap_or(lines);
        let laid = format(&std::format!("PROGRAM T\n{lines}\nEND\n"));
        let laid = laid.strip_prefix("PROGRAM T\n").unwrap();
        laid.strip_suffix("END\n").unwrap().into()
    }

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
            ("p={1,2}", "P = {1, 2}"),
            ("remark  Keep  This", "REMARK  Keep  This"),
            ("a=1   ' Aligned", "A = 1 ' Aligned"),
            ("a   =   1  ' Aligned", "A = 1    ' Aligned"),
            // The words would change.
            ("a=1 .x", "a=1 .x"),
        ] {
            let found = inside(from);
            assert_eq!(found.trim(), to);
        }
    }

    #[test]
    fn blocks_labels_data_and_line_ends() {
        let source = "\r\n\r\nprogram t\r\nlast:\r\n    stop\r\n\r\n\r\n out: goto last\r\nend\r\ndata\r\npoint p1 = 1, -2 ,,3/\r\nend\r\n\r\n\x1Arest\r\n";
        assert_eq!(
            format(source),
            "PROGRAM T\r\nLAST:\r\n  STOP\r\n\r\nOUT: GOTO LAST\r\nEND\r\nDATA\r\n  POINT P1=1,-2,,3/\r\nEND\r\n\x1Arest\r\n"
        );
    }

    #[test]
    fn lines_that_do_not_parse_only_lose_trailing_blanks() {
        for line in [
            "   é",
            " INPUT 7A",
            " w:=5",
            " n+=1 // two",
            " n=1//Part's count",
            " PRINT  \"a\tb\" ' \t c",
            "\tX  = 1 ' é",
            " foo  bar",
            "   /* Comment */",
            " (* Comment  Text *)",
            "-- Comment Text",
            " rem Comment  Text",
            "     end if",
        ] {
            assert_eq!(inside(line), std::format!("{line}\n"));
            // The row of a tab in a text parses.
            if !line.contains("a\tb") {
                assert_eq!(inside(&std::format!("{line} \t ")), std::format!("{line}\n"));
            }
        }
        // They begin and end their loops.
        let from = "fro i=1 to 3\nn=1\nenxt i\nif n==1 then\nn=2\n    endif\n";
        let to = "fro i=1 to 3\n    N = 1\nenxt i\nif n==1 then\n  N = 2\n    endif\n";
        assert_eq!(inside(from), to);
    }

    #[test]
    fn lines_outside_all_blocks_keep_their_indentation() {
        for (from, to) in [
            // A misspelt heading opens its block.
            (
                "progrm t\nfor i=1 to 3\nprint i\n  next\nedn\nprogram b\nend\n",
                "progrm t\n  FOR I = 1 TO 3\n    PRINT I\n  NEXT\nedn\nPROGRAM B\nEND\n",
            ),
            (
                "proc t\n    n=1  \n  ' a comment\n\n    x=2\nend\n  ' another\nprogram b\n      ' inside\nend\n",
                "proc t\n    n=1\n  ' a comment\n\n    x=2\nend\n  ' another\nPROGRAM B\n  ' inside\nEND\n",
            ),
        ] {
            assert_eq!(format(from), to);
            assert_eq!(format(to), to);
        }
        let marked = "\u{FEFF}program t\n n=1\nend\n";
        assert_eq!(format(marked), marked);
    }

    #[test]
    fn comments_stay_in_one_column() {
        for (from, to) in [
            // Changed indentation and spacing leave them where they were.
            (
                "program t\nn=1        ' one\nmove  p1   ' two\n           ' more of two\n      ' three\nend\n",
                "PROGRAM T\n  N = 1    ' one\n  MOVE P1  ' two\n           ' more of two\n  ' three\nEND\n",
            ),
            // Where a statement has become too long all move, also past a line without a comment.
            (
                "program t\nn=1  ' one\nstop\nx=n+1' two\nend\n",
                "PROGRAM T\n  N = 1     ' one\n  STOP\n  X = N + 1 ' two\nEND\n",
            ),
            // An empty line, and a line that stays as it is, part them.
            (
                "program t\nn=1    ' one\n\nx=n+1' two\nx=n+1' é\nn=1    ' three\nend\n",
                "PROGRAM T\n  N = 1 ' one\n\n  X = N + 1 ' two\nx=n+1' é\n  N = 1 ' three\nEND\n",
            ),
            (
                "program t\nn=1    ' one\nn=2      ' two\nend\n",
                "PROGRAM T\n  N = 1 ' one\n  N = 2  ' two\nEND\n",
            ),
        ] {
            assert_eq!(format(from), to);
            assert_eq!(format(to), to);
        }
    }

    #[test]
    fn a_comment_that_would_become_too_long_leaves_its_column() {
        let long = "x".repeat(MAX_LINE - 9);
        let from = std::format!("n=1    '{long}\nx=n+1'two\n");
        let to = std::format!("  N = 1 '{long}\n  X = N + 1 'two\n");
        assert_eq!(inside(&from), to);
        assert_eq!(inside(&to), to);
        let full = std::format!("n=1 '{long}xxxx\nn=2 'two\n");
        let to = std::format!("n=1 '{long}xxxx\n  N = 2 'two\n");
        assert_eq!(inside(&full), to);
    }

    #[test]
    fn tabs_become_blanks_outside_of_texts() {
        for (from, to) in [
            (
                "program t\n\tn=1\t' one\n\tfor\ti=1 to 2\t\n\t\tn=2\t' two\n\t'a\tb\n\tnext\nend\n",
                "PROGRAM T\n  N = 1         ' one\n  FOR I = 1 TO 2\n    N = 2               ' two\n    'a      b\n  NEXT\nEND\n",
            ),
            (
                "program t\nprint\t\"a\"\t,cr\tremark\tx\nend\n",
                "PROGRAM T\n  PRINT \"a\", CR         REMARK  x\nEND\n",
            ),
            ("\t\nprogram t\t\n\tstop\n\t\nend\n", "PROGRAM T\n  STOP\n\nEND\n"),
        ] {
            assert_eq!(format(from), to);
            assert_eq!(format(to), to);
        }
    }
}
