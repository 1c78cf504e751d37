// Checks of both libraries without a test framework, so that they run on Mono and on .NET. Prints a line for each; the
// first that fails ends it with exit code 1. The binary is in TS3100_BINARY.
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.IO;
using System.Linq;
using System.Net.Sockets;
using System.Text;
using System.Text.RegularExpressions;
using System.Threading;
using Ts3100;
using Ts3100.Testing;

static class Checks
{
    const int FreshRobots = 500;
    // Long enough to travel in several texts.
    static readonly string Ask = string.Concat(Enumerable.Repeat("' A remark that makes the file long.\n", 20)) + "GLOBAL\nCOUNT = 3\nRATE = 0.5\nEND\nPROGRAM ASK\nPRINT IP1, \"HOW FAR?\", CR\nINPUT IP1, X\n"
        + "PRINT IP1, \"THAT IS\", X, CR\nCOUNT = COUNT + 1\nEND\nDATA\nPOINT A1=400,0,200,0,0,0,0,0/11111\nEND\n";

    static int Main(string[] arguments)
    {
        if (arguments.Length > 0)
            return Killed();
        try
        {
            TextOfJson();
            SixAxes();
            Scara();
            Refusals();
            Control();
            Dialogue();
            FreshRobot();
            WrongHost();
            Starts();
            Console.WriteLine("ok   all of it on " + Environment.Version);
            return 0;
        }
        catch (Exception failed)
        {
            Console.WriteLine("FAIL " + failed);
            return 1;
        }
    }

    static void TextOfJson()
    {
        Json value = Json.Parse("{\"a\":[1,-2.5e3,true,null,\"\\u00e9\\n\\\"\"],\"b\":{}}");
        Equal("JSON: what was read is written", "{\"a\":[1,-2500,true,null,\"\u00e9\\u000a\\\"\"],\"b\":{}}", value.ToString());
        Equal("JSON: 64 bits are not rounded", "[8139114023949186051,6E+30]", Json.Parse("[8139114023949186051,6e30]").ToString());
        Equal("JSON: and are a number", 8139114023949186051d, Json.Parse("8139114023949186051").AsDouble());
        Equal("JSON: an object of names and values", "{\"x\":[1.5,2],\"y\":\"z\"}", Json.Object("x", new[] { 1.5, 2 }, "y", "z"));
        Equal("JSON: the place of an error", "JSON, character 5: expected `:`, found the end",
            Thrown<FormatException>(() => Json.Parse("{\"a\"")));
        Equal("JSON: no endless nesting", true,
            Thrown<FormatException>(() => Json.Parse(new string('[', 100000))).Contains("at most 64"));
    }

    static void SixAxes()
    {
        using (RobotFixture fixture = RobotFixture.Start())
        using (TestRobot robot = fixture.Fresh("SixAxes"))
        using (Host host = robot.Host())
        {
            host.ServoOn();
            host.Download("ASK", Ask);
            Equal("UL returns what DL stored", Ask, Encoding.ASCII.GetString(host.Upload("ASK")));
            Thrown<EncoderFallbackException>(() => host.Download("OTHER", "' \u00e9\n"));
            Equal("CA has it", Ask.Length, host.Directory()["ASK"]);
            Equal("VR", "TS3100", host.Version().Split(' ')[0]);
            host.Select("ASK");
            Equal("MR of an integer", 3.0, host.ReadVariable("COUNT").Single());
            Equal("MR of a position", "400 0 200 0 0 0 0 0 11111", string.Join(" ", host.ReadVariable("A1")));
            host.WriteVariable("COUNT", 12);
            host.WriteVariable("RATE", 0.25);
            Equal("MW of an integer and a real", "12 0.25", host.ReadVariable("COUNT")[0] + " " + Text(host.ReadVariable("RATE")[0]));
            host.SetOverride(40);
            using (var channel = robot.Channel("ip1"))
            {
                host.Start();
                Equal("PRINT", "HOW FAR?", channel.ReadLine());
                Status running = host.Status();
                Equal("SU while it runs", "Running external(ethernet) cycle ASK 40 False", string.Join(" ", running.Execution,
                    running.MasterMode, running.OperationMode, running.File, running.Override, running.MachineLock));
                channel.SendLine("2.5");
                Equal("INPUT and PRINT", "THAT IS       2.500", channel.ReadLine());
                host.WaitForStop();
            }
            host.SetOutputs(new Dictionary<int, bool> { { 3, true } });
            robot.SetInput(201, true);
            robot.RaiseAlarm("1-200");
            TotalStatus total = host.TotalStatus();
            Equal("SF", "True False Reset 1-200 False True True False", string.Join(" ", total.ServoOn, total.EmergencyStop, total.Motion,
                string.Join(",", total.Alarms), total.IsScara, total.Output(3), total.Input(201), total.Input(1)));
            Equal("SF: eight joints, and the tool point that the control interface shows", "8 408.509 293.282", total.Joints.Length
                + " " + Text(total.World[0]) + " " + Text(total.World[2]));
            Equal("AC", "1-200", host.Alarms().Single().Number);
            Equal("AH", 1, host.AlarmHistory().Count);
            host.Execute("MOVE POINT(400,50,250)");
            while (host.TotalStatus().Motion == Execution.Running) { }
            Equal("DO moves the arm", "400 50 250", string.Join(" ", host.TotalStatus().World.Take(3).Select(Text)));
            host.UseStx = false;
            Equal("without STX", "ASK", host.Status().File);
            host.ServoOff();
        }
    }

