//! The words of the documents for what the controller names by types, in both directions.

use serde::{Deserialize, Serialize};
use ts3100_controller::input;
use ts3100_controller::port::Port;
use ts3100_proto::status::ExecutionStatus;
use utoipa::ToSchema;

/// Position of the key switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum KeyWord {
    Teaching,
    Internal,
    Ext,
}

impl From<input::KeySwitch> for KeyWord {
    fn from(key: input::KeySwitch) -> KeyWord {
        match key {
            input::KeySwitch::Teaching => KeyWord::Teaching,
            input::KeySwitch::Internal => KeyWord::Internal,
            input::KeySwitch::Ext => KeyWord::Ext,
        }
    }
}

impl From<KeyWord> for input::KeySwitch {
    fn from(word: KeyWord) -> input::KeySwitch {
        match word {
            KeyWord::Teaching => input::KeySwitch::Teaching,
            KeyWord::Internal => input::KeySwitch::Internal,
            KeyWord::Ext => input::KeySwitch::Ext,
        }
    }
}

/// Who commands the robot in EXT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum RightWord {
    Sig,
    Rs232c,
    Ether,
}

impl From<input::ControlRight> for RightWord {
    fn from(right: input::ControlRight) -> RightWord {
        match right {
            input::ControlRight::Sig => RightWord::Sig,
            input::ControlRight::Rs232c => RightWord::Rs232c,
            input::ControlRight::Ether => RightWord::Ether,
        }
    }
}

impl From<RightWord> for input::ControlRight {
    fn from(word: RightWord) -> input::ControlRight {
        match word {
            RightWord::Sig => input::ControlRight::Sig,
            RightWord::Rs232c => input::ControlRight::Rs232c,
            RightWord::Ether => input::ControlRight::Ether,
        }
    }
}

/// A communication port; small letters, as in the ready line, are read too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "UPPERCASE")]
pub enum PortWord {
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

impl From<Port> for PortWord {
    fn from(port: Port) -> PortWord {
        match port {
            Port::Host => PortWord::Host,
            Port::Com1 => PortWord::Com1,
            Port::Ip0 => PortWord::Ip0,
            Port::Ip1 => PortWord::Ip1,
            Port::Ip2 => PortWord::Ip2,
            Port::Ip3 => PortWord::Ip3,
        }
    }
}

impl From<PortWord> for Port {
    fn from(word: PortWord) -> Port {
        match word {
            PortWord::Host => Port::Host,
            PortWord::Com1 => Port::Com1,
            PortWord::Ip0 => Port::Ip0,
            PortWord::Ip1 => Port::Ip1,
            PortWord::Ip2 => Port::Ip2,
            PortWord::Ip3 => Port::Ip3,
        }
    }
}

/// Execution status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum StatusWord {
    /// A program or the statement of DO runs.
    Running,
    /// `stop (reset)`: at step 1.
    Reset,
    /// `stop (retry)`: inside a step, which will be done again.
    Retry,
    /// `stop (continue)`: between steps.
    Continue,
}

impl From<ExecutionStatus> for StatusWord {
    fn from(status: ExecutionStatus) -> StatusWord {
        match status {
            ExecutionStatus::Running => StatusWord::Running,
            ExecutionStatus::Reset => StatusWord::Reset,
            ExecutionStatus::Retry => StatusWord::Retry,
            ExecutionStatus::Continue => StatusWord::Continue,
        }
    }
}

impl From<StatusWord> for ExecutionStatus {
    fn from(word: StatusWord) -> ExecutionStatus {
        match word {
            StatusWord::Running => ExecutionStatus::Running,
            StatusWord::Reset => ExecutionStatus::Reset,
            StatusWord::Retry => ExecutionStatus::Retry,
            StatusWord::Continue => ExecutionStatus::Continue,
        }
    }
}
