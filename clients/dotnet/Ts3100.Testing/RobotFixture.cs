using System;
using System.IO;
using System.Linq;
using System.Text.RegularExpressions;
using System.Threading;

namespace Ts3100.Testing
{
    /// <summary>Which tests leave the run of their robot as a file.</summary>
    public enum TraceMode
    {
        /// <summary>None.</summary>
        Off,
        /// <summary>Each.</summary>
        On,
        /// <summary>Those that fail.</summary>
        RetainOnFailure
    }

    /// <summary>One emulator for the tests of a class, an assembly or a run. <see cref="Fresh"/> gives each test a fresh
    /// robot of it, in less than a millisecond.</summary>
    /// <remarks>Needs no test framework. xUnit creates it as a class fixture; NUnit uses <see cref="Shared"/>.</remarks>
    public class RobotFixture : IDisposable
    {
        const string Prepared = "prepared";
        static readonly Lazy<RobotFixture> shared = new Lazy<RobotFixture>(() => Start(SharedOptions));

        readonly bool prepared;
        TestRobot current;
        int tests;

        /// <summary>A robot with the defaults of <c>ts3100 serve</c>.</summary>
        public RobotFixture() : this(null, new string[0]) { }

        /// <summary>A robot with these options of <c>ts3100 serve</c>, prepared once by <paramref name="prepare"/>: every test
        /// begins with what that has left.</summary>
        protected RobotFixture(Action<Robot> prepare, params string[] arguments)
        {
            Deny = Severity.Warning;
            Trace = TraceMode.RetainOnFailure;
            TranscriptDirectory = Path.Combine(AppContext.BaseDirectory, "ts3100-transcripts");
            Process = new RobotProcess(arguments);
            if (prepare == null)
                return;
            try
            {
                using (var robot = new Robot(Process.ControlUrl))
                {
                    prepare(robot);
                    robot.TakeSnapshot(Prepared);
                }
                prepared = true;
            }
            catch
            {
                Process.Dispose();
                throw;
            }
        }

        /// <summary>Starts a robot with these options of <c>ts3100 serve</c>.</summary>
        public static RobotFixture Start(params string[] arguments) { return new RobotFixture(null, arguments); }

        /// <summary>The options of <see cref="Shared"/>; set them before its first use.</summary>
        public static string[] SharedOptions { get; set; } = new string[0];

        /// <summary>One robot for this process, started at first use and ended with the process.</summary>
        public static RobotFixture Shared { get { return shared.Value; } }

        /// <summary>The emulator.</summary>
        public RobotProcess Process { get; private set; }

        /// <summary>Findings of this severity and worse fail a test: warnings unless you set it. Null denies nothing.</summary>
        public Severity? Deny { get; set; }

        /// <summary>Which tests leave a transcript and its page: those that fail, unless you set it.</summary>
        public TraceMode Trace { get; set; }

        /// <summary>Where transcripts and their pages go: ts3100-transcripts beside the test assembly.</summary>
        public string TranscriptDirectory { get; set; }

        /// <summary>A fresh robot: as it was started and prepared, without connections and findings.</summary>
        /// <param name="test">The name of the test, for its transcript.</param>
        /// <exception cref="InvalidOperationException">Another test still has the robot.</exception>
        public TestRobot Fresh(string test = "test")
        {
            var robot = new TestRobot(this, test, Interlocked.Increment(ref tests));
            TestRobot other = Interlocked.CompareExchange(ref current, robot, null);
            if (other != null)
            {
                robot.Forget();
                throw new InvalidOperationException("the test " + other.Test + " still has this robot: end it first, or give "
                    + "each of the parallel tests a RobotFixture of its own");
            }
            try
            {
                robot.Reset();
                if (prepared)
                    robot.RestoreSnapshot(Prepared);
                return robot;
            }
            catch
            {
                robot.Forget();
                throw;
            }
        }

        /// <summary>Ends the emulator.</summary>
        public void Dispose()
        {
            Process.Dispose();
            GC.SuppressFinalize(this);
        }

        internal void Release(TestRobot robot) { Interlocked.CompareExchange(ref current, null, robot); }
    }

    /// <summary>The host of a test has made protocol mistakes.</summary>
    public sealed class FindingsException : Exception
    {
        /// <summary>The mistakes.</summary>
        public Finding[] Findings { get; private set; }

        internal FindingsException(Finding[] findings, string message) : base(message)
        {
            Findings = findings;
        }
    }

    /// <summary>The robot of one test.</summary>
    public sealed class TestRobot : Robot
    {
        /// <summary>How many texts the message of a failure repeats.</summary>
        public const int LastTexts = 6;
        const int LongestShown = 120;

        readonly RobotFixture fixture;
        readonly int number;
        string[] allowed = new string[0];
        bool ended;

