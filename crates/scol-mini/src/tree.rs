//! The syntax tree: expressions and statements as the parser makes them.
//!
//! The parser fills in names, the compiler what they refer to. The machine evaluates the same expressions, so there is no
//! second tree.

use crate::prelude::*;

use crate::builtin::{Builtin, Condition, System};
use crate::diagnostic::Span;
use crate::request::{Channel, Request};
use crate::value::{Number, ValueKind};

/// A name as written, in upper case, and where.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Name {
    pub text: String,
    pub span: Span,
}

impl Name {
    pub fn new(text: &str, span: Span) -> Name {
        Name {
            text: text.into(),
            span,
        }
    }
}

/// Target of a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reference {
    /// Not resolved yet; a compiled program has none of these.
    Unresolved,
    /// A variable of the memory: its slot, and its first cell.
    Slot { slot: usize, cell: usize },
    /// A parameter of the subprogram.
    Parameter(usize),
}

/// A variable, or an element of an array.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Variable {
    pub name: Name,
    pub reference: Reference,
    /// Empty for a plain variable.
    pub subscripts: Vec<Expression>,
}

impl Variable {
    /// A variable as the parser finds it.
    pub fn new(name: Name, subscripts: Vec<Expression>) -> Variable {
        Variable {
            name,
            reference: Reference::Unresolved,
            subscripts,
        }
    }
}

/// Operators with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binary {
    Or,
    And,
    Relation(Relation),
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
}

impl Binary {
    /// Whether operands may be positions and coordinates.
    pub fn takes_vectors(self) -> bool {
        matches!(self, Binary::Add | Binary::Subtract | Binary::Multiply)
    }
}

/// Operators that compare two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Relation {
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

/// Operators with one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unary {
    Minus,
    Plus,
    Not,
    /// Parentheses around a variable that is an argument of a call: it is passed by value.
    Value,
}

/// An expression and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expression {
    pub node: Node,
    pub span: Span,
    /// Its instructions, filled in by the compiler where a statement computes it as an operand.
    pub formula: Formula,
}

/// The instructions of an operand: where they begin, and the register that has the value after them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Formula {
    /// `None` when the register has the value without any.
    pub start: Option<u32>,
    pub result: u32,
}

impl Expression {
    pub fn new(node: Node, span: Span) -> Expression {
        let formula = Formula::default();
        Expression { node, span, formula }
    }

    /// An integer instead of a written expression.
    pub fn integer(value: i32, span: Span) -> Expression {
        Expression::new(Node::Literal(Number::Integer(value)), span)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Node {
    Literal(Number),
    Variable(Variable),
    /// `P.X`: the letter of one coordinate.
    Component(Box<Expression>, u8),
    Unary(Unary, Box<Expression>),
    Binary(Binary, Box<Expression>, Box<Expression>),
    Function(Builtin, Vec<Expression>),
    System(System),
}

impl Condition {
    /// Returns the operand that sets it.
    pub fn takes(self) -> Takes {
        match self {
            Condition::Speed
            | Condition::Accel
            | Condition::Decel
            | Condition::Config
            | Condition::Pass
            | Condition::Accur => Takes::Number,
            Condition::Payload => Takes::Exactly(ValueKind::Load),
            Condition::Work | Condition::Tool | Condition::Base => Takes::Exactly(ValueKind::Coordinate),
        }
    }
}

/// A condition with one value for each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PerAxis {
    Gain,
    Torque,
}

/// Operand that a statement takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Takes {
    Number,
    Exactly(ValueKind),
    /// A value of any kind: the argument of a call.
    Any,
    /// The same as the variable that is assigned.
    Assigned,
}

const POSITION: Takes = Takes::Exactly(ValueKind::Position);

/// The shape of a motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MotionKind {
    Ptp(Expression),
    Line(Expression),
    /// A point on the way and the end.
    Arc([Expression; 2]),
    /// The end and the gate.
    Arch([Expression; 2]),
    /// Axis and value.
    Axis([Expression; 2]),
    /// Axis and difference.
    AxisBy([Expression; 2]),
    Ready,
}

/// An item of a `PRINT`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Item {
    Text(String),
    Value(Expression),
}

/// A statement that does one thing and continues with the next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Simple {
    Assign(Assignment),
    Change(Change),
    Ask(Ask),
    /// `ENABLE` or `DISABLE` alone: whether the monitors of the task are looked at.
    Monitors(bool),
    Ignore,
}

/// A variable, or one of its coordinates, and the new value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assignment {
    pub target: Variable,
    pub component: Option<u8>,
    pub value: Expression,
}

