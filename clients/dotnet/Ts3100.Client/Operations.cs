// Written by clients/generate.py from the OpenAPI document. Do not edit.
using System.Collections.Generic;

namespace Ts3100
{
    static class Operations
    {
        public static readonly Dictionary<string, string> All = new Dictionary<string, string>
        {
            { "get_alarms", "GET /alarms" },
            { "raise_alarm", "POST /alarms" },
            { "reset_alarms", "POST /alarms/reset" },
            { "get_alarm_table", "GET /alarms/table" },
            { "get_alarm_row", "GET /alarms/table/{number}" },
            { "get_arm", "GET /arm" },
            { "get_pose", "GET /arm/pose" },
            { "get_battery", "GET /battery" },
            { "put_battery", "PUT /battery" },
            { "get_breakpoints", "GET /breakpoints" },
            { "put_breakpoints", "PUT /breakpoints" },
            { "get_channels", "GET /channels" },
            { "get_channel", "GET /channels/{port}" },
            { "drop_peer", "POST /channels/{port}/drop" },
            { "inject_bytes", "POST /channels/{port}/inject" },
            { "check_program", "POST /check" },
            { "get_clock", "GET /clock" },
            { "put_clock", "PUT /clock" },
            { "advance_time", "POST /clock/advance" },
            { "advance_time_until", "POST /clock/advance-until" },
            { "get_control_right", "GET /control-right" },
            { "put_control_right", "PUT /control-right" },
            { "get_coverage", "GET /coverage" },
            { "decode_text", "POST /decode" },
            { "get_emergency_stop", "GET /emergency-stop" },
            { "put_emergency_stop", "PUT /emergency-stop" },
            { "get_events", "GET /events{?since,count,state}" },
            { "get_faults", "GET /faults" },
            { "arm_fault", "POST /faults" },
            { "clear_faults", "DELETE /faults" },
            { "get_fault_kinds", "GET /faults/kinds" },
            { "get_fault", "GET /faults/{number}" },
            { "disarm_fault", "DELETE /faults/{number}" },
            { "get_feed_hold", "GET /feed-hold" },
            { "put_feed_hold", "PUT /feed-hold" },
            { "press_feed_hold", "POST /feed-hold/press" },
            { "get_files", "GET /files" },
            { "get_file", "GET /files/{name}" },
            { "put_file", "PUT /files/{name}" },
            { "delete_file", "DELETE /files/{name}" },
            { "select_file", "POST /files/{name}/select" },
            { "get_findings", "GET /findings" },
            { "get_health", "GET /health" },
            { "get_inputs", "GET /inputs" },
            { "get_input", "GET /inputs/{line}" },
            { "put_input", "PUT /inputs/{line}" },
            { "force_input", "PUT /inputs/{line}/force" },
            { "release_input", "DELETE /inputs/{line}/force" },
            { "pulse_input", "POST /inputs/{line}/pulse" },
            { "jog_arm", "POST /jog" },
            { "stop_jog", "POST /jog/stop" },
            { "get_key_switch", "GET /key-switch" },
            { "put_key_switch", "PUT /key-switch" },
            { "get_lines", "GET /lines" },
            { "get_machine_lock", "GET /machine-lock" },
            { "put_machine_lock", "PUT /machine-lock" },
            { "get_metrics", "GET /metrics" },
            { "get_outputs", "GET /outputs" },
            { "get_output", "GET /outputs/{line}" },
            { "put_output", "PUT /outputs/{line}" },
            { "force_output", "PUT /outputs/{line}/force" },
            { "release_output", "DELETE /outputs/{line}/force" },
            { "pulse_output", "POST /outputs/{line}/pulse" },
            { "get_override", "GET /override" },
            { "put_override", "PUT /override" },
            { "get_parameters", "GET /parameters" },
            { "get_pendant", "GET /pendant" },
            { "press_keys", "POST /pendant/keys" },
            { "get_positions", "GET /positions" },
            { "get_position", "GET /positions/{name}" },
            { "put_position", "PUT /positions/{name}" },
            { "teach_position", "POST /positions/{name}/teach" },
            { "get_power", "GET /power" },
            { "power_cycle", "POST /power/cycle" },
            { "power_off", "POST /power/off" },
            { "power_on", "POST /power/on" },
            { "get_program", "GET /program" },
            { "assign_variable", "POST /program/assign" },
            { "evaluate_expression", "POST /program/evaluate" },
            { "reset_program", "POST /program/reset" },
            { "run_program_to", "POST /program/run-to" },
            { "get_program_stack", "GET /program/stack" },
            { "start_program", "POST /program/start" },
            { "step_program", "POST /program/step" },
            { "step_task", "POST /program/step-task" },
            { "stop_program", "POST /program/stop" },
            { "reset_emulator", "POST /reset" },
            { "get_robots", "GET /robots" },
            { "get_robot", "GET /robots/{name}" },
            { "get_run_mode", "GET /run-mode" },
            { "put_run_mode", "PUT /run-mode" },
            { "get_safety_switch", "GET /safety-switch" },
            { "put_safety_switch", "PUT /safety-switch" },
            { "get_scenario", "GET /scenario" },
            { "get_servo", "GET /servo" },
            { "put_servo", "PUT /servo" },
            { "get_snapshot", "GET /snapshot" },
            { "load_snapshot", "PUT /snapshot" },
            { "get_snapshots", "GET /snapshots" },
            { "get_named_snapshot", "GET /snapshots/{name}" },
            { "put_snapshot", "PUT /snapshots/{name}" },
            { "delete_snapshot", "DELETE /snapshots/{name}" },
            { "restore_snapshot", "POST /snapshots/{name}/restore" },
            { "get_state", "GET /state" },
            { "get_status_frame", "GET /status-frame" },
            { "get_transcript", "GET /transcript{?format}" },
            { "get_variables", "GET /variables" },
            { "get_variable", "GET /variables/{name}" },
            { "put_variable", "PUT /variables/{name}" },
            { "get_version", "GET /version" },
            { "wait_until", "POST /wait" },
            { "get_wires", "GET /wires" },
            { "put_outside", "PUT /wires/outside/{name}" },
        };
    }

