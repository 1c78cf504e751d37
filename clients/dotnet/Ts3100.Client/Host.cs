using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Net.Sockets;
using System.Text;
using System.Threading;

namespace Ts3100
{
    /// <summary>The robot sent something else than expected, or nothing in time.</summary>
    public class ProtocolException : IOException
    {
        /// <summary>An exception with this message.</summary>
        public ProtocolException(string message) : base(message) { }
    }

    /// <summary>The robot sent nothing, or not the expected line, in time.</summary>
    public sealed class NoReplyException : ProtocolException
    {
        internal NoReplyException(string message) : base(message) { }
    }

    /// <summary>The robot answered NG.</summary>
    public sealed class RefusedException : ProtocolException
    {
        /// <summary>The text that was refused.</summary>
        public string Command { get; private set; }

        /// <summary>An exception for this text.</summary>
        public RefusedException(string command)
            : base("the robot answered NG to " + command + "; the log of the emulator gives the reason")
        {
            Command = command;
        }
    }

    /// <summary>A host of the simple protocol on IP0: one text out, one answer or one file back.</summary>
    /// <remarks>Not thread-safe: a connection has one exchange at a time, so give it one thread.</remarks>
    public sealed class Host : IDisposable
    {
        const byte Stx = 0x02, Etx = 0x03, Eof = 0x1A;
        /// <summary>The most data bytes between STX and ETX.</summary>
        public const int LongestText = 253;
        /// <summary>The largest file of the RAM drive; an answer that is longer is given up.</summary>
        public const int LargestFile = 99999;

        readonly Link link;
        readonly Stopwatch sinceText = new Stopwatch();

        /// <summary>Connects to a robot.</summary>
        /// <param name="address">Name or address of the robot.</param>
        /// <param name="port">The TCP port of IP0; 1000 on a robot in its factory settings.</param>
        /// <param name="describe">Adds to the message of <see cref="NoReplyException"/>.</param>
        public Host(string address, int port = 1000, Func<string> describe = null)
        {
            link = new Link(address, port, describe);
            UseStx = true;
            Pause = TimeSpan.FromMilliseconds(50);
        }

        /// <summary>Whether texts begin with STX. The robot answers in kind.</summary>
        public bool UseStx { get; set; }

        /// <summary>The pause after a text of the robot; the manual asks for 50 ms.</summary>
        public TimeSpan Pause { get; set; }

        /// <summary>How long an answer may take: 5 s unless you set it.</summary>
        public TimeSpan Timeout
        {
            get { return link.Timeout; }
            set { link.Timeout = value; }
        }

        /// <summary>How many times the robot has sent SP by itself, less the calls of <see cref="WaitForStop"/>.</summary>
        public int Stops { get; private set; }

        /// <summary>SO: turns servo power on.</summary>
        public void ServoOn() { Command("SO"); }

        /// <summary>BR: turns servo power off.</summary>
        public void ServoOff() { Command("BR"); }

        /// <summary>RN: starts the selected program, or continues it.</summary>
        public void Start() { Command("RN"); }

        /// <summary>SP: stops the program after the current statement.</summary>
        public void Stop() { Command("SP"); }

        /// <summary>EC,BREAK: stops at once.</summary>
        public void BreakMotion() { Command("EC,BREAK"); }

        /// <summary>FD: turns feed hold on, or off again.</summary>
        public void FeedHold() { Command("FD"); }

        /// <summary>SL: selects a file.</summary>
        public void Select(string file) { Command("SL," + file); }

        /// <summary>RS,SEL: deselects the file.</summary>
        public void Deselect() { Command("RS,SEL"); }

        /// <summary>RS,PRG: goes to step 1, with the data of the file.</summary>
        public void ResetProgram() { Command("RS,PRG"); }

        /// <summary>RS,STP: goes to step 1 and keeps the data.</summary>
        public void ResetStep() { Command("RS,STP"); }

        /// <summary>RS,CYC: goes to the label RCYCLE, or to step 1 without one, and keeps the data.</summary>
        public void ResetCycle() { Command("RS,CYC"); }

