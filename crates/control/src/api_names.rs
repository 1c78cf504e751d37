//! Names of the control interface for enumerations of the controller: key positions, control right, ports,
//! execution status.
//!
//! They say how serde and the OpenAPI document spell the controller's types, because that spelling is a public format.

use serde::{Deserialize, Serialize};
use ts3100_controller::{ControlRight, KeySwitch, Port};
use ts3100_proto::command::RunMode;
use ts3100_proto::status::ExecutionStatus;

/// Position of the key switch.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(remote = "KeySwitch", rename_all = "lowercase")]
pub enum KeyPosition {
    Teaching,
    Internal,
    Ext,
}

/// Who commands the robot while the key switch is at EXT.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(remote = "ControlRight", rename_all = "lowercase")]
pub enum RightHolder {
    Sig,
    Rs232c,
    Ether,
}

/// Operation mode.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = RunMode))]
#[serde(remote = "RunMode", rename_all = "lowercase")]
pub enum RunModeName {
    /// Starts again after the last statement.
    Continuous,
    /// Runs once to the end.
    Cycle,
    /// Runs one statement for each start.
    Step,
    /// Runs through the next motion for each start.
    Segment,
}

/// A communication port. Calls accept lower case too.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(remote = "Port", rename_all = "UPPERCASE")]
pub enum PortName {
    #[serde(alias = "host")]
    Host,
    #[serde(alias = "com1")]
    Com1,
    #[serde(alias = "ip0")]
    Ip0,
    #[serde(alias = "ip1")]
    Ip1,
    #[serde(alias = "ip2")]
    Ip2,
    #[serde(alias = "ip3")]
    Ip3,
}

/// A port that a call names.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(transparent)]
pub struct NamedPort(#[serde(with = "PortName")] pub Port);

/// Execution status.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Status))]
#[serde(remote = "ExecutionStatus")]
pub enum StatusName {
    /// A program or the statement of DO runs.
    #[serde(rename = "running")]
    Running,
    /// At step 1.
    #[serde(rename = "stop (reset)")]
    Reset,
    /// Inside a step, which will be done again.
    #[serde(rename = "stop (retry)")]
    Retry,
    /// Between steps.
    #[serde(rename = "stop (continue)")]
    Continue,
}

/// An execution status that a call names.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(transparent)]
pub struct NamedStatus(#[serde(with = "StatusName")] pub ExecutionStatus);

#[cfg(test)]
impl utoipa::PartialSchema for NamedStatus {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
        StatusName::schema()
    }
}

#[cfg(test)]
impl utoipa::ToSchema for NamedStatus {
    fn name() -> std::borrow::Cow<'static, str> {
        StatusName::name()
    }
}
