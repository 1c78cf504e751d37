using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Net.Http;
using System.Text;

namespace Ts3100
{
    /// <summary>The emulator refused a call of the control interface; nothing has changed.</summary>
    public sealed class ControlException : InvalidOperationException
    {
        /// <summary>The HTTP status: 409 if the state forbids the call; 0 if nobody answered.</summary>
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
        /// <summary>Something was lost, given up, or is no text, command or file at all.</summary>
        Error
    }

    /// <summary>A protocol mistake of a host.</summary>
    public sealed class Finding
    {
        internal Finding(Json finding)
        {
            Rule = finding["rule"].AsString();
            Severity = (Severity)Enum.Parse(typeof(Severity), finding["severity"].AsString(), true);
            Port = finding["port"].IsNull ? "" : finding["port"].AsString();
            Message = finding["message"].AsString();
            Remedy = finding["remedy"].AsString();
            Seconds = finding["t"].AsDouble();
            CausedBy = finding.Has("caused-by") ? finding["caused-by"].AsString() : "";
        }

        /// <summary>The rule that was broken, as in docs/reference/findings.md.</summary>
        public string Rule { get; private set; }

        /// <summary>How bad it is.</summary>
        public Severity Severity { get; private set; }

        /// <summary>The port: <c>IP0</c>.</summary>
        public string Port { get; private set; }

        /// <summary>What the host did.</summary>
        public string Message { get; private set; }

        /// <summary>What to do instead.</summary>
        public string Remedy { get; private set; }

        /// <summary>When, in seconds of virtual time.</summary>
        public double Seconds { get; private set; }

        /// <summary>The fault that has caused it; empty if the host has. No test fails on what a fault has caused.</summary>
        public string CausedBy { get; private set; }

        /// <summary>Port, message, rule and remedy in two sentences.</summary>
        public override string ToString()
        {
            return Port + ": " + Message + " (" + Rule + ", " + Severity.ToString().ToLowerInvariant() + "). " + Remedy;
        }
    }

    /// <summary>The control interface of the emulator: inspects and sets any state, and the clock.</summary>
    /// <remarks>A call returns when its effect is there. <see cref="Call"/> reaches what has no method.</remarks>
    public class Robot : IDisposable
    {
        // A call may wait 30 s for virtual time, unless it says otherwise.
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
                throw new ControlException(0, "TS3100_CONTROL_URL is not set: run the tests by `ts3100 exec -- dotnet test`");
            return new Robot(url, Environment.GetEnvironmentVariable("TS3100_CONTROL_TOKEN"));
        }

        /// <summary>Everything at one moment.</summary>
        public Json State() { return Get("/state"); }

        /// <summary>Presses the emergency stop.</summary>
        public void PressEmergencyStop() { Put("/emergency-stop", "pressed", true); }

        /// <summary>Releases the emergency stop.</summary>
        public void ReleaseEmergencyStop() { Put("/emergency-stop", "pressed", false); }

        /// <summary>Opens the safety switch.</summary>
        public void OpenSafetySwitch() { Put("/safety-switch", "open", true); }

        /// <summary>Closes the safety switch.</summary>
        public void CloseSafetySwitch() { Put("/safety-switch", "open", false); }

        /// <summary>Turns the key switch to <c>teaching</c>, <c>internal</c> or <c>ext</c>.</summary>
        public void TurnKeySwitch(string position) { Put("/key-switch", "position", position); }

        /// <summary>Gives the control right to <c>sig</c>, <c>rs232c</c> or <c>ether</c>.</summary>
        public void SetControlRight(string holder) { Put("/control-right", "holder", holder); }

        /// <summary>Turns servo power on or off.</summary>
        public void SetServo(bool on) { Put("/servo", "on", on); }

        /// <summary>Turns feed hold on or off.</summary>
        public void SetFeedHold(bool on) { Put("/feed-hold", "on", on); }

