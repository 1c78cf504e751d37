using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Net;
using System.Net.Http;
using System.Text;
using System.Text.RegularExpressions;

namespace Ts3100
{
    /// <summary>The emulator refused a call of the control interface; nothing has changed.</summary>
    public sealed class ControlException : InvalidOperationException
    {
        /// <summary>The HTTP status: 409 if the state forbids the call; 0 without an answer.</summary>
        public int StatusCode { get; private set; }

        /// <summary>An exception with the emulator's sentence.</summary>
        public ControlException(int statusCode, string message) : base(message)
        {
            StatusCode = statusCode;
        }
    }

    /// <summary>How bad a finding is.</summary>
    public enum Severity
    {
        /// <summary>It worked; another controller may see it differently.</summary>
        Note,
        /// <summary>The manual advises against it, or the robot refused what the host could have known.</summary>
        Warning,
        /// <summary>Something was lost, given up, or is not a text, command or file at all.</summary>
        Error
    }

    public sealed partial class Finding
    {
        /// <summary>Port, message, rule and remedy in two sentences.</summary>
        public override string ToString()
        {
            return Port + ": " + Message + " (" + Rule + ", " + Severity.ToString().ToLowerInvariant() + "). " + Remedy;
        }
    }

    /// <summary>Members of a document; an empty value where it has none.</summary>
    static class Read
    {
        static bool Has(Json json, string name) { return json.Has(name) && !json[name].IsNull; }
        public static string Text(Json json, string name) { return Has(json, name) ? json[name].AsString() : ""; }
        public static double Number(Json json, string name) { return json[name].AsDouble(); }
        public static int Whole(Json json, string name) { return json[name].AsInt(); }
        public static bool Truth(Json json, string name) { return json[name].AsBool(); }
        public static double[] Numbers(Json json, string name) { return json[name].AsDoubles(); }
        public static Severity Severity(Json json, string name) { return (Severity)Enum.Parse(typeof(Severity), Text(json, name), true); }
    }

    /// <summary>A condition was not met in time; the message says what is there instead.</summary>
    public sealed class NotReachedException : TimeoutException
    {
        internal NotReachedException(string message) : base(message) { }
    }

    /// <summary>The control interface of the emulator: inspects and sets any state, and the clock.</summary>
    /// <remarks>A call returns when its effect is there. <see cref="Call"/> reaches what has no method.</remarks>
    public class Robot : IDisposable
    {
        // The HTTP status of a wait that took longer than `wall`.
        const int WallSeconds = 30, TooLong = 408;
        static readonly TimeSpan LongestCall = TimeSpan.FromSeconds(60);

        readonly HttpClient http;
        readonly string url;

        /// <summary>The control interface at this URL.</summary>
        /// <param name="url">The URL of the ready line or of TS3100_CONTROL_URL; ends in /robots/NAME for one of several.</param>
        /// <param name="token">The bearer token, if it wants one.</param>
        public Robot(string url, string token = null)
        {
            this.url = url.TrimEnd('/');
            // A proxy for the Internet does not lead to a test machine.
            http = new HttpClient(new HttpClientHandler { UseProxy = false }) { Timeout = LongestCall };
            if (token != null)
                http.DefaultRequestHeaders.Add("Authorization", "Bearer " + token);
        }

        /// <summary>The robot that <c>ts3100 exec</c> has started around this process.</summary>
        public static Robot FromEnvironment()
        {
            string url = Environment.GetEnvironmentVariable("TS3100_CONTROL_URL");
            if (url == null)
                throw new ControlException(0, "TS3100_CONTROL_URL is not set: run the tests with `ts3100 exec -- dotnet test`");
            return new Robot(url, Environment.GetEnvironmentVariable("TS3100_CONTROL_TOKEN"));
        }

