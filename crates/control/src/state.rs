//! `/state`: everything about the controller at one moment, in one document.
//!
//! It is put together from the documents of the other resources; values are read from the controller's queries.

use super::alarms::ActiveAlarm;
use super::api_names::{KeyPosition, RightHolder, StatusName};
use super::channels::ChannelStatus;
use super::faults::FaultList;
use super::files::DriveStatus;
use super::lines::LineList;
use super::noise::without_noise;
use super::parameters::Parameters;
use super::resource::{Answer, Handle, Json, Serialize, View, call};
use super::variables::VariableInfo;
use std::collections::BTreeMap;
use std::sync::Arc;
use ts3100_controller::{ControlRight, KeySwitch, Port, Time};
use ts3100_proto::status::ExecutionStatus;

/// The whole state at one moment.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = State))]
pub struct ControllerState {
    /// Virtual time in seconds.
    t: f64,
    /// How time passes: `real`, `xN`, `stepped`, `auto`.
    time_mode: String,
    /// Date and time as the error history writes them.
    calendar: String,
    /// Whether the power is on.
    power: bool,
    /// Position of the key switch.
    #[serde(with = "KeyPosition")]
    #[cfg_attr(test, schema(value_type = KeyPosition))]
    key_switch: KeySwitch,
    /// Source of commands in EXT.
    #[serde(with = "RightHolder")]
    #[cfg_attr(test, schema(value_type = RightHolder))]
    control_right: ControlRight,
    /// Master mode: the present column of the permission tables.
    master_mode: &'static str,
    /// Operation mode: `continuous`, `cycle`, `step`, `segment`.
    run_mode: &'static str,
    /// Whether servo power is on.
    servo: bool,
    /// Virtual time in seconds at which delayed servo power comes on (`servo.interval`).
    #[serde(skip_serializing_if = "Option::is_none")]
    servo_due: Option<f64>,
    /// Whether the emergency stop is pressed.
    emergency_stop: bool,
    /// Whether the safety switch is open.
    safety_open: bool,
    /// Whether feed hold is on.
    feed_hold: bool,
    /// Whether the machine lock is on.
    machine_lock: bool,
    /// Whether the battery of the RAM drive is low.
    battery_low: bool,
    /// Speed override in percent.
    override_percent: u8,
    /// Guidance by hand.
    guide: JogStatus,
    /// The selected file; empty when none is.
    file: String,
    /// Execution status.
    #[serde(with = "StatusName")]
    #[cfg_attr(test, schema(value_type = StatusName))]
    status: ExecutionStatus,
    /// Current file line of the main program.
    line: u32,
    /// File line that is executed: that of the current motion, if any.
    executed_line: u32,
    /// File line that is analysed.
    analysed_line: u32,
    /// File lines before which the program stops, in ascending order.
    breakpoints: Vec<u32>,
    /// The main program, its tasks, and the statement of DO.
    tasks: Vec<TaskStatus>,
    /// The arm.
    arm: ArmPose,
    /// Hand 1 and hand 2: `open`, `closed` or `neither`.
    hands: [&'static str; 2],
    /// Active alarms, oldest first.
    alarms: Vec<ActiveAlarm>,
    /// Inputs (Din).
    inputs: LineList,
    /// Outputs (Dout).
    outputs: LineList,
    /// The six communication ports.
    channels: Vec<ChannelStatus>,
    /// The RAM drive.
    files: DriveStatus,
    /// Variables and positions of GLOBAL and DATA of the selected file.
    variables: Vec<VariableInfo>,
    /// Faults and their outcome.
    faults: FaultList,
    /// Rules of the manual that hosts broke, with the number of times.
    findings: BTreeMap<String, u64>,
    /// Whether a scenario is played; `/scenario` has its progress.
    scenario: bool,
    /// The watchdog of a host, while it is armed.
    #[serde(skip_serializing_if = "Option::is_none")]
    watchdog: Option<WatchdogStatus>,
    /// Parameters in effect.
    parameters: Parameters,
    /// Output of PRINT on the teach pendant.
    pendant: String,
    /// The three pages [ETHER] of the teach pendant.
    ether_pages: Vec<PendantPage>,
    /// Whole minutes since the power came on.
    power_on_minutes: u32,
    /// Whole minutes in which a program ran since then.
    run_minutes: u32,
}

/// Guidance by hand, as in SF.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Guidance))]
pub struct JogStatus {
    /// 0 joint, 1 tool, 2 work, 3 world.
    coordinate: u16,
    /// 0 slow, 1 mid, 2 fast.
    rate: u16,
    /// 0 jog, 1 inching, 2 free.
    mode: u16,
}

/// A task.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Task))]
pub struct TaskStatus {
    /// 1 the main program, 0 the statement of DO.
    id: u16,
    /// Current file line.
    line: u32,
    /// State of the task: `stopped`, `ready`, `running`, `held`, `moving`, `queued`, `resting`, `delay`, `input`,
    /// `wait`.
    doing: &'static str,
    /// The port from which it waits for values; absent for the teach pendant.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schema(value_type = Option<super::api_names::PortName>))]
    reads: Option<Port>,
    /// Its open calls, outermost first.
    calls: Vec<OpenCall>,
}

/// A program under way.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct OpenCall {
    /// Name of the program.
    program: String,
    /// File line that it is at.
    line: u32,
}