        /// <summary>Turns the machine lock on or off.</summary>
        public void SetMachineLock(bool on) { Put("/machine-lock", "on", on); }

        /// <summary>Makes the battery of the RAM drive low, or good.</summary>
        public void SetBatteryLow(bool low) { Put("/battery", "low", low); }

        /// <summary>Sets the override in percent.</summary>
        public void SetOverride(int percent) { Put("/override", "percent", percent); }

        /// <summary>Sets the operation mode: <c>continuous</c>, <c>cycle</c>, <c>step</c> or <c>segment</c>.</summary>
        public void SetMode(string mode) { Put("/run-mode", "mode", mode); }

        /// <summary>Presses START.</summary>
        public void StartProgram() { Post("/program/start"); }

        /// <summary>Presses STOP.</summary>
        public void StopProgram() { Post("/program/stop"); }

        /// <summary>Types keys on the teach pendant.</summary>
        public void TypeKeys(string keys) { Post("/pendant/keys", "keys", keys); }

        /// <summary>What PRINT without a channel has printed on the teach pendant.</summary>
        public string Pendant() { return Get("/pendant")["text"].AsString(); }

        /// <summary>The numbers of the active alarms, oldest first: <c>2-046</c>.</summary>
        public IList<string> Alarms() { return Get("/alarms")["active"].Select(alarm => alarm["number"].AsString()).ToArray(); }

        /// <summary>Raises an alarm of the table: <c>2-046</c>.</summary>
        public void RaiseAlarm(string number) { Post("/alarms", "number", number); }

        /// <summary>Resets the alarms whose cause is gone.</summary>
        public void ResetAlarms() { Post("/alarms/reset"); }

        /// <summary>Whether an input shows on.</summary>
        public bool Input(int line) { return Get("/inputs/" + line)["on"].AsBool(); }

        /// <summary>Sets an input; it keeps its state until it is set again.</summary>
        public void SetInput(int line, bool on) { Put("/inputs/" + line, "on", on); }

        /// <summary>Turns an input on for this many seconds of virtual time.</summary>
        public void PulseInput(int line, double seconds) { Post("/inputs/" + line + "/pulse", "seconds", seconds); }

        /// <summary>Whether an output is on.</summary>
        public bool Output(int line) { return Get("/outputs/" + line)["on"].AsBool(); }

        /// <summary>Sets a user output, as IW does.</summary>
        public void SetOutput(int line, bool on) { Put("/outputs/" + line, "on", on); }

        /// <summary>The values of a variable of the selected file.</summary>
        public double[] Variable(string name) { return Get("/variables/" + Uri.EscapeDataString(name))["value"].AsDoubles(); }

        /// <summary>Sets a variable of the selected file.</summary>
        public void SetVariable(string name, params double[] values)
        {
            Put("/variables/" + Uri.EscapeDataString(name), "value", values.Length == 1 ? (object)values[0] : values);
        }

        /// <summary>The coordinates of a position of the selected file.</summary>
        public double[] Position(string name) { return Get("/positions/" + Uri.EscapeDataString(name))["value"].AsDoubles(); }

        /// <summary>Teaches a position: it becomes where the arm is.</summary>
        public void Teach(string name) { Post("/positions/" + Uri.EscapeDataString(name) + "/teach"); }

        /// <summary>Puts a file on the RAM drive.</summary>
        public void PutFile(string name, string text) { Put("/files/" + Uri.EscapeDataString(name), "text", text.Replace("\r\n", "\n")); }

        /// <summary>The text of a file of the RAM drive.</summary>
        public string File(string name) { return Get("/files/" + Uri.EscapeDataString(name))["text"].AsString(); }

        /// <summary>Erases a file of the RAM drive.</summary>
        public void EraseFile(string name) { Call("DELETE", "/files/" + Uri.EscapeDataString(name)); }