        /// <summary>The URL of the control interface.</summary>
        public string Url { get { return url; } }
        /// <summary>Makes a call by its operation in the OpenAPI document: <c>Call("put_input", "line", 5, "on", true)</c>.</summary>
        /// <param name="operation">The operation.</param>
        /// <param name="namesAndValues">The parameters of the path and the query, and the fields of the body, in turn.</param>
        /// <returns>The answer; as a string if it is not JSON.</returns>
        /// <exception cref="ControlException">The call was refused, or there was no answer.</exception>
        public Json Call(string operation, params object[] namesAndValues)
        {
            if (!Operations.All.TryGetValue(operation, out string row))
                throw new ArgumentException("unknown operation " + operation);
            string method = row.Split(' ')[0];
            string[] template = row.Split(' ')[1].Split(new[] { "{?" }, StringSplitOptions.None);
            var rest = new Dictionary<string, object>();
            for (int at = 0; at + 1 < namesAndValues.Length; at += 2)
                rest[(string)namesAndValues[at]] = namesAndValues[at + 1];
            Func<string, string> take = name =>
            {
                if (!rest.TryGetValue(name, out object value))
                    throw new ArgumentException(operation + " needs the argument " + name);
                rest.Remove(name);
                return Uri.EscapeDataString(Json.Plain(value));
            };
            string path = Regex.Replace(template[0], @"\{(\w+)\}", place => take(place.Groups[1].Value));
            string[] query = template.Skip(1).SelectMany(names => names.TrimEnd('}').Split(',')).Where(rest.ContainsKey).ToArray();
            if (query.Length > 0)
                path += "?" + string.Join("&", query.Select(name => name + "=" + take(name)));
            bool hasBody = method == "PUT" || method == "POST";
            if (!hasBody && rest.Count > 0)
                throw new ArgumentException(operation + " has no argument " + rest.Keys.First());
            return Send(method, path, hasBody ? Json.Object(rest.SelectMany(one => new[] { one.Key, one.Value }).ToArray()) : null);
        }

        // Settings

        /// <summary>The key switch: <c>teaching</c>, <c>internal</c> or <c>ext</c>.</summary>
        public string KeySwitch() { return Call("get_key_switch")["position"].AsString(); }
        /// <summary>Sets it.</summary>
        public void SetKeySwitch(string value) { Call("put_key_switch", "position", value); }
        /// <summary>Who has the control right: <c>sig</c>, <c>rs232c</c> or <c>ether</c>.</summary>
        public string ControlRight() { return Call("get_control_right")["holder"].AsString(); }
        /// <summary>Sets it.</summary>
        public void SetControlRight(string value) { Call("put_control_right", "holder", value); }
        /// <summary>Whether the emergency stop is pressed.</summary>
        public bool EmergencyStop() { return Call("get_emergency_stop")["pressed"].AsBool(); }
        /// <summary>Sets it.</summary>
        public void SetEmergencyStop(bool value) { Call("put_emergency_stop", "pressed", value); }
        /// <summary>Whether the safety switch is open.</summary>
        public bool SafetySwitch() { return Call("get_safety_switch")["open"].AsBool(); }
        /// <summary>Opens or closes it.</summary>
        public void SetSafetySwitch(bool open) { Call("put_safety_switch", "open", open); }
        /// <summary>Whether servo power is on.</summary>
        public bool Servo() { return Call("get_servo")["on"].AsBool(); }
        /// <summary>Sets it.</summary>
        public void SetServo(bool value) { Call("put_servo", "on", value); }
        /// <summary>Whether feed hold is on.</summary>
        public bool FeedHold() { return Call("get_feed_hold")["on"].AsBool(); }
        /// <summary>Sets it.</summary>
        public void SetFeedHold(bool value) { Call("put_feed_hold", "on", value); }
        /// <summary>Whether the machine lock is on.</summary>
        public bool MachineLock() { return Call("get_machine_lock")["on"].AsBool(); }
        /// <summary>Sets it.</summary>
        public void SetMachineLock(bool value) { Call("put_machine_lock", "on", value); }
        /// <summary>Whether the battery of the RAM drive is low.</summary>
        public bool Battery() { return Call("get_battery")["low"].AsBool(); }
        /// <summary>Sets it to low or ok.</summary>
        public void SetBattery(bool low) { Call("put_battery", "low", low); }
        /// <summary>The override in percent.</summary>
        public int Override() { return Call("get_override")["percent"].AsInt(); }
        /// <summary>Sets it.</summary>
        public void SetOverride(int value) { Call("put_override", "percent", value); }
        /// <summary>The operation mode: <c>continuous</c>, <c>cycle</c>, <c>step</c> or <c>segment</c>.</summary>
        public string RunMode() { return Call("get_run_mode")["mode"].AsString(); }
        /// <summary>Sets it.</summary>
        public void SetRunMode(string value) { Call("put_run_mode", "mode", value); }
        /// <summary>The lines with a breakpoint.</summary>
        public double[] Breakpoints() { return Call("get_breakpoints")["lines"].AsDoubles(); }
        /// <summary>Sets it.</summary>
        public void SetBreakpoints(params int[] value) { Call("put_breakpoints", "lines", value); }
        /// <summary>How time passes: <c>real</c>, <c>x10</c>, <c>stepped</c> or <c>auto</c>.</summary>
        public string TimeMode() { return Clock().Mode; }
        /// <summary>Sets it.</summary>
        public void SetTimeMode(string value) { Call("put_clock", "mode", value); }
        // Panel, program, arm

