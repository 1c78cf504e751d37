//! The numbers of the language once more, as simply as they can be computed: a walk over the syntax tree, with variables by
//! their names, integers of 64 bits and no regard for speed. What a machine does is compared with it, statement by statement.

use super::*;
use crate::builtin::{Builtin, Numeric};
use crate::diagnostic::Sink;
use crate::parser::{Block, parse_file};
use crate::tree::{Binary, Counting, Node, Relation, Statement, Unary, Variable};
use alloc::collections::BTreeMap;
use std::vec::Vec;

/// Result of a statement.
#[derive(Debug, PartialEq)]
pub enum Step {
    Done,
    Ended,
    Fault(FaultKind),
}

/// A variable, whose name no other program of the file has.
#[derive(Default)]
struct Cells {
    is_real: Option<bool>,
    bounds: Vec<usize>,
    values: BTreeMap<usize, Number>,
}

#[derive(Clone)]
enum Place {
    Variable(String, usize),
    /// An argument by value, among those of all calls.
    Argument(usize),
}

enum Passed {
    Place(Place),
    Number(Number),
}

struct Call {
    block: usize,
    /// The statement that is next; that after the last one is END.
    at: usize,
    first_argument: usize,
    /// Statement of the FOR, limit and step.
    loops: Vec<(usize, Number, Number)>,
}

pub struct Reference {
    options: LanguageOptions,
    blocks: Vec<Block>,
    calls: Vec<Call>,
    arguments: Vec<Passed>,
    variables: BTreeMap<String, Cells>,
}

type Outcome<T> = core::result::Result<T, FaultKind>;

fn double(number: Number) -> f64 {
    match number {
        Number::Integer(value) => f64::from(value),
        Number::Real(value) => f64::from(value),
    }
}

fn integer(value: i64) -> Outcome<Number> {
    let value = i32::try_from(value).map_err(|_| FaultKind::Overflow)?;
    Ok(Number::Integer(value))
}

fn real(value: f32) -> Outcome<Number> {
    if value.is_finite() {
        return Ok(Number::Real(value));
    }
    Err(FaultKind::Overflow)
}

fn truncated(number: Number) -> Outcome<i64> {
    match number {
        Number::Integer(value) => Ok(value.into()),
        Number::Real(value) if value.abs() < 2_147_483_648.0 => Ok(value.trunc() as i64),
        Number::Real(-2_147_483_648.0) => Ok(i32::MIN.into()),
        Number::Real(_) => Err(FaultKind::Overflow),
    }
}

fn truth(holds: bool) -> Outcome<Number> {
    Ok(Number::Integer(holds.into()))
}

impl Reference {
    pub fn new(source: &str, options: LanguageOptions) -> Self {
        let blocks = parse_file(source, &options, &mut Sink::new(source)).blocks;
        let mut variables: BTreeMap<String, Cells> = BTreeMap::new();
        for dim in blocks.iter().flat_map(|block| &block.dims) {
            let bounds: Vec<usize> = dim.subscripts.iter().map(|bound| *bound as usize).collect();
            let is_real = dim.kind.map(|kind| kind == crate::ValueKind::Real);
            let zero = match is_real {
                Some(true) => Number::Real(0.0),
                _ => Number::Integer(0),
            };
            let length = bounds.iter().map(|bound| bound + 1).product();
            let values = (0..length).filter(|_| is_real.is_some()).map(|at| (at, zero));
            variables.insert(
                dim.name.text.clone(),
                Cells {
                    is_real,
                    bounds,
                    values: values.collect(),
                },
            );
        }
        let main = Call {
            block: 0,
            at: 0,
            first_argument: 0,
            loops: Vec::new(),
        };
        Reference {
            options,
            blocks,
            calls: vec![main],
            arguments: Vec::new(),
            variables,
        }
    }

    fn call(&mut self) -> &mut Call {
        self.calls.last_mut().unwrap()
    }

    pub fn line(&self) -> u32 {
        let call = self.calls.last().unwrap();
        let block = &self.blocks[call.block];
        block
            .statements
            .get(call.at)
            .map_or(block.end_line, |located| located.line)
    }

