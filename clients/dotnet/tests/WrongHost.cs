// A host with two mistakes, for NUnit: the test must fail and name them. tests/system/packages/client_libraries.py expects that.
using NUnit.Framework;
using Ts3100;

[TestFixture]
public class WrongHost : RobotTest
{
    [Test]
    public void Sends_a_command_that_no_robot_knows()
    {
        using (Host host = Robot.Host())
            Assert.Throws<RefusedException>(() => host.Command("XX"));
    }

    [Test]
    public void Starts_a_program_with_the_servo_off()
    {
        using (Host host = Robot.Host())
        {
            host.Select("DEMO");
            Assert.Throws<RefusedException>(host.Start);
        }
    }
}
