// A test of a cell: replace place_part() by your host program, and these checks by those of your test framework.
#include <iostream>

#include "ts3100.hpp"

namespace {

int failures = 0;

void check(bool holds, const char* what) {
    std::cout << (holds ? "ok   " : "FAIL ") << what << '\n';
    failures += holds ? 0 : 1;
}

/// The host: downloads a program, starts it, and returns.
void place_part(ts3100::Host& host) {
    host.servo_on();
    host.download("PICK", "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n");
    host.select("PICK");
    host.start();
}

void the_robot_places_a_part(const ts3100::Fixture& cell) {
    const ts3100::Robot& robot = cell.fresh();
    ts3100::Host host = robot.host();
    robot.set_time_mode("stepped");
    place_part(host);
    robot.set_input(1, true);
    const ts3100::Reached placed = robot.advance_until("output 5 on", 10);
    check(placed.now >= 2, "the part is placed after two seconds of the robot's time");
    robot.set_time_mode("real");
    host.wait_for_stop();
    check(host.total_status().output(5), "the host sees the output");
    check(cell.mistakes().empty(), "the host keeps the protocol");
}

void the_emergency_stop_refuses_a_start(const ts3100::Fixture& cell) {
    const ts3100::Robot& robot = cell.fresh();
    robot.set_emergency_stop(true);
    ts3100::Host host = robot.host();
    try {
        place_part(host);
        check(false, "the start is refused");
    } catch (const ts3100::Refused& refused) {
        check(refused.command == "SO", "the start is refused");
    }
    check(cell.mistakes(ts3100::Severity::warning, {"refused-by-state"}).empty(), "and this refusal is expected");
}

}  // namespace

int main() try {
    const ts3100::Fixture cell;
    the_robot_places_a_part(cell);
    the_emergency_stop_refuses_a_start(cell);
    return failures == 0 ? 0 : 1;
} catch (const std::exception& error) {
    std::cout << "FAIL " << error.what() << '\n';
    return 1;
}