/// The arm.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Arm))]
pub struct ArmPose {
    /// The model.
    model: String,
    /// Joint values: degrees, of the SCARA's third axis mm.
    joints: Vec<f64>,
    /// The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees.
    world: Vec<f64>,
    /// The tool point in the work coordinate system.
    work: Vec<f64>,
    /// Name of that coordinate system; empty without a name.
    work_name: String,
    /// The configuration as a program writes it.
    configuration: i64,
    /// Whether a motion is under way or held.
    moving: bool,
    /// Completed percentage of the motion; 100 without a motion.
    percent: f64,
    /// The current position file of the SCARA edition, its 20 items: motion status, execution line, joints 1 to 6 as
    /// integer parts, as commanded and as measured, torques 1 to 6 in percent of the acceleration an axis has. No known
    /// command reads it.
    position_file: String,
}

/// The watchdog of a host.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Watchdog))]
pub struct WatchdogStatus {
    /// Longest allowed pause between two SM, in seconds.
    timeout: f64,
    /// Level of the alarm after a longer pause.
    level: u8,
    /// Virtual time in seconds at which the watchdog raises the alarm.
    due: f64,
}

/// One page of the teach pendant.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct PendantPage {
    /// For example `ETHERNET STATUS [1/3]`.
    heading: String,
    /// The lines below it.
    lines: Vec<String>,
}

/// The pages [ETHER] of the teach pendant.
pub fn ether_pages(view: &View<'_>) -> Vec<PendantPage> {
    let pages = view.controller.ethernet_pages().into_iter();
    pages
        .map(|page| PendantPage {
            heading: page.heading,
            lines: page.lines,
        })
        .collect()
}

impl ControllerState {
    /// Reads the present state.
    pub fn new(view: &View<'_>, findings: BTreeMap<String, u64>, scenario: bool) -> ControllerState {
        let controller = view.controller;
        let state = controller.state();
        let now = controller.now();
        let (executed_line, analysed_line) = controller.steps();
        let hand = |open: Option<bool>| match open {
            Some(true) => "open",
            Some(false) => "closed",
            None => "neither",
        };
        ControllerState {
            t: now.as_seconds(),
            time_mode: view.time.to_string(),
            calendar: controller.calendar_now().to_string(),
            power: state.powered,
            key_switch: state.key,
            control_right: state.control_right,
            master_mode: state.master_mode().as_str(),
            run_mode: state.run_mode.as_str(),
            servo: state.servo,
            servo_due: state.servo_due.map(Time::as_seconds),
            emergency_stop: state.emergency_stop,
            safety_open: state.safety_open,
            feed_hold: state.feed_hold,
            machine_lock: state.machine_lock,
            battery_low: state.battery_low,
            override_percent: state.override_percent,
            guide: JogStatus {
                coordinate: state.jog_mode.coordinate,
                rate: state.jog_mode.rate,
                mode: state.jog_mode.mode,
            },
            file: controller.selected().to_owned(),
            status: controller.status(),
            line: controller.line(),
            executed_line,
            analysed_line,
            breakpoints: controller.breakpoint_lines().collect(),
            tasks: task_statuses(view),
            arm: arm_pose(view),
            hands: controller.hands().map(hand),
            alarms: controller
                .alarms()
                .active()
                .iter()
                .map(ActiveAlarm::new)
                .collect(),
            inputs: LineList::inputs(view),
            outputs: LineList::outputs(view),
            channels: ChannelStatus::all(view),
            files: DriveStatus::new(view),
            variables: VariableInfo::all(view),
            faults: FaultList::new(view),
            findings,
            scenario,
            watchdog: state.watchdog.as_ref().map(|watchdog| WatchdogStatus {
                timeout: watchdog.timeout.as_secs_f64(),
                level: watchdog.level.number(),
                due: watchdog.deadline().as_seconds(),
            }),
            parameters: Parameters::new(view),
            pendant: controller.pendant().to_owned(),
            ether_pages: ether_pages(view),
            power_on_minutes: state.power_on_minutes(now),
            run_minutes: state.run_minutes(now),
        }
    }
}

fn task_statuses(view: &View<'_>) -> Vec<TaskStatus> {
    let tasks = view.controller.tasks().into_iter();
    tasks
        .map(|task| TaskStatus {
            id: task.id,
            line: task.line,
            doing: task.state,
            reads: task.reads.and_then(Port::from_channel),
            calls: task
                .calls
                .into_iter()
                .map(|(program, line)| OpenCall { program, line })
                .collect(),
        })
        .collect()
}

fn arm_pose(view: &View<'_>) -> ArmPose {
    let controller = view.controller;
    let pose = controller.arm_pose();
    let digits = pose.configuration;
    // The document has the four axes every SCARA has; T is the fifth value of its position.
    let axes = match pose.kind {
        scol_mini::Arm::SixAxis => 6,
        scol_mini::Arm::Scara => 4,
    };
    ArmPose {
        model: controller.config().model.name.clone(),
        joints: without_noise(&pose.joint_values()[..])
            .into_iter()
            .take(axes)
            .collect(),
        world: without_noise(&pose.world_values()),
        work: without_noise(&pose.work_values()),
        work_name: controller.work_name(),
        configuration: scol_mini::Configuration { digits }.number_on(pose.kind),
        moving: controller.is_arm_moving(),
        percent: controller.motion_percent(),
        position_file: String::from_utf8_lossy(&view.controller.current_position().encode())
            .trim_end()
            .to_owned(),
    }
}

call! {
    /// Get the whole state
    ///
    /// Everything at one moment: mode, status, panel, lines, arm, channels, tasks, alarms.
    get_state = get("/state", responses((status = 200, body = ControllerState)))
}
pub async fn get_state(handle: Handle) -> Answer<ControllerState> {
    let (journal, scenario) = (Arc::clone(&handle.journal), handle.scenario.is_some());
    let look = move |view: &View<'_>| ControllerState::new(view, journal.findings_by_rule(), scenario);
    handle.query(look).await.map(Json)
}
