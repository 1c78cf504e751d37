//! The syntax tree: expressions and statements as the parser makes them.
//!
//! The parser fills in names, the compiler what they refer to. The machine evaluates the same expressions, so there is no
//! second tree.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use crate::builtin::{Builtin, System};
use crate::diagnostic::Span;
use crate::request::Channel;
use crate::value::Value;

/// A name as written, in upper case, and where.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Name {
    pub text: String,
    pub span: Span,
}

/// What a name refers to.
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

/// Operators with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binary {
    Or,
    And,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
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
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Node {
    Literal(Value),
    Variable(Variable),
    /// `P.X`: the letter of one coordinate.
    Component(Box<Expression>, u8),
    Unary(Unary, Box<Expression>),
    Binary(Binary, Box<Expression>, Box<Expression>),
    Function(Builtin, Vec<Expression>),
    System(System),
}

/// A motion condition that can be assigned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Condition {
    Speed,
    Accel,
    Decel,
    Config,
    Payload,
    Work,
    Tool,
    Base,
    Pass,
    Accur,
}

impl Binary {
    /// Whether it compares two numbers.
    pub fn is_relation(self) -> bool {
        matches!(
            self,
            Binary::Equal
                | Binary::NotEqual
                | Binary::Less
                | Binary::LessEqual
                | Binary::Greater
                | Binary::GreaterEqual
        )
    }
}

impl Condition {
    /// Whether it is a coordinate system.
    pub fn is_frame(self) -> bool {
        matches!(self, Condition::Work | Condition::Tool | Condition::Base)
    }
}

/// A condition with one value for each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PerAxis {
    Gain,
    Torque,
}

/// What `ENABLE` and `DISABLE` switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feature {
    Pass,
    Nowait,
    /// The monitors of the task; the bare words.
    Monitors,
}

/// The shape of a motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MotionKind {
    Ptp(Expression),
    Line(Expression),
    Arc(Expression, Expression),
    Arch(Expression, Expression),
    Axis(Expression, Expression),
    AxisBy(Expression, Expression),
    Ready,
}

/// An item of a `PRINT`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Item {
    Text(String),
    Value(Expression),
}

/// A statement that does one thing and goes on to the next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Simple {
    Assign {
        target: Variable,
        component: Option<u8>,
        value: Expression,
    },
    Set(Condition, Expression),
    FreeLoad,
    Move {
        motion: MotionKind,
        with: Vec<(Condition, Expression)>,
    },
    Print {
        channel: Channel,
        items: Vec<Item>,
        cr: bool,
    },
    Input {
        channel: Channel,
        targets: Vec<Variable>,
    },
    Delay(Expression),
    Outputs(Vec<Expression>),
    Stop,
    Hand {
        hand: u8,
        open: bool,
        at_once: bool,
    },
    /// Output and seconds.
    Pulse(Expression, Expression),
    /// First output, digits, value.
    Bcd([Expression; 3]),
    Break,
    Pause,
    Resume,
    Timer(Expression),
    /// `GAIN = {...}`: axis 1 first.
    PerAxis(PerAxis, Vec<Expression>),
    /// `SETGAIN(axis, value)`.
    SetGain(Expression, Expression),
    Switch(Feature, bool),
    Ignore,
    Task {
        target: Option<Variable>,
        name: Name,
        /// Number of the PROGRAM block, filled in by the compiler.
        block: usize,
    },
    Yield,
    Kill(Expression),
    /// `RESTORE A, B`; without names all data of the file.
    Restore(Vec<Name>),
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
    For {
        variable: Variable,
        from: Expression,
        to: Expression,
        step: Option<Expression>,
    },
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

impl Statement {
    /// Calls `visit` with every expression of the statement, outermost only.
    pub fn expressions(&mut self, visit: &mut dyn FnMut(&mut Expression)) {
        match self {
            Statement::Simple(simple) => simple.expressions(visit),
            Statement::Wait(e) | Statement::Select(e, _) => visit(e),
            Statement::If {
                condition,
                then,
                otherwise,
            } => {
                visit(condition);
                then.expressions(visit);
                if let Some(otherwise) = otherwise {
                    otherwise.expressions(visit);
                }
            }
            Statement::For { from, to, step, .. } => {
                visit(from);
                visit(to);
                step.iter_mut().for_each(visit);
            }
            Statement::Call(_, arguments) => arguments.iter_mut().for_each(visit),
            Statement::On { condition, action } => {
                visit(condition);
                action.expressions(visit);
            }
            Statement::Next(_) | Statement::Goto(_) | Statement::Return => {}
        }
    }

