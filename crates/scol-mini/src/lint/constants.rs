//! Warnings about constants that always raise an alarm: the machine tries the statements whose operands are constants.
//!
//! An operand that is not a constant is replaced by a value that every statement takes, so what is left to refuse is
//! constant. Which lines, axes and places exist says the [`Robot`] of the check. The codes are listed in `diagnostic`.

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use crate::MAX_BCD_DIGITS;
use crate::builtin::{Builtin, Condition, Numeric};
use crate::conditions::Conditions;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::machine::{TrialInputs, outside_array, try_operations, try_value};
use crate::options::LanguageOptions;
use crate::parser::{Block, Declaration, File};
use crate::points::TaughtPoint;
use crate::program::{Operation, Owner, Slot};
use crate::request::{Fault, FaultKind, Motion, Path, Request, Robot};
use crate::tree::{Ask, Binary, Change, Expression, MotionKind, Node, Simple, Statement, Takes, Variable};
use crate::value::{Number, Position, Value, ValueKind};

pub(super) fn lint(
    file: &mut File,
    options: &LanguageOptions,
    points: &[TaughtPoint],
    robot: &dyn Robot,
    sink: &mut Sink,
) {
    let fixed = fixed_points(file, points);
    let mut linter = Linter {
        options,
        robot,
        fixed,
        arrays: BTreeMap::new(),
        reported: BTreeSet::new(),
        reached: BTreeSet::new(),
        noted: Vec::new(),
        operations: Vec::new(),
        found: false,
        sink,
    };
    let globals = core::mem::take(&mut file.globals);
    for block in &mut file.blocks {
        linter.arrays = arrays(&globals, block);
        for located in &mut block.statements {
            linter.line(&mut located.statement, located.line);
        }
    }
    linter.try_noted();
    file.globals = globals;
}

/// A position that no program of the file changes.
struct FixedPoint {
    position: Position,
    /// Its name in DATA; a taught point has none.
    datum: Option<Span>,
}

/// The points of DATA and the taught ones that no program gives another value; none when a program moves the coordinate
/// systems in which they are meant.
fn fixed_points(file: &mut File, points: &[TaughtPoint]) -> BTreeMap<String, FixedPoint> {
    let mut changed = BTreeSet::new();
    let mut moved = false;
    for located in file.blocks.iter_mut().flat_map(|block| &mut block.statements) {
        let statement = &mut located.statement;
        statement.targets(&mut |variable| {
            changed.insert(variable.name.text.clone());
        });
        // A subprogram may give the variables that it gets a value.
        statement.expressions(&mut |expression, takes| {
            if let (Takes::Any, Node::Variable(variable)) = (takes, &expression.node) {
                changed.insert(variable.name.text.clone());
            }
        });
        statement.each(&mut |statement| {
            if let Statement::Simple(Simple::Change(Change::Set(condition, _))) = statement {
                moved |= condition.is_frame();
            }
        });
    }
    if moved {
        return BTreeMap::new();
    }
    let taught = points.iter().map(|point| {
        let (position, datum) = (point.position.clone(), None);
        (point.name.clone(), FixedPoint { position, datum })
    });
    // Where a WORK names coordinate data, the file says where that is, but a program may change it.
    let data = file
        .data
        .iter()
        .filter(|datum| datum.kind == ValueKind::Position && datum.work.is_none());
    let data = data.map(|datum| {
        let position = Position {
            config: datum.config,
            ..Position::from_leading(&datum.numbers)
        };
        let datum = (datum.name.text.clone(), Some(datum.name.span));
        (
            datum.0,
            FixedPoint {
                position,
                datum: datum.1,
            },
        )
    });
    // Those of the file come first.
    let mut fixed: BTreeMap<String, FixedPoint> = taught.chain(data).collect();
    for datum in file.data.iter().filter(|datum| datum.work.is_some()) {
        fixed.remove(&datum.name.text);
    }
    let parameters = file.blocks.iter().flat_map(|block| &block.parameters);
    changed.extend(parameters.map(|name| name.text.clone()));
    let locals = file.blocks.iter().flat_map(|block| &block.dims);
    changed.extend(locals.map(|declaration| declaration.name.text.clone()));
    fixed.retain(|name, _| !changed.contains(name));
    fixed
}

