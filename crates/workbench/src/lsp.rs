//! The language server of SCOL (Language Server Protocol 3.17) as a value: messages of an editor in, messages to it out.
//!
//! [`Server`] knows the messages, their order and the open files. `document` is an open file and what is known of it;
//! [`project`] is the disk. The answers are made in `diagnose`, `complete`, `describe`, `names` and `layout`.

mod complete;
mod describe;
mod diagnose;
mod document;
mod layout;
mod names;
pub mod project;
mod text;

#[cfg(test)]
mod tests;

pub use project::{Project, Settings, SettingsError};

use crate::rpc::{self, Message, RequestId, ResponseError};
use document::Document;
use project::Projects;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use text::{Position, Span, Text, Units};

/// Most files that are open at a time.
pub const MAX_OPEN: usize = 1_000;

/// Questions about a place of a file.
const AT_PLACES: [&str; 8] = [
    "hover",
    "signatureHelp",
    "completion",
    "definition",
    "references",
    "documentHighlight",
    "prepareRename",
    "rename",
];

/// Progress of the conversation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing but `initialize` is answered.
    Begun,
    Running,
    /// Nothing but `exit` is expected.
    ShutDown,
    Ended {
        is_orderly: bool,
    },
}

/// Abilities of the editor.
#[derive(Debug, Clone, Copy, Default)]
struct Client {
    units: Units,
    takes_snippets: bool,
    registers_watchers: bool,
}

/// A language server.
#[derive(Debug)]
pub struct Server<P> {
    projects: Projects<P>,
    phase: Phase,
    client: Client,
    documents: BTreeMap<String, Rc<Document>>,
    /// Open files whose diagnostics have not been sent since they changed.
    changed: BTreeSet<String>,
    /// Tables of points with a diagnostic.
    marked_tables: BTreeSet<String>,
    /// Messages about tables that cannot be read, each of which is shown once.
    reported: BTreeSet<String>,
    /// The process of the editor, if it has named one.
    editor: Option<u32>,
}

/// Place in an open file.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct AtPosition {
    text_document: TextDocument,
    position: Position,
}

/// Part of an open file.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct AtRange {
    text_document: TextDocument,
    range: Span,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct OfDocument {
    text_document: TextDocument,
}

/// A file; its text where it is opened, its version there and where it changes.
#[derive(Debug, Deserialize)]
struct TextDocument {
    uri: String,
    #[serde(default)]
    version: i64,
    #[serde(default)]
    text: String,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Changed {
    text_document: TextDocument,
    content_changes: Vec<Change>,
}

/// A change of a text: a part, or all of it.
#[derive(Debug, Deserialize)]
struct Change {
    range: Option<Span>,
    text: String,
}

impl<P: Project> Server<P> {
    pub fn new(project: P, settings: Settings) -> Server<P> {
        Server {
            projects: Projects::new(project, settings),
            phase: Phase::Begun,
            client: Client::default(),
            documents: BTreeMap::new(),
            changed: BTreeSet::new(),
            marked_tables: BTreeSet::new(),
            reported: BTreeSet::new(),
            editor: None,
        }
    }

    /// The process of the editor, by the number in `initialize`: the server ends with it.
    pub fn editor(&self) -> Option<u32> {
        self.editor
    }

    /// Whether the conversation has ended, and if so whether the editor has asked for it first.
    pub fn ended(&self) -> Option<bool> {
        match self.phase {
            Phase::Ended { is_orderly } => Some(is_orderly),
            Phase::Begun | Phase::Running | Phase::ShutDown => None,
        }
    }

