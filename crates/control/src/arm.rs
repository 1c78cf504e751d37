//! `/arm`: the data for a picture of the arm: model, posture, coordinate systems and path.
//!
//! `/arm/pose` is the part that changes while the arm moves, for readers that draw an animation.

use super::noise::without_noise;
use super::resource::{Serialize, View};
use ts3100_controller::model::{ArmKind, ArmModel};

/// The arm with its model.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ArmPicture {
    /// Posture and tool point.
    #[serde(flatten)]
    pose: ArmPosture,
    /// The model.
    model: ModelInfo,
    /// TOOL, the tool point as seen from the flange: X Y Z A B C; mm and degrees.
    tool: Vec<f64>,
    /// BASE in world; WORK is relative to it.
    base: Vec<f64>,
    /// WORK, the workpiece in BASE.
    work_frame: Vec<f64>,
    /// X Y Z of the tool point in world.
    tool_point: Vec<f64>,
    /// X Y Z of tool points in world along the motion under way or else the last one, at most 64.
    path: Vec<Vec<f64>>,
}

/// Posture and tool point of the arm.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ArmPosture {
    /// Virtual time in seconds.
    t: f64,
    /// Joint values: degrees, of the SCARA's third axis mm.
    joints: Vec<f64>,
    /// The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees.
    world: Vec<f64>,
    /// The tool point in the work coordinate system.
    work: Vec<f64>,
    /// Whether a motion is under way or held.
    moving: bool,
    /// Completed percentage of the motion; 100 without a motion.
    percent: f64,
    /// File line that is executed.
    executed_line: u32,
    /// File line that is analysed.
    analysed_line: u32,
}

/// A model of arm.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = ArmModel))]
struct ModelInfo {
    /// Name of the model.
    name: String,
    /// `six-axis` or `scara`.
    kind: &'static str,
    /// Lengths in mm.
    geometry: Geometry,
    /// Axes, axis 1 first.
    axes: Vec<AxisInfo>,
    /// Posture to which READY moves.
    ready: Vec<f64>,
    /// Speed of the tool point at 100 % in mm/s.
    max_tool_speed: f64,
}

/// An axis: degrees, or mm for axis 3 of a SCARA.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Axis))]
struct AxisInfo {
    /// Lowest value.
    min: f64,
    /// Highest value.
    max: f64,
    /// Speed at 100 %, units/s.
    max_speed: f64,
}

/// Lengths of an arm in mm.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(untagged)]
enum Geometry {
    /// Of a six-axis arm.
    SixAxis {
        /// Height of axis 2.
        shoulder_height: f64,
        /// Distance of axis 2 in front of axis 1.
        shoulder_offset: f64,
        /// Axis 2 to axis 3.
        upper_arm: f64,
        /// Distance of the forearm line in front of axis 3, arm stretched up.
        elbow_offset: f64,
        /// Axis 3 to the wrist centre.
        forearm: f64,
        /// Wrist centre to flange.
        flange: f64,
    },
    /// Of a SCARA.
    Scara {
        /// Axis 1 to axis 2.
        first_arm: f64,
        /// Axis 2 to the shaft.
        second_arm: f64,
    },
}

impl ModelInfo {
    fn new(model: &ArmModel) -> ModelInfo {
        let (kind, geometry) = match model.kind {
            ArmKind::SixAxis(lengths) => (
                "six-axis",
                Geometry::SixAxis {
                    shoulder_height: lengths.shoulder_height,
                    shoulder_offset: lengths.shoulder_offset,
                    upper_arm: lengths.upper_arm,
                    elbow_offset: lengths.elbow_offset,
                    forearm: lengths.forearm,
                    flange: lengths.flange,
                },
            ),
            ArmKind::Scara(lengths) => (
                "scara",
                Geometry::Scara {
                    first_arm: lengths.first_arm,
                    second_arm: lengths.second_arm,
                },
            ),
        };
        let axes = model.axes.iter().map(|axis| AxisInfo {
            min: axis.min,
            max: axis.max,
            max_speed: axis.max_speed,
        });
        ModelInfo {
            name: model.name.clone(),
            kind,
            geometry,
            axes: axes.collect(),
            ready: model.ready.iter().take(model.axes.len()).copied().collect(),
            max_tool_speed: model.max_tool_speed,
        }
    }
}

impl ArmPosture {
    /// Reads the present posture.
    pub(super) fn new(view: &View<'_>) -> ArmPosture {
        let controller = view.controller;
        let pose = controller.arm_pose();
        let (executed_line, analysed_line) = controller.steps();
        ArmPosture {
            t: controller.now().as_seconds(),
            joints: without_noise(&pose.joint_values()),
            world: without_noise(&pose.world_values()),
            work: without_noise(&pose.work_values()),
            moving: controller.is_arm_moving(),
            percent: controller.motion_percent(),
            executed_line,
            analysed_line,
        }
    }
}

impl ArmPicture {
    pub fn new(view: &View<'_>) -> ArmPicture {
        let controller = view.controller;
        let pose = controller.arm_pose();
        let frames = controller.frames();
        let path = controller.motion_path();
        ArmPicture {
            pose: ArmPosture::new(view),
            model: ModelInfo::new(&controller.config().model),
            tool: without_noise(&frames.tool.trans.coords),
            base: without_noise(&frames.base.trans.coords),
            work_frame: without_noise(&frames.work.trans.coords),
            tool_point: without_noise(&pose.world.xyz),
            path: path.iter().map(|point| without_noise(point)).collect(),
        }
    }
}
