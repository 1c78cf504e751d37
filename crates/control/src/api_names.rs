//! Names of the control interface for enumerations of the controller: key positions, control right, ports,
//! execution status.
//!
//! They say how serde and the OpenAPI document spell the controller's types, because that spelling is a public format.

use serde::{Deserialize, Serialize};
use ts3100_controller::{ControlRight, KeySwitch, Port};
use ts3100_proto::status::ExecutionStatus;
use utoipa::ToSchema;

/// Position of the key switch.
#[derive(Serialize, Deserialize, ToSchema)]
#[serde(remote = "KeySwitch", rename_all = "lowercase")]
#[schema(as = KeyWord)]
pub enum KeyPosition {
    Teaching,
    Internal,
    Ext,
}

/// Who commands the robot in EXT.
#[derive(Serialize, Deserialize, ToSchema)]
#[serde(remote = "ControlRight", rename_all = "lowercase")]
#[schema(as = RightWord)]
pub enum RightHolder {
    Sig,
    Rs232c,
    Ether,
}

/// A communication port; small letters, as in the ready line, are read too.
#[derive(Serialize, Deserialize, ToSchema)]
#[serde(remote = "Port", rename_all = "UPPERCASE")]
#[schema(as = PortWord)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = StatusWord)]
pub enum StatusName {
    /// A program or the statement of DO runs.
    Running,
    /// `stop (reset)`: at step 1.
    Reset,
    /// `stop (retry)`: inside a step, which will be done again.
    Retry,
    /// `stop (continue)`: between steps.
    Continue,
}

impl From<ExecutionStatus> for StatusName {
    fn from(status: ExecutionStatus) -> StatusName {
        match status {
            ExecutionStatus::Running => StatusName::Running,
            ExecutionStatus::Reset => StatusName::Reset,
            ExecutionStatus::Retry => StatusName::Retry,
            ExecutionStatus::Continue => StatusName::Continue,
        }
    }
}

impl From<StatusName> for ExecutionStatus {
    fn from(word: StatusName) -> ExecutionStatus {
        match word {
            StatusName::Running => ExecutionStatus::Running,
            StatusName::Reset => ExecutionStatus::Reset,
            StatusName::Retry => ExecutionStatus::Retry,
            StatusName::Continue => ExecutionStatus::Continue,
        }
    }
}
