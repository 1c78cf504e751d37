using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Text;

namespace Ts3100
{
    /// <summary>What the program does.</summary>
    public enum Execution
    {
        /// <summary>Stopped; RN starts at step 1.</summary>
        Reset,
        /// <summary>A program runs.</summary>
        Running,
        /// <summary>Stopped; RN repeats the statement.</summary>
        Retry,
        /// <summary>Stopped; RN continues after the last statement.</summary>
        Continue
    }

    /// <summary>An alarm of AC or AH.</summary>
    public sealed class AlarmRecord
    {
        internal AlarmRecord(string record)
        {
            string[] fields = record.Split(',');
            if (fields.Length < 3)
                throw new ProtocolException("alarm: expected number,message,date, found \"" + record + "\"");
            // The robot writes 002-046.
            Number = fields[0].TrimStart('0');
            Message = fields[1];
            Date = fields[2];
        }

        /// <summary>Level and code: <c>2-046</c>.</summary>
        public string Number { get; private set; }

        /// <summary>What the operator reads.</summary>
        public string Message { get; private set; }

        /// <summary>Date and time of the controller: <c>2026-03-01 13:05:59</c> in AC, <c>26-03-01 13:05:59</c> in AH.</summary>
        public string Date { get; private set; }
    }

    /// <summary>The status that SU returns. Both layouts are read: one record, and six.</summary>
    public sealed class Status
    {
        readonly Dictionary<string, string> items = new Dictionary<string, string>();

        internal Status(string text)
        {
            // The six records have blanks inside their items: "stop (reset)".
            char between = text.IndexOf('\r') >= 0 ? '\r' : ' ';
            foreach (string item in text.Split(between).Where(item => item.Contains(":")))
                items[item.Substring(0, item.IndexOf(':'))] = item.Substring(item.IndexOf(':') + 1).Replace(" ", "");
        }

        /// <summary>Who commands the robot: <c>external(ethernet)</c>, <c>teaching</c>, ...</summary>
        public string MasterMode { get { return Item("MODE").Split('/')[0]; } }

        /// <summary><c>continuous</c>, <c>cycle</c>, <c>step</c> or <c>segment</c>.</summary>
        public string OperationMode { get { return Item("MODE").Split('/').Last(); } }

        /// <summary>The selected file, or an empty text.</summary>
        public string File { get { return Item("FILE"); } }

        /// <summary>The override in percent.</summary>
        public int Override { get { return int.Parse(Item("OVRD").TrimEnd('%'), CultureInfo.InvariantCulture); } }

        /// <summary>Whether the machine lock is on.</summary>
        public bool MachineLock { get { return Item("MACHINE") == "lock"; } }

        /// <summary>What the program does.</summary>
        public Execution Execution
        {
            get
            {
                switch (Item("STATUS"))
                {
                    case "running": return Execution.Running;
                    case "stop(reset)": return Execution.Reset;
                    case "stop(retry)": return Execution.Retry;
                    case "stop(continue)": return Execution.Continue;
                    default: throw new ProtocolException("SU: unknown status \"" + Item("STATUS") + "\"");
                }
            }
        }

        string Item(string label)
        {
            if (items.TryGetValue(label, out string value))
                return value;
            throw new ProtocolException("SU: no item " + label);
        }
    }

    /// <summary>The total status that SF returns, of a six-axis or a SCARA arm.</summary>
    public sealed class TotalStatus
    {
        internal const int SixAxisBytes = 276, ScaraBytes = 250;
        const int AlarmsAt = 4, AlarmWords = 10, InputsAt = 52, OutputsAt = 84, LineWords = 16, JointsAt = 116, NameBytes = 20;
        const int NoAlarm = 0xFFFF;

        readonly byte[] body;

        internal TotalStatus(byte[] body)
        {
            this.body = body;
        }

        /// <summary>Whether the arm is a SCARA: its groups have six numbers, those of a six-axis arm eight.</summary>
        public bool IsScara { get { return body.Length == ScaraBytes; } }

        /// <summary>Whether servo power is on.</summary>
        public bool ServoOn { get { return body[0] == 1; } }

