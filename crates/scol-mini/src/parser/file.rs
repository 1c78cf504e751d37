//! Parses the layout of a file: GLOBAL, PROGRAM blocks, DATA, in this order, each closed by END (RAM-04).
//!
//! The lines within are parsed by `declaration`, `statement` and `data`. Start with [`parse_file`].

use crate::prelude::*;

use super::foreign::{self, ForeignBlock, Part};
use super::{Block, Cursor, File, Label, Located, Unparsed};
use crate::builtin;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::fix::Edit;
use crate::lexer::{self, Lexeme, Line, Sign, Token, leading_word, lines};
use crate::lines::BYTE_ORDER_MARK;
use crate::options::LanguageOptions;
use crate::outline::Place;
use crate::suggest;
use crate::tree::{Counting, Expression, Name, Statement, Variable};
use crate::value::ValueKind;
use crate::{MAX_DIRECT, MAX_LINE};

/// Parses a whole file; reports lines that do not parse to `sink` and drops them.
pub(crate) fn parse_file(source: &str, options: &LanguageOptions, sink: &mut Sink) -> File {
    let mut parser = Parser {
        source,
        options,
        sink,
        file: File::default(),
        place: Place::Outside,
        opened: None,
        astray: false,
        work: None,
        foreign: Vec::new(),
        unparsed: None,
    };
    if source.starts_with(BYTE_ORDER_MARK) {
        parser.sink.push(byte_order_mark());
    }
    for line in lines(source) {
        let before = parser.place;
        match lexer::tokens(source, line.span, MAX_LINE) {
            Ok(tokens) if tokens.is_empty() => {}
            Ok(tokens) => {
                if let Err(problem) = parser.line(line, &tokens) {
                    parser.broken(line, problem);
                }
            }
            Err(problem) => parser.broken(line, problem),
        }
        parser.note_unparsed(line, before);
    }
    parser.finish();
    parser.file
}

struct Parser<'a> {
    source: &'a str,
    options: &'a LanguageOptions,
    sink: &'a mut Sink,
    file: File,
    place: Place,
    /// The line that opened the present block.
    opened: Option<Span>,
    /// A line outside all blocks has been reported; further ones up to an END are not.
    astray: bool,
    /// The WORK line that waits for its position.
    work: Option<Name>,
    /// Open blocks of other languages.
    foreign: Vec<&'static ForeignBlock>,
    /// Set when the present line does not parse.
    unparsed: Option<Unparsed>,
}

