using System.Linq;
using NUnit.Framework;
using Ts3100;

[TestFixture]
public class DialogueTest : RobotTest
{
    const string Ask = @"PROGRAM ASK
PRINT IP1, ""HOW FAR?"", CR
INPUT IP1, X
PRINT IP1, ""GOING"", CR
MOVE POINT(400, X, 200)
END
";

    [Test]
    public void The_emergency_stop_ends_the_motion()
    {
        Robot.SetTimeMode("stepped");
        using (Host host = Robot.Host())
        using (Channel channel = Robot.Channel("ip1"))
        {
            host.ServoOn();
            host.Download("ASK", Ask);
            host.Select("ASK");
            host.Start();
            channel.WaitForLine("HOW FAR?");
            channel.SendLine("62.5");
            channel.WaitForLine("GOING");
            Robot.Advance(0.2);
            Robot.SetEmergencyStop(true);
            Assert.That(Robot.Status(), Is.EqualTo("stop (retry)"));
            Assert.Throws<RefusedException>(host.Start);
            Assert.That(Robot.Alarms().First().Number, Is.EqualTo("8-014"));
            Assert.That(Robot.Findings().Last().Rule, Is.EqualTo("refused-by-state"));
            Robot.Allow("refused-by-state");
        }
    }
}
