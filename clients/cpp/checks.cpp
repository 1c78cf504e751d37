// Checks of ts3100.hpp against the emulator; the first that fails ends them with exit code 1.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "ts3100.hpp"

namespace {

using ts3100::Execution;
using ts3100::Fixture;
using ts3100::Host;
using ts3100::Json;
using ts3100::Robot;

// Long enough to travel in several texts.
const std::string ask = "' " + std::string(200, 'a') + "\n' " + std::string(200, 'b') + "\n' " + std::string(200, 'c') + "\n"
                        "GLOBAL\nCOUNT = 3\nRATE = 0.5\nEND\nPROGRAM ASK\nPRINT IP1, \"HOW FAR?\", CR\nINPUT IP1, X\n"
                        "PRINT IP1, \"THAT IS\", X, CR\nEND\nDATA\nPOINT A1=400,0,200,0,0,0,0,0/11111\nEND\n";
constexpr int fresh_robots = 500;

template <typename T>
void same(const std::string& what, const T& expected, const T& found) {
    if (!(expected == found)) {
        std::ostringstream text;
        text << what << "\n     expected " << expected << "\n     found    " << found;
        throw std::logic_error(text.str());
    }
    std::cout << "ok   " << what << '\n';
}

void expect(const std::string& what, const std::string& expected, const std::string& found) { same(what, expected, found); }
void expect(const std::string& what, double expected, double found) { same(what, expected, found); }
void expect(const std::string& what, int expected, int found) { same(what, expected, found); }
void expect(const std::string& what, bool expected, bool found) { same(what, expected, found); }

template <typename E, typename F>
std::string thrown(F action) {
    try {
        action();
    } catch (const E& error) {
        return error.what();
    }
    throw std::logic_error("an exception was expected");
}

void set_variable(const char* name, const char* value) {
#ifdef _WIN32
    _putenv_s(name, value);
#else
    setenv(name, value, 1);
#endif
}

std::string numbers(const std::vector<double>& values) {
    std::string text;
    for (double value : values) text += (text.empty() ? "" : " ") + Json::number(std::round(value * 1000) / 1000);
    return text;
}

void text_of_json() {
    const Json value = Json::parse(" {\"a\": [1, -2.5e3, true, null, \"\\u00e9\\n\\\"\"], \"b\": {}} ");
    expect("JSON: a number", -2500.0, value["a"].elements()[1].as_double());
    expect("JSON: a text", "\xC3\xA9\n\"", value["a"].elements()[4].as_string());
    expect("JSON: an empty object", true, value["b"].members().empty());
    expect("JSON: values are written", "{\"a\":[1,-2500,true,null,\"\xC3\xA9\\u000a\\\"\"],\"b\":{}}", value.text());
    expect("JSON: 64 bits are not rounded", "[8139114023949186051,6e30]", Json::parse("[8139114023949186051,6e30]").text());
    expect("JSON: the place of an error", "JSON, character 5: expected `:`, found the end", thrown<ts3100::Error>([] { Json::parse("{\"a\""); }));
    expect("JSON: no endless nesting", true, thrown<ts3100::Error>([] { Json::parse(std::string(100000, '[')); }).find("at most 64") != std::string::npos);
    expect("JSON: a number of the wrong form", true, thrown<ts3100::Error>([] { Json::parse("[-]"); }).find("expected a value") != std::string::npos);
}

void six_axes() {
    const Fixture cell;
    const Robot& robot = cell.fresh();
    Host host = cell.robot.host();
    host.servo_on();
    host.download("ASK", ask);
    expect("UL returns what DL stored", ask, host.upload("ASK"));
    expect("CA has it", static_cast<int>(ask.size()), host.directory()["ASK"]);
    expect("VR", "TS3100", host.version().substr(0, 6));
    host.select("ASK");
    expect("MR of a position", "400 0 200 0 0 0 0 0 11111", numbers(host.read_variable("A1")));
    host.write_variable("COUNT", {12});
    host.write_variable("RATE", {0.25});
    expect("MW of an integer and a real", "12 0.25", numbers(host.read_variable("COUNT")) + " " + numbers(host.read_variable("RATE")));
    host.set_override(40);
    {
        ts3100::Channel channel = robot.channel("ip1");
        host.start();
        expect("PRINT", "HOW FAR?", channel.read_line());
        const ts3100::Status running = host.status();
        expect("SU while it runs", "external(ethernet) cycle ASK 40 0 1",
              running.master_mode + " " + running.operation_mode + " " + running.file + " " + std::to_string(running.override_percent) + " " +
                  std::to_string(running.machine_lock) + " " + std::to_string(running.execution == Execution::running));
        channel.send_line("2.5");
        expect("INPUT and PRINT", "THAT IS       2.500", channel.read_line());
        host.wait_for_stop();
    }
    host.set_outputs({{3, true}});
    robot.set_input(201, true);
    robot.raise_alarm("1-200");
    const ts3100::TotalStatus total = host.total_status();
    expect("SF: servo, emergency stop, SCARA", "1 0 0", std::to_string(total.servo_on()) + " " + std::to_string(total.emergency_stop()) + " " + std::to_string(total.is_scara()));
    expect("SF: alarms", "1-200", total.alarms().at(0));
    expect("SF: lines", "1 1 0", std::to_string(total.output(3)) + " " + std::to_string(total.input(201)) + " " + std::to_string(total.input(1)));
    expect("SF: the tool point that the control interface shows", numbers(robot.state()["arm"]["world"].as_doubles()), numbers(total.world()));
    expect("a line that does not exist", "line 65: expected 1 to 64, 101 to 164, 201 to 264 or 301 to 364", thrown<ts3100::Error>([&] { total.input(65); }));
    host.execute("MOVE POINT(400,50,250)");
    while (host.total_status().motion() == Execution::running) {
    }
    expect("DO moves the arm", "400 50 250", numbers(host.total_status().world()).substr(0, 10));
    host.use_stx = false;
    expect("without STX", "ASK", host.status().file);
    expect("no mistakes", "", cell.mistakes());
}

void scara() {
    set_variable("TS3100_KEY_SWITCH", "teaching");  // has no effect
    const Fixture cell({"--model", "tsl3000-thl400", "--servo-on"});
    set_variable("TS3100_KEY_SWITCH", "");
    Host host = cell.robot.host();
    const ts3100::TotalStatus total = host.total_status();
    expect("SF of a SCARA", "1 6 1", std::to_string(total.is_scara()) + " " + std::to_string(total.joints().size()) + " " + std::to_string(total.servo_on()));
    host.servo_on();
    expect("and the next answer is its own", true, host.status().execution == Execution::reset);
}

void refusals() {
    const Fixture cell({"--key-switch", "teaching"});
    Host host = cell.robot.host();
    expect("NG names the command", "the robot answered NG to SO; the log of the emulator gives the reason", thrown<ts3100::Refused>([&] { host.servo_on(); }));
    expect("and of a file", "the robot answered NG to UL,NONE; the log of the emulator gives the reason", thrown<ts3100::Refused>([&] { host.upload("NONE"); }));
    cell.robot.arm_fault("late-reply:command=SU,delay=400");
    host.timeout(ts3100::milliseconds(200));
    expect("a robot that does not answer", true,
           thrown<ts3100::NoReply>([&] { host.status(); }).find("the robot did not send an answer to SU within 0.2 s: the clock runs (real) and is at ") == 0);
    std::this_thread::sleep_for(ts3100::milliseconds(300));
    expect("an answer that comes later is not that of the next command", "TS3100", host.version().substr(0, 6));
    expect("an address that is none", true, thrown<ts3100::Error>([] { Host("127.0.0.1", 1); }).find("cannot connect to 127.0.0.1:1;") == 0);
}

void control() {
    const Fixture cell({"--time", "stepped"});
    const Robot& robot = cell.fresh();
    robot.put_file("ASK", ask);
    expect("a file", ask, robot.file("ASK"));
    robot.select_file("ASK");
    robot.set_variable("COUNT", 7);
    expect("a variable", 7.0, robot.variable("COUNT").at(0));
    robot.set_servo(true);
    robot.set_override(50);
    robot.take_snapshot("set");
    robot.advance(0.5);
    expect("time moves", 0.5, robot.clock().now);
    robot.set_emergency_stop(true);
    expect("a refusal in the emulator's words", "cannot turn the servo on: the emergency stop is pressed", thrown<ts3100::ControlError>([&] { robot.set_servo(true); }));
    robot.restore_snapshot("set");
    expect("a snapshot restores all of it", "0 50", Json::number(robot.clock().now) + " " + std::to_string(robot.state()["override_percent"].as_int()));
    expect("a wait that is not met", "`output 5 on` was not met within 0 s of virtual time: the clock is stepped and stopped at 0 s; ASK is stop (reset), line 9; "
           "alarms: none; outputs on: 250 255 256 260; the pendant printed nothing", thrown<ts3100::NotReached>([&] { robot.wait_until("output 5 on", 0); }));
    robot.raise_alarm("2-046");
    expect("an alarm", "2-046", robot.alarms().at(0).number);
    robot.reset_alarms();
    robot.power_off();
    robot.power_on();
    expect("any operation by its name", true, robot.call("put_input", {{"line", 5}, {"on", true}})["on"].as_bool());
    expect("a text", "event: ", robot.call("get_events", {{"since", 1}, {"count", 1}}).as_string().substr(0, 7));
    expect("an unknown operation", "unknown operation get_inputt", thrown<ts3100::Error>([&] { robot.call("get_inputt"); }));
    expect("a missing argument", "get_input needs the argument line", thrown<ts3100::Error>([&] { robot.call("get_input"); }));
    expect("an unknown argument", "get_input has no argument on", thrown<ts3100::Error>([&] { robot.call("get_input", {{"line", 5}, {"on", true}}); }));
    const Robot nobody("http://127.0.0.1:1");
    expect("no emulator", true, thrown<ts3100::Error>([&] { nobody.state(); }).find("cannot connect to 127.0.0.1:1;") == 0);
    const auto begun = std::chrono::steady_clock::now();
    for (int test = 0; test < fresh_robots; ++test) {
        cell.fresh();
        if (!cell.mistakes().empty()) throw std::logic_error("a fresh robot has findings");
    }
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begun;
    std::cout << "     " << took.count() / fresh_robots << " ms for a fresh robot and its findings\n";
}

void dialogue() {
    const Fixture cell({"--time", "stepped", "--servo-on", "--serial-com1-tcp", "127.0.0.1:0", "--robots", "2"});
    const Robot one(cell.robot.url() + "/robots/robot-1"), two(cell.robot.url() + "/robots/robot-2");
    expect("each robot has its address", false, one.address() == two.address());
    two.put_file("ASK", ask);
    two.select_file("ASK");
    ts3100::Channel channel = two.channel("ip1"), line = two.channel("com1");
    two.start_program();
    channel.timeout(ts3100::milliseconds(100));
    const std::string late = thrown<ts3100::NoReply>([&] { channel.wait_for_line("EVER"); });
    expect("a line that does not come", "IP1: expected a line with `EVER` within 0.1 s, found `HOW FAR?`: the clock is stepped and stopped at 0 s; ASK is running, line 10, "
           "an INPUT waits for IP1; alarms: none; outputs on:", late.substr(0, late.find(" outputs on:") + 12));
    expect("what was printed", true, late.find("; IP1 printed HOW FAR?<CR>, the pendant nothing") != std::string::npos);
    channel.send_line("2.5");
    expect("lines before the expected one are dropped", "THAT IS       2.500", channel.wait_for_line("2.500"));
    two.put_file("ASK", "PROGRAM ASK\nPRINT IP1, \"HALF\"\nDELAY 1\nPRINT IP1, \"DONE\", CR\nEND\n");
    two.select_file("ASK");
    two.start_program();
    expect("half a line is shown", 0, static_cast<int>(thrown<ts3100::NoReply>([&] { channel.read_line(); }).find("IP1: expected a line within 0.1 s, found `HALF`: ")));
    two.advance(1);
    expect("and kept", "HALFDONE", channel.read_line());
    two.put_file("ASK", "PROGRAM ASK\nPRINT COM1, \"ONE\", CR\nEND\n");
    two.select_file("ASK");
    two.start_program();
    two.advance(1);  // a serial line takes its time
    expect("COM1 as bare TCP", "ONE", line.read_line());
    expect("no robot of exec", true, thrown<ts3100::Error>([] { Robot::from_environment(); }).find("TS3100_CONTROL_URL is not set: run the tests by") == 0);
    set_variable("TS3100_CONTROL_URL", one.url().c_str());
    expect("the robot of exec", 100, Robot::from_environment().override());
    expect("the log is not the output of the test", true, cell.process.log().find("INFO") != std::string::npos);
}

std::size_t files(const std::filesystem::path& folder, const char* extension) {
    std::size_t count = 0;
    if (std::filesystem::exists(folder))
        for (const auto& entry : std::filesystem::directory_iterator(folder)) count += entry.path().extension() == extension ? 1 : 0;
    return count;
}

/// A text without the numbers in it.
std::string without_numbers(std::string text) {
    text.erase(std::remove_if(text.begin(), text.end(), [](unsigned char letter) { return std::isdigit(letter) != 0; }), text.end());
    return text;
}

void traces() {
    Fixture cell;
    cell.artifacts = "it's a trace";
    std::filesystem::remove_all(cell.artifacts);
    cell.fresh().host().status();
    expect("a test that passes keeps nothing", "", cell.mistakes());
    cell.trace = ts3100::Trace::off;
    expect("nor does one that fails, if told so", "", cell.keep("off"));
    same("and there are no files", std::size_t{0}, files(cell.artifacts, ".txt"));
    cell.trace = ts3100::Trace::on;
    expect("a test that passes keeps its run, if told so", "", cell.mistakes());
    cell.trace = ts3100::Trace::retain_on_failure;
    const std::string answered = cell.keep("an answer");
    expect("the command shows the last that a host sent", true, answered.find(" --last received\npage: it's a trace/an-answer-") != std::string::npos);
    Host host = cell.fresh().host();
    thrown<ts3100::Refused>([&] { host.select("NOFILE"); });
    expect("or the first NG", true, cell.keep().find(" --first ng\npage: ") != std::string::npos);
    thrown<ts3100::Refused>([&] { host.command("XX"); });
    const std::string mistakes = cell.mistakes(ts3100::Severity::error, {}, "wrong host");
    expect("or the finding that failed the test", "ts view 'it'\\''s a trace/wrong-host--.txt' --first unknown-command\npage: it's a trace/wrong-host--.html",
           without_numbers(mistakes.substr(mistakes.find("ts3100 view"))));
    same("each has a transcript", std::size_t{4}, files(cell.artifacts, ".txt"));
    same("and a page", std::size_t{4}, files(cell.artifacts, ".html"));
    std::filesystem::remove_all(cell.artifacts);
    std::ofstream(cell.artifacts) << "a file";
    expect("a run that cannot be kept hides no failure", true, cell.mistakes(ts3100::Severity::error).find("(unknown-command, error)") != std::string::npos);
    expect("and says why", 0, static_cast<int>(cell.keep().find("the run is not kept: cannot write it's a trace")));
    std::filesystem::remove(cell.artifacts);
    const std::string binary = ts3100::Process::binary();
    set_variable("TS3100_BINARY", "./no-such-binary");
    expect("nor does a page that cannot be written", true, cell.mistakes(ts3100::Severity::error).find("\nno page: cannot write it's a trace/test-") != std::string::npos);
    set_variable("TS3100_BINARY", binary.c_str());
    std::filesystem::remove_all(cell.artifacts);
}

void starts() {
    expect("wrong options", true, thrown<ts3100::Error>([] { ts3100::Process({"--no-such-option"}); }).find("--no-such-option") != std::string::npos);
    std::string url;
    {
        const ts3100::Process process;
        url = process.control_url();
    }
    expect("a process that went out of scope has ended", true, thrown<ts3100::Error>([&] { Robot(url).state(); }).find("cannot connect") == 0);
#ifndef _WIN32
    int ends[2];
    if (pipe(ends) != 0) throw std::logic_error("no pipe");
    const pid_t test = fork();
    if (test == 0) {
        const ts3100::Process process;
        const std::string line = process.control_url();
        if (write(ends[1], line.data(), line.size()) < 0) _exit(2);
        kill(getpid(), SIGKILL);
    }
    char line[100] = {};
    if (read(ends[0], line, sizeof line - 1) <= 0) throw std::logic_error("the child wrote nothing");
    waitpid(test, nullptr, 0);
    bool ended = false;
    for (int look = 0; look < 500 && !ended; ++look) try {
            Robot(line).state();
            std::this_thread::sleep_for(ts3100::milliseconds(10));
        } catch (const ts3100::Error&) {
            ended = true;
        }
    expect("a process ends with a test that is killed", true, ended);
#endif
}

}  // namespace

int main() try {
    text_of_json();
    six_axes();
    scara();
    refusals();
    control();
    dialogue();
    traces();
    starts();
    std::cout << "all of it\n";
    return 0;
} catch (const std::exception& error) {
    std::cout << "FAIL " << error.what() << '\n';
    return 1;
}
