//! Documents of the operating panel: key switch, control right, servo and the other switches; and of the selected program.
//!
//! The calls are made from the table of controls in [`super::controls`].

use super::api_names::{KeyPosition, RightHolder, RunModeName, StatusName};
use super::body::whole;
use super::resource::{Deserialize, Serialize, View};
use ts3100_controller::input;
use ts3100_proto::command::RunMode;
use ts3100_proto::status::ExecutionStatus;

/// The key switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct KeySwitch {
    /// Position of the key switch.
    #[serde(with = "KeyPosition")]
    #[cfg_attr(test, schema(value_type = KeyPosition))]
    pub position: input::KeySwitch,
}

/// The parameter EXTERNAL mode control right.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct ControlRight {
    /// Source of commands in EXT.
    #[serde(with = "RightHolder")]
    #[cfg_attr(test, schema(value_type = RightHolder))]
    pub holder: input::ControlRight,
}

/// The state of a button that latches.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Button {
    /// Whether it is pressed.
    pub pressed: bool,
}

/// The safety switch (fence).
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct SafetySwitch {
    /// Whether it is open.
    pub open: bool,
}

/// The state of a switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// Whether it is on.
    pub on: bool,
}

/// The battery of the RAM drive.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// Whether it is low.
    pub low: bool,
}

/// The speed override.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Override {
    /// In percent.
    #[serde(deserialize_with = "whole")]
    #[cfg_attr(test, schema(minimum = 1, maximum = 100))]
    pub percent: u8,
}

/// The operation mode.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct OperationMode {
    /// Name of the mode.
    #[serde(with = "RunModeName")]
    #[cfg_attr(test, schema(value_type = RunModeName))]
    pub mode: RunMode,
}

/// The selected program and its status.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ProgramStatus {
    /// The selected file; empty when none is.
    file: String,
    /// Execution status.
    #[serde(with = "StatusName")]
    #[cfg_attr(test, schema(value_type = StatusName))]
    status: ExecutionStatus,
    /// Current line of the file; 0 when no file is selected.
    line: u32,
}

impl ProgramStatus {
    /// Reads the present state.
    pub fn new(view: &View<'_>) -> ProgramStatus {
        let controller = view.controller;
        ProgramStatus {
            file: controller.selected().to_owned(),
            status: controller.status(),
            line: controller.line(),
        }
    }
}
