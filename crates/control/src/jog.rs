//! `/jog`: the keys of the teach pendant that move the arm.
//!
//! A call with `hold` is a held key: the end of the call releases it.

use super::arm::ArmPosture;
use super::body::whole;
use super::resource::{Answer, Deserialize, Handle, Json, Serialize, View, call};
use std::time::Duration;
use tokio::time::sleep;
use ts3100_controller::action::Action;
use ts3100_controller::input::{JogMode, PanelAction};

/// Interval between two checks whether the arm still moves, while a key is held.
const LOOK: Duration = Duration::from_millis(50);

/// A key of the teach pendant that moves the arm.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct JogRequest {
    /// Axis of the arm from 1; in a coordinate system 1 to 3 go along X Y Z, 4 to 6 turn about them.
    #[serde(deserialize_with = "whole")]
    #[cfg_attr(test, schema(minimum = 1, maximum = 8))]
    axis: u8,
    /// Towards larger or smaller values.
    direction: JogWay,
    /// The coordinate system.
    coordinates: JogCoordinates,
    /// 2, 10 or 30 % of full speed, at most 250 mm/s; of inching steps of 0.1, 1 or 10 mm or degrees.
    speed: JogSpeed,
    /// One step instead of a motion as far as limits and reach allow.
    #[serde(default)]
    inching: bool,
    /// The call lasts as long as the motion. If the client ends it earlier, the arm stops.
    #[serde(default)]
    hold: bool,
}

/// Towards larger or smaller values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = JogDirection))]
#[serde(rename_all = "lowercase")]
enum JogWay {
    Plus,
    Minus,
}

/// The coordinate system of a jog, in the order of the command SC.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(rename_all = "lowercase")]
enum JogCoordinates {
    Joint,
    Tool,
    Work,
    World,
}

/// The speed of a jog, in the order of the command RT.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(rename_all = "lowercase")]
enum JogSpeed {
    Slow,
    Mid,
    Fast,
}

/// Releases the key if its call ends before the motion.
struct HeldKey {
    handle: Handle,
    is_held: bool,
}

impl Drop for HeldKey {
    fn drop(&mut self) {
        if self.is_held {
            let handle = self.handle.clone();
            tokio::spawn(async move {
                // Fails only while the emulator shuts down.
                let _ = handle.act(Action::Panel(PanelAction::JogStop), |_| ()).await;
            });
        }
    }
}

call! {
    /// Press a key that moves the arm
    ///
    /// Only with the key switch in TEACHING, servo power on and no program running. The arm moves as far as its limits and its
    /// reach allow, until POST /jog/stop.
    jog = post("/jog",
        operation_id = "jog_arm",
        request_body = JogRequest,
        responses((status = 200, body = ArmPosture)))
}
pub async fn jog(handle: Handle, Json(body): Json<JogRequest>) -> Answer<ArmPosture> {
    let mode = JogMode {
        coordinate: body.coordinates as u16,
        rate: body.speed as u16,
        mode: if body.inching {
            JogMode::INCHING
        } else {
            JogMode::JOG
        },
    };
    let positive = body.direction == JogWay::Plus;
    let press = PanelAction::Jog {
        axis: body.axis,
        positive,
        mode,
    };
    let mut key = HeldKey {
        handle,
        is_held: body.hold,
    };
    let mut pose = key.handle.act(Action::Panel(press), ArmPosture::new).await?;
    while key.is_held {
        sleep(LOOK).await;
        let look = |view: &View<'_>| (ArmPosture::new(view), view.controller.is_jogging());
        (pose, key.is_held) = key.handle.query(look).await?;
    }
    Ok(Json(pose))
}