    /// Value of a variable at this index.
    pub fn value(&self, name: &str, index: usize) -> Option<Number> {
        self.variables.get(name)?.values.get(&index).copied()
    }

    /// Does one statement; after a fault the next one follows.
    pub fn step(&mut self) -> Step {
        let call = self.calls.last().unwrap();
        let (block, at, depth) = (call.block, call.at, self.calls.len());
        let blocks = core::mem::take(&mut self.blocks);
        let statement = blocks[block].statements.get(at).map(|located| &located.statement);
        self.call().at = at + 1;
        let done = self.statement(&blocks, at, statement.unwrap_or(&Statement::Return));
        self.blocks = blocks;
        match done {
            Ok(true) => Step::Done,
            Ok(false) => Step::Ended,
            Err(kind) => {
                assert_eq!(self.calls.len(), depth, "a fault leaves nothing behind");
                Step::Fault(kind)
            }
        }
    }

    /// `false` when the main program ends.
    fn statement(&mut self, blocks: &[Block], at: usize, statement: &Statement) -> Outcome<bool> {
        let block = &blocks[self.call().block];
        let label = |name: &crate::tree::Name| {
            let mut labels = block.labels.iter();
            let found = labels.find(|label| label.name.text == name.text);
            found.unwrap().statement
        };
        match statement {
            Statement::Simple(Simple::Assign(assignment)) => {
                let value = self.number(block, &assignment.value)?;
                let place = self.place(block, &assignment.target)?;
                self.write(&place, value)?;
            }
            Statement::If {
                condition,
                then,
                otherwise,
            } => {
                if double(self.number(block, condition)?) != 0.0 {
                    return self.statement(blocks, at, then);
                }
                if let Some(otherwise) = otherwise {
                    return self.statement(blocks, at, otherwise);
                }
            }
            Statement::Goto(name) => self.call().at = label(name),
            Statement::Select(selector, labels) => {
                let number = truncated(self.number(block, selector)?)?;
                let chosen = usize::try_from(number - 1).ok().and_then(|at| labels.get(at));
                if let Some(name) = chosen {
                    self.call().at = label(name);
                }
            }
            Statement::For(counting) => self.begin_loop(block, at, counting)?,
            Statement::Next(_) => self.end_loop(block, at)?,
            Statement::Call(name, passed) => self.enter(blocks, &name.text, passed)?,
            Statement::Return => {
                if self.calls.len() == 1 {
                    self.call().at = at;
                    return Ok(false);
                }
                let left = self.calls.pop().unwrap();
                self.arguments.truncate(left.first_argument);
            }
            other => panic!("{other:?} is not for this reference"),
        }
        Ok(true)
    }

    fn begin_loop(&mut self, block: &Block, at: usize, counting: &Counting) -> Outcome<()> {
        let limit = self.number(block, &counting.to)?;
        let step = counting.step.as_ref();
        let step = step.map_or(Ok(Number::Integer(1)), |step| self.number(block, step))?;
        let from = self.number(block, &counting.from)?;
        if double(step) == 0.0 {
            return Err(FaultKind::Range);
        }
        let place = self.place(block, &counting.variable)?;
        self.write(&place, from)?;
        let now = self.read(&place)?;
        let end = next_of(block, at);
        self.call()
            .loops
            .retain(|(opener, ..)| *opener < at && at <= next_of(block, *opener));
        if is_past(now, limit, step) {
            self.call().at = end + 1;
        } else {
            self.call().loops.push((at, limit, step));
        }
        Ok(())
    }

    fn end_loop(&mut self, block: &Block, at: usize) -> Outcome<()> {
        let mut openers = (0..at).rev().filter(|opener| next_of(block, *opener) == at);
        let opener = openers.next().unwrap();
        let loops = &mut self.call().loops;
        let open = loops.iter().position(|(open, ..)| *open == opener);
        let open = open.ok_or(FaultKind::NextWithoutFor)?;
        loops.truncate(open + 1);
        let (_, limit, step) = loops[open];
        let Statement::For(counting) = &block.statements[opener].statement else {
            panic!("no FOR");
        };
        let place = self.place(block, &counting.variable)?;
        let sum = self.binary(Binary::Add, self.read(&place)?, step)?;
        self.write(&place, sum)?;
        match is_past(self.read(&place)?, limit, step) {
            true => drop(self.call().loops.pop()),
            false => self.call().at = opener + 1,
        }
        Ok(())
    }

