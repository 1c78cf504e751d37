//! `/alarms`: active alarms, the error history, the alarm table with causes and remedies; raise and reset.
//!
//! The table and the effects of an alarm are in the controller's `alarm` module.

use super::resource::{Answer, Deserialize, Handle, Json, Path, Problem, Serialize, View, call};
use ts3100_book::explain_path;
use ts3100_controller::Action;
use ts3100_controller::alarm::{ALARMS, Alarm, AlarmCode, AlarmSource};

/// Longest detail of an alarm in characters.
const MAX_DETAIL: usize = 200;

/// An alarm that was raised.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ActiveAlarm {
    /// Number, as `level-code`.
    number: String,
    /// Level: 8 the most severe, 1 a warning.
    level: u8,
    /// Text that the operator reads.
    text: String,
    /// Cause of the alarm.
    cause: &'static str,
    /// Remedy.
    remedy: &'static str,
    /// Path of the page that explains it.
    docs: String,
    /// Date and time, `YYYY-MM-DD HH:MM:SS`.
    at: String,
}

/// A row of the alarm table.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct AlarmRow {
    /// Number, as `level-code`.
    number: String,
    /// Level: 8 the most severe, 1 a warning.
    level: u8,
    /// Text that the operator reads.
    text: &'static str,
    /// Cause of the alarm.
    cause: &'static str,
    /// Remedy.
    remedy: &'static str,
    /// Path of the page that explains it.
    docs: String,
    /// Whether the number is an invention of the emulator; `false` for alarms of the real controller.
    ours: bool,
}

/// Active alarms and the error history.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Alarms))]
pub struct AlarmList {
    /// Active alarms, oldest first.
    active: Vec<ActiveAlarm>,
    /// The last 99 alarms, newest first.
    history: Vec<ActiveAlarm>,
}

/// The alarm to raise.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Raise))]
#[serde(deny_unknown_fields)]
pub struct RaiseRequest {
    /// `level-code` as the table has it, for example `2-046`.
    #[cfg_attr(test, schema(example = "2-046", pattern = "^[1248]-[0-9]{3}$"))]
    number: String,
    /// Detail that follows the text of the alarm; without a comma.
    #[serde(default)]
    #[cfg_attr(test, schema(max_length = 200, pattern = "^[ !-+.-~-]*$"))]
    detail: String,
}

impl ActiveAlarm {
    /// An alarm as a document.
    pub fn new(alarm: &Alarm) -> ActiveAlarm {
        ActiveAlarm {
            text: alarm.message(),
            at: alarm.at.to_string(),
            ..ActiveAlarm::of_code(&alarm.code)
        }
    }

    /// An alarm whose time and detail are not known.
    pub fn of_code(code: &AlarmCode) -> ActiveAlarm {
        ActiveAlarm {
            number: code.number(),
            level: code.level.number(),
            text: code.text.to_owned(),
            cause: code.cause,
            remedy: code.remedy,
            docs: explain_path(&code.number()),
            at: String::new(),
        }
    }
}

impl AlarmRow {
    fn new(row: &AlarmCode) -> AlarmRow {
        AlarmRow {
            number: row.number(),
            level: row.level.number(),
            text: row.text,
            cause: row.cause,
            remedy: row.remedy,
            docs: explain_path(&row.number()),
            ours: row.source == AlarmSource::Ours,
        }
    }
}

impl AlarmList {
    pub fn new(view: &View<'_>) -> AlarmList {
        let alarms = view.controller.alarms();
        AlarmList {
            active: alarms.active().iter().map(ActiveAlarm::new).collect(),
            history: alarms.history().map(ActiveAlarm::new).collect(),
        }
    }
}

call! {
    /// Raise an alarm
    ///
    /// The level decides about the effect: 8 and 4 stop the robot immediately, 2 stops it after the current step.
    raise_alarm = post("/alarms", request_body = RaiseRequest, responses((status = 200, body = AlarmList)))
}
pub async fn raise_alarm(handle: Handle, Json(body): Json<RaiseRequest>) -> Answer<AlarmList> {
    let RaiseRequest { number, detail } = body;
    let plain = |letter: char| (letter == ' ' || letter.is_ascii_graphic()) && letter != ',';
    if detail.len() > MAX_DETAIL || !detail.chars().all(plain) {
        let expected = format!("at most {MAX_DETAIL} characters of ASCII without a comma");
        return Err(Problem::invalid("detail", expected, detail));
    }
    let action = Action::RaiseAlarm { number, detail };
    handle.act(action, AlarmList::new).await.map(Json)
}

call! {
    /// List every alarm of the controller
    get_alarm_table = get("/alarms/table",
        responses((status = 200, description = "All alarms, with cause and remedy.", body = Vec<AlarmRow>)))
}
pub async fn get_alarm_table() -> Json<Vec<AlarmRow>> {
    Json(ALARMS.iter().map(AlarmRow::new).collect())
}

call! {
    /// Look up an alarm by its number
    get_alarm_row = get("/alarms/table/{number}",
        responses((status = 200, body = AlarmRow)),
        params(("number" = String, Path, description = "`level-code`, for example `2-046`")))
}
pub async fn get_alarm_row(Path(number): Path<String>) -> Answer<AlarmRow> {
    let row = AlarmCode::from_number(&number);
    row.map(|row| Json(AlarmRow::new(&row))).ok_or_else(|| {
        let replaced = AlarmCode::replacement(&number).map(|_| AlarmCode::expected_number(&number));
        let expected = replaced.unwrap_or_else(|| String::from("an alarm of /alarms/table"));
        let hint = AlarmCode::did_you_mean(&number);
        let sentence = format!("unknown number `{number}`: expected {expected}{hint}");
        Problem::not_found("number", expected, number).told(sentence)
    })
}
