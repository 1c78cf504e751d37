//! What is shown of a program that has stopped: scopes, variables, elements of arrays, parts of positions.

use super::debuggee::{Debuggee, Refusal, Scene};
use scol_mini::{Arm, ValueKind};
use ts3100_controller::inspection::readable;
use ts3100_controller::queries::VariableView;
use ts3100_proto::escape::Escaped;

/// Elements of one dimension that are shown where the editor does not say how many it wants.
const MAX_SHOWN: usize = 100;

/// Something that can be opened.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Container {
    /// Variables and parameters of a call.
    Locals {
        task: u16,
        call: usize,
    },
    /// Variables of GLOBAL and DATA but for positions, as a call sees them.
    Globals {
        task: u16,
        call: usize,
    },
    /// The positions of GLOBAL and DATA.
    Points {
        task: u16,
        call: usize,
    },
    Lines {
        task: u16,
        call: usize,
    },
    /// The inputs that are on, and those that the program reads.
    Inputs {
        task: u16,
        call: usize,
    },
    /// The outputs that are on.
    Outputs,
    Channels,
    /// Elements of an array whose first subscripts are known.
    Array {
        task: u16,
        call: usize,
        name: String,
        known: Vec<u32>,
        left: Vec<u32>,
    },
    /// Parts of a position.
    Parts {
        task: u16,
        call: usize,
        name: String,
        numbers: Vec<String>,
    },
}

/// A row of what is opened.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shown {
    pub name: String,
    pub value: String,
    pub kind: Option<&'static str>,
    /// What has this value in a program.
    pub expression: Option<String>,
    pub children: Option<Container>,
    pub can_be_set: bool,
}

impl Shown {
    /// A variable as a call sees it.
    pub fn of(view: VariableView, task: u16, call: usize) -> Shown {
        let value = shown_value(&view);
        let numbers = numbers(&view);
        let name = view.name.clone();
        let children = if !view.bounds.is_empty() {
            Some(Container::Array {
                task,
                call,
                name,
                known: Vec::new(),
                left: view.bounds.clone(),
            })
        } else if view.kind == Some(ValueKind::Position) && !numbers.is_empty() {
            Some(Container::Parts {
                task,
                call,
                name,
                numbers,
            })
        } else {
            None
        };
        Shown {
            kind: view.kind.map(ValueKind::word),
            expression: Some(view.name.clone()),
            name: view.name,
            value,
            can_be_set: children.is_none() || view.bounds.is_empty(),
            children,
        }
    }

    fn fixed(name: impl Into<String>, value: impl Into<String>) -> Shown {
        Shown {
            name: name.into(),
            value: value.into(),
            kind: None,
            expression: None,
            children: None,
            can_be_set: false,
        }
    }
}

/// A value as a program would write it.
fn shown_value(view: &VariableView) -> String {
    if !view.bounds.is_empty() {
        let bounds: Vec<String> = view.bounds.iter().map(|bound| format!("0 to {bound}")).collect();
        return format!("array ({})", bounds.join(", "));
    }
    if view.value.is_none() {
        return "no value yet".to_owned();
    }
    let numbers = numbers(view).join(", ");
    match view.kind.and_then(function) {
        Some(function) => format!("{function}({numbers})"),
        None => numbers,
    }
}

/// The numbers of a value.
fn numbers(view: &VariableView) -> Vec<String> {
    let numbers = view.value.iter().flatten();
    let shown = numbers.map(|number| match view.kind {
        Some(kind) => readable(*number, kind),
        None => number.to_string(),
    });
    shown.collect()
}

/// The function that makes a value of this kind of numbers.
fn function(kind: ValueKind) -> Option<&'static str> {
    match kind {
        ValueKind::Position => Some("POINT"),
        ValueKind::Coordinate => Some("TRANS"),
        ValueKind::Load => Some("PAYLOAD"),
        ValueKind::Integer | ValueKind::Real => None,
    }
}

/// The assignment of what somebody has typed as a value: `(1, 2, 3)` is enough for a position.
pub(super) fn assignment(target: &str, kind: Option<ValueKind>, value: &str) -> String {
    let value = value.trim();
    match kind.and_then(function).filter(|_| value.starts_with('(')) {
        Some(function) => format!("{target} = {function}{value}"),
        None => format!("{target} = {value}"),
    }
}

impl Container {
    /// How many elements it has.
    pub fn indexed(&self) -> usize {
        if let Container::Array { left, .. } = self {
            return left.first().map_or(0, |bound| *bound as usize + 1);
        }
        0
    }