/// A statement that changes the motion conditions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Change {
    Set(Condition, Expression),
    FreeLoad,
    /// `GAIN = {...}`: axis 1 first.
    PerAxis(PerAxis, Vec<Expression>),
    /// `SETGAIN(axis, value)`.
    SetGain([Expression; 2]),
    Pass(bool),
    Nowait(bool),
}

/// A statement that asks for something outside.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ask {
    Move {
        motion: MotionKind,
        with: Vec<(Condition, Expression)>,
    },
    Print {
        channel: Channel,
        items: Vec<Item>,
        cr: bool,
    },
    Input(Channel, Vec<Variable>),
    Delay(Expression),
    Outputs(Vec<Expression>),
    /// Output and seconds.
    Pulse([Expression; 2]),
    /// First output, digits, value.
    Bcd([Expression; 3]),
    Timer(Expression),
    Task {
        target: Option<Variable>,
        name: Name,
        /// Number of the PROGRAM block, filled in by the compiler.
        block: usize,
    },
    Kill(Expression),
    /// `RESTORE A, B`; without names all data of the file.
    Restore(Vec<Name>),
    /// A request without operands to be evaluated.
    Fixed(Request),
}

/// A statement as parsed; the compiler turns control flow into steps and jumps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Statement {
    Simple(Simple),
    Wait(Expression),
    If {
        condition: Expression,
        then: Box<Statement>,
        otherwise: Option<Box<Statement>>,
    },
    For(Counting),
    Next(Option<Name>),
    Goto(Name),
    Select(Expression, Vec<Name>),
    Call(Name, Vec<Expression>),
    Return,
    On {
        condition: Expression,
        action: Box<Statement>,
    },
}

/// Variable and range of a FOR.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Counting {
    pub variable: Variable,
    pub from: Expression,
    pub to: Expression,
    pub step: Option<Expression>,
}

impl Statement {
    /// Calls `visit` with the statement and those within its IF or ON, outermost first.
    pub fn each(&mut self, visit: &mut dyn FnMut(&mut Statement)) {
        visit(self);
        if let Statement::If { then, otherwise, .. } = self {
            then.each(visit);
            otherwise.iter_mut().for_each(|otherwise| otherwise.each(visit));
        } else if let Statement::On { action, .. } = self {
            action.each(visit);
        }
    }

    /// Calls `visit` with every expression of the statement, outermost only, and what it has to be.
    pub fn expressions(&mut self, visit: &mut dyn FnMut(&mut Expression, Takes)) {
        self.each(&mut |statement| match statement {
            Statement::Simple(simple) => simple.expressions(visit),
            Statement::Wait(e)
            | Statement::Select(e, _)
            | Statement::If { condition: e, .. }
            | Statement::On { condition: e, .. } => visit(e, Takes::Number),
            Statement::For(counting) => {
                numbers([&mut counting.from, &mut counting.to], visit);
                numbers(&mut counting.step, visit);
            }
            Statement::Call(_, arguments) => arguments.iter_mut().for_each(|e| visit(e, Takes::Any)),
            Statement::Next(_) | Statement::Goto(_) | Statement::Return => {}
        });
    }

    /// Calls `visit` with every variable the statement gives a value to.
    pub fn targets(&mut self, visit: &mut dyn FnMut(&mut Variable)) {
        self.each(&mut |statement| {
            if let Statement::For(counting) = statement {
                visit(&mut counting.variable);
            } else if let Statement::Simple(simple) = statement {
                simple.targets().iter_mut().for_each(&mut *visit);
            }
        });
    }
}

impl Simple {
    /// The variables the statement gives a value to.
    pub fn targets(&mut self) -> &mut [Variable] {
        match self {
            Simple::Assign(assignment) => core::slice::from_mut(&mut assignment.target),
            Simple::Ask(Ask::Task { target, .. }) => target.as_mut_slice(),
            Simple::Ask(Ask::Input(_, targets)) => targets,
            Simple::Ask(_) | Simple::Change(_) | Simple::Monitors(_) | Simple::Ignore => &mut [],
        }
    }

    /// Calls `visit` with every expression of the statement, outermost only, and what it has to be.
    pub fn expressions(&mut self, visit: &mut dyn FnMut(&mut Expression, Takes)) {
        match self {
            Simple::Assign(assignment) => visit(&mut assignment.value, Takes::Assigned),
            Simple::Change(Change::Set(condition, value)) => visit(value, condition.takes()),
            Simple::Change(Change::PerAxis(_, list)) => numbers(list, visit),
            Simple::Change(Change::SetGain(list)) => numbers(list, visit),
            Simple::Ask(ask) => ask.expressions(visit),
            Simple::Change(Change::FreeLoad | Change::Pass(_) | Change::Nowait(_))
            | Simple::Monitors(_)
            | Simple::Ignore => {}
        }
    }
}

