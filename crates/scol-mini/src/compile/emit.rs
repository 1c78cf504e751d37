//! Turns the statements of a block into steps: labels become step numbers, `IF` becomes branches and jumps, and `FOR` and
//! `NEXT` find each other.
//!
//! Names of variables are resolved before (`names`).

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::Signature;
use crate::MAX_FOR_NESTING;
use crate::diagnostic::{Problem, Span};
use crate::parser::Block;
use crate::program::{Operation, Step};
use crate::sink::Sink;
use crate::tree::{Expression, Name, Reference, Simple, Statement};

/// Appends the steps of a block and its END; returns the step of its label `RCYCLE`.
pub(super) fn block(
    block: &mut Block,
    suppressed: &BTreeSet<String>,
    signatures: &[Signature],
    steps: &mut Vec<Step>,
    sink: &mut Sink,
) -> Option<usize> {
    let names: Vec<&Name> = block.labels.iter().map(|label| &label.name).collect();
    super::duplicates(&names, "label", sink);
    let labels: BTreeMap<String, usize> = block
        .labels
        .iter()
        .map(|label| (label.name.text.clone(), label.statement))
        .collect();
    let first = steps.len();
    let mut emitter = Emitter {
        labels,
        suppressed,
        signatures,
        steps,
        sink,
        starts: Vec::new(),
        loops: Vec::new(),
        line: 0,
        head: true,
    };
    for located in core::mem::take(&mut block.statements) {
        emitter.starts.push(emitter.steps.len());
        emitter.line = located.line;
        emitter.head = true;
        emitter.statement(located.statement, located.span);
    }
    emitter.starts.push(emitter.steps.len());
    emitter.line = block.end_line;
    emitter.head = true;
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
    /// FOR loops that are open here: step, name of the variable, place.
    loops: Vec<(usize, String, Span)>,
    line: u32,
    head: bool,
}

