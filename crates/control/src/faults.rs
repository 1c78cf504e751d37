//! `/faults`: list the faults with their counters; arm, disarm and clear them; list the kinds.
//!
//! Kinds, parameters and their validation are in the controller's `faults` module.

use super::body::{object_only, optional_whole, whole};
use super::resource::{Answer, Deserialize, Handle, Json, NoBody, Path, Problem, Serialize, View, call};
use axum::http::StatusCode;
use std::collections::BTreeMap;
use std::fmt::Display;
use ts3100_controller::faults::{
    Fault, FaultAction, FaultError, FaultKind, FaultReport, KINDS, Parameter, ParameterType,
};
use ts3100_controller::{Action, Port};
use ts3100_recording::faults::points;

/// Most parameters of one request: no kind has as many.
const MAX_PARAMETERS: usize = 16;

/// Filter of a fault; an absent key matches anything.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields, default)]
pub struct FaultTrigger {
    /// Letters of a command: the command, the texts of its exchange, its answers.
    #[cfg_attr(test, schema(example = "SU"))]
    command: Option<String>,
    /// The port.
    #[cfg_attr(test, schema(example = "IP0"))]
    channel: Option<String>,
    /// Number of the FL text in its exchange, from 1, or of the OK to it; 0 matches any other text.
    #[serde(deserialize_with = "optional_whole")]
    #[cfg_attr(test, schema(maximum = 1_000_000))]
    block: Option<u32>,
}

/// Value of a parameter: a number, or text as in `--fault`.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(untagged, expecting = "expected a whole number or words")]
pub enum ParameterValue {
    /// A whole number.
    Number(#[serde(deserialize_with = "whole")] u32),
    /// Text: `2s`, `teaching`, `OK<CR>`.
    Words(String),
}

/// The fault to arm: as text like `--fault`, or by its parts.
#[cfg(test)]
#[derive(utoipa::ToSchema)]
#[schema(as = ArmFault)]
#[serde(untagged)]
#[expect(dead_code, reason = "it is only described; what is read is `ArmRequest`")]
enum ArmSchema {
    Spec(FaultSpec),
    Parts(ArmRequest),
}

/// A fault as text, like `--fault`.
#[cfg(test)]
#[derive(utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "it is only described; what is read is `ArmRequest`")]
struct FaultSpec {
    /// `KIND` or `KIND:key=value,key=value`; `/book/reference/faults` explains them.
    #[cfg_attr(test, schema(example = "no-reply:command=SU", max_length = 4096))]
    spec: String,
}

/// A fault by its parts.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = FaultParts))]
#[serde(deny_unknown_fields)]
pub struct ArmRequest {
    /// One of `/faults/kinds`.
    #[serde(default)]
    #[cfg_attr(test, schema(value_type = String, required, example = "no-reply"))]
    kind: Option<String>,
    /// The whole fault as text like `--fault`, instead of all other fields.
    #[serde(default)]
    #[cfg_attr(test, schema(ignore))]
    spec: Option<String>,
    /// Number of the fault; default: the next free one. A fault with the same number is replaced.
    #[serde(default, deserialize_with = "optional_whole")]
    #[cfg_attr(test, schema(minimum = 1, maximum = 1_000_000))]
    id: Option<u32>,
    /// Filter that triggers it; some kinds have a default command.
    #[serde(default, deserialize_with = "object_only")]
    on: FaultTrigger,
    /// Number of matches to skip first.
    #[serde(default, deserialize_with = "optional_whole")]
    #[cfg_attr(test, schema(maximum = 1_000_000))]
    after: Option<u32>,
    /// Maximum number of times it triggers; 0: no limit; default 1.
    #[serde(default, deserialize_with = "optional_whole")]
    #[cfg_attr(test, schema(maximum = 1_000_000))]
    times: Option<u32>,
    /// Probability of triggering at a match, above 0; default 1.
    #[cfg_attr(test, schema(minimum = 0.000001, maximum = 1))]
    probability: Option<f64>,
    /// The parameters of the kind.
    #[serde(default)]
    parameters: BTreeMap<String, ParameterValue>,
}

/// A fault and its outcome.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Fault))]
pub struct FaultStatus {
    /// Number of the fault.
    id: u32,
    /// Kind of the fault.
    kind: &'static str,
    /// As text, like `--fault`.
    spec: String,
    /// Filter that triggers it.
    on: FaultTrigger,
    /// Number of matches to skip first.
    after: u32,
    /// Maximum number of times it triggers; 0: no limit.
    times: u32,
    /// Probability of triggering at a match.
    probability: f64,
    /// The parameters of the kind, including defaults.
    parameters: BTreeMap<String, String>,
    /// Whether it can still trigger.
    armed: bool,
    /// Matches while it was armed.
    seen: u32,
    /// Number of times it triggered.
    fired: u32,
    /// Times at which it triggered, in seconds of virtual time; the first hundred.
    at: Vec<f64>,
}

/// All faults that were armed and not removed.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Faults))]
pub struct FaultList {
    /// Faults in the order of their numbers.
    faults: Vec<FaultStatus>,
    /// Numbers of the faults that have not triggered.
    never_fired: Vec<u32>,
}

/// A parameter of a kind.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = FaultParameter))]
pub struct ParameterInfo {
    /// Key of the parameter.
    name: &'static str,
    /// The values it accepts.
    takes: String,
    /// Default value; absent: drawn at random, or as `what` describes.
    default: Option<&'static str>,
    /// Description of the parameter.
    what: &'static str,
}

/// A kind of fault.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = FaultKind))]
pub struct FaultKindInfo {
    /// Name of the kind.
    kind: &'static str,
    /// Description of the fault.
    what: &'static str,
    /// Behaviour of a robust host.
    remedy: &'static str,
    /// Places at which it can trigger.
    applies_to: Vec<&'static str>,
    /// The command that triggers it by default.
    command: Option<&'static str>,
    /// The block that triggers it by default.
    block: Option<u32>,
    /// Parameters of the kind.
    parameters: Vec<ParameterInfo>,
}

impl FaultStatus {
    fn new(report: &FaultReport) -> FaultStatus {
        let Fault {
            id, kind, filter: on, ..
        } = &report.fault;
        let parameters = report.fault.parameters().into_iter();
        FaultStatus {
            id: *id,
            kind: kind.name,
            spec: report.fault.to_string(),
            on: FaultTrigger {
                command: on.command.clone(),
                channel: on.channel.map(|port| Port::name(port).to_owned()),
                block: on.block,
            },
            after: report.fault.after,
            times: report.fault.times,
            probability: report.fault.chance(),
            parameters: parameters.map(|(name, value)| (name.to_owned(), value)).collect(),
            armed: report.armed,
            seen: report.seen,
            fired: report.fired,
            at: report.at.iter().map(|at| at.as_seconds()).collect(),
        }
    }