/// The arrays that a block sees, with their bounds.
fn arrays(globals: &[Declaration], block: &Block) -> BTreeMap<String, Slot> {
    let declared = globals.iter().chain(&block.dims);
    let declared = declared.filter(|declaration| declaration.dim && !declaration.subscripts.is_empty());
    let slots = declared.map(|declaration| {
        let name = &declaration.name.text;
        let slot = Slot {
            bounds: Some(declaration.subscripts.clone()),
            ..Slot::plain(name, Owner::Local)
        };
        (name.clone(), slot)
    });
    let mut arrays: BTreeMap<String, Slot> = slots.collect();
    let parameters = block.parameters.iter();
    parameters.for_each(|name| drop(arrays.remove(&name.text)));
    arrays
}

/// The meaning of an operand, which decides the code of its alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Line,
    Axis,
    Percent,
    Seconds,
    Digits,
    Setting,
    Step,
    Place,
}

/// An operand of a statement: its place, and whether it is a constant.
struct Operand {
    span: Span,
    role: Role,
    constant: bool,
}

struct Linter<'a> {
    options: &'a LanguageOptions,
    robot: &'a dyn Robot,
    fixed: BTreeMap<String, FixedPoint>,
    arrays: BTreeMap<String, Slot>,
    /// Points that have been reported.
    reported: BTreeSet<String>,
    /// Points that a motion without WITH reaches.
    reached: BTreeSet<String>,
    /// Statements to be tried, with their operands, and what is tried of each.
    noted: Vec<(Statement, Vec<Operand>)>,
    operations: Vec<Operation>,
    /// The statement under way has been reported.
    found: bool,
    sink: &'a mut Sink,
}