        internal TestRobot(RobotFixture fixture, string test, int number) : base(fixture.Process.ControlUrl)
        {
            this.fixture = fixture;
            this.number = number;
            Test = test;
        }

        /// <summary>The name of the test.</summary>
        public string Test { get; private set; }

        /// <summary>The transcript of this test if it is kept, otherwise null. Known after <see cref="End"/>.</summary>
        public string TranscriptFile { get; private set; }

        /// <summary>The page that shows the run in a browser; null if it could not be written, or the transcript is not kept.</summary>
        public string PageFile { get; private set; }

        /// <summary>Findings of these rules do not fail this test.</summary>
        public void Allow(params string[] rules) { allowed = allowed.Concat(rules).ToArray(); }

        /// <summary>Ends the test: keeps its run if it failed, and fails it if its host made mistakes.</summary>
        /// <param name="failed">Whether the test has failed already. Then the command that shows the run is printed.</param>
        /// <exception cref="FindingsException">The host made mistakes.</exception>
        public void End(bool failed)
        {
            if (ended)
                return;
            Finding[] denied;
            string transcript = "", trace = "";
            try
            {
                denied = fixture.Deny == null ? new Finding[0]
                    : Findings().Where(one => one.CausedBy.Length == 0 && one.Severity >= fixture.Deny && !allowed.Contains(one.Rule)).ToArray();
                bool isKept = fixture.Trace == TraceMode.On || fixture.Trace == TraceMode.RetainOnFailure && (failed || denied.Length > 0);
                if (isKept || denied.Length > 0)
                    transcript = Transcript();
                if (isKept)
                    trace = Keep(transcript, denied.Length > 0 ? denied[0].Rule : null);
            }
            finally
            {
                Forget();
            }
            if (denied.Length > 0)
                throw new FindingsException(denied, "protocol mistakes of the host:\n  " + string.Join("\n  ", (object[])denied)
                    + "\nlast texts:\n  " + string.Join("\n  ", LastOf(transcript)) + trace);
            if (failed && trace.Length > 0)
                Console.WriteLine(trace.TrimStart());
        }

        /// <summary>Ends a test that has not failed otherwise; see <see cref="End"/>.</summary>
        protected override void Dispose(bool disposing) { End(false); }

        internal void Forget()
        {
            ended = true;
            fixture.Release(this);
            base.Dispose(true);
        }

        /// <summary>Writes the transcript and its page; the command that shows the moment of the failure, and the page.</summary>
        string Keep(string transcript, string rule)
        {
            Directory.CreateDirectory(fixture.TranscriptDirectory);
            string name = string.Concat((Test + "-" + number).Select(letter => char.IsLetterOrDigit(letter) ? letter : '-'));
            string file = Path.Combine(fixture.TranscriptDirectory, name + ".txt"), page = Path.ChangeExtension(file, ".html");
            System.IO.File.WriteAllText(file, transcript);
            TranscriptFile = file;
            string failure = RobotProcess.Run("view", file, "--html", page);
            if (failure == null)
                PageFile = page;
            return "\nts3100 view " + Quoted(Shown(file)) + Moment(transcript, rule)
                + (failure == null ? "\npage: " + Shown(page) : "\nno page: " + failure);
        }

        /// <summary>The finding that failed the test, otherwise the first NG, otherwise the last that a host sent.</summary>
        static string Moment(string transcript, string rule)
        {
            if (rule != null)
                return " --first " + rule;
            if (Regex.IsMatch(transcript, @"^<:? \S+ NG<CR>", RegexOptions.Multiline))
                return " --first ng";
            return Regex.IsMatch(transcript, "^>:? ", RegexOptions.Multiline) ? " --last received" : "";
        }

        /// <summary>A path, relative to the working directory if it is below.</summary>
        static string Shown(string path)
        {
            string here = Directory.GetCurrentDirectory().TrimEnd(Path.DirectorySeparatorChar) + Path.DirectorySeparatorChar;
            string full = Path.GetFullPath(path);
            return full.StartsWith(here, StringComparison.Ordinal) ? full.Substring(here.Length) : full;
        }

        /// <summary>A word for a shell.</summary>
        static string Quoted(string word)
        {
            if (Regex.IsMatch(word, @"^[\w./\\:-]+$"))
                return word;
            return Path.DirectorySeparatorChar == '\\' ? "\"" + word + "\"" : "'" + word.Replace("'", "'\\''") + "'";
        }

        static string[] LastOf(string transcript)
        {
            string[] texts = transcript.Split('\n').Where(line => line.StartsWith("> ", StringComparison.Ordinal)
                || line.StartsWith("< ", StringComparison.Ordinal)).ToArray();
            return texts.Skip(Math.Max(0, texts.Length - LastTexts))
                .Select(text => text.Length > LongestShown ? text.Substring(0, LongestShown) + "..." : text).ToArray();
        }
    }
}