    /// Takes all messages that have arrived and returns those to send. Requests that a later message of the batch cancels are
    /// not carried out, and diagnostics are made once for all changes.
    pub fn receive<'m>(&mut self, batch: impl IntoIterator<Item = &'m [u8]>) -> Vec<Value> {
        let batch: Vec<Message> = batch.into_iter().map(Message::parse).collect();
        let cancelled: Vec<(usize, RequestId)> = batch
            .iter()
            .enumerate()
            .filter_map(|(at, message)| Some((at, message.cancels()?)))
            .collect();
        let mut out = Vec::new();
        for (at, message) in batch.into_iter().enumerate() {
            if self.ended().is_some() {
                break;
            }
            match message {
                Message::Request { id, method, params } => {
                    let is_cancelled = cancelled.iter().any(|(later, other)| *later > at && *other == id);
                    let result = match is_cancelled {
                        true => Err(ResponseError::cancelled()),
                        false => self.answer(&method, params),
                    };
                    out.push(rpc::response(&id, result));
                    if method == "initialize" && self.phase == Phase::Running {
                        out.extend(self.watchers());
                    }
                }
                Message::Notification { method, params } => self.notice(&method, params, &mut out),
                // We ask for nothing whose answer matters.
                Message::Response => {}
                Message::Invalid(id, error) => out.push(rpc::response(&id, Err(error))),
            }
        }
        if self.phase == Phase::Running {
            if !self.changed.is_empty() && self.projects.tables_differ() {
                self.read_again();
            }
            self.send_diagnostics(&mut out);
        }
        out
    }

    fn answer(&mut self, method: &str, params: Value) -> Result<Value, ResponseError> {
        match (self.phase, method) {
            (Phase::Begun, "initialize") => self.initialize(&rpc::Params(params)),
            (Phase::Begun, _) => Err(ResponseError::not_initialized()),
            (Phase::Running, "shutdown") => {
                self.phase = Phase::ShutDown;
                Ok(Value::Null)
            }
            (Phase::Running, "initialize") => Err(ResponseError::invalid_request(
                "the server is initialized already",
            )),
            (Phase::Running, _) => self.serve(method, params),
            (Phase::ShutDown | Phase::Ended { .. }, _) => {
                Err(ResponseError::invalid_request("the server is shut down"))
            }
        }
    }

    fn serve(&self, method: &str, params: Value) -> Result<Value, ResponseError> {
        let params = rpc::Params(params);
        let of_document: fn(&Document) -> Value = match method {
            "completionItem/resolve" => return Ok(complete::resolved(params.0)),
            "workspace/symbol" => {
                let all = self.projects.programs(&self.documents, self.client.units);
                return Ok(names::workspace_symbols(&all, params.text("/query")));
            }
            "textDocument/codeAction" | "textDocument/inlayHint" => {
                let AtRange { text_document, range } = params.parse()?;
                let document = self.open(&text_document.uri)?;
                return Ok(match method {
                    "textDocument/codeAction" => {
                        let only = params.0.pointer("/context/only").and_then(Value::as_array);
                        diagnose::actions(document, range, only.map(Vec::as_slice))
                    }
                    _ => describe::hints(document, document.text.bytes(range)),
                });
            }
            "textDocument/documentSymbol" => names::document_symbols,
            "textDocument/formatting" => layout::formatting,
            "textDocument/foldingRange" => layout::folding,
            "textDocument/semanticTokens/full" => layout::tokens,
            _ => return self.serve_place(method, &params),
        };
        self.open(&params.parse::<OfDocument>()?.text_document.uri)
            .map(|document| of_document(document))
    }

    /// Answers what is asked about a place of a file.
    fn serve_place(&self, method: &str, params: &rpc::Params) -> Result<Value, ResponseError> {
        let Some(method) = method
            .strip_prefix("textDocument/")
            .filter(|method| AT_PLACES.contains(method))
        else {
            return Err(ResponseError::unknown_method(method));
        };
        let AtPosition {
            text_document,
            position,
        } = params.parse()?;
        let document = self.open(&text_document.uri)?;
        let byte = document.text.byte(position);
        let others = || {
            self.projects
                .sharing_table(document, &self.documents, self.client.units)
        };
        Ok(match method {
            "hover" => describe::hover(document, byte),
            "signatureHelp" => describe::signature_help(document, byte),
            "completion" => complete::items(
                document,
                byte,
                complete::trigger(&params.0),
                self.client.takes_snippets,
            ),
            "definition" => names::definition(document, byte),
            "references" => {
                let with_declaration = params.is_set("/context/includeDeclaration");
                names::references(document, byte, with_declaration, others)
            }
            "documentHighlight" => names::highlights(document, byte),
            "prepareRename" => names::prepare_rename(document, byte)?,
            _ => names::rename(document, byte, params.text("/newName"), others)?,
        })
    }