    /// Calls `visit` with every name that the statement restores.
    pub fn restored(&self, visit: &mut dyn FnMut(&Name)) {
        match self {
            Statement::Simple(Simple::Restore(names)) => names.iter().for_each(visit),
            Statement::If { then, otherwise, .. } => {
                then.restored(visit);
                if let Some(otherwise) = otherwise {
                    otherwise.restored(visit);
                }
            }
            Statement::On { action, .. } => action.restored(visit),
            _ => {}
        }
    }

    /// Calls `visit` with every position a motion of the statement leads to or through.
    pub fn targeted(&mut self, visit: &mut dyn FnMut(&mut Expression)) {
        match self {
            Statement::Simple(Simple::Move { motion, .. }) => match motion {
                MotionKind::Ptp(a) | MotionKind::Line(a) => visit(a),
                MotionKind::Arc(a, b) | MotionKind::Arch(a, b) => {
                    visit(a);
                    visit(b);
                }
                MotionKind::Axis(..) | MotionKind::AxisBy(..) | MotionKind::Ready => {}
            },
            Statement::If { then, otherwise, .. } => {
                then.targeted(visit);
                if let Some(otherwise) = otherwise {
                    otherwise.targeted(visit);
                }
            }
            Statement::On { action, .. } => action.targeted(visit),
            _ => {}
        }
    }

    /// Calls `visit` with every variable the statement gives a value to.
    pub fn targets(&mut self, visit: &mut dyn FnMut(&mut Variable)) {
        match self {
            Statement::Simple(Simple::Assign { target, .. }) | Statement::For { variable: target, .. } => {
                visit(target);
            }
            Statement::Simple(Simple::Input { targets, .. }) => targets.iter_mut().for_each(visit),
            Statement::Simple(Simple::Task {
                target: Some(target), ..
            }) => visit(target),
            Statement::On { action, .. } => action.targets(visit),
            Statement::If { then, otherwise, .. } => {
                then.targets(visit);
                if let Some(otherwise) = otherwise {
                    otherwise.targets(visit);
                }
            }
            _ => {}
        }
    }
}

impl Simple {
    fn expressions(&mut self, visit: &mut dyn FnMut(&mut Expression)) {
        match self {
            Simple::Assign { value, .. }
            | Simple::Set(_, value)
            | Simple::Delay(value)
            | Simple::Timer(value)
            | Simple::Kill(value) => visit(value),
            Simple::Pulse(a, b) | Simple::SetGain(a, b) => {
                visit(a);
                visit(b);
            }
            Simple::Bcd(operands) => operands.iter_mut().for_each(visit),
            Simple::PerAxis(_, values) => values.iter_mut().for_each(visit),
            Simple::Move { motion, with } => {
                match motion {
                    MotionKind::Ptp(a) | MotionKind::Line(a) => visit(a),
                    MotionKind::Arc(a, b)
                    | MotionKind::Arch(a, b)
                    | MotionKind::Axis(a, b)
                    | MotionKind::AxisBy(a, b) => {
                        visit(a);
                        visit(b);
                    }
                    MotionKind::Ready => {}
                }
                with.iter_mut().for_each(|(_, value)| visit(value));
            }
            Simple::Print { items, .. } => {
                for item in items {
                    if let Item::Value(value) = item {
                        visit(value);
                    }
                }
            }
            Simple::Outputs(lines) => lines.iter_mut().for_each(visit),
            Simple::FreeLoad
            | Simple::Stop
            | Simple::Input { .. }
            | Simple::Hand { .. }
            | Simple::Break
            | Simple::Pause
            | Simple::Resume
            | Simple::Switch(..)
            | Simple::Ignore
            | Simple::Task { .. }
            | Simple::Restore(_)
            | Simple::Yield => {}
        }
    }
}

impl Expression {
    /// Calls `visit` with every variable in the expression; those within subscripts come after their array.
    pub fn variables(&mut self, visit: &mut dyn FnMut(&mut Variable)) {
        match &mut self.node {
            Node::Literal(_) | Node::System(_) => {}
            Node::Variable(variable) => {
                visit(variable);
                for subscript in &mut variable.subscripts {
                    subscript.variables(visit);
                }
            }
            Node::Component(of, _) | Node::Unary(_, of) => of.variables(visit),
            Node::Binary(_, left, right) => {
                left.variables(visit);
                right.variables(visit);
            }
            Node::Function(_, arguments) => {
                for argument in arguments {
                    argument.variables(visit);
                }
            }
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
            _ => {}
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