        /// <summary>Whether the emergency stop is pressed.</summary>
        public bool EmergencyStop { get { return body[1] == 1; } }

        /// <summary>Running while a program runs or a DO is under way.</summary>
        public Execution Motion
        {
            get { return new[] { Execution.Reset, Execution.Running, Execution.Retry, Execution.Continue }[body[2] & 3]; }
        }

        /// <summary>The active alarms, oldest first: <c>2-046</c>.</summary>
        public IList<string> Alarms
        {
            get
            {
                return Enumerable.Range(0, AlarmWords).Select(which => Word(AlarmsAt + 2 * which))
                    .Where(word => word != NoAlarm).Select(AlarmNumber).ToArray();
            }
        }

        /// <summary>The line of the file that is executed, from 1; 0 without a file.</summary>
        public int ExecutionLine { get { return Word(24); } }

        /// <summary>Whether feed hold is on.</summary>
        public bool FeedHold { get { return Word(32) == 1; } }

        /// <summary>The minutes since power-on.</summary>
        public int PowerOnMinutes { get { return Word(44) << 16 | Word(46); } }

        /// <summary>The joints, in degrees; axis 3 of a SCARA in mm.</summary>
        public double[] Joints { get { return Group(0); } }

        /// <summary>The tool point in the world: X Y Z A B C and axes 7, 8; of a SCARA X Y Z C T 0.</summary>
        public double[] World { get { return Group(1); } }

        /// <summary>The tool point in work coordinates.</summary>
        public double[] Work { get { return Group(2); } }

        /// <summary>The name of the work coordinate system.</summary>
        public string WorkName { get { return Name(0); } }

        /// <summary>The name of the tool.</summary>
        public string ToolName { get { return Name(1); } }

        /// <summary>Whether an input is on: 1 to 64, 101 to 164, 201 to 264.</summary>
        public bool Input(int line) { return Line(InputsAt, line); }

        /// <summary>Whether an output is on: 1 to 64, 101 to 164, 201 to 264.</summary>
        public bool Output(int line) { return Line(OutputsAt, line); }

        /// <summary>The data as received.</summary>
        public byte[] ToBytes() { return (byte[])body.Clone(); }

        /// <summary>An alarm word as level and code.</summary>
        internal static string AlarmNumber(int word)
        {
            // Level, first word, first code, number of codes; the second four are the further codes.
            int[][] ranges =
            {
                new[] { 8, 0, 1, 368 }, new[] { 4, 368, 1, 144 }, new[] { 2, 512, 1, 224 }, new[] { 1, 736, 1, 224 },
                new[] { 8, 960, 369, 512 }, new[] { 4, 1472, 145, 256 }, new[] { 2, 1728, 225, 256 }, new[] { 1, 1984, 225, 256 }
            };
            int[] range = ranges.FirstOrDefault(one => word >= one[1] && word < one[1] + one[3]);
            return range == null ? "?-" + word : range[0] + "-" + (word - range[1] + range[2]).ToString("000");
        }

        int Word(int at) { return body[at] << 8 | body[at + 1]; }

        double[] Group(int which)
        {
            int axes = IsScara ? 6 : 8;
            return Enumerable.Range(0, axes).Select(axis => Float(JointsAt + 4 * (which * axes + axis))).ToArray();
        }

        double Float(int at)
        {
            byte[] four = body.Skip(at).Take(4).ToArray();
            if (BitConverter.IsLittleEndian)
                Array.Reverse(four);
            return BitConverter.ToSingle(four, 0);
        }

        string Name(int which)
        {
            int at = JointsAt + 3 * 4 * (IsScara ? 6 : 8) + which * NameBytes;
            return Encoding.ASCII.GetString(body, at, NameBytes).TrimEnd('\0');
        }

        bool Line(int from, int line)
        {
            int hundred = line / 100, bit = line % 100 - 1;
            if (bit < 0 || bit >= 64 || hundred * 4 + bit / 16 >= LineWords)
                throw new ArgumentOutOfRangeException("line", line, "expected 1 to 64, 101 to 164, 201 to 264 or 301 to 364");
            return (Word(from + 2 * (hundred * 4 + bit / 16)) >> bit % 16 & 1) == 1;
        }
    }
}
