// xUnit 2: a class fixture starts one robot for the class; the constructor takes a fresh one for each test.
using System;
using Ts3100;
using Ts3100.Testing;
using Xunit;

public class CellTests : IClassFixture<RobotFixture>, IDisposable
{
    readonly TestRobot robot;

    public CellTests(RobotFixture fixture) { robot = fixture.Fresh(nameof(CellTests)); }

    public void Dispose() { robot.Dispose(); }

    [Fact]
    public void The_servo_turns_on()
    {
        using (Host host = robot.Host())
        {
            host.ServoOn();
            Assert.True(host.TotalStatus().ServoOn);
        }
    }
}
