//! The calls of the table of controls ([`ts3100_controller::controls`]): its switches, buttons and queries.
//!
//! Each call of a switch or a button sends one panel action to the controller, which decides whether it is allowed. The
//! documents are in the files of their resources.

use super::alarms::AlarmList;
use super::arm::{ArmPicture, ArmPosture};
use super::breakpoints::Breakpoints;
use super::channels::ChannelStatus;
use super::clock::ClockStatus;
use super::faults::FaultList;
use super::files::DriveStatus;
use super::lines::{LineList, LineTable};
use super::panel::{
    Battery, Button, ControlRight, KeySwitch, OperationMode, Override, ProgramStatus, SafetySwitch, Switch,
};
use super::parameters::Parameters;
use super::pendant::PendantStatus;
use super::power::PowerStatus;
use super::resource::{Answer, Handle, Json, NoBody, Problem, View, call};
use super::route_table::Call;
use super::status_frame::StatusField;
use super::variables::VariableInfo;
use ts3100_controller::{PanelAction, controls};

/// Makes the calls of each row: two of a switch, which read and set it, one of a button, and one of a query.
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
        queries { $(
            $(#[$query_doc:meta])*
            $query:ident = $query_path:literal {
                has_more: $has_more:literal,
                group: $query_group:ident,
                answer: ($read:ty, $read_by:path $(, $about:literal)?),
            }
        )* }
    ) => {
        $(
            // Not by the name of the control: `override` is a keyword.
            mod $act {
                use super::*;

                call! {
                    #[doc = $get]
                    get = get($path,
                        operation_id = concat!("get_", stringify!($name)),
                        responses((status = 200, body = $document)))
                }
                pub async fn get(handle: Handle) -> Answer<$document> {
                    handle.query(look).await.map(Json)
                }

                call! {
                    $(#[$doc])*
                    put = put($path,
                        operation_id = concat!("put_", stringify!($name)),
                        request_body = $document,
                        responses((status = 200, body = $document)))
                }
                pub async fn put(handle: Handle, Json($document { $field }): Json<$document>) -> Answer<$document> {
                    $( let range = $range;
                    if !range.contains(&$field) {
                        let expected = format!("{} to {}", range.start(), range.end());
                        return Err(Problem::invalid(stringify!($field), expected, $field));
                    } )?
                    handle.press(PanelAction::$variant($field), look).await
                }

                pub fn look(view: &View<'_>) -> $document {
                    $document { $field: view.controller.state().$state }
                }
            }
        )*
        $(
            call! {
                $(#[$press_doc])*
                $press_name = post($press_path, responses((status = 200, body = $answer)))
            }
            async fn $press_name(handle: Handle, _: NoBody) -> Answer<$answer> {
                handle.press(PanelAction::$press, $look).await
            }
        )*
        $(
            call! {
                $(#[$query_doc])*
                $query = get($query_path, responses((status = 200, $(description = $about,)? body = $read)))
            }
            async fn $query(handle: Handle) -> Answer<$read> {
                handle.query($read_by).await.map(Json)
            }
        )*

        /// The calls of the table of controls.
        pub fn calls() -> Vec<Call> {
            vec![
                $( $act::get::call("panel"), $act::put::call("panel"), )*
                $( $press_name::call(stringify!($group)), )*
                $( $query::call(stringify!($query_group)), )*
            ]
        }
    };
}

controls!(calls_of_controls);