        /// <summary>Everything at one moment.</summary>
        public Json State() { return Call("get_state"); }
        /// <summary>Presses the button, which turns feed hold on or off.</summary>
        public void PressFeedHold() { Call("press_feed_hold"); }
        /// <summary>Turns the power off; every TCP port closes.</summary>
        public void PowerOff() { Call("power_off"); }
        /// <summary>Turns the power on.</summary>
        public void PowerOn() { Call("power_on"); }
        /// <summary>Turns the power off and on.</summary>
        public void PowerCycle() { Call("power_cycle"); }
        /// <summary>As when the emulator was started. Hosts are disconnected; findings and the transcript begin again.</summary>
        /// <param name="timeMode">How time passes then; null keeps the mode.</param>
        public void Reset(string timeMode = null) { Call("reset_emulator", timeMode == null ? new object[0] : new object[] { "mode", timeMode }); }
        /// <summary>The selected program.</summary>
        public Program Program() { return new Program(Call("get_program")); }
        /// <summary><c>running</c>, <c>stop (reset)</c>, <c>stop (retry)</c> or <c>stop (continue)</c>.</summary>
        public string Status() { return Program().Status; }
        /// <summary>Selects a file of the RAM drive.</summary>
        public void SelectFile(string name) { Call("select_file", "name", name); }
        /// <summary>Presses START.</summary>
        public void StartProgram() { Call("start_program"); }
        /// <summary>Presses STOP.</summary>
        public void StopProgram() { Call("stop_program"); }
        /// <summary>Goes back to the first step, with the initial values of the file.</summary>
        public void ResetProgram() { Call("reset_program"); }
        /// <summary>Runs one step.</summary>
        public void StepProgram() { Call("step_program"); }
        /// <summary>Runs the program and stops before this line.</summary>
        public void RunProgramTo(int line) { Call("run_program_to", "line", line); }
        /// <summary>What programs have printed on the teach pendant.</summary>
        public string Pendant() { return Call("get_pendant")["text"].AsString(); }
        /// <summary>Types at the teach pendant, for INPUT without a channel; <c>\r</c> ends a value.</summary>
        public void PressKeys(string keys) { Call("press_keys", "keys", keys); }
        /// <summary>Presses a key that moves the arm, <c>plus</c> or <c>minus</c>, until <see cref="StopJog"/> or for one step.</summary>
        public void Jog(int axis, string direction, string coordinates = "joint", string speed = "slow", bool inching = false)
        {
            Call("jog_arm", "axis", axis, "direction", direction, "coordinates", coordinates, "speed", speed, "inching", inching);
        }
        /// <summary>Lets the key go.</summary>
        public void StopJog() { Call("stop_jog"); }
        /// <summary>Where the arm is.</summary>
        public Pose Pose() { return new Pose(Call("get_pose")); }
        // Alarms and faults

