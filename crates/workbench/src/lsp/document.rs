//! An open file, or one of the disk beside it, and what is known of its text.

use super::project::{Projects, Table};
use super::text::Text;
use scol_mini::editor::{Context, Index, Symbol, SymbolKind, Use};
use scol_mini::{Arm, Diagnostic};
use std::cell::OnceCell;
use std::path::PathBuf;
use std::rc::Rc;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Dialect};
use ts3100_recording::uri;

/// A text with the settings it is read by. What is known of it is found out when it is asked for.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) uri: String,
    pub(super) text: Text,
    pub(super) version: i64,
    pub(super) table: Rc<Table>,
    pub(super) model: Rc<ArmModel>,
    index: OnceCell<Index>,
    diagnostics: OnceCell<Vec<Diagnostic>>,
}

impl Document {
    pub(super) fn new<P>(
        uri: &str,
        text: Text,
        version: i64,
        projects: &Projects<P>,
        table: Rc<Table>,
    ) -> Document {
        Document {
            uri: uri.to_owned(),
            text,
            version,
            table,
            model: projects.model(),
            index: OnceCell::new(),
            diagnostics: OnceCell::new(),
        }
    }

    /// The file with another text.
    pub(super) fn with_text(&self, text: Text, version: i64) -> Document {
        Document {
            uri: self.uri.clone(),
            text,
            version,
            table: Rc::clone(&self.table),
            model: Rc::clone(&self.model),
            index: OnceCell::new(),
            diagnostics: OnceCell::new(),
        }
    }

    /// The file with other settings; `None` if it has them.
    pub(super) fn with_settings(&self, model: Rc<ArmModel>, table: Rc<Table>) -> Option<Document> {
        let differs = table != self.table || !Rc::ptr_eq(&model, &self.model);
        differs.then(|| Document {
            model,
            table,
            ..self.with_text(self.text.clone(), self.version)
        })
    }

    /// Its file, unless it has none.
    pub(super) fn path(&self) -> Option<PathBuf> {
        uri::to_path(&self.uri)
    }

    pub(super) fn source(&self) -> &str {
        self.text.as_str()
    }

    pub(super) fn arm(&self) -> Arm {
        self.model.language()
    }

    pub(super) fn index(&self) -> &Index {
        self.index
            .get_or_init(|| Index::new(self.source(), self.arm(), &self.table.points))
    }

    /// Errors and warnings, as `ts3100 check` has them. Those about unknown points say why the table is not used.
    pub(super) fn diagnostics(&self) -> &[Diagnostic] {
        self.diagnostics.get_or_init(|| {
            let config = Config {
                model: (*self.model).clone(),
                points: self.table.points.clone(),
                ..Config::new(Dialect::default())
            };
            let mut diagnostics = config.check(self.source()).diagnostics;
            let Some(refusal) = self.table.refusal() else {
                return diagnostics;
            };
            for diagnostic in diagnostics.iter_mut().filter(|found| found.misses_point()) {
                diagnostic.help = Some(match diagnostic.help.take() {
                    Some(help) => format!("{refusal}. Otherwise: {help}"),
                    None => refusal.clone(),
                });
            }
            diagnostics
        })
    }

    /// Text of a place.
    pub(super) fn text_of(&self, span: scol_mini::Span) -> &str {
        self.source().get(span.start..span.end).unwrap_or_default()
    }

    /// The symbol at a byte, with its place there.
    pub(super) fn symbol_at(&self, byte: usize) -> Option<(&Symbol, &Use)> {
        let found = self.index().use_at(byte)?;
        Some((self.index().symbols().get(found.symbol)?, found))
    }

    /// The line that declares a symbol, without blanks around it, its comment included.
    pub(super) fn declaration(&self, symbol: &Symbol) -> Option<&str> {
        let (_, line) = self.index().line_of(symbol.declared?.start);
        Some(self.text_of(line).trim())
    }

    /// Position of the symbol of a taught point, if the program uses it.
    pub(super) fn taught(&self, name: &str) -> Option<usize> {
        let is_meant = |symbol: &Symbol| symbol.kind == SymbolKind::Taught && symbol.name == name;
        self.index().symbols().iter().position(is_meant)
    }

    /// What can follow at a byte, and the call that it is in.
    pub(super) fn context(&self, byte: usize) -> Context {
        Context::at(self.source(), byte, self.index(), self.arm())
    }

    /// As [`Index::datum`].
    pub(super) fn datum(&self, symbol: &Symbol) -> Option<(String, &str)> {
        self.index().datum(self.source(), symbol)
    }
}