    fn enter(&mut self, blocks: &[Block], name: &str, passed: &[Expression]) -> Outcome<()> {
        let block = &blocks[self.call().block];
        let first = self.arguments.len();
        let mut arguments = Vec::new();
        for expression in passed {
            arguments.push(match &expression.node {
                Node::Variable(variable) => Passed::Place(self.place(block, variable)?),
                _ => Passed::Number(self.number(block, expression)?),
            });
        }
        if self.calls.len() > crate::MAX_CALL_NESTING {
            return Err(FaultKind::Nesting);
        }
        self.arguments.extend(arguments);
        let called = blocks.iter().position(|block| block.name.text == name);
        self.calls.push(Call {
            block: called.unwrap(),
            at: 0,
            first_argument: first,
            loops: Vec::new(),
        });
        Ok(())
    }

    fn place(&mut self, block: &Block, variable: &Variable) -> Outcome<Place> {
        let name = &variable.name.text;
        if let Some(at) = block
            .parameters
            .iter()
            .position(|parameter| parameter.text == *name)
        {
            let at = self.call().first_argument + at;
            return Ok(match &self.arguments[at] {
                Passed::Place(place) => place.clone(),
                Passed::Number(_) => Place::Argument(at),
            });
        }
        let mut index = 0;
        let bounds = self
            .variables
            .get(name)
            .map(|cells| cells.bounds.clone())
            .unwrap_or_default();
        let mut is_outside = false;
        for (bound, subscript) in bounds.iter().zip(&variable.subscripts) {
            let subscript = usize::try_from(truncated(self.number(block, subscript)?)?);
            let subscript = subscript.unwrap_or(usize::MAX);
            is_outside |= subscript > *bound;
            index = index * (bound + 1) + subscript.min(*bound);
        }
        match is_outside {
            true => Err(FaultKind::Subscript),
            false => Ok(Place::Variable(name.clone(), index)),
        }
    }

    fn read(&self, place: &Place) -> Outcome<Number> {
        match place {
            Place::Variable(name, index) => self.value(name, *index).ok_or(FaultKind::Undefined),
            Place::Argument(at) => match &self.arguments[*at] {
                Passed::Number(number) => Ok(*number),
                Passed::Place(_) => panic!("an argument by value"),
            },
        }
    }

    /// The first value of a variable or an array makes it an integer or a real.
    fn write(&mut self, place: &Place, number: Number) -> Outcome<()> {
        let converted = |is_real: bool| match is_real {
            true => Ok(Number::Real(double(number) as f32)),
            false => truncated(number).and_then(integer),
        };
        match place {
            Place::Variable(name, index) => {
                let cells = self.variables.entry(name.clone()).or_default();
                let is_real = cells.is_real.unwrap_or(matches!(number, Number::Real(_)));
                cells.values.insert(*index, converted(is_real)?);
                cells.is_real = Some(is_real);
            }
            Place::Argument(at) => {
                let is_real = matches!(self.arguments[*at], Passed::Number(Number::Real(_)));
                self.arguments[*at] = Passed::Number(converted(is_real)?);
            }
        }
        Ok(())
    }