        /// <summary>The active alarms, oldest first.</summary>
        public IList<Alarm> Alarms() { return Call("get_alarms")["active"].Select(row => new Alarm(row)).ToArray(); }
        /// <summary>The error history, newest first.</summary>
        public IList<Alarm> AlarmHistory() { return Call("get_alarms")["history"].Select(row => new Alarm(row)).ToArray(); }
        /// <summary>Raises an alarm of the table: <c>2-046</c>.</summary>
        public void RaiseAlarm(string number, string detail = "") { Call("raise_alarm", "number", number, "detail", detail); }
        /// <summary>Resets the alarms whose cause is gone.</summary>
        public void ResetAlarms() { Call("reset_alarms"); }
        /// <summary>The faults since the start, and their outcome.</summary>
        public IList<Fault> Faults() { return Call("get_faults")["faults"].Select(row => new Fault(row)).ToArray(); }
        /// <summary>Arms a fault: <c>no-reply:command=SU</c>.</summary>
        public void ArmFault(string spec) { Call("arm_fault", "spec", spec); }
        /// <summary>Disarms a fault by its number; it stays in the list.</summary>
        public void DisarmFault(int number) { Call("disarm_fault", "number", number); }
        /// <summary>Removes all faults.</summary>
        public void ClearFaults() { Call("clear_faults"); }
        // Lines, variables, files

        /// <summary>Whether an input shows on.</summary>
        public bool Input(int line) { return Call("get_input", "line", line)["on"].AsBool(); }
        /// <summary>The numbers of the inputs that are on.</summary>
        public double[] Inputs() { return Call("get_inputs")["on"].AsDoubles(); }
        /// <summary>Sets an input; it keeps its state until it is set again.</summary>
        public void SetInput(int line, bool on) { Call("put_input", "line", line, "on", on); }
        /// <summary>Sets a line and sets it back after this much virtual time.</summary>
        public void PulseInput(int line, double seconds, bool on = true) { Call("pulse_input", "line", line, "seconds", seconds, "on", on); }
        /// <summary>The line shows this state, whatever drives it, until it is released.</summary>
        public void ForceInput(int line, bool on) { Call("force_input", "line", line, "on", on); }
        /// <summary>Ends forcing.</summary>
        public void ReleaseInput(int line) { Call("release_input", "line", line); }
        /// <summary>Whether an output shows on.</summary>
        public bool Output(int line) { return Call("get_output", "line", line)["on"].AsBool(); }
        /// <summary>The numbers of the outputs that are on.</summary>
        public double[] Outputs() { return Call("get_outputs")["on"].AsDoubles(); }
        /// <summary>Sets a user output, as IW does.</summary>
        public void SetOutput(int line, bool on) { Call("put_output", "line", line, "on", on); }
        /// <summary>Turns a user output on, and off after this much virtual time.</summary>
        public void PulseOutput(int line, double seconds) { Call("pulse_output", "line", line, "seconds", seconds); }
        /// <summary>The line shows this state, whatever drives it, until it is released.</summary>
        public void ForceOutput(int line, bool on) { Call("force_output", "line", line, "on", on); }
        /// <summary>Ends forcing.</summary>
        public void ReleaseOutput(int line) { Call("release_output", "line", line); }
        /// <summary>The values of a variable of the selected file.</summary>
        public double[] Variable(string name) { return Call("get_variable", "name", name)["value"].AsDoubles(); }
        /// <summary>All variables of the selected file.</summary>
        public Json Variables() { return Call("get_variables"); }
        /// <summary>Sets a variable of the selected file; one value for an integer or a real.</summary>
        public void SetVariable(string name, params double[] values) { Call("put_variable", "name", name, "value", values.Length == 1 ? (object)values[0] : values); }
        /// <summary>The coordinates of a position of the selected file.</summary>
        public double[] Position(string name) { return Call("get_position", "name", name)["value"].AsDoubles(); }
        /// <summary>All positions of the selected file.</summary>
        public Json Positions() { return Call("get_positions"); }
        /// <summary>Sets a position of the selected file.</summary>
        public void SetPosition(string name, params double[] values) { Call("put_position", "name", name, "value", values); }
        /// <summary>Teaches a position: it becomes where the arm is.</summary>
        public void TeachPosition(string name, bool restore = false) { Call("teach_position", "name", name, "restore", restore); }
        /// <summary>The text of a file of the RAM drive.</summary>
        public string File(string name) { return Call("get_file", "name", name)["text"].AsString(); }
        /// <summary>The names of the files of the RAM drive.</summary>
        public IList<string> Files() { return Call("get_files")["files"].Select(file => file["name"].AsString()).ToArray(); }
        /// <summary>Puts a file on the RAM drive.</summary>
        public void PutFile(string name, string text) { Call("put_file", "name", name, "text", text.Replace("\r\n", "\n")); }
        /// <summary>Erases a file of the RAM drive.</summary>
        public void EraseFile(string name) { Call("delete_file", "name", name); }
        // Ports

