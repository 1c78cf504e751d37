//! `/faults`: list the faults with their counters; arm, disarm and clear them; list the kinds.
//!
//! Kinds, parameters and their validation are in the controller's `faults` module.

use super::body::{Json, NoBody, Path, object_only, optional_whole, whole};
use super::event::seconds;
use super::handle::{Answer, Handle};
use super::problem::Problem;
use super::route_table::RouteTable;
use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;
use ts3100_controller::Port;
use ts3100_controller::action::Action;
use ts3100_controller::faults::{
    Fault, FaultAction, FaultError, FaultKind, FaultReport, InjectionPoint, KINDS, Parameter, ParameterType,
};
use ts3100_driver::driver::request::View;
use utoipa::ToSchema;
use utoipa_axum::routes;

/// Most parameters of one request: no kind has as many.
const MAX_PARAMETERS: usize = 16;

/// What a fault waits for; what is not said does not matter.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
#[schema(as = On)]
pub struct FaultTrigger {
    /// Letters of a command: the command, the texts of its exchange, its answers.
    #[schema(example = "SU")]
    command: Option<String>,
    /// The port.
    #[schema(example = "IP0")]
    channel: Option<String>,
    /// Number of the FL text in its exchange, from 1, or of the OK to it; 0 is what is no FL text.
    #[serde(deserialize_with = "optional_whole")]
    #[schema(maximum = 1_000_000)]
    block: Option<u32>,
}

/// A value of a parameter: a number, or words as `--fault` takes them.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(untagged, expecting = "a whole number or words expected")]
#[schema(as = Given)]
pub enum ParameterValue {
    /// A whole number.
    Number(#[serde(deserialize_with = "whole")] u32),
    /// Words: `2s`, `teaching`, `OK<CR>`.
    Words(String),
}

/// A fault to be armed: in the words of `--fault`, or by its parts.
#[derive(ToSchema)]
#[schema(as = Arm)]
#[serde(untagged)]
#[expect(dead_code, reason = "it is only described; what is read is `ArmRequest`")]
enum ArmSchema {
    Spec(FaultSpec),
    Parts(ArmRequest),
}

/// A fault in the words of `--fault`.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "it is only described; what is read is `ArmRequest`")]
#[schema(as = Spec)]
struct FaultSpec {
    /// `KIND` or `KIND:key=value,key=value`, as docs/reference/faults.md says.
    #[schema(example = "no-reply:command=SU", max_length = 4096)]
    spec: String,
}

/// A fault by its parts.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = FaultParts)]
pub struct ArmRequest {
    /// One of `/faults/kinds`.
    #[serde(default)]
    #[schema(value_type = String, required, example = "no-reply")]
    kind: Option<String>,
    /// In the words of `--fault`, instead of all the others.
    #[serde(default)]
    #[schema(ignore)]
    spec: Option<String>,
    /// Its number; the next free one if not said. A fault of the same number is replaced.
    #[serde(default, deserialize_with = "optional_whole")]
    #[schema(minimum = 1, maximum = 1_000_000)]
    id: Option<u32>,
    /// What it waits for; some kinds wait for a command of their own if nothing is said.
    #[serde(default, deserialize_with = "object_only")]
    on: FaultTrigger,
    /// How many occasions pass before the first it can take.
    #[serde(default, deserialize_with = "optional_whole")]
    #[schema(maximum = 1_000_000)]
    after: Option<u32>,
    /// How often it bites at most; 0: always; 1 if not said.
    #[serde(default, deserialize_with = "optional_whole")]
    #[schema(maximum = 1_000_000)]
    times: Option<u32>,
    /// How probably it takes an occasion, above 0; 1 if not said.
    #[schema(minimum = 0.000001, maximum = 1)]
    probability: Option<f64>,
    /// The parameters of the kind.
    #[serde(default)]
    parameters: BTreeMap<String, ParameterValue>,
}

/// A fault and what has become of it.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = FaultDoc)]
pub struct FaultStatus {
    /// Its number.
    id: u32,
    /// Its kind.
    kind: &'static str,
    /// As `--fault` takes it.
    spec: String,
    /// What it waits for.
    on: FaultTrigger,
    /// How many occasions pass before the first it can take.
    after: u32,
    /// How often it bites at most; 0: always.
    times: u32,
    /// How probably it takes an occasion.
    probability: f64,
    /// The parameters of the kind, the defaults among them.
    parameters: BTreeMap<String, String>,
    /// It can still bite.
    armed: bool,
    /// Occasions it saw while it was armed.
    seen: u32,
    /// How often it bit.
    fired: u32,
    /// When, the first hundred times, in seconds of virtual time.
    at: Vec<f64>,
}

/// All faults since the start or the last DELETE.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = FaultsDoc)]
pub struct FaultList {
    /// In the order of their numbers.
    faults: Vec<FaultStatus>,
    /// Numbers of those that have not bitten.
    never_fired: Vec<u32>,
}

/// A parameter of a kind.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = ParameterDoc)]
pub struct ParameterInfo {
    /// Its key.
    name: &'static str,
    /// What it takes, in words.
    takes: String,
    /// Its value when nothing is said; absent: drawn, or as `what` says.
    default: Option<&'static str>,
    /// What it is.
    what: &'static str,
}

/// A kind of fault.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = KindDoc)]
pub struct FaultKindInfo {
    /// Its name.
    kind: &'static str,
    /// What it does.
    what: &'static str,
    /// What a host that lives with it does.
    remedy: &'static str,
    /// Where it bites.
    bites: Vec<&'static str>,
    /// The command it waits for when nothing is said.
    command: Option<&'static str>,
    /// The block it waits for when nothing is said.
    block: Option<u32>,
    /// Its parameters.
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
            at: report.at.iter().map(|at| seconds(*at)).collect(),
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
    /// As they are now.
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
            bites: kind
                .points
                .iter()
                .copied()
                .map(InjectionPoint::description)
                .collect(),
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
            (None, None) => return Err(Problem::invalid("body", "`kind` or `spec`", "neither")),
            (..) => {
                let expected = "`spec` alone, or `kind` and what goes with it";
                return Err(Problem::invalid("body", expected, "`spec` and others"));
            }
        };
        read.map_err(Problem::from)
    }
}

