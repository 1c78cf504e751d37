//! Resolves the variables of a block: parameter, then `DIM`, then GLOBAL and DATA, then an implicit local variable.
//!
//! Labels and calls are left to `emit`, kinds to `kinds`. Start with [`resolve_block`].

use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};

use super::declare::dim_slot;
use super::duplicates;
use crate::diagnostic::{Diagnostic, NO_POINT, Sink};
use crate::parser::Block;
use crate::program::{Entry, Owner, Slot, Symbols};
use crate::tree::{Ask, Name, Node, Reference, Simple, Statement, Takes, Variable};
use crate::value::ValueKind;

/// Resolves every variable of a block. With `data_copy` a name of DATA that the block assigns to is a variable of its
/// own, with the value of the datum at first.
pub(super) fn resolve_block(
    block: &mut Block,
    suppressed: &BTreeSet<String>,
    symbols: &mut Symbols,
    data_copy: bool,
    sink: &mut Sink,
) {
    let mut scope = Scope::new(suppressed, symbols, sink);
    for (at, parameter) in block.parameters.iter().enumerate() {
        let reference = Reference::Parameter(at);
        scope.locals.insert(parameter.text.clone(), reference);
    }
    let dims = block.dims.iter().map(|declaration| &declaration.name);
    duplicates(block.parameters.iter().chain(dims), "local variable", scope.sink);
    for declaration in &block.dims {
        match dim_slot(declaration, Owner::Local, scope.symbols) {
            Ok(slot) => scope.local(slot),
            Err(problem) => {
                scope.sink.push(problem);
                scope.failed_dims.insert(declaration.name.text.clone());
            }
        }
    }
    if data_copy {
        for located in &mut block.statements {
            located.statement.targets(&mut |variable| scope.copy(variable));
        }
    }
    for located in &mut block.statements {
        located.statement.targets(&mut |variable| scope.define(variable));
        // A subprogram may give the variables that it gets a value.
        located.statement.expressions(&mut |expression, takes| {
            if let (Takes::Any, Node::Variable(variable)) = (takes, &mut expression.node) {
                scope.define(variable);
            }
        });
    }
    for located in &mut block.statements {
        scope.statement(&mut located.statement);
    }
}

/// Resolves a statement that is executed directly: GLOBAL and DATA only. A name that neither has and INPUT gives a value
/// is a variable of the statement (S16); returns how many of them there are.
pub(super) fn resolve_direct(statement: &mut Statement, symbols: &mut Symbols, sink: &mut Sink) -> usize {
    let suppressed = BTreeSet::new();
    let mut scope = Scope::new(&suppressed, symbols, sink);
    if let Statement::Simple(Simple::Ask(Ask::Input(_, targets))) = statement {
        for target in targets.iter().filter(|target| target.subscripts.is_empty()) {
            let name = &target.name.text;
            if scope.lookup(name).is_none() {
                let created = Reference::Parameter(scope.locals.len());
                scope.locals.insert(name.clone(), created);
            }
        }
    }
    scope.statement(statement);
    scope.locals.len()
}

/// Resolves a statement that is asked of a program of the file: its parameters and variables, then GLOBAL and DATA.
pub(super) fn resolve_in_block(
    statement: &mut Statement,
    block: Option<&Entry>,
    symbols: &mut Symbols,
    sink: &mut Sink,
) {
    let suppressed = BTreeSet::new();
    let mut scope = Scope::new(&suppressed, symbols, sink);
    if let Some(block) = block {
        let slots = block.locals.clone().zip(
            scope
                .symbols
                .slots
                .get(block.locals.clone())
                .into_iter()
                .flatten(),
        );
        let variables = slots.map(|(slot, info)| {
            (
                info.name.clone(),
                Reference::Slot {
                    slot,
                    cell: info.base,
                },
            )
        });
        let parameters = block.parameters.iter().cloned().enumerate();
        let parameters = parameters.map(|(at, name)| (name, Reference::Parameter(at)));
        scope.locals = variables.chain(parameters).collect();
    }
    scope.statement(statement);
}

/// Names that can only mean positions: targets of motions, what a coordinate is read of, what a POINT is added to.
fn positions(statement: &mut Statement) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let mut take = |variable: &Variable| {
        names.insert(variable.name.text.clone());
    };
    statement.expressions(&mut |expression, takes| {
        if takes == Takes::Exactly(ValueKind::Position) {
            expression.terms(&mut take);
        }
        expression.positions(&mut take);
    });
    names
}

struct Scope<'a> {
    locals: BTreeMap<String, Reference>,
    /// Names of `DIM` that could not be made.
    failed_dims: BTreeSet<String>,
    suppressed: &'a BTreeSet<String>,
    symbols: &'a mut Symbols,
    sink: &'a mut Sink,
}

impl<'a> Scope<'a> {
    fn new(suppressed: &'a BTreeSet<String>, symbols: &'a mut Symbols, sink: &'a mut Sink) -> Self {
        Scope {
            locals: BTreeMap::new(),
            failed_dims: BTreeSet::new(),
            suppressed,
            symbols,
            sink,
        }
    }