        /// <summary>Where <c>ip0</c> to <c>ip3</c>, or a serial line that is served as bare TCP, accepts a connection.</summary>
        public DnsEndPoint Address(string port = "ip0")
        {
            string name = Regex.Match(url, "/robots/([^/]+)$").Groups[1].Value;
            Json[] rows = Call("get_robots")["robots"].ToArray();
            Json row = rows.FirstOrDefault(one => Uri.EscapeDataString(one["name"].AsString()) == name) ?? rows[0];
            string group = row["ports"].Has(port) ? "ports" : "serial";
            if (!row.Has(group) || !row[group].Has(port))
                throw new ArgumentException(port + " has no TCP address");
            Match place = Regex.Match(row[group][port].AsString(), @"^(?:socket://)?(.*):(\d+)$");
            string host = place.Groups[1].Value.Trim('[', ']');
            // An address of all interfaces is reached where the control interface is.
            return new DnsEndPoint(host == "0.0.0.0" || host == "::" ? new Uri(url).Host : host, int.Parse(place.Groups[2].Value, CultureInfo.InvariantCulture));
        }

        /// <summary>A host that is connected to IP0.</summary>
        public Host Host()
        {
            DnsEndPoint place = Address();
            return new Host(place.Host, place.Port, Describe);
        }

        /// <summary>A peer that is connected to <c>ip1</c> or <c>ip2</c>, or to <c>com1</c> where it is served as bare TCP.</summary>
        public Channel Channel(string name = "ip1")
        {
            DnsEndPoint place = Address(name);
            return new Channel(place.Host, place.Port, name.ToUpperInvariant(), Describe);
        }
        /// <summary>A communication port (HOST, COM1, IP0 to IP3): its peer, its exchange, its buffer.</summary>
        public Json ChannelState(string port) { return Call("get_channel", "port", port.ToUpperInvariant()); }
        /// <summary>Feeds text to a port as if its peer had sent it.</summary>
        public void Inject(string port, string text) { Call("inject_bytes", "port", port.ToUpperInvariant(), "text", text); }
        /// <summary>Closes the connection of the peer of a port: <c>IP1</c>.</summary>
        public void DropPeer(string port) { Call("drop_peer", "port", port.ToUpperInvariant()); }
        // Time, snapshots, records

        /// <summary>The virtual time, and how it passes.</summary>
        public Clock Clock() { return new Clock(Call("get_clock")); }
        /// <summary>Advances a stopped clock.</summary>
        public void Advance(double seconds) { Call("advance_time", "seconds", seconds, "wall", WallSeconds); }
        /// <summary>Advances a stopped clock until a condition is met, such as <c>output 5 on</c>.</summary>
        /// <exception cref="NotReachedException">It was not met within that much virtual time.</exception>
        public Reached AdvanceUntil(string condition, double within = 60) { return Await("advance_time_until", condition, within); }

        /// <summary>Waits for a condition while time passes by itself.</summary>
        /// <exception cref="NotReachedException">It was not met within that much virtual time.</exception>
        public Reached WaitUntil(string condition, double within = 60) { return Await("wait_until", condition, within); }

        /// <summary>The names of the snapshots.</summary>
        public IList<string> Snapshots() { return Call("get_snapshots")["snapshots"].Select(one => one["name"].AsString()).ToArray(); }
        /// <summary>Keeps the present state under a name.</summary>
        public void TakeSnapshot(string name) { Call("put_snapshot", "name", name); }
        /// <summary>Returns to a snapshot; hosts stay connected, findings and transcript continue.</summary>
        public void RestoreSnapshot(string name) { Call("restore_snapshot", "name", name); }
        /// <summary>Deletes a snapshot.</summary>
        public void DeleteSnapshot(string name) { Call("delete_snapshot", "name", name); }
        /// <summary>The mistakes of hosts since the start or the last reset, oldest first.</summary>
        public IList<Finding> Findings() { return Call("get_findings").Select(row => new Finding(row)).ToArray(); }
        /// <summary>What went over the ports since the start or the last reset.</summary>
        public string Transcript() { return Call("get_transcript", "format", "text").AsString(); }