impl Linter<'_> {
    fn line(&mut self, statement: &mut Statement, line: u32) {
        self.found = false;
        statement.targets(&mut |variable| self.element(variable));
        statement.expressions(&mut |expression, _| {
            self.expression(expression);
        });
        if self.found {
            return;
        }
        statement.each(&mut |statement| match statement {
            Statement::Simple(Simple::Ask(_) | Simple::Change(_)) | Statement::For(_) => {
                self.note(statement);
                if let Statement::Simple(Simple::Ask(Ask::Move { motion, with })) = statement {
                    self.places(motion, with, line);
                }
            }
            Statement::Simple(Simple::Assign(_) | Simple::Monitors(_) | Simple::Ignore)
            | Statement::Wait(_)
            | Statement::If { .. }
            | Statement::Next(_)
            | Statement::Goto(_)
            | Statement::Select(..)
            | Statement::Call(..)
            | Statement::Return
            | Statement::On { .. } => {}
        });
    }

    fn report(&mut self, code: &'static str, span: Span, reason: &str) {
        self.found = true;
        let message = format!("this raises an alarm: {reason}");
        self.sink
            .push(Diagnostic::new(code, span, message).help(help(code)));
    }

    fn inputs(&self) -> TrialInputs<'_> {
        TrialInputs { robot: self.robot }
    }

    /// An element of an array whose subscripts are constants.
    fn element(&mut self, variable: &Variable) {
        let numbers = variable.subscripts.iter().map(|subscript| {
            let Node::Literal(Number::Integer(number)) = subscript.node else {
                return None;
            };
            Some(number)
        });
        let numbers: Option<Vec<i32>> = numbers.collect();
        let slot = self.arrays.get(&variable.name.text);
        if let (Some(numbers), Some(slot)) = (numbers, slot)
            && slot
                .bounds
                .as_ref()
                .is_some_and(|bounds| bounds.len() == numbers.len())
            && slot.index(&numbers).is_none()
        {
            let fault = outside_array(&slot.name, &numbers);
            let last = variable
                .subscripts
                .last()
                .map_or(variable.name.span, |last| last.span);
            self.report("W0622", variable.name.span.to(last), &fault.message);
        }
    }

    /// Whether an expression, or a part of it, is a constant that raises an alarm; reports the smallest such part.
    fn expression(&mut self, expression: &Expression) -> bool {
        let parts = match &expression.node {
            Node::Literal(_) | Node::System(_) => return false,
            Node::Variable(variable) => {
                self.element(variable);
                return self.parts(&variable.subscripts);
            }
            Node::Component(of, _) | Node::Unary(_, of) => self.expression(of),
            Node::Binary(_, left, right) => {
                let left = self.expression(left);
                self.expression(right) || left
            }
            Node::Function(_, arguments) => self.parts(arguments),
        };
        if parts {
            return true;
        }
        let Some(probe) = probe(expression) else {
            return false;
        };
        let Err(fault) = try_value(&probe, self.options, &self.inputs()) else {
            return false;
        };
        let Some(code) = code_of(fault.kind, || function_role(expression)) else {
            return false;
        };
        self.report(code, expression.span, &fault.message);
        true
    }

    /// The same of several expressions, all of which are looked at.
    fn parts(&mut self, parts: &[Expression]) -> bool {
        let mut found = false;
        for part in parts {
            found |= self.expression(part);
        }
        found
    }

    /// Notes a statement with constants, to be tried with all others.
    fn note(&mut self, statement: &Statement) {
        let mut whole = statement.clone();
        let operands = operands(&mut whole);
        if operands.iter().any(|operand| operand.constant)
            && let Some(operation) = operation(whole)
        {
            self.noted.push((statement.clone(), operands));
            self.operations.push(operation);
        }
    }

    /// Tries the noted statements.
    fn try_noted(&mut self) {
        let operations = core::mem::take(&mut self.operations);
        let tried = try_operations(operations, self.options, &self.inputs());
        let noted = core::mem::take(&mut self.noted);
        for ((statement, operands), tried) in noted.iter().zip(tried) {
            if let Some(reason) = self.refusal(tried, operands) {
                self.refused(statement, operands, reason);
            }
        }
    }

    /// Reports a statement that is refused, at the operand that is at fault.
    fn refused(&mut self, statement: &Statement, operands: &[Operand], mut reason: String) {
        // One operand alone is at fault, or the last one does not go with those before it.
        let constants = || {
            operands
                .iter()
                .enumerate()
                .filter(|(_, operand)| operand.constant)
        };
        let mut at_fault = constants().next_back();
        for (number, operand) in constants() {
            let mut single = statement.clone();
            let others = replaced(&mut single, |other, _| other == number);
            let operations = operation(single).into_iter().collect();
            let tried = try_operations(operations, self.options, &self.inputs()).pop();
            if let Some(single) = tried.and_then(|tried| self.refusal(tried, &others)) {
                at_fault = Some((number, operand));
                reason = single;
                break;
            }
        }
        let Some((_, operand)) = at_fault else { return };
        let code = match operand.role {
            Role::Line => "W0615",
            Role::Axis => "W0616",
            Role::Percent => "W0614",
            Role::Seconds => "W0618",
            Role::Digits => "W0619",
            Role::Setting => "W0623",
            Role::Step => "W0620",
            Role::Place => "W0624",
        };
        self.report(code, operand.span, &reason);
    }

    /// Why the machine, or the robot, refuses what has been tried.
    fn refusal(&self, tried: Result<Option<Request>, Fault>, operands: &[Operand]) -> Option<String> {
        match tried {
            Err(fault) => Some(fault.message),
            Ok(request) => {
                let request = asked(request?, operands)?;
                self.robot.refusal(&request)
            }
        }
    }

    /// The places a motion leads to, where they are constants.
    fn places(&mut self, motion: &MotionKind, with: &[(Condition, Expression)], line: u32) {
        let frames = with.iter().filter(|(condition, _)| condition.is_frame());
        if self.found || frames.clone().any(|(_, frame)| !frame.is_constant()) {
            return;
        }
        let ends: &[Expression] = match motion {
            MotionKind::Ptp(end) | MotionKind::Line(end) => core::slice::from_ref(end),
            MotionKind::Arc(ends) => ends,
            MotionKind::Arch([end, _]) => core::slice::from_ref(end),
            MotionKind::Axis(_) | MotionKind::AxisBy(_) | MotionKind::Ready => return,
        };
        let Some(conditions) = self.conditions(with) else {
            return;
        };
        for end in ends {
            self.place(end, &conditions, with.is_empty(), line);
        }
    }

    /// A motion with the conditions of a WITH, those that are constants.
    fn conditions(&self, with: &[(Condition, Expression)]) -> Option<Motion> {
        if with.is_empty() {
            return Some(Motion {
                path: Path::Ready,
                conditions: Conditions::default(),
                over_full: None,
                own_frames: false,
            });
        }
        let mut statement = Statement::Simple(Simple::Ask(Ask::Move {
            motion: MotionKind::Ready,
            with: with.to_vec(),
        }));
        operands(&mut statement);
        let operations = operation(statement).into_iter().collect();
        match try_operations(operations, self.options, &self.inputs()).pop()? {
            Ok(Some(Request::Move(motion))) => Some(*motion),
            Ok(_) | Err(_) => None,
        }
    }

    fn place(&mut self, end: &Expression, motion: &Motion, plain: bool, line: u32) {
        let variable = if let Node::Variable(variable) = &end.node {
            Some(variable).filter(|variable| variable.subscripts.is_empty())
        } else {
            None
        };
        let named = variable.and_then(|variable| {
            let name = &variable.name.text;
            self.fixed.get(name).map(|fixed| (fixed, name.clone()))
        });
        let (position, name, datum) = match named {
            Some((_, name)) if self.reported.contains(&name) => return,
            Some((_, name)) if plain && self.reached.contains(&name) => return,
            Some((fixed, name)) => (fixed.position.clone(), Some(name), fixed.datum),
            None if end.is_constant() => match try_value(end, self.options, &self.inputs()) {
                Ok(Value::Position(position)) => (*position, None, None),
                _ => return,
            },
            None => return,
        };
        let motion = Motion {
            path: Path::Ptp(position),
            ..motion.clone()
        };
        let Some(reason) = self.robot.refusal(&Request::Move(Box::new(motion))) else {
            self.reached.extend(name.filter(|_| plain));
            return;
        };
        let what = name.as_deref().unwrap_or("this position");
        let message = format!("the arm cannot reach {what} ({reason})");
        let mut problem = Diagnostic::new("W0624", datum.unwrap_or(end.span), message);
        problem = problem.help(match datum {
            Some(_) => format!("line {line} moves there; correct the position, or check for another arm"),
            None => "correct the position, or check for another arm".to_string(),
        });
        self.found = true;
        self.sink.push(problem);
        self.reported.extend(name);
    }
}