impl Parser<'_> {
    /// Keeps the effect of a line that did not parse. `before` is the place it was in.
    fn note_unparsed(&mut self, line: Line, before: Place) {
        let Some(effect) = self.unparsed.take() else {
            return;
        };
        let opens = self.opened.is_some_and(|opened| opened.start >= line.span.start);
        let effect = match (before, self.place) {
            (_, place) if opens => Unparsed::Opens(place),
            (Place::Outside, Place::Outside) => Unparsed::Outside,
            (_, Place::Outside) => Unparsed::Closes,
            _ => effect,
        };
        self.file.unparsed.insert(line.number, effect);
    }

    /// Reports a line that does not parse.
    fn broken(&mut self, line: Line, problem: Diagnostic) {
        self.unparsed = Some(Unparsed::Inside);
        let text = line.span.text(self.source).to_ascii_uppercase();
        let words = text
            .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .filter(|word| !word.is_empty());
        self.file.suppressed.extend(words.map(String::from));
        let (problem, statement) = (remark_of(line, &text, problem), after_label(&text));
        let end = ends_loop(statement).filter(|_| self.place == Place::Program);
        let closes = end.is_some() && self.has_open_loop();
        self.sink.push(match end {
            Some(word) if !closes && problem.code == "E0103" => {
                Diagnostic::new("E0216", problem.span, format!("{word} without a FOR before it"))
            }
            _ => problem,
        });
        if self.place == Place::Program {
            self.keep_loops_paired(line, statement, closes);
            self.foreign.extend(foreign::opened(statement));
        }
    }

    /// A FOR or a NEXT with an error still begins or ends its loop, so that the other one is not reported. `closes`: the line ends
    /// an open loop in the words of another language.
    fn keep_loops_paired(&mut self, line: Line, text: &str, closes: bool) {
        let (first, rest) = leading_word(text);
        let span = line.span;
        let (effect, statement) = if first == "FOR" || suggest::is_nearly(first, "FOR") && rest.contains('=')
        {
            let name = Name::new(leading_word(rest.trim_start()).0, span);
            let counting = Counting {
                variable: Variable::new(name, Vec::new()),
                from: Expression::integer(0, span),
                to: Expression::integer(0, span),
                step: None,
            };
            (Unparsed::BeginsLoop, Statement::For(counting))
        } else if closes || suggest::is_nearly(first, "NEXT") {
            (Unparsed::EndsLoop, Statement::Next(None))
        } else {
            return;
        };
        self.unparsed = Some(effect);
        self.push(line.number, span, statement);
    }

    /// Whether the present program has a FOR without its NEXT so far.
    fn has_open_loop(&self) -> bool {
        let statements = self.file.blocks.last().map(|block| &block.statements);
        let open = statements.into_iter().flatten().fold(0_usize, |open, located| {
            if let Statement::For(_) = located.statement {
                return open + 1;
            }
            open - usize::from(open > 0 && matches!(located.statement, Statement::Next(_)))
        });
        open > 0
    }

    /// Adds a statement to the present program.
    fn push(&mut self, line: u32, span: Span, statement: Statement) {
        if let Some(block) = self.file.blocks.last_mut() {
            block.statements.push(Located {
                line,
                span,
                statement,
            });
        }
    }

    /// A line outside all blocks: a misspelt heading opens its block all the same.
    fn outside(&mut self, cursor: &mut Cursor<'_>, alone: bool) -> Result<(), Diagnostic> {
        self.unparsed = Some(Unparsed::Outside);
        let message = match self.after_data() {
            true => "nothing follows the DATA block",
            false => "expected GLOBAL, PROGRAM or DATA",
        };
        let (word, place) = (cursor.peek_word(), cursor.span());
        let problem = Diagnostic::new("E0301", place, format!("{message}, found this line"));
        let problem = problem.help(match word {
            "GLOBAL" | "DATA" => {
                format!("write {word} alone on its line, and what it declares on the lines up to END")
            }
            _ => "put every statement between PROGRAM and END".to_string(),
        });
        let mut headings = ["GLOBAL", "DATA", "PROGRAM"].into_iter();
        let meant = headings.find(|known| (alone || *known == "PROGRAM") && suggest::is_nearly(word, known));
        if let Some(heading) = meant {
            self.astray = false;
            self.sink.push(problem);
            return match heading {
                "PROGRAM" => self.program(cursor),
                _ => self.open(heading, place),
            };
        }
        if core::mem::replace(&mut self.astray, true) {
            return Ok(());
        }
        Err(problem)
    }

    fn line(&mut self, line: Line, tokens: &[Lexeme]) -> Result<(), Diagnostic> {
        let mut cursor = Cursor::new(self.source, self.options.arm, tokens);
        let word = cursor.peek_word();
        let alone = tokens.len() == 1;
        match (word, self.place) {
            ("END", Place::Outside) if core::mem::take(&mut self.astray) => {
                self.unparsed = Some(Unparsed::Outside);
                Ok(())
            }
            ("END", Place::Outside) => Diagnostic::fail("E0303", cursor.span(), "END without an open block"),
            ("END", _) if alone => {
                self.close(line.number);
                Ok(())
            }
            // The word after END names the block that it closes in other languages.
            ("END", _) if cursor.foreign_word() == "END" && !cursor.is_assignment() => {
                let end = cursor.span().end;
                cursor.advance();
                let problem = cursor
                    .expected("the end of the line")
                    .help("close a block with END alone");
                let last = tokens.last().map_or(end, |last| last.span.end);
                let end = Span::new(end, last);
                self.unparsed = Some(Unparsed::Closes);
                self.sink.push(problem.fix(Edit::replace(end, "")));
                self.close(line.number);
                Ok(())
            }
            (_, Place::Program | Place::Global | Place::Data) if alone && self.is_end(line, word) => {
                let message = format!("{word} is neither a statement nor a program of this file");
                let problem = Diagnostic::new("E0203", cursor.span(), message).help("did you mean END?");
                self.unparsed = Some(Unparsed::Closes);
                self.sink.push(problem.fix(Edit::replace(cursor.span(), "END")));
                self.close(line.number);
                Ok(())
            }
            ("GLOBAL" | "DATA", _) if alone => {
                self.unclosed(cursor.span(), word, line.number);
                self.open(word, cursor.span())
            }
            ("PROGRAM", _) => {
                self.unclosed(cursor.span(), word, line.number);
                self.program(&mut cursor)
            }
            (_, Place::Outside) => self.outside(&mut cursor, alone),
            (_, Place::Global) => cursor.global_line(&mut self.file.globals),
            (_, Place::Data) => self.data(&mut cursor),
            (_, Place::Program) => self.statement(line.number, &mut cursor),
        }
    }

    /// Whether a line with one word is a misspelt END: what follows it begins another block, or nothing does.
    fn is_end(&self, line: Line, word: &str) -> bool {
        if word == "END" || !suggest::is_nearly(word, "END") || builtin::is_reserved(word, self.options.arm) {
            return false;
        }
        let rest = self.source.get(line.span.end..).unwrap_or_default();
        let mut lines = rest.split(['\r', '\n']).map(str::trim_start);
        let next = lines.find(|line| !line.is_empty() && !line.starts_with(['\'', '\u{1A}']));
        let next = leading_word(next.unwrap_or_default()).0.to_ascii_uppercase();
        matches!(next.as_str(), "" | "PROGRAM" | "DATA") && !self.is_program(word)
    }

    /// Whether the file has a program of this name.
    fn is_program(&self, name: &str) -> bool {
        self.source.split(['\r', '\n']).any(|line| {
            let (word, rest) = leading_word(line.trim_start());
            let program = leading_word(rest.trim_start()).0;
            word.eq_ignore_ascii_case("PROGRAM") && program.eq_ignore_ascii_case(name)
        })
    }

    fn after_data(&self) -> bool {
        self.file.data_heading.is_some()
    }

    fn open(&mut self, word: &str, span: Span) -> Result<(), Diagnostic> {
        self.opened = Some(span);
        if word == "GLOBAL" {
            self.place = Place::Global;
            if !self.file.globals.is_empty() || !self.file.blocks.is_empty() || self.after_data() {
                return Diagnostic::fail("E0301", span, "GLOBAL must come first, and once only");
            }
        } else {
            self.place = Place::Data;
            if self.after_data() {
                return Diagnostic::fail("E0301", span, "a file has one DATA block");
            }
            self.file.data_heading = Some(span);
        }
        Ok(())
    }

    /// Reports a block that lacks its END and closes it.
    fn unclosed(&mut self, span: Span, word: &str, line: u32) {
        self.astray = false;
        if self.place != Place::Outside {
            let message = format!("expected END before {word}");
            self.sink.push(Diagnostic::new("E0302", span, message));
            self.close(line);
        }
    }

    fn close(&mut self, line: u32) {
        if self.place == Place::Program
            && let Some(block) = self.file.blocks.last_mut()
        {
            block.end_line = line;
        }
        self.lonely_work();
        self.work = None;
        self.foreign.clear();
        self.place = Place::Outside;
        self.opened = None;
    }

    /// Reports a WORK line without its position, unless it holds for more than one.
    fn lonely_work(&mut self) {
        if self.options.sticky_work {
            return;
        }
        if let Some(name) = self.work.take() {
            let problem = Diagnostic::new("W0404", name.span, "this WORK is not followed by a POINT");
            self.sink.push(problem.help("WORK holds for the next line only"));
        }
    }

    fn program(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Diagnostic> {
        let span = cursor.span();
        cursor.advance();
        self.place = Place::Program;
        self.opened = Some(span);
        let mut block = Block {
            name: Name::new("", span),
            ..Block::default()
        };
        let heading = heading(cursor, &mut block);
        self.file.blocks.push(block);
        heading?;
        if self.after_data() {
            return Diagnostic::fail("E0301", span, "put programs before the DATA block");
        }
        Ok(())
    }

    fn data(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Diagnostic> {
        // The coordinate system of the next position (DATA-09).
        if cursor.word("WORK") {
            let name = cursor.name("the name of coordinate data")?;
            cursor.end_of_line()?;
            self.lonely_work();
            self.work = Some(name);
            return Ok(());
        }
        let mut datum = cursor.datum()?;
        if datum.kind == ValueKind::Position {
            datum.work = match self.options.sticky_work {
                true => self.work.clone(),
                false => self.work.take(),
            };
        } else {
            self.lonely_work();
        }
        self.file.data.push(datum);
        Ok(())
    }

    fn statement(&mut self, line: u32, cursor: &mut Cursor<'_>) -> Result<(), Diagnostic> {
        let Some(block) = self.file.blocks.last_mut() else {
            return Ok(());
        };
        if cursor.peek_at(1) == Some(&Token::Sign(Sign::Colon)) {
            let name = cursor.name("a label")?;
            cursor.advance();
            block.labels.push(Label {
                name,
                statement: block.statements.len(),
            });
        }
        if cursor.peek().is_none() {
            return Ok(());
        }
        let start = cursor.span();
        let word = cursor.foreign_word();
        // The line that opened the block has been reported.
        if let Some(part) = foreign::part_of(&self.foreign, &word).filter(|_| !cursor.is_assignment()) {
            if let Part::Closes(at) = part {
                self.foreign.truncate(at);
            }
            self.unparsed = Some(Unparsed::Inside);
            return Ok(());
        }
        let closes_loop = word == "ENDFOR" && !cursor.is_assignment();
        let call = cursor.is_foreign_call() || closes_loop;
        if word.starts_with("END ") || call && !self.is_program(&word) {
            cursor.advance();
            let whole = if word.contains(' ') {
                start.to(cursor.span())
            } else {
                start
            };
            return Diagnostic::fail("E0103", whole, format!("{word} is not a statement"));
        }
        let Some(block) = self.file.blocks.last_mut() else {
            return Ok(());
        };
        if block.statements.is_empty() && cursor.word("DIM") {
            return cursor.dim(&mut block.dims);
        }
        if cursor.word("END") {
            // END after a label closes the block as well.
            cursor.end_of_line()?;
            self.close(line);
            return Ok(());
        }
        let statement = cursor.statement_line()?;
        let span = start.to(cursor.before());
        self.push(line, span, statement);
        Ok(())
    }

    fn finish(&mut self) {
        if let Some(span) = self.opened {
            let word = span.text(self.source).trim().to_ascii_uppercase();
            let message = format!("this {word} has no END");
            self.sink.push(Diagnostic::new("E0302", span, message));
        } else if self.file.blocks.is_empty() {
            let message = "expected a PROGRAM, found none in the file";
            self.sink.push(Diagnostic::new("E0304", Span::default(), message));
        }
    }
}

/// The problem of a file that begins with a mark of its encoding.
fn byte_order_mark() -> Diagnostic {
    let span = Span::new(0, BYTE_ORDER_MARK.len_utf8());
    let problem = Diagnostic::new(
        "E0004",
        span,
        "expected an ASCII character, found a byte order mark",
    );
    let problem = problem.help("save the file without it: as ASCII, or as UTF-8 without a byte order mark");
    problem.fix(Edit::replace(span, ""))
}

/// A line after its label, in upper case as given.
fn after_label(text: &str) -> &str {
    let text = text.trim_start();
    let (_, rest) = leading_word(text);
    let statement = rest.trim_start().strip_prefix(':');
    statement
        .filter(|rest| !rest.starts_with('='))
        .map_or(text, str::trim_start)
}

/// The words of other languages for NEXT, where they begin a statement.
fn ends_loop(statement: &str) -> Option<&'static str> {
    let (first, rest) = leading_word(statement);
    match (first, leading_word(rest.trim_start()).0) {
        ("ENDFOR", _) => Some("ENDFOR"),
        ("END", "FOR") => Some("END FOR"),
        _ => None,
    }
}