    static void Scara()
    {
        using (RobotFixture fixture = RobotFixture.Start("--model", "tsl3000-thl400", "--servo-on"))
        using (TestRobot robot = fixture.Fresh("Scara"))
        using (Host host = robot.Host())
        {
            TotalStatus total = host.TotalStatus();
            Equal("SF of a SCARA", "True 6 True", total.IsScara + " " + total.Joints.Length + " " + total.ServoOn);
            Equal("and the next answer is its own", Execution.Reset, host.Status().Execution);
            Equal("its tool point is that of the control interface", Text(robot.State()["arm"]["world"][0].AsDouble()), Text(total.World[0]));
        }
    }

    static void Refusals()
    {
        using (RobotFixture fixture = RobotFixture.Start("--key-switch", "teaching"))
        using (TestRobot robot = fixture.Fresh("Refusals"))
        using (Host host = robot.Host())
        {
            robot.Allow("mode-forbids", "left-in-exchange", "command-in-exchange");
            Equal("NG names the command", "the robot answered NG to SO; the log of the emulator gives the reason",
                Thrown<RefusedException>(host.ServoOn));
            robot.ArmFault("late-reply:command=SU,delay=400");
            host.Timeout = TimeSpan.FromSeconds(0.2);
            Equal("a robot that does not answer", true, Thrown<NoReplyException>(() => host.Status()).StartsWith(
                "the robot did not send an answer to SU within 0.2 s: the clock runs (real) and is at "));
            Thread.Sleep(300);
            Equal("an answer that comes later is not that of the next command", "TS3100", host.Version().Substring(0, 6));
            robot.ArmFault("reset-mid-text:command=SU");
            Equal("a connection that is reset", true, Thrown<ProtocolException>(() => host.Status()).StartsWith("the connection has ended: "));
        }
        Equal("nobody there", true, Thrown<ProtocolException>(() => new Host("127.0.0.1", FreePort())).StartsWith("cannot connect to 127.0.0.1:"));
    }

