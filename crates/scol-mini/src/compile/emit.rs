//! Turns the statements of a block into steps: labels become step numbers, `IF` becomes branches and jumps, and each
//! `NEXT` is matched with its `FOR`.
//!
//! Names of variables are resolved before (`names`).

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use super::Signature;
use crate::MAX_FOR_NESTING;
use crate::diagnostic::{Diagnostic, Sink, Span};
use crate::parser::Block;
use crate::program::{Operation, Step};
use crate::tree::{Ask, Expression, Name, Node, Reference, Simple, Statement, Variable};
use crate::value::Number;

/// Appends the steps of a block and its END; returns the step of its label `RCYCLE`.
pub(super) fn block(
    block: &mut Block,
    suppressed: &BTreeSet<String>,
    signatures: &[Signature],
    steps: &mut Vec<Step>,
    sink: &mut Sink,
) -> Option<usize> {
    super::duplicates(block.labels.iter().map(|label| &label.name), "label", sink);
    let labels = block.labels.iter();
    let first = steps.len();
    let mut emitter = Emitter {
        labels: labels
            .map(|label| (label.name.text.clone(), label.statement))
            .collect(),
        suppressed,
        signatures,
        steps,
        sink,
        starts: Vec::new(),
        jumps: Vec::new(),
        loops: Vec::new(),
        line: 0,
        head: true,
    };
    for located in core::mem::take(&mut block.statements) {
        emitter.begin(located.line);
        emitter.statement(located.statement, located.span);
    }
    emitter.begin(block.end_line);
    emitter.push(Operation::Return);
    emitter.finish(first)
}

struct Emitter<'a> {
    suppressed: &'a BTreeSet<String>,
    /// Label to number of the statement.
    labels: BTreeMap<String, usize>,
    signatures: &'a [Signature],
    steps: &'a mut Vec<Step>,
    sink: &'a mut Sink,
    /// First step of each statement of the block, and of its END.
    starts: Vec<usize>,
    /// Steps that jump to labels: their targets are statements until all labels have a step.
    jumps: Vec<usize>,
    /// FOR loops that are open here: step, name of the variable, place.
    loops: Vec<(usize, String, Span)>,
    line: u32,
    head: bool,
}

