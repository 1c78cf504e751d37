//! Parses the layout of a file: GLOBAL, PROGRAM blocks, DATA, in this order, each closed by END (RAM-04).
//!
//! The lines within are parsed by `declaration`, `statement` and `data`. Start with [`parse_file`].

use crate::prelude::*;

use super::{Block, Cursor, File, Label, Located};
use crate::builtin;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::lexer::{self, Lexeme, Line, Sign, Token, leading_word, lines};
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
    };
    for line in lines(source) {
        match lexer::tokens(source, line.span, MAX_LINE) {
            Ok(tokens) if tokens.is_empty() => {}
            Ok(tokens) => {
                if let Err(problem) = parser.line(line, &tokens) {
                    parser.broken(line, problem);
                }
            }
            Err(problem) => parser.broken(line, problem),
        }
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
}

impl Parser<'_> {
    /// Reports a line that does not parse.
    fn broken(&mut self, line: Line, problem: Diagnostic) {
        let text = line.span.text(self.source).to_ascii_uppercase();
        let words = text
            .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .filter(|word| !word.is_empty());
        self.file.suppressed.extend(words.map(String::from));
        self.sink.push(problem);
        if self.place == Place::Program {
            self.keep_loops_paired(line, &text);
        }
    }

    /// A FOR or a NEXT with an error still begins or ends its loop, so that the other one is not reported.
    fn keep_loops_paired(&mut self, line: Line, text: &str) {
        let (mut first, mut rest) = leading_word(text.trim_start());
        if let Some(statement) = rest.trim_start().strip_prefix(':') {
            (first, rest) = leading_word(statement.trim_start());
        }
        let span = line.span;
        let statement = if suggest::is_nearly(first, "FOR") && rest.contains('=') {
            let name = Name::new(leading_word(rest.trim_start()).0, span);
            Statement::For(Counting {
                variable: Variable::new(name, Vec::new()),
                from: Expression::integer(0, span),
                to: Expression::integer(0, span),
                step: None,
            })
        } else if suggest::is_nearly(first, "NEXT") {
            Statement::Next(None)
        } else {
            return;
        };
        self.push(line.number, span, statement);
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
        let message = match self.after_data() {
            true => "nothing follows the DATA block",
            false => "expected GLOBAL, PROGRAM or DATA",
        };
        let (word, place) = (cursor.peek_word(), cursor.span());
        let problem = Diagnostic::new("E0301", place, format!("{message}, found this line"));
        let problem = problem.help("put every statement between PROGRAM and END");
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
            ("END", Place::Outside) if core::mem::take(&mut self.astray) => Ok(()),
            ("END", Place::Outside) => Diagnostic::fail("E0303", cursor.span(), "END without an open block"),
            ("END", _) if alone => {
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
