//! Names of the control interface for enumerations of the controller: key positions, control right, ports,
//! execution status. Each type converts in both directions.
//!
//! They are separate from the controller's types because their spelling is a public format.

use serde::{Deserialize, Serialize};
use ts3100_controller::input;
use ts3100_controller::port::Port;
use ts3100_proto::status::ExecutionStatus;
use utoipa::ToSchema;

/// Position of the key switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = KeyWord)]
pub enum KeyPosition {
    Teaching,
    Internal,
    Ext,
}

impl From<input::KeySwitch> for KeyPosition {
    fn from(key: input::KeySwitch) -> KeyPosition {
        match key {
            input::KeySwitch::Teaching => KeyPosition::Teaching,
            input::KeySwitch::Internal => KeyPosition::Internal,
            input::KeySwitch::Ext => KeyPosition::Ext,
        }
    }
}

impl From<KeyPosition> for input::KeySwitch {
    fn from(word: KeyPosition) -> input::KeySwitch {
        match word {
            KeyPosition::Teaching => input::KeySwitch::Teaching,
            KeyPosition::Internal => input::KeySwitch::Internal,
            KeyPosition::Ext => input::KeySwitch::Ext,
        }
    }
}

/// Who commands the robot in EXT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = RightWord)]
pub enum RightHolder {
    Sig,
    Rs232c,
    Ether,
}

impl From<input::ControlRight> for RightHolder {
    fn from(right: input::ControlRight) -> RightHolder {
        match right {
            input::ControlRight::Sig => RightHolder::Sig,
            input::ControlRight::Rs232c => RightHolder::Rs232c,
            input::ControlRight::Ether => RightHolder::Ether,
        }
    }
}

impl From<RightHolder> for input::ControlRight {
    fn from(word: RightHolder) -> input::ControlRight {
        match word {
            RightHolder::Sig => input::ControlRight::Sig,
            RightHolder::Rs232c => input::ControlRight::Rs232c,
            RightHolder::Ether => input::ControlRight::Ether,
        }
    }
}

/// A communication port; small letters, as in the ready line, are read too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "UPPERCASE")]
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

impl From<Port> for PortName {
    fn from(port: Port) -> PortName {
        match port {
            Port::Host => PortName::Host,
            Port::Com1 => PortName::Com1,
            Port::Ip0 => PortName::Ip0,
            Port::Ip1 => PortName::Ip1,
            Port::Ip2 => PortName::Ip2,
            Port::Ip3 => PortName::Ip3,
        }
    }
}

impl From<PortName> for Port {
    fn from(word: PortName) -> Port {
        match word {
            PortName::Host => Port::Host,
            PortName::Com1 => Port::Com1,
            PortName::Ip0 => Port::Ip0,
            PortName::Ip1 => Port::Ip1,
            PortName::Ip2 => Port::Ip2,
            PortName::Ip3 => Port::Ip3,
        }
    }
}

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