/// The code of a fault; `None` for one that constants do not decide.
fn code_of(kind: FaultKind, role: impl FnOnce() -> Option<Role>) -> Option<&'static str> {
    Some(match kind {
        FaultKind::DivisionByZero => "W0613",
        FaultKind::Domain => "W0617",
        FaultKind::Overflow => "W0621",
        FaultKind::Range => match role()? {
            Role::Line => "W0615",
            Role::Axis => "W0616",
            Role::Digits => "W0619",
            Role::Percent | Role::Seconds | Role::Setting | Role::Step | Role::Place => "W0623",
        },
        FaultKind::Subscript
        | FaultKind::Undefined
        | FaultKind::Type
        | FaultKind::Nesting
        | FaultKind::NextWithoutFor => return None,
    })
}

/// The role of the arguments of a function that refuses some.
fn function_role(expression: &Expression) -> Option<Role> {
    let Node::Function(builtin, arguments) = &expression.node else {
        return None;
    };
    Some(match builtin {
        Builtin::Din | Builtin::Dout => Role::Line,
        Builtin::Gain | Builtin::Torque => Role::Axis,
        Builtin::Bcdin => match arguments.get(1).map(|digits| &digits.node) {
            Some(Node::Literal(Number::Integer(digits))) if !(1..=MAX_BCD_DIGITS as i32).contains(digits) => {
                Role::Digits
            }
            _ => Role::Line,
        },
        Builtin::Max
        | Builtin::Min
        | Builtin::Point
        | Builtin::Trans
        | Builtin::Payload
        | Builtin::Numeric(_) => Role::Setting,
    })
}

