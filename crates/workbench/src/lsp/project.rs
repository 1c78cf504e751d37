//! The disk around the open files: the programs of a folder, and the table of taught points that they share.

use super::document::Document;
use super::text::{Text, Units};
use crate::rpc::ResponseError;
use scol_mini::{PointsError, TaughtPoint, parse_points};
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use ts3100_controller::model::ArmModel;
use ts3100_recording::uri;

/// The table of points of the programs in its folder.
pub const TABLE: &str = "points.csv";
const SETTINGS: [&str; 2] = ["model", "points"];
/// Most programs of the disk that are looked at in an answer.
const MAX_PROGRAMS: usize = 1_000;

/// The world around the server.
pub trait Project {
    /// The text of a file.
    ///
    /// # Errors
    /// It cannot be read, or is not text.
    fn read(&self, path: &Path) -> io::Result<String>;
    /// The files in and below a folder that end in `.scol`, and those in the folder itself that have no ending, as on the
    /// controller: not all of them are programs.
    fn programs(&self, folder: &Path) -> Vec<PathBuf>;
    /// The arm of a value of `--model`.
    ///
    /// # Errors
    /// The reason why there is none.
    fn model(&self, name: &str) -> Result<ArmModel, SettingsError>;
    /// The address of a page that explains a code; `None` if there is none.
    fn explanation(&self, code: &str) -> Option<String>;
}

/// Error in the settings of the editor.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    #[error("{name}: expected a string, found {found}")]
    NoText { name: &'static str, found: Value },
    #[error("model: {0}")]
    Model(String),
    #[error("unknown setting {0:?}; the settings are model and points")]
    Unknown(String),
}

impl From<SettingsError> for ResponseError {
    fn from(error: SettingsError) -> ResponseError {
        ResponseError::invalid_params(error.to_string())
    }
}

/// The settings of the command line.
#[derive(Debug, Clone)]
pub struct Settings {
    pub model: ArmModel,
    /// Table of points of all programs; without one the `points.csv` beside each.
    pub points: Option<PathBuf>,
}

/// Points that are taught on the controller.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Table {
    /// `None`: the program has no table.
    pub(super) path: Option<PathBuf>,
    pub(super) text: String,
    pub(super) points: Vec<TaughtPoint>,
    pub(super) error: Option<PointsError>,
    /// Why it could not be read.
    pub(super) unreadable: Option<String>,
}

impl Table {
    /// Why no point of it is known, with the place in it.
    pub(super) fn refusal(&self) -> Option<String> {
        let name = self.path.as_ref()?.file_name()?.to_string_lossy();
        let error = self.error.as_ref().map(|error| {
            let PointsError {
                line,
                column,
                expected,
                found,
            } = error;
            format!("correct {name}, of which no point is used: line {line}, column {column}: expected {expected}, found {found}")
        });
        error.or_else(|| self.unreadable.clone())
    }

    /// Place of the name of a point in its text.
    pub(super) fn place_of(&self, name: &str) -> Option<std::ops::Range<usize>> {
        let mut at = 0;
        for line in self.text.split_inclusive('\n') {
            let field = line.split(',').next().unwrap_or_default();
            let blanks = field.len() - field.trim_start_matches([' ', '\u{FEFF}', '"']).len();
            let word = field.trim_matches([' ', '\u{FEFF}', '"', '\r', '\n']);
            if word.eq_ignore_ascii_case(name) {
                return Some(at + blanks..at + blanks + word.len());
            }
            at += line.len();
        }
        None
    }
}

/// The settings in force and the tables that have been read.
#[derive(Debug)]
pub(super) struct Projects<P> {
    project: P,
    settings: Settings,
    model: Rc<ArmModel>,
    points: Option<PathBuf>,
    folders: Vec<PathBuf>,
    tables: RefCell<BTreeMap<PathBuf, Rc<Table>>>,
}

impl<P> Projects<P> {
    pub(super) fn model(&self) -> Rc<ArmModel> {
        Rc::clone(&self.model)
    }
}

impl<P: Project> Projects<P> {
    pub(super) fn new(project: P, settings: Settings) -> Projects<P> {
        Projects {
            project,
            model: Rc::new(settings.model.clone()),
            points: settings.points.clone(),
            settings,
            folders: Vec::new(),
            tables: RefCell::default(),
        }
    }

    #[cfg(test)]
    pub(super) fn project_mut(&mut self) -> &mut P {
        &mut self.project
    }