    /// <summary>The selected program.</summary>
    public sealed partial class Program
    {
        /// <summary>The selected file; empty when none is.</summary>
        public readonly string File;
        /// <summary>Execution status.</summary>
        public readonly string Status;
        /// <summary>Current line of the file; 0 when no file is selected.</summary>
        public readonly int Line;
        internal Program(Json json)
        {
            File = Read.Text(json, "file");
            Status = Read.Text(json, "status");
            Line = Read.Whole(json, "line");
        }
    }

    /// <summary>An alarm, with its cause and its remedy.</summary>
    public sealed partial class Alarm
    {
        /// <summary>Number, as `level-code`.</summary>
        public readonly string Number;
        /// <summary>Level: 8 the most severe, 1 a warning.</summary>
        public readonly int Level;
        /// <summary>Text that the operator reads.</summary>
        public readonly string Text;
        /// <summary>Cause of the alarm.</summary>
        public readonly string Cause;
        /// <summary>Remedy.</summary>
        public readonly string Remedy;
        /// <summary>Date and time, `YYYY-MM-DD HH:MM:SS`.</summary>
        public readonly string At;
        internal Alarm(Json json)
        {
            Number = Read.Text(json, "number");
            Level = Read.Whole(json, "level");
            Text = Read.Text(json, "text");
            Cause = Read.Text(json, "cause");
            Remedy = Read.Text(json, "remedy");
            At = Read.Text(json, "at");
        }
    }