    fn initialize(&mut self, params: &rpc::Params) -> Result<Value, ResponseError> {
        let encodings = params
            .0
            .pointer("/capabilities/general/positionEncodings")
            .and_then(Value::as_array);
        // A column is then a byte, which spares the conversion.
        let is_utf8 = encodings.is_some_and(|encodings| encodings.iter().any(|name| name == "utf-8"));
        self.client = Client {
            units: if is_utf8 { Units::Utf8 } else { Units::Utf16 },
            takes_snippets: params
                .is_set("/capabilities/textDocument/completion/completionItem/snippetSupport"),
            registers_watchers: params
                .is_set("/capabilities/workspace/didChangeWatchedFiles/dynamicRegistration"),
        };
        self.projects
            .configure(params.0.get("initializationOptions").unwrap_or(&Value::Null))?;
        let process = params.0.get("processId").and_then(Value::as_u64);
        self.editor = process.and_then(|process| u32::try_from(process).ok());
        let mut folders = params.uris("/workspaceFolders");
        if folders.is_empty() {
            folders.extend(params.0.get("rootUri").and_then(Value::as_str).map(str::to_owned));
        }
        self.projects.change_folders(&folders, &[]);
        self.phase = Phase::Running;
        Ok(json!({
            "serverInfo": { "name": "ts3100", "version": env!("CARGO_PKG_VERSION") },
            "capabilities": {
                "positionEncoding": self.client.units.name(),
                "textDocumentSync": { "openClose": true, "change": 2, "save": true },
                "hoverProvider": true,
                "completionProvider": { "resolveProvider": true, "triggerCharacters": [" ", "\"", "(", ",", "."] },
                "signatureHelpProvider": { "triggerCharacters": ["(", ","], "retriggerCharacters": [" "] },
                "definitionProvider": true,
                "referencesProvider": true,
                "documentHighlightProvider": true,
                "documentSymbolProvider": true,
                "workspaceSymbolProvider": true,
                "codeActionProvider": { "codeActionKinds": [diagnose::QUICK_FIX, diagnose::FIX_ALL] },
                "documentFormattingProvider": true,
                "renameProvider": { "prepareProvider": true },
                "foldingRangeProvider": true,
                "semanticTokensProvider": { "legend": layout::legend(), "full": true },
                "inlayHintProvider": true,
                "workspace": { "workspaceFolders": { "supported": true, "changeNotifications": true } },
            },
        }))
    }

    /// Asks the editor to tell of files that change on the disk.
    fn watchers(&self) -> Option<Value> {
        let watched = ["**/*.scol", "**/*.csv"].map(|pattern| json!({ "globPattern": pattern }));
        self.client.registers_watchers.then(|| {
            json!({ "jsonrpc": "2.0", "id": "watch", "method": "client/registerCapability", "params": { "registrations": [{
                "id": "watch",
                "method": "workspace/didChangeWatchedFiles",
                "registerOptions": { "watchers": watched },
            }] } })
        })
    }

    fn notice(&mut self, method: &str, params: Value, out: &mut Vec<Value>) {
        if method == "exit" {
            let is_orderly = self.phase == Phase::ShutDown;
            self.phase = Phase::Ended { is_orderly };
            return;
        }
        if self.phase != Phase::Running {
            return;
        }
        if let Err(error) = self.changed_by_editor(method, &rpc::Params(params), out) {
            let message = format!("{method}: {}", error.message);
            out.push(rpc::notification(
                "window/logMessage",
                &json!({ "type": 1, "message": message }),
            ));
        }
    }