    /// Takes `model` and `points` of the editor; each that is missing is as the command line has it.
    pub(super) fn configure(&mut self, options: &Value) -> Result<(), SettingsError> {
        let names = options.as_object().into_iter().flatten().map(|(name, _)| name);
        if let Some(name) = names.into_iter().find(|name| !SETTINGS.contains(&name.as_str())) {
            return Err(SettingsError::Unknown(name.clone()));
        }
        let text = |name: &'static str| match options.get(name) {
            None | Some(Value::Null) => Ok(None),
            Some(Value::String(text)) if text.is_empty() => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.as_str())),
            Some(found) => Err(SettingsError::NoText {
                name,
                found: found.clone(),
            }),
        };
        let model = match text("model")? {
            None => self.settings.model.clone(),
            Some(name) => self.project.model(name)?,
        };
        if model != *self.model {
            self.model = Rc::new(model);
        }
        self.points = text("points")?
            .map(PathBuf::from)
            .or_else(|| self.settings.points.clone());
        self.forget_tables();
        Ok(())
    }

    pub(super) fn change_folders(&mut self, added: &[String], removed: &[String]) {
        let paths = |uris: &[String]| {
            uris.iter()
                .filter_map(|uri| uri::to_path(uri))
                .collect::<Vec<_>>()
        };
        let (added, removed) = (paths(added), paths(removed));
        self.folders
            .retain(|folder| !removed.contains(folder) && !added.contains(folder));
        self.folders.extend(added);
    }

    pub(super) fn explanation(&self, code: &str) -> Option<String> {
        self.project.explanation(code)
    }

    pub(super) fn forget_tables(&self) {
        self.tables.borrow_mut().clear();
    }

    /// Whether a table that has been read is another one now: not every editor tells of files that change.
    pub(super) fn tables_differ(&self) -> bool {
        let tables = self.tables.borrow();
        tables.iter().any(|(path, table)| match self.project.read(path) {
            Ok(text) => table.path.is_none() || text != table.text,
            Err(_) => table.path.is_some(),
        })
    }

    /// The table of points of a program.
    pub(super) fn table_of(&self, program: &str) -> Rc<Table> {
        let path = self.points.as_ref().map(|points| match self.folders.first() {
            Some(folder) => folder.join(points),
            None => points.clone(),
        });
        let beside = || Some(uri::to_path(program)?.parent()?.join(TABLE));
        let Some(path) = path.or_else(beside) else {
            return Rc::default();
        };
        let mut tables = self.tables.borrow_mut();
        let table = tables
            .entry(path)
            .or_insert_with_key(|path| Rc::new(self.read_table(path)));
        Rc::clone(table)
    }

    fn read_table(&self, path: &Path) -> Table {
        let text = match self.project.read(path) {
            Ok(text) => text,
            // A program needs no table, unless one is named.
            Err(error) if error.kind() == io::ErrorKind::NotFound && self.points.is_none() => {
                return Table::default();
            }
            Err(error) => {
                return Table {
                    unreadable: Some(format!("cannot read {}: {error}", path.display())),
                    ..Table::default()
                };
            }
        };
        let (points, error) = match parse_points(&text, self.model.language()) {
            Ok(points) => (points, None),
            Err(error) => (Vec::new(), Some(error)),
        };
        Table {
            path: Some(path.to_path_buf()),
            text,
            points,
            error,
            unreadable: None,
        }
    }

    /// All programs of the folders of the editor, as they are there if they are open.
    pub(super) fn programs(&self, open: &BTreeMap<String, Rc<Document>>, units: Units) -> Vec<Rc<Document>> {
        self.read_programs(&self.folders, open, units)
    }

    /// The other programs that share the table of points of one.
    pub(super) fn sharing_table(
        &self,
        of: &Document,
        open: &BTreeMap<String, Rc<Document>>,
        units: Units,
    ) -> Vec<Rc<Document>> {
        let folder = of.path().and_then(|path| Some(path.parent()?.to_path_buf()));
        let folders = match self.points {
            Some(_) => self.folders.clone(),
            None => folder.into_iter().collect(),
        };
        let mut programs = self.read_programs(&folders, open, units);
        programs.retain(|other| other.table.path.is_some() && other.table == of.table && other.uri != of.uri);
        programs
    }

    fn read_programs(
        &self,
        folders: &[PathBuf],
        open: &BTreeMap<String, Rc<Document>>,
        units: Units,
    ) -> Vec<Rc<Document>> {
        let mut paths: Vec<PathBuf> = folders
            .iter()
            .flat_map(|folder| self.project.programs(folder))
            .collect();
        paths.sort();
        paths.dedup();
        let mut found: Vec<Rc<Document>> = open.values().cloned().collect();
        for path in paths.into_iter().take(MAX_PROGRAMS) {
            if found
                .iter()
                .any(|document| document.path().as_deref() == Some(&path))
            {
                continue;
            }
            let text = self.project.read(&path);
            if let Ok(text) = text
                && (path.extension().is_some() || is_program(&text))
            {
                let uri = uri::of_file(&path);
                let table = self.table_of(&uri);
                found.push(Rc::new(Document::new(
                    &uri,
                    Text::new(text, units),
                    0,
                    self,
                    table,
                )));
            }
        }
        found
    }
}

/// Whether a text begins as a program does: with a comment or the heading of a block.
fn is_program(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('\''));
    let word = first.and_then(|line| line.split(' ').next()).unwrap_or_default();
    ["PROGRAM", "GLOBAL", "DATA", "REMARK"]
        .iter()
        .any(|heading| word.eq_ignore_ascii_case(heading))
}