impl Emitter<'_> {
    /// Begins a statement of the block.
    fn begin(&mut self, line: u32) {
        self.starts.push(self.steps.len());
        (self.line, self.head) = (line, true);
    }

    fn push(&mut self, operation: Operation) {
        self.steps.push(Step {
            line: self.line,
            head: self.head,
            operation,
        });
        self.head = false;
    }

    /// Lets the step at `at` lead to the step that comes next.
    fn lead_here(&mut self, at: usize) {
        let here = self.steps.len();
        if let Some(
            Operation::Branch {
                otherwise: target, ..
            }
            | Operation::Jump(target)
            | Operation::On { after: target, .. }
            | Operation::For { exit: target, .. },
        ) = self.steps.get_mut(at).map(|step| &mut step.operation)
        {
            *target = here;
        }
    }

    fn error(&mut self, code: &'static str, span: Span, message: String) {
        self.sink.push(Diagnostic::new(code, span, message));
    }

    /// The statement of a label; `finish` replaces it by its step.
    fn label(&mut self, name: &Name) -> usize {
        let known = self.labels.get(&name.text).copied();
        if known.is_none() && !self.suppressed.contains(&name.text) {
            let message = format!("this program has no label {}", name.text);
            let problem = Diagnostic::new("E0202", name.span, message);
            self.sink.push(problem.help("a jump cannot leave its program"));
        }
        known.unwrap_or(0)
    }

    fn statement(&mut self, statement: Statement, span: Span) {
        match statement {
            Statement::On { condition, action } => self.monitor(condition, *action, span),
            Statement::Simple(mut simple) => {
                if let Simple::Ask(Ask::Task { name, block, .. }) = &mut simple {
                    *block = self.task(name, span);
                }
                self.push(Operation::Simple(simple));
            }
            Statement::Wait(condition) => self.push(Operation::Wait(condition)),
            Statement::Return => self.push(Operation::Return),
            Statement::Goto(name) => self.goto(&name),
            Statement::Select(selector, labels) => match (&selector.node, labels.as_slice()) {
                (Node::Literal(Number::Integer(1)), [only]) => self.goto(only),
                _ => {
                    let targets = labels.iter().map(|name| self.label(name)).collect();
                    self.jumps.push(self.steps.len());
                    self.push(Operation::Select { selector, targets });
                }
            },
            Statement::If {
                condition,
                then,
                otherwise,
            } => self.branch(condition, *then, otherwise.map(|otherwise| *otherwise), span),
            Statement::Call(name, arguments) => self.call(&name, arguments, span),
            Statement::For(counting) => {
                // It replaces a line with an error: its name is not known, and a missing end is not reported.
                let known = Some(&counting.variable.name).filter(|name| name.span != span);
                let name = known.map(|name| name.text.clone()).unwrap_or_default();
                if self.loops.len() >= MAX_FOR_NESTING {
                    let message = format!("FOR loops nested more than {MAX_FOR_NESTING} deep");
                    self.error("E0104", span, message);
                }
                self.loops.push((self.steps.len(), name, span));
                self.push(Operation::For { counting, exit: 0 });
            }
            Statement::Next(name) => self.next(name.as_ref(), span),
        }
    }

    fn goto(&mut self, name: &Name) {
        let target = self.label(name);
        self.jumps.push(self.steps.len());
        self.push(Operation::Jump(target));
    }

    fn branch(&mut self, condition: Expression, then: Statement, otherwise: Option<Statement>, span: Span) {
        let branch = self.steps.len();
        self.push(Operation::Branch {
            condition,
            otherwise: 0,
        });
        self.statement(then, span);
        let jump = self.steps.len();
        if otherwise.is_some() {
            self.push(Operation::Jump(0));
        }
        self.lead_here(branch);
        if let Some(otherwise) = otherwise {
            self.statement(otherwise, span);
            self.lead_here(jump);
        }
    }

    /// The program of this name: its number, and how many arguments it takes.
    fn program(&self, name: &Name) -> Option<(usize, usize)> {
        let mut known = self.signatures.iter().enumerate();
        let (at, (_, parameters)) = known.find(|(_, (known, _))| *known == name.text)?;
        Some((at, *parameters))
    }

    fn call(&mut self, name: &Name, arguments: Vec<Expression>, span: Span) {
        let known = !self.suppressed.contains(&name.text);
        let Some((block, takes)) = self.program(name) else {
            if known {
                let message = format!("{} is neither a statement nor a program of this file", name.text);
                self.error("E0203", name.span, message);
            }
            return;
        };
        if known && takes != arguments.len() {
            let message = format!("{} takes {takes} arguments, found {}", name.text, arguments.len());
            self.error("E0206", span, message);
        }
        self.push(Operation::Call { block, arguments });
    }

    /// The number of the program that a TASK starts.
    fn task(&mut self, name: &Name, span: Span) -> usize {
        match self.program(name) {
            Some((at, 0)) => return at,
            Some(_) => {
                let message = format!("{} takes arguments; a task is started without", name.text);
                self.error("E0206", span, message);
            }
            None if self.suppressed.contains(&name.text) => {}
            None => {
                let message = format!("this file has no program {}", name.text);
                self.error("E0203", name.span, message);
            }
        }
        0
    }

    /// The action follows its ON; it is entered only by the monitor.
    fn monitor(&mut self, mut condition: Expression, mut action: Statement, span: Span) {
        let mut parameter = None;
        let mut look = |variable: &mut Variable| {
            if let Reference::Parameter(_) = variable.reference {
                parameter = Some(variable.name.clone());
            }
        };
        condition.variables(&mut look);
        action.expressions(&mut |e, _| e.variables(&mut look));
        action.targets(&mut look);
        if let Some(name) = parameter {
            let Name { text, span } = name;
            let message = format!("ON outlasts the call and cannot use the parameter {text}");
            let problem = Diagnostic::new("E0218", span, message);
            self.sink.push(problem.help("copy it to a variable first"));
        }
        let jump = matches!(action, Statement::Goto(_) | Statement::Select(..));
        let on = self.steps.len();
        self.push(Operation::On {
            condition,
            after: 0,
            jump,
        });
        self.head = true;
        self.statement(action, span);
        self.head = true;
        self.push(Operation::HandlerEnd);
        self.lead_here(on);
    }

    fn next(&mut self, name: Option<&Name>, span: Span) {
        let Some((opener, variable, _)) = self.loops.pop() else {
            return self.error("E0216", span, "NEXT without a FOR before it".into());
        };
        if let Some(name) = name.filter(|name| name.text != variable && !variable.is_empty()) {
            let message = format!("expected NEXT {variable}, found NEXT {}", name.text);
            self.error("E0217", name.span, message);
        }
        self.push(Operation::Next { opener });
        self.lead_here(opener);
    }

    /// Replaces statement numbers by step numbers.
    fn finish(mut self, first: usize) -> Option<usize> {
        for (_, variable, span) in core::mem::take(&mut self.loops) {
            if !variable.is_empty() {
                self.error("E0215", span, format!("this FOR {variable} has no NEXT"));
            }
        }
        let step_of = |statement: usize| self.starts.get(statement).copied().unwrap_or(first);
        for jump in &self.jumps {
            match self.steps.get_mut(*jump).map(|step| &mut step.operation) {
                Some(Operation::Jump(target)) => *target = step_of(*target),
                Some(Operation::Select { targets, .. }) => {
                    targets.iter_mut().for_each(|target| *target = step_of(*target));
                }
                _ => {}
            }
        }
        self.labels.get("RCYCLE").map(|statement| step_of(*statement))
    }
}
