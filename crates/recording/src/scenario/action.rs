//! The actions of a scenario. Those on the controller have the text form of transcripts ([`Action`]); those on a connection
//! are read here.

use ts3100_controller::alarm::AlarmCode;
use ts3100_controller::signals::{LINE_NUMBERS, Signals};
use ts3100_controller::{Action, ActionParseError, Input, PanelAction, Port, action_forms};
use ts3100_driver::seat::PlannedAction;
use ts3100_proto::escape::{self, EscapeError};
use ts3100_proto::words::{UnexpectedWord, Word as _, did_you_mean_or};

/// Every form of an action beside those of [`ts3100_controller::action_forms`].
pub const CHANNEL_ACTIONS: [&str; 2] = ["channel CHANNEL inject TEXT", "channel PORT drop"];

/// Words that are not an action.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScenarioActionError {
    /// A word.
    #[error(transparent)]
    Word(#[from] UnexpectedWord),
    /// The end.
    #[error("expected {0}, found nothing")]
    Nothing(&'static str),
    /// A line that the controller does not have.
    #[error("expected line {LINE_NUMBERS}, found {0}")]
    Line(u16),
    /// Bytes.
    #[error(transparent)]
    Bytes(#[from] EscapeError),
    /// No action begins so.
    #[error("unknown action `{words}`{hint}")]
    Unknown {
        words: String,
        /// A name that may be meant, as the end of the message; may be empty.
        hint: String,
    },
    /// A known action with wrong words after it.
    #[error("cannot read the action `{words}`: {reason}")]
    Action { words: String, reason: ActionParseError },
}

/// Something that is done.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioAction {
    /// As it was written.
    pub words: String,
    /// Its line of the file, from 1; 0 without a file.
    pub line: usize,
    pub action: PlannedAction,
}

impl ScenarioAction {
    /// Reads one.
    ///
    /// # Errors
    pub fn parse(words: &str) -> Result<ScenarioAction, ScenarioActionError> {
        let action = match words.split_once(' ') {
            Some(("channel", rest)) => channel_action(rest)?,
            _ => {
                let action = action(words)?;
                PlannedAction::Input(if let Action::Panel(panel) = action {
                    Input::by_hand(panel)
                } else {
                    Input::by_owner(action)
                })
            }
        };
        Ok(ScenarioAction {
            words: words.to_owned(),
            line: 0,
            action,
        })
    }

    /// The same action, at a line of its file.
    pub(crate) fn at_line(self, line: usize) -> ScenarioAction {
        ScenarioAction { line, ..self }
    }

    /// One at the panel, in its words.
    pub(super) fn at_panel(panel: PanelAction) -> ScenarioAction {
        ScenarioAction {
            words: panel.to_string(),
            line: 0,
            action: PlannedAction::Input(Input::by_hand(panel)),
        }
    }
}

/// `IP1 inject TEXT` or `IP0 drop`.
fn channel_action(words: &str) -> Result<PlannedAction, ScenarioActionError> {
    let (name, what) = words.split_once(' ').unwrap_or((words, ""));
    let (verb, text) = what.split_once(' ').unwrap_or((what, ""));
    match (verb, text) {
        ("inject", text) => {
            let found = Port::from_word(name).filter(|port| port.is_scol_channel());
            let port = found.ok_or_else(|| UnexpectedWord::new("the channel COM1, IP1 or IP2", name))?;
            let bytes = escape::parse(text)?;
            if bytes.is_empty() {
                return Err(ScenarioActionError::Nothing("text, with control codes as <CR>"));
            }
            Ok(PlannedAction::Input(Input::received(port, bytes)))
        }
        ("drop", "") => {
            let found = Port::from_word(name).filter(|port| Port::ETHERNET.contains(port));
            let port = found.ok_or_else(|| UnexpectedWord::new("IP0, IP1, IP2 or IP3", name))?;
            Ok(PlannedAction::Drop(port))
        }
        _ => Err(UnexpectedWord::new("inject TEXT or drop", what).into()),
    }
}

/// The error for words that no action begins like.
fn unknown(words: &str) -> ScenarioActionError {
    let first = |words: &'static str| words.split(' ').next().unwrap_or_default();
    let forms = action_forms().chain(CHANNEL_ACTIONS).map(first);
    let page = "; `ts3100 docs scenarios` lists every action";
    let hint = did_you_mean_or(words.split(' ').next().unwrap_or_default(), forms, page);
    let words = words.to_owned();
    ScenarioActionError::Unknown { words, hint }
}

fn action(words: &str) -> Result<Action, ScenarioActionError> {
    let found = words.parse::<Action>().map_err(|reason| {
        if matches!(reason, ActionParseError::Unknown(_)) {
            return unknown(words);
        }
        let words = words.to_owned();
        ScenarioActionError::Action { words, reason }
    })?;
    if let Action::Panel(PanelAction::InputLine { line, .. })
    | Action::Pulse { line, .. }
    | Action::SetOutput { line, .. }
    | Action::Force { line, .. }
    | Action::Release { line, .. } = found
        && !Signals::exists(line)
    {
        return Err(ScenarioActionError::Line(line));
    }
    // A recording has empty files; who writes a scenario has forgotten the text.
    if matches!(&found, Action::PutFile { content, .. } if content.is_empty()) {
        return Err(ScenarioActionError::Nothing("a text after the name of the file"));
    }
    if let Action::RaiseAlarm { number, .. } = &found
        && AlarmCode::from_number(number).is_none()
    {
        let hint = AlarmCode::did_you_mean(number);
        return Err(UnexpectedWord::new(AlarmCode::expected_number(number), number)
            .hinting(hint)
            .into());
    }
    Ok(found)
}