        /// <summary>RS,SIG: turns outputs 1 to 24 off.</summary>
        public void ResetSignals() { Command("RS,SIG"); }

        /// <summary>RS,ERR: resets alarms whose cause is gone (extension).</summary>
        public void ResetAlarms() { Command("RS,ERR"); }

        /// <summary>EC,OVRD: sets the override.</summary>
        public void SetOverride(int percent) { Command("EC,OVRD " + Text(percent)); }

        /// <summary>EC,MODE: STEP, CYCLE, SEGMENT or CONT.</summary>
        public void SetRunMode(string mode) { Command("EC,MODE " + mode); }

        /// <summary>DO: executes one statement. OK comes when it begins; <see cref="TotalStatus"/> shows its end.</summary>
        public void Execute(string statement) { Command("DO," + statement); }

        /// <summary>IW: switches outputs, all of them or none.</summary>
        public void SetOutputs(IDictionary<int, bool> lines) { Command("IW," + string.Join(" ", lines.Select(one => Text(one.Key) + (one.Value ? " 1" : " 0")))); }

        /// <summary>ER: erases a file.</summary>
        public void Erase(string file) { Command("ER," + file); }

        /// <summary>MR: the values of a variable of GLOBAL or DATA.</summary>
        public double[] ReadVariable(string name)
        {
            return ReadText("MR," + name + " -1").Split(new[] { ' ', '\r' }, StringSplitOptions.RemoveEmptyEntries)
                .Select(number => double.Parse(number, CultureInfo.InvariantCulture)).ToArray();
        }

        /// <summary>MW: writes a variable of GLOBAL or DATA.</summary>
        /// <param name="name">The variable, or an element: <c>A(1,2)</c>.</param>
        /// <param name="values">Its values; one for an integer or a real.</param>
        public void WriteVariable(string name, params double[] values)
        {
            Command("MW,0 " + name + " -1 " + string.Join(" ", values.Select(Text)));
        }

        /// <summary>VR: the version.</summary>
        public string Version() { return ReadText("VR").TrimEnd('\r'); }

        /// <summary>CA: the files of the RAM drive and their sizes.</summary>
        public IDictionary<string, int> Directory()
        {
            return Records(ReadText("CA")).Select(record => record.Split(' '))
                .ToDictionary(words => words[0], words => int.Parse(words[1], CultureInfo.InvariantCulture));
        }

        /// <summary>AC: the active alarms, newest first.</summary>
        public IList<AlarmRecord> Alarms() { return AlarmList("AC"); }

        /// <summary>AH: the alarm history, newest first.</summary>
        public IList<AlarmRecord> AlarmHistory() { return AlarmList("AH"); }

        /// <summary>SU: modes, file, override and execution status.</summary>
        public Status Status() { return new Status(ReadText("SU")); }

        /// <summary>SF: lines, alarms and positions of either kind of arm.</summary>
        public TotalStatus TotalStatus()
        {
            // The data may contain ETX, so the length decides where the text ends.
            Ask("SF");
            byte[] head = Begin(3);
            if (Encoding.ASCII.GetString(head) != "FL,")
                throw Unexpected("SF", head);
            var body = new List<byte>(link.Read(Ts3100.TotalStatus.ScaraBytes));
            byte next = link.Read();
            if (next != Etx)
            {
                body.Add(next);
                body.AddRange(link.Read(Ts3100.TotalStatus.SixAxisBytes - body.Count));
                byte[] end = link.Read(2);
                if (end[0] != Eof || end[1] != Etx)
                    throw new ProtocolException("SF: expected 250 or 276 bytes, found more");
            }
            sinceText.Restart();
            Send("OK\r");
            return new TotalStatus(body.ToArray());
        }

        /// <summary>DL: stores a file on the RAM drive. Line ends are sent as LF.</summary>
        /// <exception cref="EncoderFallbackException">The text is not ASCII.</exception>
        public void Download(string file, string text)
        {
            Download(file, Link.Ascii.GetBytes(text.Replace("\r\n", "\n")));
        }