impl Emitter<'_> {
    fn push(&mut self, operation: Operation) -> usize {
        self.steps.push(Step {
            line: self.line,
            head: self.head,
            operation,
        });
        self.head = false;
        self.steps.len() - 1
    }

    /// The statement of a label; `finish` replaces it by its step.
    fn label(&mut self, name: &Name) -> usize {
        if let Some(statement) = self.labels.get(&name.text) {
            return *statement;
        }
        if self.suppressed.contains(&name.text) {
            return 0;
        }
        let problem = Problem::new(
            "E0202",
            name.span,
            format!("this program has no label {}", name.text),
        );
        self.sink.error(problem.help("a jump cannot leave its program"));
        0
    }

    fn statement(&mut self, statement: Statement, span: Span) {
        match statement {
            Statement::On { condition, action } => self.monitor(condition, *action, span),
            Statement::Simple(simple @ Simple::Task { .. }) => self.task(simple, span),
            Statement::Simple(simple) => {
                self.push(Operation::Simple(simple));
            }
            Statement::Wait(condition) => {
                self.push(Operation::Wait(condition));
            }
            Statement::Return => {
                self.push(Operation::Return);
            }
            Statement::Goto(name) => {
                let target = self.label(&name);
                // A selection without a choice marks a jump to a label until all labels have a step.
                self.push(Operation::Select {
                    selector: one(span),
                    targets: Vec::from([target]),
                });
            }
            Statement::Select(selector, labels) => {
                let targets = labels.iter().map(|name| self.label(name)).collect();
                self.push(Operation::Select { selector, targets });
            }
            Statement::If {
                condition,
                then,
                otherwise,
            } => self.branch(condition, *then, otherwise, span),
            Statement::Call(name, arguments) => self.call(&name, arguments, span),
            Statement::For {
                variable,
                from,
                to,
                step,
                ..
            } => {
                // It replaces a line with an error: its name is not known, and a missing end is not reported.
                let broken = variable.name.span == span;
                let name = if broken {
                    String::new()
                } else {
                    variable.name.text.clone()
                };
                let at = self.push(Operation::For {
                    variable,
                    from,
                    to,
                    step,
                    exit: 0,
                });
                if self.loops.len() >= MAX_FOR_NESTING {
                    let message = format!("FOR loops nested more than {MAX_FOR_NESTING} deep");
                    self.sink.error(Problem::new("E0104", span, message));
                }
                self.loops.push((at, name, span));
            }
            Statement::Next(name) => self.next(name.as_ref(), span),
        }
    }

    fn branch(
        &mut self,
        condition: crate::tree::Expression,
        then: Statement,
        otherwise: Option<alloc::boxed::Box<Statement>>,
        span: Span,
    ) {
        let branch = self.push(Operation::Branch {
            condition,
            otherwise: 0,
        });
        self.statement(then, span);
        let mut target = self.steps.len();
        if let Some(otherwise) = otherwise {
            let jump = self.push(Operation::Jump(0));
            target = self.steps.len();
            self.statement(*otherwise, span);
            let end = self.steps.len();
            if let Some(step) = self.steps.get_mut(jump) {
                step.operation = Operation::Jump(end);
            }
        }
        if let Some(Step {
            operation: Operation::Branch { otherwise, .. },
            ..
        }) = self.steps.get_mut(branch)
        {
            *otherwise = target;
        }
    }

    fn call(&mut self, name: &Name, arguments: Vec<crate::tree::Expression>, span: Span) {
        let found = self
            .signatures
            .iter()
            .position(|signature| signature.name == name.text);
        let Some((block, signature)) = found.and_then(|at| Some((at, self.signatures.get(at)?))) else {
            if self.suppressed.contains(&name.text) {
                return;
            }
            let message = format!("{} is no statement and no program of this file", name.text);
            self.sink.error(Problem::new("E0203", name.span, message));
            return;
        };
        let known = !self.suppressed.contains(&name.text);
        if known && signature.parameters != arguments.len() {
            let message = format!(
                "{} takes {} arguments, found {}",
                name.text,
                signature.parameters,
                arguments.len()
            );
            self.sink.error(Problem::new("E0206", span, message));
        }
        self.push(Operation::Call { block, arguments });
    }

    /// The action follows its ON; it is entered only by the monitor.
    fn monitor(&mut self, mut condition: Expression, mut action: Statement, span: Span) {
        let mut parameter = None;
        let mut look = |variable: &mut crate::tree::Variable| {
            if let Reference::Parameter(_) = variable.reference {
                parameter = Some(variable.name.clone());
            }
        };
        condition.variables(&mut look);
        action.expressions(&mut |e, _| e.variables(&mut look));
        action.targets(&mut look);
        if let Some(name) = parameter {
            let message = format!(
                "ON outlasts the call: the parameter {} cannot stand in it",
                name.text
            );
            let problem = Problem::new("E0218", name.span, message);
            self.sink.error(problem.help("copy it to a variable first"));
        }
        let jump = matches!(action, Statement::Goto(_) | Statement::Select(..));
        let on = self.push(Operation::On {
            condition,
            after: 0,
            jump,
        });
        self.head = true;
        self.statement(action, span);
        self.head = true;
        let end = self.push(Operation::HandlerEnd);
        if let Some(Step {
            operation: Operation::On { after, .. },
            ..
        }) = self.steps.get_mut(on)
        {
            *after = end + 1;
        }
    }

    fn task(&mut self, mut simple: Simple, span: Span) {
        if let Simple::Task { name, block, .. } = &mut simple {
            let found = self.signatures.iter().position(|known| known.name == name.text);
            match found.and_then(|at| Some((at, self.signatures.get(at)?))) {
                Some((at, signature)) if signature.parameters == 0 => *block = at,
                Some(_) => {
                    let message = format!("{} takes arguments; a task is started without", name.text);
                    self.sink.error(Problem::new("E0206", span, message));
                }
                None if self.suppressed.contains(&name.text) => {}
                None => {
                    let message = format!("{} is no program of this file", name.text);
                    self.sink.error(Problem::new("E0203", name.span, message));
                }
            }
        }
        self.push(Operation::Simple(simple));
    }

    fn next(&mut self, name: Option<&Name>, span: Span) {
        let Some((opener, variable, _)) = self.loops.pop() else {
            self.sink
                .error(Problem::new("E0216", span, "NEXT without a FOR before it"));
            return;
        };
        if let Some(name) = name
            && name.text != variable
            && !variable.is_empty()
        {
            let message = format!("expected NEXT {variable}, found NEXT {}", name.text);
            self.sink.error(Problem::new("E0217", name.span, message));
        }
        let at = self.push(Operation::Next { opener });
        if let Some(Step {
            operation: Operation::For { exit, .. },
            ..
        }) = self.steps.get_mut(opener)
        {
            *exit = at + 1;
        }
    }

    /// Replaces statement numbers by step numbers.
    fn finish(mut self, first: usize) -> Option<usize> {
        let open = core::mem::take(&mut self.loops);
        for (_, variable, span) in open.into_iter().filter(|(_, variable, _)| !variable.is_empty()) {
            self.sink.error(Problem::new(
                "E0215",
                span,
                format!("this FOR {variable} has no NEXT"),
            ));
        }
        let starts = core::mem::take(&mut self.starts);
        let step_of = |statement: usize| starts.get(statement).copied().unwrap_or(first);
        for step in self.steps.iter_mut().skip(first) {
            if let Operation::Select { selector, targets } = &mut step.operation {
                targets.iter_mut().for_each(|target| *target = step_of(*target));
                if *selector == one(selector.span)
                    && let [only] = targets.as_slice()
                {
                    step.operation = Operation::Jump(*only);
                }
            }
        }
        self.labels.get("RCYCLE").map(|statement| step_of(*statement))
    }
}

/// The constant 1 as an expression.
fn one(span: Span) -> crate::tree::Expression {
    crate::tree::Expression {
        node: crate::tree::Node::Literal(crate::value::Value::Integer(1)),
        span,
    }
}