    /// Looks for the fault of this number.
    fn find(number: String) -> impl FnOnce(&View<'_>) -> Result<FaultStatus, Problem> {
        move |view| {
            let id = number.parse().ok();
            let mut reports = view.controller.faults().reports();
            let found = reports.find(|report| Some(report.fault.id) == id);
            found
                .map(FaultStatus::new)
                .ok_or_else(|| Problem::not_found("number", "the number of a fault of /faults", number))
        }
    }
}

impl FaultList {
    /// Reads the present list.
    pub fn new(view: &View<'_>) -> FaultList {
        let faults = view.controller.faults();
        FaultList {
            faults: faults.reports().map(FaultStatus::new).collect(),
            never_fired: faults.never_fired().map(|report| report.fault.id).collect(),
        }
    }
}

impl FaultKindInfo {
    fn new(kind: &&'static FaultKind) -> FaultKindInfo {
        let parameter = |parameter: &Parameter| ParameterInfo {
            name: parameter.name,
            takes: ParameterType::description(&parameter.value_type),
            default: parameter.default,
            what: parameter.description,
        };
        FaultKindInfo {
            kind: kind.name,
            what: kind.summary,
            remedy: kind.remedy,
            applies_to: points(kind),
            command: kind.command,
            block: kind.block,
            parameters: kind.parameters.iter().map(parameter).collect(),
        }
    }
}

impl ArmRequest {
    fn into_fault(self) -> Result<Fault, Problem> {
        if self.parameters.len() > MAX_PARAMETERS {
            let expected = format!("at most {MAX_PARAMETERS}");
            return Err(Problem::invalid("parameters", expected, self.parameters.len()));
        }
        fn pair(key: &str, value: Option<impl Display>) -> Option<(String, String)> {
            Some((key.to_owned(), value?.to_string()))
        }
        let common = [
            pair("id", self.id),
            pair("command", self.on.command),
            pair("channel", self.on.channel),
            pair("block", self.on.block),
            pair("after", self.after),
            pair("times", self.times),
            pair("probability", self.probability),
        ];
        let own = self.parameters.into_iter().map(|(name, value)| match value {
            ParameterValue::Number(number) => (name, number.to_string()),
            ParameterValue::Words(words) => (name, words),
        });
        let pairs: Vec<(String, String)> = common.into_iter().flatten().chain(own).collect();
        let read = match (self.kind, self.spec) {
            (Some(kind), None) => Fault::from_pairs(&kind, &pairs),
            (None, Some(spec)) if pairs.is_empty() => spec.parse(),
            (None, None) => {
                let told = "the fault has neither `kind` nor `spec`";
                return Err(Problem::invalid("body", "`kind` or `spec`", "neither").told(told));
            }
            (..) => {
                let expected = "`spec` alone, or `kind` and what goes with it";
                let told = "`spec` describes the whole fault: remove the other keys";
                return Err(Problem::invalid("body", expected, "`spec` and others").told(told));
            }
        };
        read.map_err(Problem::from)
    }
}

impl From<FaultError> for Problem {
    fn from(error: FaultError) -> Problem {
        match &error {
            FaultError::UnknownKind { .. } => Problem::new(StatusCode::CONFLICT, &error).at("kind"),
            FaultError::UnknownKey { key, .. } | FaultError::DuplicateKey { key, .. } => {
                Problem::new(StatusCode::CONFLICT, &error).at(key)
            }
            FaultError::InvalidValue {
                key, expected, found, ..
            } => Problem::expected_found(StatusCode::CONFLICT, key, expected, found),
            FaultError::NeverFires { .. } => Problem::new(StatusCode::CONFLICT, &error),
            FaultError::Syntax { found } => {
                let expected = "KIND:key=value,key=value";
                Problem::expected_found(StatusCode::CONFLICT, "spec", expected, found)
            }
        }
    }
}

call! {
    /// Arm a fault
    ///
    /// It triggers from now on. A fault with the same number is replaced, with counters at zero.
    arm_fault = post("/faults", request_body = ArmSchema, responses((status = 200, body = FaultList)))
}
pub async fn arm_fault(handle: Handle, Json(body): Json<ArmRequest>) -> Answer<FaultList> {
    let arm = FaultAction::Arm(Box::new(body.into_fault()?));
    handle.act(Action::Fault(arm), FaultList::new).await.map(Json)
}

call! {
    /// Remove all faults
    ///
    /// The list is empty afterwards.
    clear_faults = delete("/faults", responses((status = 200, body = FaultList)))
}
pub async fn clear_faults(handle: Handle, _: NoBody) -> Answer<FaultList> {
    let clear = FaultAction::Clear;
    handle.act(Action::Fault(clear), FaultList::new).await.map(Json)
}

call! {
    /// List the kinds of faults
    get_fault_kinds = get("/faults/kinds",
        responses((status = 200, description = "All kinds, with their parameters.", body = Vec<FaultKindInfo>)))
}
pub async fn get_fault_kinds() -> Json<Vec<FaultKindInfo>> {
    Json(fault_kinds())
}

/// Every kind of fault.
pub fn fault_kinds() -> Vec<FaultKindInfo> {
    KINDS.iter().map(FaultKindInfo::new).collect()
}

call! {
    /// Get a fault
    get_fault = get("/faults/{number}",
        responses((status = 200, body = FaultStatus)),
        params(("number" = String, Path, description = "Number of the fault")))
}
pub async fn get_fault(handle: Handle, Path(number): Path<String>) -> Answer<FaultStatus> {
    handle.query(FaultStatus::find(number)).await?.map(Json)
}

call! {
    /// Disarm a fault
    ///
    /// It does not trigger any more; its outcome stays in the list.
    disarm_fault = delete("/faults/{number}",
        responses((status = 200, body = FaultStatus)),
        params(("number" = String, Path, description = "Number of the fault")))
}
pub async fn disarm_fault(handle: Handle, Path(number): Path<String>, _: NoBody) -> Answer<FaultStatus> {
    let known = handle.query(FaultStatus::find(number.clone())).await??;
    let disarm = Action::Fault(FaultAction::Disarm(known.id));
    handle.act(disarm, FaultStatus::find(number)).await?.map(Json)
}
