//! `/key-switch`, `/control-right`, `/servo` and the other switches and buttons of the robot, one for each row of the table
//! of controls; and `/program`.
//!
//! Each call sends one panel action to the controller, which decides whether it is allowed.

use super::alarms::AlarmList;
use super::api_names::{KeyPosition, RightHolder, RunModeName, StatusName};
use super::arm::ArmPosture;
use super::body::whole;
use super::resource::{Answer, Deserialize, Handle, Json, NoBody, Problem, Serialize, ToSchema, View};
use super::route_table::{Call, call};
use ts3100_controller::controls;
use ts3100_controller::input::{self, PanelAction};
use ts3100_proto::command::RunMode;
use ts3100_proto::status::ExecutionStatus;

/// The key switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KeySwitch {
    /// Its position.
    #[serde(with = "KeyPosition")]
    #[schema(value_type = KeyPosition)]
    position: input::KeySwitch,
}

/// The parameter EXTERNAL mode control right.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlRight {
    /// Who commands the robot in EXT.
    #[serde(with = "RightHolder")]
    #[schema(value_type = RightHolder)]
    holder: input::ControlRight,
}

/// The state of a button that latches.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Button {
    /// Whether it is pressed.
    pressed: bool,
}

/// The safety switch (fence).
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SafetySwitch {
    /// Whether it is open.
    open: bool,
}

/// The state of a switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// Whether it is on.
    on: bool,
}

/// The battery of the RAM drive.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// Whether it is low.
    low: bool,
}

/// The speed override.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Override {
    /// In percent.
    #[serde(deserialize_with = "whole")]
    #[schema(minimum = 1, maximum = 100)]
    percent: u8,
}

/// The operation mode.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OperationMode {
    /// Which.
    #[serde(with = "RunModeName")]
    #[schema(value_type = RunModeName)]
    mode: RunMode,
}

/// The selected program and its status.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ProgramStatus {
    /// The selected file; empty when none is.
    file: String,
    /// Execution status.
    #[serde(with = "StatusName")]
    #[schema(value_type = StatusName)]
    status: ExecutionStatus,
    /// Current line of the file; 0 when no file is selected.
    line: u32,
}

impl ProgramStatus {
    /// As it is now.
    pub fn new(view: &View<'_>) -> ProgramStatus {
        let controller = view.controller;
        ProgramStatus {
            file: controller.selected().to_owned(),
            status: controller.status(),
            line: controller.line(),
        }
    }
}

/// Makes the calls of each row of the table of controls: two of a switch, which read and set it, and one of a button.
macro_rules! calls_of_controls {
    (
        switches { $(
            $(#[$doc:meta])*
            $name:ident: $variant:ident($type:ty $(, $range:expr)?) = $path:literal {
                form: $form:literal,
                document: $document:ident { $field:ident: $state:ident },
                act: $act:ident,
                needs_power: $needs_power:literal,
                cannot: $cannot:tt,
                get: $get:literal,
            }
        )* }
        buttons { $(
            $(#[$press_doc:meta])*
            $press_name:ident: $press:ident = $press_path:literal {
                form: $press_form:literal,
                group: $group:ident,
                answer: ($answer:ty, $look:path),
                $($more:tt)*
            }
        )* }
    ) => { utoipa_axum::paste! {
        $(
            #[doc = $get]
            #[utoipa::path(get, path = $path, responses((status = 200, body = $document)))]
            async fn [<get_ $name>](handle: Handle) -> Answer<$document> {
                handle.query([<look_at_ $name>]).await.map(Json)
            }

            $(#[$doc])*
            #[utoipa::path(put, path = $path, request_body = $document, responses((status = 200, body = $document)))]
            async fn [<put_ $name>](handle: Handle, Json($document { $field }): Json<$document>) -> Answer<$document> {
                $( let range = $range;
                if !range.contains(&$field) {
                    let expected = format!("{} to {}", range.start(), range.end());
                    return Err(Problem::invalid(stringify!($field), expected, $field));
                } )?
                handle.press(PanelAction::$variant($field), [<look_at_ $name>]).await
            }

            fn [<look_at_ $name>](view: &View<'_>) -> $document {
                $document { $field: view.controller.state().$state }
            }
        )*
        $(
            $(#[$press_doc])*
            #[utoipa::path(post, path = $press_path, responses((status = 200, body = $answer)))]
            async fn $press_name(handle: Handle, _: NoBody) -> Answer<$answer> {
                handle.press(PanelAction::$press, $look).await
            }
        )*

        /// The calls of the table of controls.
        pub fn calls() -> Vec<Call> {
            vec![
                $( call!("panel", self::[<get_ $name>]), call!("panel", self::[<put_ $name>]), )*
                $( call!(stringify!($group), self::$press_name), )*
            ]
        }
    } };
}

controls!(calls_of_controls);

/// Get the selected program and its status
#[utoipa::path(get, path = "/program", responses((status = 200, body = ProgramStatus)))]
pub async fn get_program(handle: Handle) -> Answer<ProgramStatus> {
    handle.query(ProgramStatus::new).await.map(Json)
}