fn help(code: &str) -> &'static str {
    match code {
        "W0613" => "divide by a number other than 0",
        "W0614" => "use a percentage in this range",
        "W0615" => "use the number of a line that the robot has",
        "W0616" => "use the number of an axis that the arm has",
        "W0617" => "use a value for which the function is defined",
        "W0618" => "use a time from 0 up, in seconds",
        "W0619" => "use as many digits as the value has, 8 at most",
        "W0620" => "count with a STEP other than 0",
        "W0621" => "use smaller numbers, or reals: write one of them with a decimal point",
        "W0622" => "use a subscript from 0 to the bound in DIM",
        "W0623" => "use one of the values that it takes",
        _ => "correct the position, or check for another arm",
    }
}

/// An expression that is tried for another: the same when it is a constant; otherwise the part of it that is, with
/// harmless values for the rest.
fn probe(expression: &Expression) -> Option<Expression> {
    if expression.is_constant() {
        return Some(expression.clone());
    }
    let number = |number: i32, of: &Expression| Expression::integer(number, of.span);
    let node = match &expression.node {
        Node::Binary(operator @ (Binary::Divide | Binary::Modulo), left, right) if right.is_constant() => {
            Node::Binary(*operator, Box::new(number(1, left)), right.clone())
        }
        Node::Function(builtin, arguments) => Node::Function(*builtin, probed(*builtin, arguments)?),
        Node::Literal(_)
        | Node::Variable(_)
        | Node::Component(..)
        | Node::Unary(..)
        | Node::Binary(..)
        | Node::System(_) => return None,
    };
    Some(Expression::new(node, expression.span))
}

/// The arguments of a function that is tried, if those that are constants decide.
fn probed(builtin: Builtin, arguments: &[Expression]) -> Option<Vec<Expression>> {
    let decides = match builtin {
        Builtin::Din | Builtin::Dout | Builtin::Bcdin | Builtin::Gain | Builtin::Torque => true,
        Builtin::Numeric(Numeric::Mod) => arguments.get(1).is_some_and(Expression::is_constant),
        Builtin::Max
        | Builtin::Min
        | Builtin::Point
        | Builtin::Trans
        | Builtin::Payload
        | Builtin::Numeric(_) => false,
    };
    let probed = arguments.iter().map(|argument| match argument.is_constant() {
        true => argument.clone(),
        false => Expression::integer(1, argument.span),
    });
    decides.then(|| probed.collect())
}

/// The roles of the operands of a statement, in their order.
fn roles(statement: &Statement) -> Vec<Role> {
    let of = |condition: &Condition| match condition {
        Condition::Speed | Condition::Accel | Condition::Decel | Condition::Pass => Role::Percent,
        Condition::Config
        | Condition::Accur
        | Condition::Payload
        | Condition::Work
        | Condition::Tool
        | Condition::Base => Role::Setting,
    };
    if let Statement::For(_) = statement {
        return Vec::from([Role::Place, Role::Place, Role::Step]);
    }
    let Statement::Simple(simple) = statement else {
        return Vec::new();
    };
    match simple {
        Simple::Change(change) => match change {
            Change::Set(condition, _) => Vec::from([of(condition)]),
            Change::PerAxis(_, values) => alloc::vec![Role::Percent; values.len()],
            Change::SetGain(_) => Vec::from([Role::Axis, Role::Percent]),
            Change::FreeLoad | Change::Pass(_) | Change::Nowait(_) => Vec::new(),
        },
        Simple::Ask(ask) => match ask {
            Ask::Move { motion, with } => {
                let mut roles = match motion {
                    MotionKind::Ptp(_) | MotionKind::Line(_) => Vec::from([Role::Place]),
                    MotionKind::Arc(_) | MotionKind::Arch(_) => Vec::from([Role::Place; 2]),
                    MotionKind::Axis(_) | MotionKind::AxisBy(_) => Vec::from([Role::Axis, Role::Place]),
                    MotionKind::Ready => Vec::new(),
                };
                roles.extend(with.iter().map(|(condition, _)| of(condition)));
                roles
            }
            Ask::Outputs(lines) => alloc::vec![Role::Line; lines.len()],
            Ask::Pulse(_) => Vec::from([Role::Line, Role::Seconds]),
            Ask::Bcd(_) => Vec::from([Role::Line, Role::Digits, Role::Digits]),
            Ask::Delay(_) | Ask::Timer(_) => Vec::from([Role::Seconds]),
            Ask::Kill(_)
            | Ask::Print { .. }
            | Ask::Input(..)
            | Ask::Task { .. }
            | Ask::Restore(_)
            | Ask::Fixed(_) => Vec::new(),
        },
        Simple::Assign(_) | Simple::Monitors(_) | Simple::Ignore => Vec::new(),
    }
}

