// A host program on sockets, for the TS3100 or the emulator: servo on, a program downloaded, selected and started, its
// questions answered, status read by SU and by SF, the file read back. It speaks the simple protocol itself and needs
// nothing but .NET; Robot is the part to take over into a program of one's own.
//
//     mcs -out:Host.exe clients/csharp/Host.cs
//     mono Host.exe 127.0.0.1:11000 127.0.0.1:11001            commands on IP0, the program talks on IP1
//     mono Host.exe 127.0.0.1:22217 127.0.0.1:22218 COM1       the same on HOST and COM1 as bare TCP
//
// Exit code: 0 all of it happened, 1 it did not (the reason is on stderr), 2 wrong arguments.

using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using System.IO;
using System.Net.Sockets;
using System.Text;
using System.Threading;

/// What the robot refused, sent in a form that is not the protocol's, or did not send in time.
class RobotException : Exception
{
    public RobotException(string message) : base(message) { }
}

/// Bytes to and from one port of the robot. TCP cuts where it likes, so what came too early is kept for the next reader.
class Link : IDisposable
{
    // A text of 282 bytes takes 0.3 s at 9600 bps; a robot that says nothing for so long does not answer at all.
    const int TimeoutMs = 5000;

    readonly TcpClient client;
    readonly NetworkStream stream;
    readonly byte[] kept = new byte[4096];
    int taken, filled;

    public Link(string address)
    {
        int colon = address.LastIndexOf(':');
        client = new TcpClient(address.Substring(0, colon), int.Parse(address.Substring(colon + 1)));
        client.NoDelay = true;
        client.ReceiveTimeout = TimeoutMs;
        stream = client.GetStream();
    }

    public void Send(byte[] data)
    {
        stream.Write(data, 0, data.Length);
    }

    public byte Byte()
    {
        if (taken == filled)
            Fill();
        return kept[taken++];
    }

    void Fill()
    {
        taken = filled = 0;
        try
        {
            filled = stream.Read(kept, 0, kept.Length);
        }
        catch (IOException error)
        {
            throw new RobotException("no byte came within " + TimeoutMs + " ms: " + error.Message);
        }
        if (filled == 0)
            throw new RobotException("the robot closed the connection (has it another host already?)");
    }

    public byte[] Bytes(int count)
    {
        var data = new byte[count];
        for (int at = 0; at < count; at++)
            data[at] = Byte();
        return data;
    }

    /// The bytes in front of `end`, which is taken and not returned.
    public byte[] Until(byte end)
    {
        var data = new List<byte>();
        for (byte next = Byte(); next != end; next = Byte())
            data.Add(next);
        return data.ToArray();
    }

    public void Dispose()
    {
        client.Close();
    }
}

/// The system total status: the part of SF's binary record that most hosts look at.
class TotalStatus
{
    public bool ServoOn, EmergencyStop;
    public int Motion; // 0 stop (reset), 1 running, 2 stop (retry), 3 stop (continue)
    public List<int> Alarms = new List<int>();
    public float[] World = new float[8]; // X Y Z A B C U V in mm and degrees

    const int AlarmsAt = 4, AlarmCount = 10, NoAlarm = 0xFFFF, WorldAt = 148;

    public TotalStatus(byte[] body)
    {
        ServoOn = body[0] == 1;
        EmergencyStop = body[1] == 1;
        Motion = body[2];
        for (int at = AlarmsAt; at < AlarmsAt + 2 * AlarmCount; at += 2)
            if ((body[at] << 8 | body[at + 1]) != NoAlarm)
                Alarms.Add(body[at] << 8 | body[at + 1]);
        for (int axis = 0; axis < World.Length; axis++)
            World[axis] = Float(body, WorldAt + 4 * axis);
    }

    /// The robot sends the highest byte first, a PC's memory has it last.
    static float Float(byte[] body, int at)
    {
        var four = new[] { body[at], body[at + 1], body[at + 2], body[at + 3] };
        if (BitConverter.IsLittleEndian)
            Array.Reverse(four);
        return BitConverter.ToSingle(four, 0);
    }
}