        /// <summary>DL: stores a file on the RAM drive, byte for byte.</summary>
        public void Download(string file, byte[] content)
        {
            Command("DL," + file);
            byte[] whole = Encoding.ASCII.GetBytes("FL,").Concat(content).Concat(new[] { Eof }).ToArray();
            for (int at = 0; at < whole.Length; at += LongestText)
            {
                Send(whole.Skip(at).Take(LongestText).ToArray());
                Expect("a text of DL," + file);
            }
        }

        /// <summary>UL: reads a file of the RAM drive.</summary>
        public byte[] Upload(string file) { return Query("UL," + file); }

        /// <summary>A command that the robot answers with OK.</summary>
        /// <exception cref="RefusedException">It answered NG.</exception>
        public void Command(string command)
        {
            Ask(command);
            Expect(command);
        }

        /// <summary>A command that the robot answers with a file or a status, without FL and EOF.</summary>
        /// <exception cref="RefusedException">It answered NG.</exception>
        public byte[] Query(string command)
        {
            Ask(command);
            byte[] text = NextAnswer();
            if (!Encoding.ASCII.GetString(text).StartsWith("FL,", StringComparison.Ordinal))
                throw Unexpected(command, text);
            var content = new List<byte>();
            for (int from = 3; ; from = 0, text = NextAnswer())
            {
                Send("OK\r");
                int end = Array.IndexOf(text, Eof);
                content.AddRange(text.Skip(from).Take((end < 0 ? text.Length : end) - from));
                if (end >= 0)
                    return content.ToArray();
                if (content.Count > LargestFile)
                    throw new ProtocolException(command + ": no EOF in " + content.Count + " bytes");
            }
        }

        /// <summary>Waits for the SP that the robot sends when a program has ended or was stopped.</summary>
        public void WaitForStop()
        {
            DropLate();
            if (Stops > 0)
            {
                Stops--;
                return;
            }
            link.Expected = "the SP of a stop";
            byte[] text = NextText();
            if (Encoding.ASCII.GetString(text) != "SP\r")
                throw Unexpected("waiting for a stop", text);
        }

        /// <summary>Closes the connection.</summary>
        public void Dispose() { link.Dispose(); }

        static string Text(double value)
        {
            // An exponent is not a number to the robot.
            return value.ToString("0.######", CultureInfo.InvariantCulture);
        }

        static IEnumerable<string> Records(string text)
        {
            return text.Split(new[] { '\r' }, StringSplitOptions.RemoveEmptyEntries);
        }

        string ReadText(string command) { return Encoding.ASCII.GetString(Query(command)); }

        IList<AlarmRecord> AlarmList(string command)
        {
            string text = ReadText(command);
            int comma = text.IndexOf(',');
            return comma < 0 ? new AlarmRecord[0] : Records(text.Substring(comma + 1)).Select(record => new AlarmRecord(record)).ToArray();
        }

        /// <summary>Sends a command: bytes received earlier are not its answer.</summary>
        void Ask(string command)
        {
            Rest();
            DropLate();
            link.Expected = "an answer to " + command;
            Send(command + "\r");
        }

        /// <summary>Drops answers that came too late. An SP among them counts, and half an SP is kept.</summary>
        void DropLate()
        {
            string late = Encoding.ASCII.GetString(link.Waiting()), stop = (UseStx ? "\x02" : "") + "SP\r\x03";
            Stops += late.Split(new[] { stop }, StringSplitOptions.None).Length - 1;
            string half = late.Substring(late.LastIndexOf((char)Etx) + 1);
            if (stop.StartsWith(half, StringComparison.Ordinal))
                link.Keep(Encoding.ASCII.GetBytes(half));
        }

        void Rest()
        {
            // Sleep cuts a rest to whole milliseconds and may wake early.
            while (sinceText.IsRunning && sinceText.Elapsed < Pause)
                Thread.Sleep((int)Math.Ceiling((Pause - sinceText.Elapsed).TotalMilliseconds));
        }

        void Send(string text) { Send(Link.Ascii.GetBytes(text)); }

        void Send(byte[] data)
        {
            Rest();
            var text = new List<byte>();
            if (UseStx)
                text.Add(Stx);
            text.AddRange(data);
            text.Add(Etx);
            link.Write(text.ToArray()); // in one piece, as the robot's own tools do
        }