/// Replaces the operands other than constants by harmless values; gives all operands that have a role.
fn operands(statement: &mut Statement) -> Vec<Operand> {
    replaced(statement, |_, expression| expression.is_constant())
}

/// Replaces all operands but those to keep by harmless values; gives all operands that have a role.
fn replaced(statement: &mut Statement, keeps: impl Fn(usize, &Expression) -> bool) -> Vec<Operand> {
    let roles = roles(statement);
    let (bcd, mut number) = (is_bcd(statement), 0);
    let mut operands = Vec::new();
    statement.expressions(&mut |expression, takes| {
        let constant = keeps(number, expression);
        if !constant {
            *expression = harmless(takes, bcd && number == 1, expression.span);
        }
        operands.extend(roles.get(number).map(|role| Operand {
            span: expression.span,
            role: *role,
            constant,
        }));
        number += 1;
    });
    operands
}

fn is_bcd(statement: &Statement) -> bool {
    matches!(statement, Statement::Simple(Simple::Ask(Ask::Bcd(_))))
}

/// A value that every statement takes; for the digits of BCDOUT the most, in which any value of fewer digits fits.
fn harmless(takes: Takes, digits: bool, span: Span) -> Expression {
    let vector = match takes {
        Takes::Exactly(ValueKind::Position) => Builtin::Point,
        Takes::Exactly(ValueKind::Coordinate) => Builtin::Trans,
        Takes::Exactly(ValueKind::Load) => Builtin::Payload,
        Takes::Number | Takes::Exactly(_) | Takes::Any | Takes::Assigned => {
            let number = if digits { MAX_BCD_DIGITS as i32 } else { 1 };
            return Expression::integer(number, span);
        }
    };
    Expression::new(Node::Function(vector, Vec::new()), span)
}

/// The operation of a statement that is tried.
fn operation(statement: Statement) -> Option<Operation> {
    if let Statement::Simple(simple) = statement {
        Some(Operation::Simple(simple))
    } else if let Statement::For(counting) = statement {
        Some(Operation::For { counting, exit: 0 })
    } else {
        None
    }
}

/// The request as the robot is asked about it: without what only harmless values decide.
fn asked(request: Request, operands: &[Operand]) -> Option<Request> {
    let is_constant = |number: usize| operands.get(number).is_some_and(|operand| operand.constant);
    if let (Request::Outputs(lines), Some(digits)) = (&request, operands.get(1))
        && digits.role == Role::Digits
        && !digits.constant
    {
        // One digit at least.
        let lines = lines.iter().take(4).copied().collect();
        return Some(Request::Outputs(lines));
    }
    let Request::Move(motion) = request else {
        return Some(request);
    };
    let path = match motion.path {
        Path::Axis { axis, value } if is_constant(0) && is_constant(1) => Path::Axis { axis, value },
        // Where the axis then is depends on where it was.
        Path::Axis { axis, .. } | Path::AxisBy { axis, .. } if is_constant(0) => {
            let delta = 0.0;
            Path::AxisBy { axis, delta }
        }
        // Positions are looked at one by one.
        Path::Axis { .. }
        | Path::AxisBy { .. }
        | Path::Ptp(_)
        | Path::Line(_)
        | Path::Arc { .. }
        | Path::Arch { .. }
        | Path::Ready => return None,
    };
    Some(Request::Move(Box::new(Motion { path, ..*motion })))
}
