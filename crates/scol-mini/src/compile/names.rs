//! Resolves the variables of a block: parameter, then `DIM`, then GLOBAL and DATA, then an implicit local variable.
//!
//! Labels and calls are left to `emit`, kinds to `kinds`. Start with [`resolve_block`].

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::String;

use super::declare::dim_slot;
use super::duplicates;
use crate::diagnostic::Problem;
use crate::parser::Block;
use crate::program::{Owner, Slot, Symbols};
use crate::sink::Sink;
use crate::tree::{Name, Node, Reference, Simple, Statement, Takes, Variable};
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
    let mut scope = Scope {
        locals: BTreeMap::new(),
        failed_dims: BTreeSet::new(),
        suppressed,
        symbols,
    };
    for (at, parameter) in block.parameters.iter().enumerate() {
        scope
            .locals
            .insert(parameter.text.clone(), Reference::Parameter(at));
    }
    let names: alloc::vec::Vec<_> = block
        .parameters
        .iter()
        .chain(block.dims.iter().map(|d| &d.name))
        .collect();
    duplicates(&names, "local variable", sink);
    for declaration in &block.dims {
        match dim_slot(declaration, Owner::Local, scope.symbols) {
            Ok(slot) => scope.local(slot),
            Err(problem) => {
                sink.error(problem);
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
        passed(&mut located.statement, &mut |variable| scope.define(variable));
    }
    for located in &mut block.statements {
        located.statement.targets(&mut |variable| {
            scope.resolve(variable, sink);
            for subscript in &mut variable.subscripts {
                subscript.variables(&mut |inner| scope.resolve(inner, sink));
            }
        });
        scope.read(&mut located.statement, sink);
    }
}

/// Resolves a statement that is executed directly: GLOBAL and DATA only. A name that neither has and INPUT gives a value
/// is a variable of the statement (S16); returns how many of them there are.
pub(super) fn resolve_direct(statement: &mut Statement, symbols: &mut Symbols, sink: &mut Sink) -> usize {
    let mut scope = Scope {
        locals: BTreeMap::new(),
        failed_dims: BTreeSet::new(),
        suppressed: &BTreeSet::new(),
        symbols,
    };
    if let Statement::Simple(Simple::Input { targets, .. }) = statement {
        for target in targets.iter().filter(|target| target.subscripts.is_empty()) {
            let name = &target.name.text;
            if scope.lookup(name).is_none() {
                let created = Reference::Parameter(scope.locals.len());
                scope.locals.insert(name.clone(), created);
            }
        }
    }
    statement.targets(&mut |variable| {
        scope.resolve(variable, sink);
        for subscript in &mut variable.subscripts {
            subscript.variables(&mut |inner| scope.resolve(inner, sink));
        }
    });
    scope.read(statement, sink);
    scope.locals.len()
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

/// Plain variables handed to a subprogram, which may give them a value.
fn passed(statement: &mut Statement, visit: &mut dyn FnMut(&mut Variable)) {
    statement.each(&mut |statement| {
        let Statement::Call(_, arguments) = statement else {
            return;
        };
        for argument in arguments {
            if let Node::Variable(variable) = &mut argument.node {
                visit(variable);
            }
        }
    });
}

struct Scope<'a> {
    locals: BTreeMap<String, Reference>,
    /// Names of `DIM` that could not be made.
    failed_dims: BTreeSet<String>,
    suppressed: &'a BTreeSet<String>,
    symbols: &'a mut Symbols,
}

impl Scope<'_> {
    fn local(&mut self, slot: Slot) {
        let name = slot.name.clone();
        let reference = self.symbols.add(slot);
        self.locals.insert(name, reference);
    }

    /// Makes a local variable of a name that is assigned and not known yet.
    fn define(&mut self, variable: &mut Variable) {
        if self.failed_dims.contains(&variable.name.text) {
            return;
        }
        if variable.subscripts.is_empty() && self.lookup(&variable.name.text).is_none() {
            self.local(Slot::plain(&variable.name.text, Owner::Local));
        }
    }

    /// Makes a copy of a datum that is assigned.
    fn copy(&mut self, variable: &Variable) {
        let name = variable.name.text.as_str();
        if self.locals.contains_key(name) {
            return;
        }
        let shared = self.symbols.shared.get(name);
        let datum = shared.and_then(|at| self.symbols.slots.get(*at));
        if let Some(datum) = datum.filter(|slot| slot.owner == Owner::Data) {
            self.local(Slot {
                owner: Owner::Local,
                is_work: false,
                ..datum.clone()
            });
        }
    }

    fn lookup(&self, name: &str) -> Option<Reference> {
        let shared = || self.symbols.reference(*self.symbols.shared.get(name)?);
        self.locals.get(name).copied().or_else(shared)
    }

    /// Resolves what a statement reads, and looks for what it restores.
    fn read(&self, statement: &mut Statement, sink: &mut Sink) {
        let mut restored = |name: &Name| {
            if !self.symbols.shared.contains_key(&name.text) && !self.suppressed.contains(&name.text) {
                let message = format!("expected a name of GLOBAL or DATA, found {}", name.text);
                let problem = Problem::new("E0201", name.span, message);
                sink.error(problem.help("RESTORE writes into the file what stands in GLOBAL and DATA"));
            }
        };
        statement.each(&mut |statement| {
            if let Statement::Simple(Simple::Restore(names)) = statement {
                names.iter().for_each(&mut restored);
            }
        });
        let positions = positions(statement);
        statement.expressions(&mut |e, _| {
            e.variables(&mut |variable| {
                if self.is_missing(variable) && positions.contains(&variable.name.text) {
                    sink.error(no_point(variable));
                } else {
                    self.resolve(variable, sink);
                }
            });
        });
    }

    /// Whether nothing gives this plain variable a value.
    fn is_missing(&self, variable: &Variable) -> bool {
        let name = &variable.name.text;
        let known =
            self.lookup(name).is_some() || self.suppressed.contains(name) || self.failed_dims.contains(name);
        variable.subscripts.is_empty() && !known
    }

    fn resolve(&self, variable: &mut Variable, sink: &mut Sink) {
        let name = &variable.name;
        let Some(reference) = self.lookup(&name.text) else {
            if !self.suppressed.contains(&name.text) && !self.failed_dims.contains(&name.text) {
                sink.error(self.undefined(variable));
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
        match bounds {
            Some(_) if found == 0 => {
                let message = format!("{} is an array: a subscript is missing", name.text);
                sink.error(Problem::new("E0212", name.span, message));
            }
            Some(bounds) if bounds.len() != found => {
                let message = format!("{} has {} subscripts, found {found}", name.text, bounds.len());
                sink.error(Problem::new("E0213", name.span, message));
            }
            None if found > 0 => {
                sink.error(Problem::new(
                    "E0212",
                    name.span,
                    format!("{} is not an array", name.text),
                ));
            }
            _ => {}
        }
    }

    fn undefined(&self, variable: &Variable) -> Problem {
        let name = &variable.name;
        if !variable.subscripts.is_empty() {
            let problem = Problem::new(
                "E0201",
                name.span,
                format!("{} is no array and no function", name.text),
            );
            return problem.help(format!("declare an array with DIM {}(n)", name.text));
        }
        Problem::new(
            "E0201",
            name.span,
            format!("{} is never given a value", name.text),
        )
        .help("assign it, or declare it in GLOBAL or DATA")
    }
}

/// A point of which neither the file nor the table of taught points says where it is.
fn no_point(variable: &Variable) -> Problem {
    let name = &variable.name;
    let message = format!("no value for {}: add DATA, or give --points", name.text);
    Problem::new("E0201", name.span, message)
}