impl From<FaultError> for Problem {
    fn from(error: FaultError) -> Problem {
        let unfit = |place: &str, expected: &str, found: &str| {
            Problem::expected_found(StatusCode::CONFLICT, place, expected, found)
        };
        match &error {
            FaultError::UnknownKind { found, known } => unfit("kind", known, found),
            FaultError::UnknownKey { key, known, .. } => unfit("parameters", known, key),
            FaultError::DuplicateKey { key, .. } => unfit("parameters", &format!("{key} once"), "twice"),
            FaultError::InvalidValue {
                key, expected, found, ..
            } => unfit(key, expected, found),
            FaultError::NeverFires { .. } => Problem::new(StatusCode::CONFLICT, error),
            FaultError::Syntax { found } => unfit("body", "a fault", found),
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group(
            "faults",
            "What is broken on purpose: armed, bitten, never fired; docs/reference/faults.md explains the kinds.",
        )
        .routes(routes!(get_faults, arm_fault, clear_faults))
        .routes(routes!(get_fault_kinds))
        .routes(routes!(get_fault, disarm_fault))
}

/// The faults and what has become of them
#[utoipa::path(get, path = "/faults", responses((status = 200, body = FaultList)))]
async fn get_faults(handle: Handle) -> Answer<FaultList> {
    handle.query(FaultList::new).await.map(Json)
}

/// Arm a fault
///
/// From now on. The same number again replaces it, its counters at zero.
#[utoipa::path(post, path = "/faults", request_body = ArmSchema, responses((status = 200, body = FaultList)))]
async fn arm_fault(handle: Handle, Json(body): Json<ArmRequest>) -> Answer<FaultList> {
    let arm = FaultAction::Arm(Box::new(body.into_fault()?));
    handle.act(Action::Fault(arm), FaultList::new).await.map(Json)
}

/// Forget all faults: none bites any more, and the report is empty
#[utoipa::path(delete, path = "/faults", responses((status = 200, body = FaultList)))]
async fn clear_faults(handle: Handle, _: NoBody) -> Answer<FaultList> {
    let clear = FaultAction::Clear;
    handle.act(Action::Fault(clear), FaultList::new).await.map(Json)
}

/// The kinds there are, with their parameters
#[utoipa::path(get, path = "/faults/kinds", responses((status = 200, body = Vec<FaultKindInfo>)))]
async fn get_fault_kinds() -> Json<Vec<FaultKindInfo>> {
    Json(KINDS.iter().map(FaultKindInfo::new).collect())
}

/// One fault
#[utoipa::path(get, path = "/faults/{number}", responses((status = 200, body = FaultStatus)),
    params(("number" = String, Path, description = "Its number, as /faults has it")))]
async fn get_fault(handle: Handle, Path(number): Path<String>) -> Answer<FaultStatus> {
    handle.query(FaultStatus::find(number)).await?.map(Json)
}

/// Disarm a fault: it does not bite any more and stays in the report
#[utoipa::path(delete, path = "/faults/{number}", responses((status = 200, body = FaultStatus)),
    params(("number" = String, Path, description = "Its number, as /faults has it")))]
async fn disarm_fault(handle: Handle, Path(number): Path<String>, _: NoBody) -> Answer<FaultStatus> {
    let known = handle.query(FaultStatus::find(number.clone())).await??;
    let disarm = Action::Fault(FaultAction::Disarm(known.id));
    handle.act(disarm, FaultStatus::find(number)).await?.map(Json)
}