impl Ask {
    fn expressions(&mut self, visit: &mut dyn FnMut(&mut Expression, Takes)) {
        match self {
            Ask::Delay(value) | Ask::Timer(value) | Ask::Kill(value) => visit(value, Takes::Number),
            Ask::Pulse(list) => numbers(list, visit),
            Ask::Bcd(list) => numbers(list, visit),
            Ask::Outputs(list) => numbers(list, visit),
            Ask::Move { motion, with } => {
                match motion {
                    MotionKind::Ptp(a) | MotionKind::Line(a) => visit(a, POSITION),
                    MotionKind::Arc(ends) | MotionKind::Arch(ends) => {
                        ends.iter_mut().for_each(|e| visit(e, POSITION));
                    }
                    MotionKind::Axis(list) | MotionKind::AxisBy(list) => numbers(list, visit),
                    MotionKind::Ready => {}
                }
                with.iter_mut()
                    .for_each(|(condition, value)| visit(value, condition.takes()));
            }
            Ask::Print { items, .. } => items.iter_mut().for_each(|item| match item {
                Item::Text(_) => {}
                Item::Value(value) => visit(value, Takes::Number),
            }),
            Ask::Input(..) | Ask::Task { .. } | Ask::Restore(_) | Ask::Fixed(_) => {}
        }
    }
}

fn numbers<'a>(
    list: impl IntoIterator<Item = &'a mut Expression>,
    visit: &mut dyn FnMut(&mut Expression, Takes),
) {
    list.into_iter().for_each(|e| visit(e, Takes::Number));
}

impl Expression {
    /// Calls `visit` with every variable in the expression; those within subscripts come after their array.
    pub fn variables(&mut self, visit: &mut dyn FnMut(&mut Variable)) {
        match &mut self.node {
            Node::Literal(_) | Node::System(_) => {}
            Node::Variable(variable) => {
                visit(variable);
                variable.subscripts.iter_mut().for_each(|e| e.variables(visit));
            }
            Node::Component(of, _) | Node::Unary(_, of) => of.variables(visit),
            Node::Binary(_, left, right) => {
                left.variables(visit);
                right.variables(visit);
            }
            Node::Function(_, arguments) => arguments.iter_mut().for_each(|e| e.variables(visit)),
        }
    }

    /// Calls `visit` with the variables that are added up to the value: those of `P1 + P2`, and `P1` of `P1 * T`.
    pub fn terms(&self, visit: &mut dyn FnMut(&Variable)) {
        match &self.node {
            Node::Variable(variable) => visit(variable),
            Node::Binary(Binary::Add | Binary::Subtract, left, right) => {
                left.terms(visit);
                right.terms(visit);
            }
            Node::Binary(Binary::Multiply, left, _) => left.terms(visit),
            Node::Binary(..)
            | Node::Literal(_)
            | Node::Component(..)
            | Node::Unary(..)
            | Node::Function(..)
            | Node::System(_) => {}
        }
    }

    /// Calls `visit` with the variables that must be positions, whatever the statement: `P` of `P.X` and of
    /// `P + POINT(...)`.
    pub fn positions(&self, visit: &mut dyn FnMut(&Variable)) {
        let is_point = |e: &Expression| matches!(e.node, Node::Function(Builtin::Point, _));
        match &self.node {
            Node::Component(of, _) => of.terms(visit),
            Node::Unary(_, of) => of.positions(visit),
            Node::Binary(_, left, right) => {
                if is_point(left) || is_point(right) {
                    self.terms(visit);
                }
                left.positions(visit);
                right.positions(visit);
            }
            Node::Function(_, arguments) => arguments.iter().for_each(|argument| argument.positions(visit)),
            Node::Literal(_) | Node::System(_) | Node::Variable(_) => {}
        }
    }

    /// `true` when the value does not depend on variables or the world.
    pub fn is_constant(&self) -> bool {
        match &self.node {
            Node::Literal(_) => true,
            Node::Variable(_) | Node::System(_) => false,
            Node::Component(of, _) | Node::Unary(_, of) => of.is_constant(),
            Node::Binary(_, left, right) => left.is_constant() && right.is_constant(),
            Node::Function(
                Builtin::Din | Builtin::Dout | Builtin::Bcdin | Builtin::Gain | Builtin::Torque,
                _,
            ) => false,
            Node::Function(_, arguments) => arguments.iter().all(Expression::is_constant),
        }
    }
}