/// The problem of a line. A remark of another language is one whatever its characters.
fn remark_of(line: Line, text: &str, problem: Diagnostic) -> Diagnostic {
    let (word, rest) = leading_word(text.trim_start());
    if word != "REM" || !rest.starts_with(' ') || matches!(problem.code, "E0003" | "E0004" | "E0005") {
        return problem;
    }
    let start = line.span.start + text.len() - text.trim_start().len();
    Diagnostic::new(
        "E0103",
        Span::new(start, start + word.len()),
        "REM is not a statement",
    )
}

/// `name` or `name(p, q)`.
fn heading(cursor: &mut Cursor<'_>, block: &mut Block) -> Result<(), Diagnostic> {
    block.name = cursor.name("the name of the program")?;
    if cursor.sign(Sign::Open) && !cursor.sign(Sign::Close) {
        loop {
            let name = cursor.name("a parameter")?;
            if block.parameters.len() >= builtin::MAX_ARGUMENTS {
                let message = format!("a program has at most {} parameters", builtin::MAX_ARGUMENTS);
                return Diagnostic::fail("E0206", name.span, message);
            }
            if block.parameters.iter().any(|known| known.text == name.text) {
                return Diagnostic::fail("E0205", name.span, format!("{} appears twice", name.text));
            }
            block.parameters.push(name);
            if cursor.sign(Sign::Close) {
                break;
            }
            cursor.expect_sign(Sign::Comma)?;
        }
    }
    cursor.end_of_line()
}

/// Parses one statement for direct execution; labels and lines of the file layout are errors.
pub(crate) fn parse_direct(source: &str, options: &LanguageOptions) -> Result<Option<Statement>, Diagnostic> {
    let tokens = lexer::tokens(source, Span::new(0, source.len()), MAX_DIRECT)?;
    let mut cursor = Cursor::new(source, options.arm, &tokens);
    if tokens.is_empty() {
        return Ok(None);
    }
    if cursor.peek_at(1) == Some(&Token::Sign(Sign::Colon)) {
        return Diagnostic::fail("E0501", cursor.span(), "a label cannot be executed directly");
    }
    cursor.statement_line().map(Some)
}