/// The simple protocol on IP0 or HOST: one text out, one text or one file back.
class Robot : IDisposable
{
    const byte Stx = 0x02, Etx = 0x03, Eof = 0x1A;
    const int AdvisedPauseMs = 50;   // between a text of the robot and the next one of the host
    const int DataBytes = 253;       // between STX and ETX
    const int TotalStatusBytes = 276; // six-axis arms; a SCARA sends 250 and no EOF

    readonly Link link;
    readonly Stopwatch sinceText = new Stopwatch();

    /// How often the robot said SP by itself: a program has ended or was stopped.
    public int Stops { get; private set; }

    public Robot(string address)
    {
        link = new Link(address);
    }

    /// A command that is answered by OK or NG.
    public void Command(string command)
    {
        Send(Encoding.ASCII.GetBytes(command + "\r"));
        Expect(command);
    }

    /// A command that is answered by a file of one or several texts, each of them acknowledged; without EOF.
    public byte[] Read(string command)
    {
        Send(Encoding.ASCII.GetBytes(command + "\r"));
        byte[] text = Text();
        if (text.Length < 3 || Encoding.ASCII.GetString(text, 0, 3) != "FL,")
            throw new RobotException(command + " is answered by " + Show(text));
        var file = new List<byte>();
        for (int from = 3; ; from = 0, text = Text())
        {
            Send(Encoding.ASCII.GetBytes("OK\r"));
            int end = Array.IndexOf(text, Eof);
            for (int at = from; at < (end < 0 ? text.Length : end); at++)
                file.Add(text[at]);
            if (end >= 0)
                return file.ToArray();
        }
    }

    /// DL: FL, and the EOF count among the data bytes; only the first text has the one and only the last has the other.
    public int Download(string name, byte[] content)
    {
        Command("DL," + name);
        var rest = new List<byte>(Encoding.ASCII.GetBytes("FL,"));
        rest.AddRange(content);
        rest.Add(Eof);
        int texts = 0;
        for (int at = 0; at < rest.Count; at += DataBytes)
        {
            Send(rest.GetRange(at, Math.Min(DataBytes, rest.Count - at)).ToArray());
            Expect("text " + ++texts + " of DL," + name);
        }
        return texts;
    }

    /// SU: the items of the status by their labels.
    public Dictionary<string, string> Status()
    {
        var items = new Dictionary<string, string>();
        foreach (string item in Encoding.ASCII.GetString(Read("SU")).Split(' '))
            items[item.Substring(0, item.IndexOf(':'))] = item.Substring(item.IndexOf(':') + 1);
        return items;
    }

    /// SF is binary: an ETX may stand anywhere in it, so it is read by its length.
    public TotalStatus Total()
    {
        Send(Encoding.ASCII.GetBytes("SF\r"));
        string head;
        while ((head = Encoding.ASCII.GetString(Begin(3))) == "SP\r")
        {
            link.Byte();
            Stops++;
        }
        if (head != "FL,")
            throw new RobotException("SF is answered by " + head.Trim());
        byte[] body = link.Bytes(TotalStatusBytes);
        byte[] end = link.Bytes(2);
        sinceText.Restart();
        if (end[0] != Eof || end[1] != Etx)
            throw new RobotException("SF is not " + TotalStatusBytes + " bytes long; is this a SCARA?");
        Send(Encoding.ASCII.GetBytes("OK\r"));
        return new TotalStatus(body);
    }

    /// Waits for the SP that tells of the end of a cycle.
    public void AwaitStop()
    {
        if (Stops == 0)
        {
            byte[] text = Next();
            if (Encoding.ASCII.GetString(text) != "SP\r")
                throw new RobotException("SP was expected, not " + Show(text));
        }
        else
            Stops--;
    }

    void Send(byte[] data)
    {
        if (sinceText.IsRunning && sinceText.ElapsedMilliseconds < AdvisedPauseMs)
            Thread.Sleep(AdvisedPauseMs - (int)sinceText.ElapsedMilliseconds);
        var text = new byte[data.Length + 2];
        text[0] = Stx;
        data.CopyTo(text, 1);
        text[text.Length - 1] = Etx;
        link.Send(text); // in one piece
    }

    void Expect(string what)
    {
        string answer = Encoding.ASCII.GetString(Text());
        if (answer != "OK\r")
            throw new RobotException(what + " is answered by " + answer.Trim());
    }

