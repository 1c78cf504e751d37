// A dialogue with a program, and the emergency stop. The checks are assert(); use those of your test framework.
#undef NDEBUG
#include <cassert>

#include "ts3100.hpp"

const std::string ask =
    "PROGRAM ASK\n"
    "PRINT IP1, \"HOW FAR?\", CR\n"
    "INPUT IP1, X\n"
    "PRINT IP1, \"GOING\", CR\n"
    "MOVE POINT(400, X, 200)\n"
    "END\n";

int main() {
    const ts3100::Fixture cell({"--time", "stepped"});
    const ts3100::Robot& robot = cell.fresh();
    ts3100::Host host = robot.host();
    ts3100::Channel channel = robot.channel("ip1");
    host.servo_on();
    host.download("ASK", ask);
    host.select("ASK");
    host.start();
    channel.wait_for_line("HOW FAR?");
    channel.send_line("62.5");
    channel.wait_for_line("GOING");
    robot.advance(0.2);
    robot.set_emergency_stop(true);
    assert(robot.status() == "stop (retry)");
    bool refused = false;
    try {
        host.start();
    } catch (const ts3100::Refused&) {
        refused = true;
    }
    assert(refused);
    assert(robot.alarms().front().number == "8-014");
    assert(robot.findings().back().rule == "refused-by-state");
    assert(cell.mistakes(ts3100::Severity::warning, {"refused-by-state"}).empty());
}
