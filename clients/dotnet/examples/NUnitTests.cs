// NUnit 2.6 and later. A base class in three methods; the tests of a cell below it. With NUnit 2.6 define NUNIT2.
using NUnit.Framework;
using Ts3100;
using Ts3100.Testing;

/// <summary>A fresh robot for each test.</summary>
public abstract class RobotTest
{
    protected TestRobot Robot;

    [SetUp]
    public void TakeRobot() { Robot = RobotFixture.Shared.Fresh(TestContext.CurrentContext.Test.Name); }

    [TearDown]
    public void EndRobot()
    {
#if NUNIT2
        Robot?.End(TestContext.CurrentContext.Result.Status == TestStatus.Failed);
#else
        try
        {
            Robot?.End(TestContext.CurrentContext.Result.Outcome.Status == NUnit.Framework.Interfaces.TestStatus.Failed);
        }
        finally
        {
            if (Robot?.TranscriptFile != null)
                TestContext.AddTestAttachment(Robot.TranscriptFile);
            if (Robot?.PageFile != null)
                TestContext.AddTestAttachment(Robot.PageFile);
        }
#endif
    }
}

[TestFixture]
public class CellTests : RobotTest
{
    const string Pick = "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n";

    [Test]
    public void The_robot_places_a_part()
    {
        Robot.SetTimeMode("stepped");
        using (Host host = Robot.Host())
        {
            host.ServoOn();
            host.Download("PICK", Pick);
            host.Select("PICK");
            host.Start();
            Robot.SetInput(1, true);
            Assert.That(Robot.AdvanceUntil("output 5 on", 10).Now, Is.GreaterThanOrEqualTo(2.0));
            Robot.SetTimeMode("real");
            host.WaitForStop();
            Assert.That(host.Status().Execution, Is.EqualTo(Execution.Reset));
            Assert.That(host.TotalStatus().Output(5), Is.True);
        }
    }

    [Test]
    public void The_next_test_finds_a_fresh_robot()
    {
        using (Host host = Robot.Host())
        {
            Assert.That(host.Directory().ContainsKey("PICK"), Is.False);
            Assert.That(host.TotalStatus().ServoOn, Is.False);
        }
    }

    [Test]
    public void The_emergency_stop_refuses_a_start()
    {
        Robot.Allow("refused-by-state"); // this test provokes it
        Robot.SetEmergencyStop(true);
        using (Host host = Robot.Host())
            Assert.Throws<RefusedException>(host.ServoOn);
    }
}