    /// The next text that is an answer; an SP may lie in front of it.
    byte[] Text()
    {
        for (;;)
        {
            byte[] text = Next();
            if (Encoding.ASCII.GetString(text) != "SP\r")
                return text;
            Stops++;
        }
    }

    byte[] Next()
    {
        Begin(0);
        byte[] text = link.Until(Etx);
        sinceText.Restart();
        return text;
    }

    byte[] Begin(int count)
    {
        byte first = link.Byte();
        if (first != Stx)
            throw new RobotException("a text begins with " + first.ToString("X2") + ", not with STX");
        return link.Bytes(count);
    }

    static string Show(byte[] text)
    {
        return "\"" + Encoding.ASCII.GetString(text).Replace("\r", "\\r") + "\"";
    }

    public void Dispose()
    {
        link.Dispose();
    }
}

static class Job
{
    const string Name = "CSHOST";
    const byte Cr = 0x0D;
    const double Far = 62.5;

    // The lines of a file on the RAM drive end in LF alone.
    static string Program(string channel)
    {
        return string.Join("\n",
            "PROGRAM " + Name,
            "REMARK Asks the host how far to go, goes there, and says so.",
            "X = 0.0",
            "PRINT " + channel + ", \"HOW FAR?\", CR",
            "INPUT " + channel + ", X",
            "MOVE START WITH SPEED=100",
            "MOVE START + POINT(0, X, 0) WITH SPEED=100",
            "WAIT MOTION >= 100",
            "PRINT " + channel + ", \"THERE\", X, CR",
            "END",
            "DATA",
            "POINT START=400,0,200,0,0,0,0,0/11111",
            "END",
            "");
    }

    static void Run(Robot robot, Link talk, string channel)
    {
        byte[] program = Encoding.ASCII.GetBytes(Program(channel));
        robot.Command("SO");
        Say("SO: servo on");
        Say("DL: " + program.Length + " bytes in " + robot.Download(Name, program) + " texts");
        bool same = Convert.ToBase64String(robot.Read("UL," + Name)) == Convert.ToBase64String(program);
        Say("UL: " + (same ? "the same bytes" : "other bytes"));
        robot.Command("SL," + Name);
        Say("SL: " + robot.Status()["FILE"]);
        robot.Command("RN");
        Say("the robot asks: " + Encoding.ASCII.GetString(talk.Until(Cr)));
        Say("SU: " + robot.Status()["STATUS"]);
        talk.Send(Encoding.ASCII.GetBytes(Far.ToString(CultureInfo.InvariantCulture) + "\r"));
        Say("the robot says: " + Encoding.ASCII.GetString(talk.Until(Cr)));
        robot.AwaitStop();
        TotalStatus total = robot.Total();
        Say(string.Format(CultureInfo.InvariantCulture, "SF: servo {0}, motion {1}, {2} alarms, X {3:F1} Y {4:F1} Z {5:F1}",
            total.ServoOn ? "on" : "off", total.Motion, total.Alarms.Count, total.World[0], total.World[1], total.World[2]));
        robot.Command("BR");
        Say("BR: servo off");
        if (!same || total.Motion != 0 || total.Alarms.Count != 0 || Math.Abs(total.World[1] - Far) > 0.01)
            throw new RobotException("the robot is not where it was sent, or the file is not what was sent");
    }

    static void Say(string line)
    {
        Console.WriteLine(line);
    }

    static int Main(string[] arguments)
    {
        if (arguments.Length < 2 || arguments.Length > 3)
        {
            Console.Error.WriteLine("Host COMMANDS DIALOGUE [CHANNEL]: two addresses, and IP1 (the default), IP2 or COM1");
            return 2;
        }
        try
        {
            using (var robot = new Robot(arguments[0]))
            using (var talk = new Link(arguments[1]))
                Run(robot, talk, arguments.Length == 3 ? arguments[2] : "IP1");
            return 0;
        }
        catch (Exception error)
        {
            if (!(error is RobotException || error is SocketException || error is IOException || error is FormatException))
                throw;
            Console.Error.WriteLine(error.Message);
            return 1;
        }
    }
}