    static void Control()
    {
        using (RobotFixture fixture = RobotFixture.Start("--time", "stepped"))
        using (TestRobot robot = fixture.Fresh("Control"))
        {
            robot.SetServo(true);
            robot.SetOverride(50);
            robot.SetRunMode("segment");
            robot.SetMachineLock(true);
            robot.SetFeedHold(true);
            Json state = robot.State();
            Equal("switches", "True 50 segment True True", string.Join(" ", state["servo"].AsBool(), state["override_percent"].AsInt(),
                state["run_mode"].AsString(), state["machine_lock"].AsBool(), state["feed_hold"].AsBool()));
            robot.Reset();
            robot.PutFile("ASK", Ask.Replace("\n", "\r\n"));
            Equal("a file comes back with LF", Ask, robot.File("ASK"));
            robot.SelectFile("ASK");
            robot.SetVariable("COUNT", 7);
            Equal("a variable", 7.0, robot.Variable("COUNT").Single());
            robot.SetServo(true);
            robot.TeachPosition("A1");
            Equal("a taught position", "408.509", Text(robot.Position("A1")[0]));
            robot.TakeSnapshot("taught");
            robot.SetOutput(5, true);
            robot.PulseInput(1, 0.5);
            robot.Advance(0.2);
            Equal("an output and a pulse", "True True", robot.Output(5) + " " + robot.Input(1));
            Equal("the pulse ends at its time", "0.5", Text(robot.AdvanceUntil("input 1 off", 1).Now));
            robot.RestoreSnapshot("taught");
            Equal("a snapshot restores the output", false, robot.Output(5));
            Equal("a wait that is not met", "`output 5 on` was not met within 0 s of virtual time: the clock is stepped and stopped at 0 s; ASK is stop "
                + "(reset), line 26; alarms: none; outputs on: 250 255 256 260; the pendant printed nothing", Thrown<NotReachedException>(() => robot.WaitUntil("output 5 on", 0)));
            robot.RaiseAlarm("2-046");
            Equal("an alarm", "2-046", robot.Alarms().Single().Number);
            robot.ResetAlarms();
            robot.SetEmergencyStop(true);
            Equal("a refusal in the emulator's words", "cannot turn the servo on: the emergency stop is pressed",
                Thrown<ControlException>(() => robot.SetServo(true)));
            robot.SetEmergencyStop(false);
            robot.SetSafetySwitch(true);
            Equal("a setting is read", true, robot.SafetySwitch());
            robot.SetKeySwitch("internal");
            robot.SetControlRight("sig");
            robot.SetBattery(true);
            robot.PowerOff();
            robot.PowerOn();
            robot.ClearFaults();
            robot.EraseFile("DEMO");
            Equal("the file is gone", false, robot.Files().Contains("DEMO"));
            Equal("any operation by its name", true, robot.Call("put_input", "line", 5, "on", true)["on"].AsBool());
            Equal("a text", "event: ", robot.Call("get_events", "since", 1, "count", 1).AsString().Substring(0, 7));
            Equal("an unknown operation", "unknown operation get_inputt", Thrown<ArgumentException>(() => robot.Call("get_inputt")));
            Equal("a missing argument", "get_input needs the argument line", Thrown<ArgumentException>(() => robot.Call("get_input")));
            Equal("an unknown argument", "get_input has no argument on", Thrown<ArgumentException>(() => robot.Call("get_input", "line", 5, "on", true)));
        }
        using (var nobody = new Robot("http://127.0.0.1:" + FreePort()))
            Equal("no emulator", true, Thrown<ControlException>(nobody.ResetAlarms).StartsWith("cannot reach http://127.0.0.1:"));
    }

    static void Dialogue()
    {
        using (RobotFixture fixture = RobotFixture.Start("--time", "stepped", "--servo-on", "--serial-com1-tcp", "127.0.0.1:0", "--robots", "2"))
        using (var one = new Robot(fixture.Process.ControlUrl + "/robots/robot-1"))
        using (var two = new Robot(fixture.Process.ControlUrl + "/robots/robot-2"))
        {
            Equal("no robot of exec", true, Thrown<ControlException>(() => Robot.FromEnvironment()).StartsWith("TS3100_CONTROL_URL is not set: run the tests with"));
            Environment.SetEnvironmentVariable("TS3100_CONTROL_URL", one.Url);
            using (Robot robot = Robot.FromEnvironment())
                Equal("the robot of exec", 100, robot.Override());
            Equal("each robot has its address", false, one.Address().Port == two.Address().Port);
            two.PutFile("ASK", Ask);
            two.SelectFile("ASK");
            using (Channel channel = two.Channel("ip1"))
            using (Channel line = two.Channel("com1"))
            {
                two.StartProgram();
                channel.Timeout = TimeSpan.FromSeconds(0.1);
                string late = Thrown<NoReplyException>(() => channel.WaitForLine("EVER"));
                Equal("a line that does not come", true, late.StartsWith("IP1: expected a line with `EVER` within 0.1 s, found `HOW FAR?`: the clock is stepped "
                    + "and stopped at 0 s; ASK is running, line 27, an INPUT waits for IP1; alarms: none; outputs on: "));
                Equal("what was printed", true, late.EndsWith("; IP1 printed HOW FAR?<CR>, the pendant nothing"));
                channel.SendLine("2.5");
                Equal("lines before the expected one are dropped", "THAT IS       2.500", channel.WaitForLine("2.500"));
                two.PutFile("ASK", "PROGRAM ASK\nPRINT IP1, \"HALF\"\nDELAY 1\nPRINT IP1, \"DONE\", CR\nEND\n");
                two.SelectFile("ASK");
                two.StartProgram();
                Equal("half a line is shown", true, Thrown<NoReplyException>(() => channel.ReadLine()).StartsWith("IP1: expected a line within 0.1 s, found `HALF`: "));
                two.Advance(1);
                Equal("and kept", "HALFDONE", channel.ReadLine());
                two.PutFile("ASK", "PROGRAM ASK\nPRINT COM1, \"ONE\", CR\nEND\n");
                two.SelectFile("ASK");
                two.StartProgram();
                two.Advance(1); // a serial line takes its time
                Equal("COM1 as bare TCP", "ONE", line.ReadLine());
            }
        }
    }