        /// <summary>Selects a file of the RAM drive.</summary>
        public void Select(string name) { Post("/files/" + Uri.EscapeDataString(name) + "/select"); }

        /// <summary>Virtual time in seconds.</summary>
        public double Now() { return Get("/clock")["now"].AsDouble(); }

        /// <summary>Sets how time passes: <c>real</c>, <c>x10</c>, <c>stepped</c> or <c>auto</c>.</summary>
        public void SetTime(string mode) { Put("/clock", "mode", mode); }

        /// <summary>Advances virtual time.</summary>
        public void Advance(double seconds) { Post("/clock/advance", "seconds", seconds); }

        /// <summary>Advances virtual time until a condition is met, such as <c>output 5 on</c>.</summary>
        /// <returns>Whether it was met within that much virtual time.</returns>
        public bool AdvanceUntil(string condition, double within)
        {
            return Post("/clock/advance-until", "condition", condition, "within", within)["reached"].AsBool();
        }

        /// <summary>Waits, without moving time, until a condition is met.</summary>
        /// <returns>Whether it was met within that much virtual time.</returns>
        public bool WaitUntil(string condition, double within)
        {
            return Post("/wait", "condition", condition, "within", within)["reached"].AsBool();
        }

        /// <summary>Turns the power off; every TCP port closes.</summary>
        public void PowerOff() { Post("/power/off"); }

        /// <summary>Turns the power on.</summary>
        public void PowerOn() { Post("/power/on"); }

        /// <summary>Arms a fault: <c>no-reply:command=SU</c>.</summary>
        public void ArmFault(string spec) { Post("/faults", "spec", spec); }

        /// <summary>Removes all faults.</summary>
        public void ClearFaults() { Call("DELETE", "/faults"); }

        /// <summary>Closes the connection of the peer of a port: <c>IP1</c>.</summary>
        public void DropPeer(string port) { Post("/channels/" + port + "/drop"); }

        /// <summary>Feeds text to a port as if its peer had sent it.</summary>
        public void Inject(string port, string text) { Post("/channels/" + port + "/inject", "text", text); }

        /// <summary>Keeps the present state under a name.</summary>
        public void TakeSnapshot(string name) { Call("PUT", "/snapshots/" + Uri.EscapeDataString(name)); }

        /// <summary>Returns to a kept state; hosts stay connected.</summary>
        public void Restore(string name) { Post("/snapshots/" + Uri.EscapeDataString(name) + "/restore"); }

        /// <summary>As when the emulator was started. Hosts are disconnected; findings and the transcript begin anew.</summary>
        public void Reset() { Post("/reset"); }

        /// <summary>The protocol mistakes of hosts since the start or the last reset.</summary>
        public IList<Finding> Findings() { return Get("/findings").Select(finding => new Finding(finding)).ToArray(); }

        /// <summary>What went over the ports since the start or the last reset.</summary>
        public string Transcript() { return Send("GET", "/transcript?format=text", null); }

        /// <summary>A call of the control interface.</summary>
        /// <param name="method">GET, PUT, POST or DELETE.</param>
        /// <param name="path">The path, such as <c>/state</c>.</param>
        /// <param name="body">JSON text, or null.</param>
        /// <exception cref="ControlException">The call was refused, or nobody answered.</exception>
        public Json Call(string method, string path, string body = null) { return Json.Parse(Send(method, path, body)); }

        /// <summary>Closes the connections to the control interface.</summary>
        public void Dispose()
        {
            Dispose(true);
            GC.SuppressFinalize(this);
        }

        /// <summary>Closes the connections to the control interface.</summary>
        protected virtual void Dispose(bool disposing) { http.Dispose(); }

        Json Get(string path) { return Call("GET", path); }

        void Put(string path, params object[] body) { Call("PUT", path, Json.Object(body)); }

        Json Post(string path, params object[] body) { return Call("POST", path, Json.Object(body)); }

        string Send(string method, string path, string body)
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
                    return text;
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