    fn local(&mut self, slot: Slot) {
        let name = slot.name.clone();
        let reference = self.symbols.add(slot);
        self.locals.insert(name, reference);
    }

    /// Makes a local variable of a name that is assigned and not known yet.
    fn define(&mut self, variable: &mut Variable) {
        let name = variable.name.text.as_str();
        let known = self.failed_dims.contains(name) || self.lookup(name).is_some();
        if !known && variable.subscripts.is_empty() {
            self.local(Slot::plain(name, Owner::Local));
        }
    }

    /// Makes a copy of a datum that is assigned.
    fn copy(&mut self, variable: &Variable) {
        let name = variable.name.text.as_str();
        if self.locals.contains_key(name) {
            return;
        }
        let datum = self.symbols.find(name);
        if let Some(datum) = datum.filter(|slot| slot.owner == Owner::Data) {
            self.local(Slot {
                owner: Owner::Local,
                is_work: false,
                ..datum.clone()
            });
        }
    }

    fn lookup(&self, name: &str) -> Option<Reference> {
        let shared = || {
            let slot = *self.symbols.shared.get(name)?;
            let cell = self.symbols.slots.get(slot)?.base;
            Some(Reference::Slot { slot, cell })
        };
        self.locals.get(name).copied().or_else(shared)
    }

    /// Whether the name is one of a line that could not be made sense of.
    fn is_suppressed(&self, name: &str) -> bool {
        self.suppressed.contains(name) || self.failed_dims.contains(name)
    }

    /// Resolves what a statement gives a value to and what it reads, and looks for what it restores.
    fn statement(&mut self, statement: &mut Statement) {
        statement.targets(&mut |variable| {
            self.resolve(variable);
            for subscript in &mut variable.subscripts {
                subscript.variables(&mut |inner| self.resolve(inner));
            }
        });
        statement.each(&mut |statement| {
            if let Statement::Simple(Simple::Ask(Ask::Restore(names))) = statement {
                names.iter().for_each(|name| self.restored(name));
            }
        });
        let positions = positions(statement);
        statement.expressions(&mut |e, _| {
            e.variables(&mut |variable| {
                if self.is_missing(variable) && positions.contains(&variable.name.text) {
                    self.sink.push(no_point(variable));
                } else {
                    self.resolve(variable);
                }
            });
        });
    }

    fn restored(&mut self, name: &Name) {
        if !self.symbols.shared.contains_key(&name.text) && !self.suppressed.contains(&name.text) {
            let message = format!("expected a name of GLOBAL or DATA, found {}", name.text);
            let problem = Diagnostic::new("E0201", name.span, message);
            let help = "RESTORE writes the values of GLOBAL and DATA into the file";
            self.sink.push(problem.help(help));
        }
    }

    /// Whether nothing gives this plain variable a value.
    fn is_missing(&self, variable: &Variable) -> bool {
        let name = &variable.name.text;
        variable.subscripts.is_empty() && self.lookup(name).is_none() && !self.is_suppressed(name)
    }

    fn resolve(&mut self, variable: &mut Variable) {
        let Name { text: name, span } = &variable.name;
        let Some(reference) = self.lookup(name) else {
            if !self.is_suppressed(name) {
                self.sink.push(undefined(variable));
            }
            return;
        };
        variable.reference = reference;
        let bounds = match reference {
            Reference::Slot { slot, .. } => {
                self.symbols.slots.get(slot).and_then(|slot| slot.bounds.as_ref())
            }
            Reference::Parameter(_) | Reference::Unresolved => None,
        };
        let found = variable.subscripts.len();
        let (code, message) = match bounds {
            Some(_) if found == 0 => ("E0212", format!("{name} is an array: a subscript is missing")),
            Some(bounds) if bounds.len() != found => {
                let length = bounds.len();
                ("E0213", format!("{name} has {length} subscripts, found {found}"))
            }
            None if found > 0 => ("E0212", format!("{name} is not an array")),
            _ => return,
        };
        self.sink.push(Diagnostic::new(code, *span, message));
    }
}

/// The problem of a name that nothing gives a value.
fn undefined(variable: &Variable) -> Diagnostic {
    let Name { text: name, span } = &variable.name;
    if !variable.subscripts.is_empty() {
        let problem = Diagnostic::new(
            "E0201",
            *span,
            format!("{name} is neither an array nor a function"),
        );
        return problem.help(format!("declare an array with DIM {name}(n)"));
    }
    let problem = Diagnostic::new("E0201", *span, format!("{name} is never given a value"));
    problem.help("assign it, or declare it in GLOBAL or DATA")
}

/// A point of which neither the file nor the table of taught points says where it is.
fn no_point(variable: &Variable) -> Diagnostic {
    let name = &variable.name;
    let message = format!("{NO_POINT} {}: add it to DATA or to the taught points", name.text);
    Diagnostic::new("E0201", name.span, message)
}