    fn changed_by_editor(
        &mut self,
        method: &str,
        params: &rpc::Params,
        out: &mut Vec<Value>,
    ) -> Result<(), ResponseError> {
        match method {
            "textDocument/didOpen" => {
                let TextDocument { uri, version, text } = params.parse::<OfDocument>()?.text_document;
                // Editors that go by the folder open the table of points as a program.
                if uri.to_ascii_lowercase().ends_with(".csv") {
                    return Ok(());
                }
                if self.documents.len() >= MAX_OPEN && !self.documents.contains_key(&uri) {
                    let message = format!("{MAX_OPEN} files are open; close some of them");
                    return Err(ResponseError::invalid_params(message));
                }
                let text = Text::new(text, self.client.units);
                let table = self.projects.table_of(&uri);
                let document = Document::new(&uri, text, version, &self.projects, table);
                self.documents.insert(uri.clone(), Rc::new(document));
                self.changed.insert(uri);
            }
            "textDocument/didChange" => {
                let Changed {
                    text_document,
                    content_changes,
                } = params.parse()?;
                let uri = text_document.uri;
                let units = self.client.units;
                let document = Rc::clone(self.open(&uri)?);
                let mut text = document.text.clone();
                for change in content_changes {
                    match change.range {
                        Some(range) => text.replace(range, &change.text),
                        None => text = Text::new(change.text, units),
                    }
                }
                let document = document.with_text(text, text_document.version);
                self.documents.insert(uri.clone(), Rc::new(document));
                self.changed.insert(uri);
            }
            "textDocument/didClose" => {
                let uri = params.parse::<OfDocument>()?.text_document.uri;
                if self.documents.remove(&uri).is_some() {
                    self.changed.remove(&uri);
                    out.push(diagnose::published(&uri, None, &[]));
                }
            }
            "textDocument/didSave" | "workspace/didChangeWatchedFiles" => self.read_again(),
            "workspace/didChangeWorkspaceFolders" => {
                self.projects
                    .change_folders(&params.uris("/event/added"), &params.uris("/event/removed"));
            }
            "workspace/didChangeConfiguration" => {
                let settings = params.0.pointer("/settings/ts3100").unwrap_or(&Value::Null);
                self.projects.configure(settings)?;
                self.read_again();
            }
            // Others change nothing here.
            _ => {}
        }
        Ok(())
    }

    /// The tables of points may have changed, and with them all open files.
    fn read_again(&mut self) {
        self.projects.forget_tables();
        for (uri, document) in &mut self.documents {
            let (model, table) = (self.projects.model(), self.projects.table_of(uri));
            if let Some(settled) = document.with_settings(model, table) {
                *document = Rc::new(settled);
                self.changed.insert(uri.clone());
            }
        }
    }

    fn send_diagnostics(&mut self, out: &mut Vec<Value>) {
        let mut tables = BTreeMap::new();
        let mut unreadable = BTreeSet::new();
        for uri in std::mem::take(&mut self.changed) {
            let Some(document) = self.documents.get(&uri) else {
                continue;
            };
            let explanation = |code: &str| self.projects.explanation(code);
            out.push(diagnose::published(
                &uri,
                Some(document.version),
                &diagnose::diagnostics(document, explanation),
            ));
            tables.extend(diagnose::table_diagnostic(document));
            unreadable.extend(document.table.unreadable.clone());
        }
        for message in unreadable {
            if self.reported.insert(message.clone()) {
                out.push(rpc::notification(
                    "window/showMessage",
                    &json!({ "type": 1, "message": message }),
                ));
            }
        }
        for (uri, diagnostics) in tables {
            let is_marked = !diagnostics.is_empty();
            let changed = if is_marked {
                self.marked_tables.insert(uri.clone())
            } else {
                self.marked_tables.remove(&uri)
            };
            if changed || is_marked {
                out.push(diagnose::published(&uri, None, &diagnostics));
            }
        }
    }

    fn open(&self, uri: &str) -> Result<&Rc<Document>, ResponseError> {
        self.documents
            .get(uri)
            .ok_or_else(|| ResponseError::not_open(uri))
    }
}