        void Expect(string command)
        {
            byte[] answer = NextAnswer();
            if (Encoding.ASCII.GetString(answer) != "OK\r")
                throw Unexpected(command, answer);
        }

        static Exception Unexpected(string command, byte[] answer)
        {
            string text = Encoding.ASCII.GetString(answer);
            if (text == "NG\r")
                return new RefusedException(command);
            return new ProtocolException(command + ": the robot answered \"" + text.Replace("\r", "\\r") + "\"");
        }

        byte[] NextAnswer()
        {
            for (; ; Stops++)
            {
                byte[] text = NextText();
                if (Encoding.ASCII.GetString(text) != "SP\r")
                    return text;
            }
        }

        byte[] NextText()
        {
            byte[] begun = FirstBytes();
            byte[] text = begun.Concat(link.Until(Etx)).ToArray();
            sinceText.Restart();
            return text;
        }

        /// <summary>The first bytes of an answer, or all of an NG; an SP may come before it.</summary>
        byte[] Begin(int count)
        {
            for (; ; Stops++)
            {
                byte[] begun = FirstBytes();
                byte[] head = begun.Concat(link.Read(count - begun.Length)).ToArray();
                string text = Encoding.ASCII.GetString(head);
                if (text != "SP\r" && text != "NG\r")
                    return head;
                link.Read(); // its ETX
                sinceText.Restart();
                if (text == "NG\r")
                    return head;
            }
        }

        byte[] FirstBytes()
        {
            byte first = link.Read();
            if (!UseStx)
                return new[] { first };
            if (first != Stx)
                throw new ProtocolException("expected STX, found byte " + first.ToString("X2"));
            return new byte[0];
        }
    }

    /// <summary>The peer of a SCOL channel: what a program prints, and what its INPUT reads, line by line.</summary>
    public sealed class Channel : IDisposable
    {
        readonly Link link;
        readonly string name;

        /// <summary>Connects to IP1 or IP2, or to COM1 served as bare TCP.</summary>
        /// <param name="address">Name or address of the robot.</param>
        /// <param name="port">The TCP port; 1001 for IP1 on a robot in its factory settings.</param>
        /// <param name="name">What a message calls the connection.</param>
        /// <param name="describe">Adds to the message of <see cref="NoReplyException"/>.</param>
        public Channel(string address, int port = 1001, string name = "the robot", Func<string> describe = null)
        {
            this.name = name;
            link = new Link(address, port, describe);
        }

        /// <summary>How long a line may take: 5 s unless you set it.</summary>
        public TimeSpan Timeout { get { return link.Timeout; } set { link.Timeout = value; } }

        /// <summary>Sends a line; INPUT expects commas between values.</summary>
        public void SendLine(string text) { link.Write(Link.Ascii.GetBytes(text + "\r")); }

        /// <summary>The next line that the program prints, without its CR.</summary>
        public string ReadLine() { return WaitForLine(""); }

        /// <summary>The next line with this text. Lines before it are dropped.</summary>
        /// <exception cref="NoReplyException">None came in time; the message has the lines that came instead.</exception>
        public string WaitForLine(string text)
        {
            var others = new List<string>();
            TimeSpan limit = link.Timeout;
            var since = Stopwatch.StartNew();
            try
            {
                for (; ; )
                {
                    string line = Encoding.ASCII.GetString(link.Until((byte)'\r'));
                    if (line.Contains(text))
                        return line;
                    others.Add("`" + line + "`");
                    link.Timeout = TimeSpan.FromMilliseconds(Math.Max(1, (limit - since.Elapsed).TotalMilliseconds));
                }
            }
            catch (NoReplyException)
            {
                byte[] begun = link.Waiting();
                link.Keep(begun);
                if (begun.Length > 0)
                    others.Add("`" + Encoding.ASCII.GetString(begun) + "`");
                throw new NoReplyException(name + ": expected a line" + (text == "" ? "" : " with `" + text + "`") + " within " + Link.Seconds(limit)
                    + ", found " + (others.Count == 0 ? "nothing" : string.Join(", ", others)) + link.Described());
            }
            finally
            {
                link.Timeout = limit;
            }
        }