    /// Its rows: of an array, this many from `first` on.
    pub fn shown(
        &self,
        scene: &Scene,
        debuggee: &dyn Debuggee,
        first: usize,
        most: Option<usize>,
    ) -> Vec<Shown> {
        let shared = |task: u16, call: usize, points: bool| {
            let shared = scene.variables.iter().filter(|view| !view.name.contains('.'));
            let shared = shared.filter(|view| (view.kind == Some(ValueKind::Position)) == points);
            shared.map(|view| Shown::of(view.clone(), task, call)).collect()
        };
        match self {
            Container::Locals { task, call } => {
                let stack = scene.tasks.iter().find(|stack| stack.id == *task);
                let view = stack.and_then(|stack| stack.calls.get(*call));
                let locals = view.map(|view| view.locals.as_slice()).unwrap_or_default();
                locals
                    .iter()
                    .map(|view| Shown::of(view.clone(), *task, *call))
                    .collect()
            }
            Container::Globals { task, call } => shared(*task, *call, false),
            Container::Points { task, call } => shared(*task, *call, true),
            Container::Lines { task, call } => {
                let (task, call) = (*task, *call);
                let lines = [
                    ("Inputs", &scene.inputs, Container::Inputs { task, call }),
                    ("Outputs", &scene.outputs, Container::Outputs),
                ];
                lines
                    .map(|(name, on, children)| {
                        let numbers: Vec<String> = on.iter().map(ToString::to_string).collect();
                        let value = match on.is_empty() {
                            true => "none on".to_owned(),
                            false => format!("on: {}", numbers.join(", ")),
                        };
                        let children = Some(children);
                        Shown {
                            children,
                            ..Shown::fixed(name, value)
                        }
                    })
                    .into()
            }
            Container::Inputs { .. } => {
                let mut lines = scol_mini::input_lines(&debuggee.source().text);
                lines.extend(&scene.inputs);
                let rows = lines.into_iter().map(|line| {
                    let name = format!("DIN({line})");
                    Shown {
                        expression: Some(name.clone()),
                        can_be_set: true,
                        ..Shown::fixed(name, u8::from(scene.inputs.contains(&line)).to_string())
                    }
                });
                rows.collect()
            }
            Container::Outputs => {
                let rows = scene.outputs.iter();
                rows.map(|line| Shown::fixed(format!("DOUT({line})"), "1"))
                    .collect()
            }
            Container::Channels => {
                let rows = scene.channels.iter().map(|(name, bytes)| {
                    let value = match bytes.is_empty() {
                        true => "empty".to_owned(),
                        false => Escaped::for_reading(bytes).to_string(),
                    };
                    Shown::fixed(name, value)
                });
                rows.collect()
            }
            Container::Array {
                task,
                call,
                name,
                known,
                left,
            } => {
                let Some((bound, left)) = left.split_first() else {
                    return Vec::new();
                };
                let wanted = (0..=*bound).skip(first).take(most.unwrap_or(MAX_SHOWN));
                wanted
                    .map(|at| {
                        element(
                            debuggee,
                            (*task, *call),
                            name,
                            &[known.as_slice(), &[at]].concat(),
                            left,
                        )
                    })
                    .collect()
            }
            Container::Parts { name, numbers, .. } => parts(numbers)
                .map(|(part, number)| Shown {
                    expression: Some(format!("{name}.{part}")),
                    can_be_set: true,
                    ..Shown::fixed(part, number)
                })
                .collect(),
        }
    }

    /// What a row of it is in an assignment: the call that sees it, its name there, its kind.
    pub fn target(
        &self,
        scene: &Scene,
        row: &str,
    ) -> Result<(u16, usize, String, Option<ValueKind>), Refusal> {
        let kind = |views: &[VariableView]| {
            views
                .iter()
                .find(|view| view.name == row)
                .and_then(|view| view.kind)
        };
        match self {
            Container::Locals { task, call } => {
                let stack = scene.tasks.iter().find(|stack| stack.id == *task);
                let view = stack.and_then(|stack| stack.calls.get(*call));
                let kind = view.and_then(|view| kind(&view.locals));
                Ok((*task, *call, row.to_owned(), kind))
            }
            Container::Globals { task, call } | Container::Points { task, call } => {
                Ok((*task, *call, row.to_owned(), kind(&scene.variables)))
            }
            Container::Array { task, call, .. } | Container::Inputs { task, call } => {
                Ok((*task, *call, row.to_owned(), None))
            }
            Container::Parts { task, call, name, .. } => Ok((*task, *call, format!("{name}.{row}"), None)),
            Container::Lines { .. } | Container::Outputs | Container::Channels => {
                Err(Refusal::new(format!("{row} is neither a variable nor an input")))
            }
        }
    }
}

/// An element of an array, or those that begin with these subscripts.
fn element(
    debuggee: &dyn Debuggee,
    (task, call): (u16, usize),
    name: &str,
    subscripts: &[u32],
    left: &[u32],
) -> Shown {
    let listed: Vec<String> = subscripts.iter().map(ToString::to_string).collect();
    let listed = listed.join(",");
    if !left.is_empty() {
        return Shown {
            children: Some(Container::Array {
                task,
                call,
                name: name.to_owned(),
                known: subscripts.to_vec(),
                left: left.to_vec(),
            }),
            ..Shown::fixed(format!("{name}({listed},...)"), "")
        };
    }
    let expression = format!("{name}({listed})");
    match debuggee.evaluate(task, call, &expression) {
        Ok(view) => Shown::of(view, task, call),
        Err(_) => Shown {
            expression: Some(expression.clone()),
            can_be_set: true,
            ..Shown::fixed(expression, "no value yet")
        },
    }
}

/// The coordinates among the numbers of a position, with their letters; the configuration follows them.
fn parts(numbers: &[String]) -> impl Iterator<Item = (char, String)> {
    let has_coordinates = |arm: &Arm| arm.coordinates().len() + 1 == numbers.len();
    let arm = [Arm::Scara, Arm::SixAxis].into_iter().find(has_coordinates);
    let letters = arm.map_or("", Arm::coordinates).chars();
    letters.zip(numbers.to_vec())
}
