// Plays the calls of a file at a URL by Robot::call, and prints an answer a line: tests/system/lib/recorded_calls.py compares them.
#include <fstream>
#include <iostream>

#include "ts3100.hpp"

int main(int count, char** words) try {
    std::stringstream text;
    text << std::ifstream(count > 1 ? words[1] : "").rdbuf();
    const ts3100::Json calls = ts3100::Json::parse(text.str());
    const ts3100::Robot robot(count > 2 ? words[2] : "");
    for (const ts3100::Json& call : calls.elements()) try {
            std::cout << robot.call(call["operation"].as_string(), call["arguments"].members()).text() << '\n';
        } catch (const ts3100::ControlError& error) {
            std::cout << ts3100::Json(ts3100::Json::Members{{"error", error.what()}}).text() << '\n';
        }
    return 0;
} catch (const std::exception& error) {
    std::cout << "FAIL " << error.what() << '\n';
    return 1;
}