        /// <summary>Closes the connection.</summary>
        public void Dispose() { link.Dispose(); }
    }

    /// <summary>Bytes to and from one port. TCP divides texts as it likes, so unread bytes are kept.</summary>
    sealed class Link : IDisposable
    {
        // The longest answer has 282 bytes; a line of PRINT has 256.
        const int BufferBytes = 4096, LongestLine = 4096;

        /// <summary>Of what is sent: another letter is an EncoderFallbackException, and no question mark.</summary>
        public static readonly Encoding Ascii = Encoding.GetEncoding("us-ascii", EncoderFallback.ExceptionFallback, DecoderFallback.ReplacementFallback);

        readonly TcpClient client = new TcpClient { NoDelay = true };
        readonly NetworkStream stream;
        readonly byte[] kept = new byte[BufferBytes];
        int taken, filled;

        readonly Func<string> describe;

        public Link(string address, int port, Func<string> describe)
        {
            this.describe = describe;
            Expected = "anything";
            try
            {
                client.Connect(address, port);
            }
            catch (SocketException error)
            {
                client.Close();
                throw new ProtocolException("cannot connect to " + address + ":" + port + ": " + error.Message);
            }
            stream = client.GetStream();
            Timeout = TimeSpan.FromSeconds(5);
        }

        public TimeSpan Timeout
        {
            get { return TimeSpan.FromMilliseconds(stream.ReadTimeout); }
            set { stream.ReadTimeout = (int)value.TotalMilliseconds; }
        }

        /// <summary>What the robot should send next, for the message of <see cref="NoReplyException"/>.</summary>
        public string Expected { get; set; }

        public static string Seconds(TimeSpan limit) { return limit.TotalSeconds.ToString(CultureInfo.InvariantCulture) + " s"; }

        /// <summary>The end of a message about something that did not come.</summary>
        public string Described() { return describe == null ? "" : ": " + describe(); }

        public void Write(byte[] data)
        {
            try
            {
                stream.Write(data, 0, data.Length);
            }
            catch (IOException error)
            {
                throw new ProtocolException("the connection has ended: " + error.Message);
            }
        }

        /// <summary>What has come and was not read yet.</summary>
        public byte[] Waiting()
        {
            var data = new List<byte>();
            while (taken < filled || client.Available > 0)
                data.Add(Read());
            return data.ToArray();
        }

        /// <summary>Bytes that are to be read again, at most those of a text.</summary>
        public void Keep(byte[] data)
        {
            data.CopyTo(kept, 0);
            taken = 0;
            filled = data.Length;
        }

        public byte Read()
        {
            if (taken == filled)
                Fill();
            return kept[taken++];
        }

        public byte[] Read(int count)
        {
            var data = new byte[count];
            for (int at = 0; at < count; at++)
                data[at] = Read();
            return data;
        }

        public byte[] Until(byte end)
        {
            var data = new List<byte>();
            try
            {
                for (byte next = Read(); next != end; next = Read())
                {
                    data.Add(next);
                    if (data.Count >= LongestLine)
                        throw new ProtocolException("no end of the text in " + LongestLine + " bytes");
                }
            }
            catch (NoReplyException)
            {
                Keep(data.ToArray()); // the rest may come yet
                throw;
            }
            return data.ToArray();
        }

        public void Dispose() { client.Close(); }

        void Fill()
        {
            taken = filled = 0;
            try
            {
                filled = stream.Read(kept, 0, kept.Length);
            }
            catch (IOException error)
            {
                var socket = error.InnerException as SocketException;
                if (socket != null && socket.SocketErrorCode == SocketError.ConnectionReset)
                    throw new ProtocolException("the connection has ended: " + socket.Message);
                throw new NoReplyException("the robot did not send " + Expected + " within " + Seconds(Timeout) + Described());
            }
            if (filled == 0)
                throw new ProtocolException("the robot closed the connection; does another host have it?");
        }
    }
}