    sealed class Prepared : RobotFixture
    {
        public Prepared() : base(robot => robot.PutFile("PICK", "PROGRAM PICK\nEND\n"), "--servo-on") { }
    }

    static void FreshRobot()
    {
        Environment.SetEnvironmentVariable("TS3100_KEY_SWITCH", "teaching"); // has no effect
        using (var fixture = new Prepared())
        {
            Environment.SetEnvironmentVariable("TS3100_KEY_SWITCH", null);
            using (TestRobot robot = fixture.Fresh("first"))
            using (Host host = robot.Host())
            {
                host.Select("PICK");
                host.Erase("DEMO");
                Equal("one test at a time", true, Thrown<InvalidOperationException>(() => fixture.Fresh("second")).StartsWith(
                    "the test first still has this robot"));
            }
            using (TestRobot robot = fixture.Fresh("second"))
            using (Host host = robot.Host())
                Equal("the next test begins with what was prepared", "|True|True|True", host.Status().File + "|"
                    + host.Directory().ContainsKey("DEMO") + "|" + host.Directory().ContainsKey("PICK") + "|" + host.TotalStatus().ServoOn);
            var watch = Stopwatch.StartNew();
            for (int test = 0; test < FreshRobots; test++)
                fixture.Fresh("many").Dispose();
            Console.WriteLine("     " + Text(watch.Elapsed.TotalMilliseconds / FreshRobots) + " ms for a fresh robot and its findings");
        }
    }

    static void WrongHost()
    {
        using (RobotFixture fixture = RobotFixture.Start())
        {
            TestRobot robot = fixture.Fresh("Wrong host");
            using (Host host = robot.Host())
                Thrown<RefusedException>(() => host.Command("XX"));
            string message = Thrown<FindingsException>(robot.Dispose);
            Equal("the failure names the mistake and its remedy", true, message.Contains(
                "IP0: unknown command \"XX\" (unknown-command, error). Use a command that `ts3100 docs commands` lists, in upper case."));
            Equal("and the last texts", true, message.Contains("> IP0 XX<CR>\n  < IP0 NG<CR>\n"));
            Equal("and the transcript", true, File.ReadAllText(robot.TranscriptFile).Contains("> IP0 XX<CR>"));
            Equal("the command shows the moment of the finding, and a page is beside", true, Regex.IsMatch(message,
                @"\nts3100 view \S*ts3100-transcripts\S*Wrong-host-1\.txt --first unknown-command\npage: \S*Wrong-host-1\.html$"));
            Equal("the page is whole", true, File.ReadAllText(robot.PageFile).TrimEnd().EndsWith("</html>"));
            Discard(robot);
            robot = fixture.Fresh("Excused");
            using (Host host = robot.Host())
                Thrown<RefusedException>(() => host.Command("XX"));
            robot.Allow("unknown-command");
            robot.Dispose();
            Equal("a mistake that the test allows", null, robot.TranscriptFile);
            robot = fixture.Fresh("Failed otherwise");
            TextWriter console = Console.Out;
            var printed = new StringWriter();
            Console.SetOut(printed);
            robot.End(true);
            Console.SetOut(console);
            Equal("a test that failed otherwise has its transcript", true, File.Exists(robot.TranscriptFile));
            Equal("and prints its command, here of a run without a host", true, Regex.IsMatch(printed.ToString(), @"^ts3100 view \S+-3\.txt\r?\n?page: "));
            Discard(robot);
            Traces(fixture);
        }
    }