    /// <summary>A mistake of a host, or what a fault has caused; `ts3100 docs findings` lists the rules.</summary>
    public sealed partial class Finding
    {
        /// <summary>Name of the rule of a finding.</summary>
        public readonly string Rule;
        /// <summary>Severity of a finding; `note` if a fault caused it.</summary>
        public readonly Severity Severity;
        /// <summary>Message.</summary>
        public readonly string Message;
        /// <summary>Remedy of a finding.</summary>
        public readonly string Remedy;
        /// <summary>Virtual time in seconds.</summary>
        public readonly double Seconds;
        /// <summary>Port of the event.</summary>
        public readonly string Port;
        /// <summary>Bytes as text, control codes by name: `&lt;STX>SO&lt;CR>&lt;ETX>`. Of an alarm and the pendant the words themselves.</summary>
        public readonly string Text;
        /// <summary>Number and kind of the fault that caused a finding; absent if the host caused it.</summary>
        public readonly string CausedBy;
        internal Finding(Json json)
        {
            Rule = Read.Text(json, "rule");
            Severity = Read.Severity(json, "severity");
            Message = Read.Text(json, "message");
            Remedy = Read.Text(json, "remedy");
            Seconds = Read.Number(json, "t");
            Port = Read.Text(json, "port");
            Text = Read.Text(json, "text");
            CausedBy = Read.Text(json, "caused-by");
        }
    }

    /// <summary>A fault and its outcome.</summary>
    public sealed partial class Fault
    {
        /// <summary>Number of the fault.</summary>
        public readonly int Number;
        /// <summary>Kind of the fault.</summary>
        public readonly string Kind;
        /// <summary>As text, like `--fault`.</summary>
        public readonly string Spec;
        /// <summary>Whether it can still trigger.</summary>
        public readonly bool Armed;
        /// <summary>Matches while it was armed.</summary>
        public readonly int Seen;
        /// <summary>Number of times it triggered.</summary>
        public readonly int Fired;
        /// <summary>Times at which it triggered, in seconds of virtual time; the first hundred.</summary>
        public readonly double[] At;
        internal Fault(Json json)
        {
            Number = Read.Whole(json, "id");
            Kind = Read.Text(json, "kind");
            Spec = Read.Text(json, "spec");
            Armed = Read.Truth(json, "armed");
            Seen = Read.Whole(json, "seen");
            Fired = Read.Whole(json, "fired");
            At = Read.Numbers(json, "at");
        }
    }

    /// <summary>The virtual time and how it passes.</summary>
    public sealed partial class Clock
    {
        /// <summary>How time passes: `real`, `xN`, `stepped`, `auto`.</summary>
        public readonly string Mode;
        /// <summary>Virtual time in seconds since the emulator was started or reset.</summary>
        public readonly double Now;
        /// <summary>Date and time as the error history writes them.</summary>
        public readonly string Calendar;
        internal Clock(Json json)
        {
            Mode = Read.Text(json, "mode");
            Now = Read.Number(json, "now");
            Calendar = Read.Text(json, "calendar");
        }
    }

    /// <summary>The end of a wait.</summary>
    public sealed partial class Reached
    {
        /// <summary>Virtual time at the end of the wait, in seconds.</summary>
        public readonly double Now;
        /// <summary>Virtual time that passed during the wait, in seconds.</summary>
        public readonly double Passed;
        internal Reached(Json json)
        {
            Now = Read.Number(json, "now");
            Passed = Read.Number(json, "passed");
        }
    }

    /// <summary>Joints in degrees (the third of a SCARA in mm), and the tool point in the world in mm and degrees.</summary>
    public sealed partial class Pose
    {
        /// <summary>Joint values: degrees, of the SCARA's third axis mm.</summary>
        public readonly double[] Joints;
        /// <summary>The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees.</summary>
        public readonly double[] World;
        /// <summary>Whether a motion is under way or held.</summary>
        public readonly bool Moving;
        /// <summary>Completed percentage of the motion; 100 without a motion.</summary>
        public readonly double Percent;
        internal Pose(Json json)
        {
            Joints = Read.Numbers(json, "joints");
            World = Read.Numbers(json, "world");
            Moving = Read.Truth(json, "moving");
            Percent = Read.Number(json, "percent");
        }
    }
}