    fn number(&mut self, block: &Block, expression: &Expression) -> Outcome<Number> {
        match &expression.node {
            Node::Literal(number) => Ok(*number),
            Node::Variable(variable) => {
                let place = self.place(block, variable)?;
                self.read(&place)
            }
            Node::Unary(operator, of) => {
                let of = self.number(block, of)?;
                match (operator, of) {
                    (Unary::Not, of) => truth(double(of) == 0.0),
                    (Unary::Minus, Number::Integer(value)) => integer(-i64::from(value)),
                    (Unary::Minus, Number::Real(value)) => real(-value),
                    (Unary::Plus | Unary::Value, of) => Ok(of),
                }
            }
            Node::Binary(operator, left, right) => {
                let (left, right) = (self.number(block, left)?, self.number(block, right)?);
                self.binary(*operator, left, right)
            }
            Node::Function(Builtin::Numeric(function), arguments) => {
                let first = self.number(block, &arguments[0])?;
                match (function, first) {
                    (Numeric::Mod, _) => {
                        let second = self.number(block, &arguments[1])?;
                        self.binary(Binary::Modulo, first, second)
                    }
                    (Numeric::Int, first) => truncated(first).and_then(integer),
                    (Numeric::Abs, Number::Integer(value)) => integer(i64::from(value).abs()),
                    (Numeric::Abs, Number::Real(value)) => real(value.abs()),
                    (Numeric::Sgn, first) => integer(match double(first) {
                        0.0 => 0,
                        value => value.signum() as i64,
                    }),
                    (Numeric::Sqrt, first) if double(first) < 0.0 => Err(FaultKind::Domain),
                    (Numeric::Sqrt, first) => real(double(first).sqrt() as f32),
                    (other, _) => panic!("{other:?} is not for this reference"),
                }
            }
            other => panic!("{other:?} is not for this reference"),
        }
    }

    fn binary(&self, operator: Binary, left: Number, right: Number) -> Outcome<Number> {
        let (a, b) = (double(left), double(right));
        match operator {
            Binary::And => return truth(a != 0.0 && b != 0.0),
            Binary::Or => return truth(a != 0.0 || b != 0.0),
            Binary::Divide | Binary::Modulo if b == 0.0 => return Err(FaultKind::DivisionByZero),
            _ => {}
        }
        if let (Number::Integer(left), Number::Integer(right)) = (left, right) {
            let (left, right) = (i64::from(left), i64::from(right));
            match operator {
                Binary::Relation(relation) => return truth(holds(relation, a, b)),
                Binary::Add => return integer(left + right),
                Binary::Subtract => return integer(left - right),
                Binary::Multiply => return integer(left * right),
                Binary::Modulo => return integer(left % right),
                Binary::Divide if self.options.int_division == crate::IntDivision::Truncate => {
                    return integer(left / right);
                }
                _ => {}
            }
        }
        let (left, right) = (a as f32, b as f32);
        match operator {
            Binary::Relation(relation) => {
                // Equal within the difference, and one digit of the larger one.
                let (a, b) = (f64::from(left), f64::from(right));
                let within = f64::from(self.options.equal_within);
                let digit = a.abs().max(b.abs()) * f64::from(f32::EPSILON);
                let is_near = within > 0.0 && (a - b).abs() <= within + digit;
                truth(holds(relation, a, if is_near { a } else { b }))
            }
            Binary::Add => real(left + right),
            Binary::Subtract => real(left - right),
            Binary::Multiply => real(left * right),
            Binary::Divide => real(left / right),
            Binary::Modulo => real(left % right),
            other => panic!("{other:?} is not for this reference"),
        }
    }
}

fn holds(relation: Relation, a: f64, b: f64) -> bool {
    match relation {
        Relation::Equal => a == b,
        Relation::NotEqual => a != b,
        Relation::Less => a < b,
        Relation::LessEqual => a <= b,
        Relation::Greater => a > b,
        Relation::GreaterEqual => a >= b,
    }
}

fn is_past(now: Number, limit: Number, step: Number) -> bool {
    let beyond = double(now) - double(limit);
    beyond * double(step).signum() > 0.0
}

/// The statement of the NEXT that belongs to the FOR of this statement.
fn next_of(block: &Block, opener: usize) -> usize {
    let mut depth = 0;
    for (at, located) in block.statements.iter().enumerate().skip(opener) {
        match located.statement {
            Statement::For(_) => depth += 1,
            Statement::Next(_) if depth == 1 => return at,
            Statement::Next(_) => depth -= 1,
            _ if depth == 0 => break,
            _ => {}
        }
    }
    usize::MAX
}
