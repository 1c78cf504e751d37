//! `/scenario`: the progress of the scenario of `--scenario`.
//!
//! It is played by [`ts3100_recording::scenario`]; here its progress becomes a document.

use super::resource::{Answer, Handle, Json, Problem, Serialize, View, call};
use axum::http::StatusCode;
use ts3100_controller::Time;
use ts3100_recording::scenario::{EntryProgress, EntryState, ScenarioProgress, ScenarioState};

/// Progress of a scenario.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Scenario))]
pub struct ScenarioDocument {
    /// Name of the file, without directories.
    file: String,
    /// `running` while a step waits, `passed` when none does, `failed` as soon as one has failed.
    #[cfg_attr(test, schema(value_type = String))]
    state: ScenarioState,
    /// Expectations and actions in the order of the file.
    steps: Vec<ScenarioStep>,
}

/// Progress of a part of a scenario.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ScenarioStep {
    /// Name of the part.
    name: String,
    /// Line of the file, from 1; 0 without a line.
    line: usize,
    /// `waiting`, `passed` (it came as expected, or was done), `failed`.
    #[cfg_attr(test, schema(value_type = String))]
    state: EntryState,
    /// Virtual time in seconds of the verdict or of the last action; absent while it waits.
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<f64>,
    /// Details of the entry, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
}

impl From<ScenarioProgress> for ScenarioDocument {
    fn from(progress: ScenarioProgress) -> ScenarioDocument {
        ScenarioDocument {
            file: progress.file,
            state: progress.state,
            steps: progress.entries.into_iter().map(ScenarioStep::from).collect(),
        }
    }
}

impl From<EntryProgress> for ScenarioStep {
    fn from(entry: EntryProgress) -> ScenarioStep {
        ScenarioStep {
            name: entry.name,
            line: entry.line,
            state: entry.state,
            t: entry.time.map(|time| (Time::ZERO + time).as_seconds()),
            message: entry.message,
        }
    }
}

call! {
    /// Get the progress of the scenario
    ///
    /// The scenario of `ts3100 serve --scenario FILE` for this robot.
    get_scenario = get("/scenario", responses((status = 200, body = ScenarioDocument)))
}
pub async fn get_scenario(handle: Handle) -> Answer<ScenarioDocument> {
    let Some(play) = handle.scenario.clone() else {
        let told = "no scenario is played; start the emulator with `ts3100 serve --scenario FILE`";
        let problem = Problem::expected_found(StatusCode::NOT_FOUND, "scenario", "--scenario FILE", "none");
        return Err(problem.told(told));
    };
    let look = move |view: &View<'_>| play.progress(view.controller.now());
    let progress = handle.query(look).await?;
    Ok(Json(progress.into()))
}