        /// <summary>Clock, program, alarms, outputs and the last printed lines in a sentence, for the message of a test that fails.</summary>
        public string Describe()
        {
            Json now = State();
            Func<IEnumerable<string>, string> listed = words => words.Any() ? string.Join(" ", words) : "none";
            string mode = now["time_mode"].AsString(), file = now["file"].AsString();
            string clock = mode == "stepped" ? "is stepped and stopped at" : "runs (" + mode + ") and is at";
            string reads = string.Concat(now["tasks"].Where(task => task.Has("reads")).Select(task => ", an INPUT waits for " + task["reads"].AsString()));
            string program = file == "" ? "no file is selected" : file + " is " + now["status"].AsString() + ", line " + now["line"] + reads;
            var last = new SortedDictionary<string, string>(StringComparer.Ordinal);
            foreach (Match line in Regex.Matches(Transcript(), "^<:? (COM1|IP1|IP2) (.*)", RegexOptions.Multiline))
                last[line.Groups[1].Value] = line.Groups[2].Value;
            string printed = string.Concat(last.Select(one => one.Key + " printed " + one.Value + ", "));
            string pendant = now["pendant"].AsString().Trim().Split('\n').Last().Trim();
            return "the clock " + clock + " " + now["t"] + " s; " + program + "; alarms: " + listed(now["alarms"].Select(alarm => alarm["number"].AsString()))
                + "; outputs on: " + listed(now["outputs"]["on"].Select(line => line.ToString())) + "; " + printed + "the pendant "
                + (printed == "" ? "printed " : "") + (pendant == "" ? "nothing" : pendant);
        }

        /// <summary>Closes the connections to the control interface.</summary>
        public void Dispose()
        {
            Dispose(true);
            GC.SuppressFinalize(this);
        }

        /// <summary>Closes the connections to the control interface.</summary>
        protected virtual void Dispose(bool disposing) { http.Dispose(); }

        Reached Await(string operation, string condition, double within)
        {
            string limit = within.ToString(CultureInfo.InvariantCulture) + " s of virtual time";
            try
            {
                Json result = Call(operation, "condition", condition, "within", within, "wall", WallSeconds);
                if (result["reached"].AsBool())
                    return new Reached(result);
            }
            catch (ControlException error) when (error.StatusCode == TooLong)
            {
                limit = WallSeconds + " s of wall-clock time";
            }
            throw new NotReachedException("`" + condition + "` was not met within " + limit + ": " + Describe());
        }

        Json Send(string method, string path, string body)
        {
            var request = new HttpRequestMessage(new HttpMethod(method), url + path);
            if (body != null)
                request.Content = new StringContent(body, Encoding.UTF8, "application/json");
            try
            {
                using (HttpResponseMessage answer = http.SendAsync(request).GetAwaiter().GetResult())
                {
                    string text = answer.Content.ReadAsStringAsync().GetAwaiter().GetResult();
                    if (!answer.IsSuccessStatusCode)
                        throw new ControlException((int)answer.StatusCode, Reason(method, path, (int)answer.StatusCode, text));
                    return answer.Content.Headers.ContentType?.MediaType == "application/json" ? Json.Parse(text) : Json.Text(text);
                }
            }
            catch (HttpRequestException error)
            {
                throw new ControlException(0, "cannot reach " + url + ": " + (error.InnerException ?? error).Message);
            }
            catch (OperationCanceledException)
            {
                throw new ControlException(0, method + " " + path + ": no answer within " + LongestCall.TotalSeconds + " s");
            }
        }

        static string Reason(string method, string path, int status, string text)
        {
            try
            {
                return Json.Parse(text)["error"].AsString();
            }
            catch (Exception error) when (error is FormatException || error is KeyNotFoundException || error is InvalidCastException)
            {
                return string.Format(CultureInfo.InvariantCulture, "{0} {1}: HTTP status {2}", method, path, status);
            }
        }
    }
}