    static void Traces(RobotFixture fixture)
    {
        fixture.Deny = null;
        fixture.Trace = TraceMode.Off;
        TestRobot robot = fixture.Fresh("Off");
        robot.End(true);
        Equal("a fixture that keeps nothing", null, robot.TranscriptFile);
        fixture.Trace = TraceMode.On;
        robot = fixture.Fresh("Passed");
        robot.Dispose();
        Equal("a fixture that keeps each run", true, File.Exists(robot.TranscriptFile) && File.Exists(robot.PageFile));
        Discard(robot);
        fixture.Trace = TraceMode.RetainOnFailure;
        fixture.TranscriptDirectory = Path.Combine(fixture.TranscriptDirectory, "it's here");
        string binary = Environment.GetEnvironmentVariable(RobotProcess.BinaryVariable);
        Environment.SetEnvironmentVariable(RobotProcess.BinaryVariable, "no-such-binary");
        fixture.Deny = Severity.Warning;
        robot = fixture.Fresh("No program");
        using (Host host = robot.Host())
            Thrown<RefusedException>(() => host.Command("XX"));
        string message = Thrown<FindingsException>(robot.Dispose);
        Environment.SetEnvironmentVariable(RobotProcess.BinaryVariable, binary);
        Equal("a page that cannot be written hides no failure", true, message.Contains("unknown-command, error")
            && message.Contains("it'\\''s here/No-program-6.txt' --first unknown-command\nno page: cannot run no-such-binary: "));
        Equal("and there is none", null, robot.PageFile);
        Directory.Delete(fixture.TranscriptDirectory, true);
    }

    static void Discard(TestRobot robot)
    {
        File.Delete(robot.TranscriptFile);
        File.Delete(robot.PageFile);
    }

    static void Starts()
    {
        Equal("wrong options", true, Thrown<StartException>(() => RobotFixture.Start("--no-such-option")).Contains("--no-such-option"));
        string folder = Path.Combine(Path.GetTempPath(), "ts3100 \"checks\" " + Process.GetCurrentProcess().Id);
        Directory.CreateDirectory(folder);
        RobotFixture fixture = RobotFixture.Start("--findings", Path.Combine(folder, "findings.json"));
        Uri control = new Uri(fixture.Process.ControlUrl);
        fixture.Dispose();
        Equal("a robot that ends has written its report", true, File.Exists(Path.Combine(folder, "findings.json")));
        Directory.Delete(folder, true);
        Thrown<SocketException>(() => new TcpClient(control.Host, control.Port));
        // The same program, killed with a robot that it has started.
        Process test = Process.Start(new ProcessStartInfo(Process.GetCurrentProcess().MainModule.FileName, "\"" + typeof(Checks).Assembly.Location + "\" killed")
        {
            UseShellExecute = false,
            RedirectStandardOutput = true
        });
        control = new Uri(test.StandardOutput.ReadLine());
        test.WaitForExit();
        var watch = Stopwatch.StartNew();
        Equal("a robot ends with a test that is killed", true, Thrown<SocketException>(() =>
        {
            while (watch.Elapsed.TotalSeconds < 10)
                new TcpClient(control.Host, control.Port).Close();
        }) != null);
        string binary = Environment.GetEnvironmentVariable(RobotProcess.BinaryVariable);
        Environment.SetEnvironmentVariable(RobotProcess.BinaryVariable, "no-such-binary");
        Equal("no binary", true, Thrown<StartException>(() => RobotFixture.Start()).StartsWith("cannot run no-such-binary: "));
        Environment.SetEnvironmentVariable(RobotProcess.BinaryVariable, binary);
    }

    static int Killed()
    {
        Console.WriteLine(RobotFixture.Start().Process.ControlUrl);
        Process.GetCurrentProcess().Kill();
        return 1;
    }

    static int FreePort()
    {
        var listener = new TcpListener(System.Net.IPAddress.Loopback, 0);
        listener.Start();
        int port = ((System.Net.IPEndPoint)listener.LocalEndpoint).Port;
        listener.Stop();
        return port;
    }

    static string Text(double value) { return value.ToString("0.###", System.Globalization.CultureInfo.InvariantCulture); }

    static string Thrown<T>(Action action) where T : Exception
    {
        try
        {
            action();
        }
        catch (T error)
        {
            return error.Message;
        }
        throw new CheckFailed("expected " + typeof(T).Name + ", found none");
    }

    static void Equal<T>(string what, T expected, T found)
    {
        if (!Equals(expected, found))
            throw new CheckFailed(what + "\n     expected " + expected + "\n     found    " + found);
        Console.WriteLine("ok   " + what);
    }

    sealed class CheckFailed : Exception
    {
        public CheckFailed(string message) : base(message) { }
    }
}
