// A host that sends a command which no robot knows: the test fails and says so.
#include <iostream>

#include "ts3100.hpp"

int main() try {
    const ts3100::Fixture cell;
    ts3100::Host host = cell.fresh().host();
    try {
        host.command("XX");
    } catch (const ts3100::Refused&) {
        // This host does not look at the answer.
    }
    const std::string mistakes = cell.mistakes(ts3100::Severity::warning, {}, "wrong host");
    std::cout << mistakes << '\n';
    return mistakes.empty() ? 0 : 1;
} catch (const std::exception& error) {
    std::cout << "FAIL " << error.what() << '\n';
    return 2;
}
