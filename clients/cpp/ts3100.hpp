// ts3100.hpp: talks to a Toshiba Machine TS3100 robot controller, and starts and controls its emulator in tests.
//
//   ts3100::Host      the protocol on IP0: commands, status, files            ts3100::Channel   PRINT and INPUT on IP1, IP2, COM1
//   ts3100::Robot     the control interface of the emulator                   ts3100::Process   starts `ts3100 serve`
//   ts3100::Fixture   one process, a fresh robot for each test, and the protocol mistakes of the host
//
// C++17, POSIX or Windows; nothing else. On Windows link ws2_32. Failures are exceptions derived from ts3100::Error.
// A class is used by one thread at a time. Licence: MIT or Apache-2.0.
#ifndef TS3100_HPP
#define TS3100_HPP

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <locale>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <winsock2.h>
#include <ws2tcpip.h>
#include <windows.h>
#else
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
extern char** environ;
#endif

namespace ts3100 {

using std::chrono::milliseconds;

/// What went wrong, in a sentence.
class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// The robot answered NG.
class Refused : public Error {
public:
    explicit Refused(const std::string& text)
        : Error("the robot answered NG to " + text + "; the log of the emulator gives the reason"), command(text) {}
    const std::string command;
};

/// The emulator refused a call of the control interface; nothing has changed. `status` is that of HTTP.
class ControlError : public Error {
public:
    ControlError(int code, const std::string& message) : Error(message), status(code) {}
    const int status;
};

/// Nothing came from the robot in time.
class NoReply : public Error {
public:
    using Error::Error;
};

/// A condition was not met in time; the message says what is there instead.
class NotReached : public Error {
public:
    using Error::Error;
};

/// A JSON value. Reading one that has another type than asked for throws Error.
class Json {
public:
    enum class Type { null, boolean, number, string, array, object };
    using Members = std::map<std::string, Json>;
    static constexpr int deepest_nesting = 64;
    static constexpr double largest_exact = 9007199254740992;  ///< 2 to the power of 53

    Json() = default;
    Json(bool value) : type_(Type::boolean), number_(value ? 1 : 0) {}
    Json(double value) : type_(Type::number), number_(value) {}
    Json(int value) : type_(Type::number), number_(value) {}
    Json(std::string text) : type_(Type::string), text_(std::move(text)) {}
    Json(const char* text) : Json(std::string(text)) {}
    Json(Members members) : type_(Type::object), members_(std::move(members)) {}
    Json(std::vector<Json> elements) : type_(Type::array), elements_(std::move(elements)) {}
    Json(const std::vector<double>& numbers) : type_(Type::array), elements_(numbers.begin(), numbers.end()) {}
    Json(const std::vector<int>& numbers) : type_(Type::array), elements_(numbers.begin(), numbers.end()) {}

    static Json parse(const std::string& text) {
        std::size_t at = 0;
        Json value = read(text, at, 0);
        blanks(text, at);
        if (at < text.size()) fail(text, at, "the end");
        return value;
    }

    Type type() const { return type_; }
    bool is_null() const { return type_ == Type::null; }
    bool as_bool() const { return need(Type::boolean, "true or false"), number_ != 0; }
    double as_double() const { return need(Type::number, "a number"), number_; }
    int as_int() const { return static_cast<int>(std::lround(as_double())); }
    const std::string& as_string() const { return need(Type::string, "a string"), text_; }
    /// The elements of an array.
    const std::vector<Json>& elements() const { return need(Type::array, "an array"), elements_; }
    /// The members of an object.
    const Members& members() const { return need(Type::object, "an object"), members_; }
    bool has(const std::string& name) const { return type_ == Type::object && members_.count(name) != 0; }
    const Json& operator[](const std::string& name) const {
        auto member = members().find(name);
        if (member == members_.end()) throw Error("JSON: no member `" + name + "`");
        return member->second;
    }
    std::vector<double> as_doubles() const {
        std::vector<double> numbers;
        for (const Json& element : elements()) numbers.push_back(element.as_double());
        return numbers;
    }

    /// The value as JSON text.
    std::string text() const {
        std::string between, all;
        switch (type_) {
            case Type::null: return "null";
            case Type::boolean: return number_ != 0 ? "true" : "false";
            case Type::number: return text_.empty() ? number(number_) : text_;
            case Type::string: return quote(text_);
            case Type::array:
                for (const Json& element : elements_) all += std::exchange(between, ",") + element.text();
                return "[" + all + "]";
            case Type::object:
                for (const auto& [name, member] : members_) all += std::exchange(between, ",") + quote(name) + ":" + member.text();
        }
        return "{" + all + "}";
    }

    /// A string as JSON writes it.
    static std::string quote(const std::string& text) {
        std::string quoted = "\"";
        for (char letter : text) {
            if (letter == '"' || letter == '\\') {
                quoted += '\\';
                quoted += letter;
            } else if (static_cast<unsigned char>(letter) < 0x20) {
                char code[8];
                std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(letter));
                quoted += code;
            } else {
                quoted += letter;
            }
        }
        return quoted + "\"";
    }

    /// A number as JSON writes it.
    static std::string number(double value) {
        std::ostringstream text;
        text.imbue(std::locale::classic());
        text.precision(15);
        text << value;
        return text.str();
    }

private:
    Type type_ = Type::null;
    double number_ = 0;
    std::string text_;
    std::vector<Json> elements_;
    Members members_;

    void need(Type type, const char* expected) const {
        if (type_ != type) throw Error(std::string("JSON: expected ") + expected);
    }
    [[noreturn]] static void fail(const std::string& text, std::size_t at, const std::string& expected) {
        throw Error("JSON, character " + std::to_string(at + 1) + ": expected " + expected + ", found " +
                    (at < text.size() ? "`" + text.substr(at, 1) + "`" : "the end"));
    }
    static void blanks(const std::string& text, std::size_t& at) { at = std::min(text.find_first_not_of(" \t\r\n", at), text.size()); }
    static bool take(const std::string& text, std::size_t& at, const char* word) {
        const std::size_t length = std::strlen(word);
        if (text.compare(at, length, word) != 0) return false;
        at += length;
        return true;
    }
    static Json read(const std::string& text, std::size_t& at, int depth) {
        if (depth > deepest_nesting) fail(text, at, "at most " + std::to_string(deepest_nesting) + " values in each other");
        Json value;
        blanks(text, at);
        if (take(text, at, "{")) {
            value.type_ = Type::object;
            for (bool more = !closed(text, at, "}"); more;) {
                blanks(text, at);
                if (!take(text, at, "\"")) fail(text, at, "`\"`");
                std::string name = string(text, at);
                blanks(text, at);
                if (!take(text, at, ":")) fail(text, at, "`:`");
                value.members_[name] = read(text, at, depth + 1);
                more = next(text, at, "}");
            }
        } else if (take(text, at, "[")) {
            value.type_ = Type::array;
            for (bool more = !closed(text, at, "]"); more; more = next(text, at, "]"))
                value.elements_.push_back(read(text, at, depth + 1));
        } else if (take(text, at, "\"")) {
            value.type_ = Type::string;
            value.text_ = string(text, at);
        } else if (take(text, at, "true")) {
            value.type_ = Type::boolean;
            value.number_ = 1;
        } else if (take(text, at, "false")) {
            value.type_ = Type::boolean;
        } else if (!take(text, at, "null")) {
            const std::size_t end = std::min(text.find_first_not_of("+-.0123456789eE", at), text.size());
            std::istringstream digits(text.substr(at, end - at));
            digits.imbue(std::locale::classic());
            if (!(digits >> value.number_)) fail(text, at, "a value");
            value.type_ = Type::number;
            // Written as it was read: seeds in a snapshot have 64 bits, a double has 53.
            if (value.number_ > largest_exact) value.text_ = text.substr(at, end - at);
            at = end;
        }
        return value;
    }
    static bool closed(const std::string& text, std::size_t& at, const char* end) { return blanks(text, at), take(text, at, end); }
    static bool next(const std::string& text, std::size_t& at, const char* end) {
        blanks(text, at);
        if (take(text, at, ",")) return true;
        if (!take(text, at, end)) fail(text, at, std::string("`,` or `") + end + "`");
        return false;
    }
    static std::string string(const std::string& text, std::size_t& at) {
        static const std::string letters = "\"\\/bfnrt", meanings = "\"\\/\b\f\n\r\t";
        std::string value;
        while (!take(text, at, "\"")) {
            if (at == text.size()) fail(text, at, "`\"`");
            if (!take(text, at, "\\")) {
                value += text[at++];
            } else if (take(text, at, "u")) {
                if (at + 4 > text.size()) fail(text, at, "four hexadecimal digits");
                utf8(value, static_cast<unsigned>(std::strtoul(text.substr(at, 4).c_str(), nullptr, 16)));
                at += 4;
            } else {
                const std::size_t which = at < text.size() ? letters.find(text[at]) : std::string::npos;
                if (which == std::string::npos) fail(text, at, "an escape");
                value += meanings[which];
                ++at;
            }
        }
        return value;
    }
    // The emulator writes control codes as \u and everything else as it is, so pairs do not occur.
    static void utf8(std::string& text, unsigned code) {
        if (code < 0x80) {
            text += static_cast<char>(code);
            return;
        }
        if (code < 0x800) {
            text += static_cast<char>(0xC0 | code >> 6);
        } else {
            text += static_cast<char>(0xE0 | code >> 12);
            text += static_cast<char>(0x80 | (code >> 6 & 0x3F));
        }
        text += static_cast<char>(0x80 | (code & 0x3F));
    }
};

namespace detail {

inline std::string trimmed(std::string text, char end) {
    while (!text.empty() && text.back() == end) text.pop_back();
    return text;
}

inline std::vector<std::string> split(const std::string& text, char between) {
    std::vector<std::string> parts;
    std::istringstream rest(text);
    for (std::string part; std::getline(rest, part, between);)
        if (!part.empty()) parts.push_back(part);
    return parts;
}

inline std::string seconds(milliseconds limit) { return Json::number(static_cast<double>(limit.count()) / 1000) + " s"; }

/// The end of a message about something that did not come.
inline std::string described(const std::function<std::string()>& describe) { return describe ? ": " + describe() : ""; }

/// A TCP connection. TCP divides texts as it likes, so unread bytes are kept.
class Connection {
public:
#ifdef _WIN32
    using Handle = SOCKET;
    static constexpr Handle none = INVALID_SOCKET;
#else
    using Handle = int;
    static constexpr Handle none = -1;
#endif

    Connection(const std::string& address, int port, milliseconds limit) : timeout(limit) {
#ifdef _WIN32
        static const bool started = [] {
            WSADATA data;
            return WSAStartup(MAKEWORD(2, 2), &data) == 0;
        }();
        if (!started) throw Error("cannot start Winsock");
#endif
        addrinfo hints{};
        hints.ai_family = AF_UNSPEC;
        hints.ai_socktype = SOCK_STREAM;
        addrinfo* found = nullptr;
        const std::string place = address + ":" + std::to_string(port);
        if (getaddrinfo(address.c_str(), std::to_string(port).c_str(), &hints, &found) != 0)
            throw Error("cannot connect to " + place + ": no such address");
        std::unique_ptr<addrinfo, void (*)(addrinfo*)> all(found, [](addrinfo* list) { freeaddrinfo(list); });
        for (const addrinfo* one = all.get(); one != nullptr && socket_ == none; one = one->ai_next) {
            socket_ = ::socket(one->ai_family, one->ai_socktype, one->ai_protocol);
            if (socket_ == none) continue;
#ifdef _WIN32
            const bool connected = ::connect(socket_, one->ai_addr, static_cast<int>(one->ai_addrlen)) == 0;
#else
            // A child process of the test must not keep the connection open.
            fcntl(socket_, F_SETFD, FD_CLOEXEC);
            const bool connected = ::connect(socket_, one->ai_addr, one->ai_addrlen) == 0;
#endif
            if (!connected) close();
        }
        if (socket_ == none) throw Error("cannot connect to " + place + "; is the robot running, and is this its port?");
        // Without this, a second text waits up to 40 ms for the acknowledgement of the first.
        const int on = 1;
        setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, reinterpret_cast<const char*>(&on), sizeof on);
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;
    ~Connection() { close(); }

    void write(const std::string& data) {
        for (std::size_t at = 0; at < data.size();) {
#if defined(_WIN32)
            const auto sent = ::send(socket_, data.data() + at, static_cast<int>(data.size() - at), 0);
#elif defined(MSG_NOSIGNAL)
            const auto sent = ::send(socket_, data.data() + at, data.size() - at, MSG_NOSIGNAL);
#else
            const auto sent = ::send(socket_, data.data() + at, data.size() - at, 0);
#endif
            if (sent <= 0) throw Error("the robot closed the connection");
            at += static_cast<std::size_t>(sent);
        }
    }

    /// The next byte, or -1 where the peer has closed the connection.
    int read_or_end() {
        if (taken_ == filled_) {
            if (!readable(until_ ? std::max(std::chrono::duration_cast<milliseconds>(*until_ - std::chrono::steady_clock::now()), milliseconds(0)) : timeout))
                throw NoReply("nothing came for " + std::to_string(timeout.count()) + " ms");
            const auto count = ::recv(socket_, kept_.data(), static_cast<unsigned>(kept_.size()), 0);
            taken_ = 0;
            filled_ = count > 0 ? static_cast<std::size_t>(count) : 0;
            if (filled_ == 0) return -1;
        }
        return static_cast<unsigned char>(kept_[taken_++]);
    }

    char read() {
        const int next = read_or_end();
        if (next < 0) throw Error("the robot closed the connection; does another host have it?");
        return static_cast<char>(next);
    }

    std::string read(std::size_t count) {
        std::string data;
        while (data.size() < count) data += read();
        return data;
    }

    std::string until(char end) {
        std::string data;
        try {
            for (char next = read(); next != end; next = read()) {
                data += next;
                if (data.size() >= longest_text) throw Error("no end of the text in " + std::to_string(longest_text) + " bytes");
            }
        } catch (const NoReply&) {
            keep(data);  // the rest may come yet
            throw;
        }
        return data;
    }

    /// What has come and was not read yet.
    std::string waiting() {
        std::string data;
        while (taken_ < filled_ || readable(milliseconds(0))) {
            const int next = read_or_end();
            if (next < 0) break;
            data += static_cast<char>(next);
        }
        return data;
    }

    /// Bytes that are to be read again, at most those of a text.
    void keep(const std::string& data) {
        std::copy(data.begin(), data.end(), kept_.begin());
        taken_ = 0;
        filled_ = data.size();
    }

    /// Reads that end by this time together; without it, each byte may take as long as `timeout`.
    void limit(std::optional<std::chrono::steady_clock::time_point> until) { until_ = until; }

    milliseconds timeout;

private:
    std::optional<std::chrono::steady_clock::time_point> until_;
    static constexpr std::size_t longest_text = 4096;  // that of the robot has 282 bytes, a line of PRINT 256

    bool readable(milliseconds within) const {
#ifdef _WIN32
        WSAPOLLFD entry{socket_, POLLIN, 0};
        return WSAPoll(&entry, 1, static_cast<int>(within.count())) != 0;
#else
        pollfd entry{socket_, POLLIN, 0};
        return ::poll(&entry, 1, static_cast<int>(within.count())) != 0;
#endif
    }
    void close() {
        if (socket_ == none) return;
#ifdef _WIN32
        closesocket(socket_);
#else
        ::close(socket_);
#endif
        socket_ = none;
    }

    Handle socket_ = none;
    std::array<char, 4096> kept_{};
    std::size_t taken_ = 0, filled_ = 0;
};

}  // namespace detail

/// What the program does.
enum class Execution {
    reset,      ///< stopped; RN starts at step 1
    running,    ///< a program runs, or a DO is under way
    retry,      ///< stopped; RN repeats the statement
    proceed     ///< stopped (continue); RN continues after the last statement
};

/// The status that SU returns, of either layout.
struct Status {
    std::string master_mode;     ///< external(ethernet), teaching, ...
    std::string operation_mode;  ///< continuous, cycle, step or segment
    std::string file;            ///< the selected file, or nothing
    int override_percent = 0;
    bool machine_lock = false;
    Execution execution = Execution::reset;

    static Status decode(const std::string& text) {
        std::map<std::string, std::string> items;
        // The six records of the other layout have blanks inside their items.
        for (std::string item : detail::split(text, text.find('\r') == std::string::npos ? ' ' : '\r')) {
            item.erase(std::remove(item.begin(), item.end(), ' '), item.end());
            const std::size_t colon = item.find(':');
            if (colon != std::string::npos) items[item.substr(0, colon)] = item.substr(colon + 1);
        }
        static const std::map<std::string, Execution> words = {{"stop(reset)", Execution::reset}, {"running", Execution::running},
                                                               {"stop(retry)", Execution::retry}, {"stop(continue)", Execution::proceed}};
        const auto word = words.find(items["STATUS"]);
        const std::size_t slash = items["MODE"].find('/');
        if (word == words.end() || slash == std::string::npos) throw Error("SU: cannot read \"" + text + "\"");
        return {items["MODE"].substr(0, slash), items["MODE"].substr(slash + 1), items["FILE"], std::atoi(items["OVRD"].c_str()),
                items["MACHINE"] == "lock", word->second};
    }
};

/// The total status that SF returns, of a six-axis or a SCARA arm.
class TotalStatus {
public:
    static constexpr std::size_t six_axis_bytes = 276, scara_bytes = 250;

    explicit TotalStatus(std::string data) : data_(std::move(data)) {
        if (data_.size() != six_axis_bytes && data_.size() != scara_bytes) throw Error("SF: expected 276 or 250 bytes, found " + std::to_string(data_.size()));
    }

    bool is_scara() const { return data_.size() == scara_bytes; }
    bool servo_on() const { return data_[0] == 1; }
    bool emergency_stop() const { return data_[1] == 1; }
    Execution motion() const { return static_cast<Execution>(data_[2] & 3); }
    int execution_line() const { return word(24); }
    bool feed_hold() const { return word(32) == 1; }
    /// The active alarms, oldest first: 2-046.
    std::vector<std::string> alarms() const {
        std::vector<std::string> numbers;
        for (std::size_t at = 4; at < 24; at += 2)
            if (word(at) != no_alarm) numbers.push_back(alarm(word(at)));
        return numbers;
    }
    /// Whether an input is on: 1 to 64, 101 to 164, 201 to 264.
    bool input(int line) const { return on(52, line); }
    bool output(int line) const { return on(84, line); }
    /// In degrees; axis 3 of a SCARA in mm.
    std::vector<double> joints() const { return group(0); }
    /// The tool point: X Y Z A B C and axes 7, 8; of a SCARA X Y Z C T 0.
    std::vector<double> world() const { return group(1); }
    std::vector<double> work() const { return group(2); }
    /// The data as received.
    const std::string& data() const { return data_; }

private:
    static constexpr int no_alarm = 0xFFFF;
    std::string data_;

    unsigned byte(std::size_t at) const { return static_cast<unsigned char>(data_[at]); }
    int word(std::size_t at) const { return static_cast<int>(byte(at) << 8 | byte(at + 1)); }
    std::vector<double> group(std::size_t which) const {
        const std::size_t axes = is_scara() ? 6 : 8;
        std::vector<double> values;
        for (std::size_t axis = 0; axis < axes; ++axis) {
            const std::size_t at = 116 + 4 * (which * axes + axis);
            const std::uint32_t bits = byte(at) << 24 | byte(at + 1) << 16 | byte(at + 2) << 8 | byte(at + 3);
            float value = 0;
            static_assert(sizeof value == sizeof bits, "IEEE 754 single");
            std::memcpy(&value, &bits, sizeof value);
            values.push_back(static_cast<double>(value));
        }
        return values;
    }
    bool on(std::size_t from, int line) const {
        const int hundred = line / 100, bit = line % 100 - 1;
        if (hundred < 0 || hundred > 3 || bit < 0 || bit >= 64) throw Error("line " + std::to_string(line) + ": expected 1 to 64, 101 to 164, 201 to 264 or 301 to 364");
        return (word(from + static_cast<std::size_t>(2 * (hundred * 4 + bit / 16))) >> bit % 16 & 1) != 0;
    }
    static std::string alarm(int word) {
        struct Range { int level, from, to, code; };
        static constexpr Range ranges[] = {{8, 0, 367, 1},      {4, 368, 511, 1},      {2, 512, 735, 1},      {1, 736, 959, 1},
                                           {8, 960, 1471, 369}, {4, 1472, 1727, 145}, {2, 1728, 1983, 225}, {1, 1984, 2239, 225}};
        for (const Range& range : ranges)
            if (word >= range.from && word <= range.to) {
                char text[16];
                std::snprintf(text, sizeof text, "%d-%03d", range.level, word - range.from + range.code);
                return text;
            }
        return "?-" + std::to_string(word);
    }
};

/// A host of the simple protocol: one text out, one answer or one file back.
class Host {
public:
    static constexpr std::size_t longest_text = 253;   ///< data bytes between STX and ETX
    static constexpr std::size_t largest_file = 99999;

    /// `describe` adds to the message of NoReply.
    explicit Host(const std::string& address, int port = 1000, std::function<std::string()> describe = {})
        : link_(address, port, milliseconds(5000)), describe_(std::move(describe)) {}

    /// Whether texts begin with STX. The robot answers in kind.
    bool use_stx = true;
    /// The pause after a text of the robot; the manual asks for 50 ms.
    std::chrono::microseconds pause = milliseconds(50);
    /// How long an answer may take: 5 s unless you set it.
    void timeout(milliseconds limit) { link_.timeout = limit; }

    void servo_on() { command("SO"); }
    void servo_off() { command("BR"); }
    /// RN: starts the selected program, or continues it.
    void start() { command("RN"); }
    void stop() { command("SP"); }
    void break_motion() { command("EC,BREAK"); }
    void feed_hold() { command("FD"); }
    void select(const std::string& file) { command("SL," + file); }
    void deselect() { command("RS,SEL"); }
    void reset_program() { command("RS,PRG"); }
    void reset_step() { command("RS,STP"); }
    void reset_cycle() { command("RS,CYC"); }
    void reset_signals() { command("RS,SIG"); }
    void reset_alarms() { command("RS,ERR"); }
    void set_override(int percent) { command("EC,OVRD " + std::to_string(percent)); }
    /// EC,MODE: STEP, CYCLE, SEGMENT or CONT.
    void set_run_mode(const std::string& mode) { command("EC,MODE " + mode); }
    /// DO: OK comes when the statement begins; total_status() shows its end.
    void execute(const std::string& statement) { command("DO," + statement); }
    /// IW: switches outputs, all of them or none: {{3, true}}.
    void set_outputs(const std::map<int, bool>& lines) {
        std::string text = "IW,";
        for (const auto& [line, on] : lines) text += (text.back() == ',' ? "" : " ") + std::to_string(line) + (on ? " 1" : " 0");
        command(text);
    }
    void erase(const std::string& file) { command("ER," + file); }
    std::string version() { return detail::trimmed(query("VR"), '\r'); }
    Status status() { return Status::decode(query("SU")); }

    /// MR: the values of a variable of GLOBAL or DATA.
    std::vector<double> read_variable(const std::string& name) {
        std::istringstream text(query("MR," + name + " -1"));
        text.imbue(std::locale::classic());
        std::vector<double> values;
        for (double value = 0; text >> value;) values.push_back(value);
        return values;
    }

    /// MW: writes a variable; one value for an integer or a real.
    void write_variable(const std::string& name, const std::vector<double>& values) {
        std::ostringstream text;
        text.imbue(std::locale::classic());
        text << "MW,0 " << name << " -1";
        for (double value : values) {
            // An exponent is not a number to the robot, and an integer has no point.
            char digits[64];
            std::snprintf(digits, sizeof digits, value == std::floor(value) ? "%.0f" : "%.6f", value);
            std::replace(digits, digits + std::strlen(digits), ',', '.');
            text << ' ' << digits;
        }
        command(text.str());
    }

    /// CA: the files of the RAM drive and their sizes.
    std::map<std::string, int> directory() {
        std::map<std::string, int> files;
        for (const std::string& record : detail::split(query("CA"), '\r')) {
            const std::size_t blank = record.find(' ');
            if (blank != std::string::npos) files[record.substr(0, blank)] = std::atoi(record.c_str() + blank);
        }
        return files;
    }

    /// SF. Its data may contain ETX, so its length decides where it ends.
    TotalStatus total_status() {
        ask("SF");
        std::string head = in_time([&] { return begin(); });
        if (head != "FL,") unexpected("SF", head);
        std::string data = link_.read(TotalStatus::scara_bytes);
        const char next = link_.read();
        if (next != etx) {
            data += next;
            data += link_.read(TotalStatus::six_axis_bytes - data.size());
            if (link_.read() != eof || link_.read() != etx) throw Error("SF: expected 250 or 276 bytes, found more");
        }
        heard();
        send("OK\r");
        return TotalStatus(std::move(data));
    }

    /// DL: stores a file on the RAM drive, byte for byte. Its lines end in LF.
    void download(const std::string& file, const std::string& content) {
        command("DL," + file);
        const std::string whole = "FL," + content + eof;
        for (std::size_t at = 0; at < whole.size(); at += longest_text) {
            send(whole.substr(at, longest_text));
            expect_ok("a text of DL," + file);
        }
    }

    /// UL: reads a file of the RAM drive.
    std::string upload(const std::string& file) { return query("UL," + file); }

    /// A command that the robot answers with OK; NG is Refused.
    void command(const std::string& text) {
        ask(text);
        expect_ok(text);
    }

    /// A command that the robot answers with a file or a status, without FL and EOF; NG is Refused.
    std::string query(const std::string& text) {
        ask(text);
        std::string part = answer();
        if (part.compare(0, 3, "FL,") != 0) unexpected(text, part);
        std::string content;
        for (std::size_t from = 3;; from = 0, part = answer()) {
            send("OK\r");
            const std::size_t end = part.find(eof, from);
            content += part.substr(from, end == std::string::npos ? end : end - from);
            if (end != std::string::npos) return content;
            if (content.size() > largest_file) throw Error(text + ": no EOF in " + std::to_string(content.size()) + " bytes");
        }
    }

    /// Waits for the SP that the robot sends when a program has ended or was stopped.
    void wait_for_stop() {
        discard();
        if (stops_ > 0) {
            --stops_;
            return;
        }
        expected_ = "the SP of a stop";
        const std::string text = next();
        if (text != "SP\r") unexpected("waiting for a stop", text);
    }

private:
    static constexpr char stx = 0x02, etx = 0x03, eof = 0x1A;
    detail::Connection link_;
    std::function<std::string()> describe_;
    std::string expected_;
    std::chrono::steady_clock::time_point heard_{};
    int stops_ = 0;

    void heard() { heard_ = std::chrono::steady_clock::now(); }
    std::string framed(const std::string& data) const { return (use_stx ? std::string(1, stx) : std::string()) + data + etx; }
    void send(const std::string& data) {
        std::this_thread::sleep_until(heard_ + pause);
        link_.write(framed(data));  // in one piece
    }
    /// Sends a command: bytes received earlier are not its answer.
    void ask(const std::string& command) {
        std::this_thread::sleep_until(heard_ + pause);
        discard();
        expected_ = "an answer to " + command;
        send(command + "\r");
    }
    /// Drops answers that came too late. An SP among them counts, and half an SP is kept.
    void discard() {
        const std::string late = link_.waiting(), stop = framed("SP\r"), half = late.substr(late.rfind(etx) + 1);
        for (std::size_t at = late.find(stop); at != std::string::npos; at = late.find(stop, at + stop.size())) ++stops_;
        if (stop.compare(0, half.size(), half) == 0) link_.keep(half);
    }
    [[noreturn]] static void unexpected(const std::string& command, const std::string& text) {
        if (text == "NG\r") throw Refused(command);
        throw Error(command + ": the robot answered \"" + detail::trimmed(text, '\r') + "\"");
    }
    void expect_ok(const std::string& text) {
        const std::string part = answer();
        if (part != "OK\r") unexpected(text, part);
    }
    std::string answer() {
        for (;; ++stops_) {
            std::string text = next();
            if (text != "SP\r") return text;
        }
    }
    void skip_stx() {
        const char first = use_stx ? link_.read() : stx;
        if (first != stx) throw Error("expected STX, found byte " + std::to_string(static_cast<unsigned char>(first)));
    }
    std::string next() {
        std::string text = in_time([&] { return skip_stx(), link_.until(etx); });
        heard();
        return text;
    }
    /// What `receive` returns; if nothing comes in time, the message says what was expected.
    std::string in_time(const std::function<std::string()>& receive) {
        try {
            return receive();
        } catch (const NoReply&) {
            throw NoReply("the robot did not send " + expected_ + " within " + detail::seconds(link_.timeout) + detail::described(describe_));
        }
    }
    /// The first three bytes of an answer, or all of an NG; an SP may come before it.
    std::string begin() {
        for (;; ++stops_) {
            skip_stx();
            std::string head = link_.read(3);
            if (head != "SP\r" && head != "NG\r") return head;
            link_.read();  // its ETX
            heard();
            if (head == "NG\r") return head;
        }
    }
};

/// The peer of a SCOL channel: what a program prints, and what its INPUT reads, line by line.
class Channel {
public:
    /// `name` is for messages, and `describe` adds to that of NoReply.
    explicit Channel(const std::string& address, int port = 1001, std::string name = "the robot", std::function<std::string()> describe = {})
        : link_(address, port, milliseconds(5000)), name_(std::move(name)), describe_(std::move(describe)) {}
    /// How long a line may take: 5 s unless you set it.
    void timeout(milliseconds limit) { link_.timeout = limit; }
    /// Sends a line; INPUT expects commas between values.
    void send_line(const std::string& text) { link_.write(text + "\r"); }
    /// The next line that the program prints, without its CR.
    std::string read_line() { return wait_for_line(""); }
    /// The next line with this text. Lines before it are dropped; if none comes in time, the message of NoReply has them.
    std::string wait_for_line(const std::string& text) {
        std::string instead;
        link_.limit(std::chrono::steady_clock::now() + link_.timeout);
        try {
            for (;;) {
                std::string line = link_.until('\r');
                if (line.find(text) != std::string::npos) return link_.limit({}), line;
                instead += (instead.empty() ? "`" : ", `") + line + "`";
            }
        } catch (const NoReply&) {
            link_.limit({});
            const std::string begun = link_.waiting();
            link_.keep(begun);
            if (!begun.empty()) instead += (instead.empty() ? "`" : ", `") + begun + "`";
            throw NoReply(name_ + ": expected a line" + (text.empty() ? "" : " with `" + text + "`") + " within " + detail::seconds(link_.timeout) + ", found " +
                          (instead.empty() ? "nothing" : instead) + detail::described(describe_));
        }
    }

private:
    detail::Connection link_;
    const std::string name_;
    const std::function<std::string()> describe_;
};

enum class Severity { note, warning, error };

namespace detail {

/// A member of a document, or an empty value if it has none.
template <typename T>
T member(const Json& document, const char* name) {
    if (!document.has(name) || document[name].is_null()) return {};
    const Json& value = document[name];
    if constexpr (std::is_same_v<T, bool>) return value.as_bool();
    else if constexpr (std::is_same_v<T, double>) return value.as_double();
    else if constexpr (std::is_same_v<T, int>) return value.as_int();
    else if constexpr (std::is_same_v<T, std::string>) return value.as_string();
    else if constexpr (std::is_same_v<T, Severity>) return value.as_string() == "error" ? Severity::error : value.as_string() == "warning" ? Severity::warning : Severity::note;
    else return value.as_doubles();
}

}  // namespace detail

// generated: Written by clients/generate.py from the OpenAPI document. Do not edit.
/// The selected program.
struct Program {
    std::string file;  ///< The selected file; empty when none is.
    std::string status;  ///< Execution status.
    int line;  ///< Current line of the file; 0 when no file is selected.
    explicit Program(const Json& json)
        : file(detail::member<std::string>(json, "file")),
          status(detail::member<std::string>(json, "status")),
          line(detail::member<int>(json, "line")) {}
};
/// An alarm, with its cause and its remedy.
struct Alarm {
    std::string number;  ///< Number, as `level-code`.
    int level;  ///< Level: 8 the most severe, 1 a warning.
    std::string text;  ///< Text that the operator reads.
    std::string cause;  ///< Cause of the alarm.
    std::string remedy;  ///< Remedy.
    std::string at;  ///< Date and time, `YYYY-MM-DD HH:MM:SS`.
    explicit Alarm(const Json& json)
        : number(detail::member<std::string>(json, "number")),
          level(detail::member<int>(json, "level")),
          text(detail::member<std::string>(json, "text")),
          cause(detail::member<std::string>(json, "cause")),
          remedy(detail::member<std::string>(json, "remedy")),
          at(detail::member<std::string>(json, "at")) {}
};
/// A mistake of a host, or what a fault has caused; `ts3100 docs findings` lists the rules.
struct Finding {
    std::string rule;  ///< Name of the rule of a finding.
    Severity severity;  ///< Severity of a finding; `note` if a fault caused it.
    std::string message;  ///< Message.
    std::string remedy;  ///< Remedy of a finding.
    double t;  ///< Virtual time in seconds.
    std::string port;  ///< Port of the event.
    std::string text;  ///< Bytes as text, control codes by name: `<STX>SO<CR><ETX>`. Of an alarm and the pendant the words themselves.
    std::string caused_by;  ///< Number and kind of the fault that caused a finding; absent if the host caused it.
    explicit Finding(const Json& json)
        : rule(detail::member<std::string>(json, "rule")),
          severity(detail::member<Severity>(json, "severity")),
          message(detail::member<std::string>(json, "message")),
          remedy(detail::member<std::string>(json, "remedy")),
          t(detail::member<double>(json, "t")),
          port(detail::member<std::string>(json, "port")),
          text(detail::member<std::string>(json, "text")),
          caused_by(detail::member<std::string>(json, "caused-by")) {}
};
/// A fault and its outcome.
struct Fault {
    int id;  ///< Number of the fault.
    std::string kind;  ///< Kind of the fault.
    std::string spec;  ///< As text, like `--fault`.
    bool armed;  ///< Whether it can still trigger.
    int seen;  ///< Matches while it was armed.
    int fired;  ///< Number of times it triggered.
    std::vector<double> at;  ///< Times at which it triggered, in seconds of virtual time; the first hundred.
    explicit Fault(const Json& json)
        : id(detail::member<int>(json, "id")),
          kind(detail::member<std::string>(json, "kind")),
          spec(detail::member<std::string>(json, "spec")),
          armed(detail::member<bool>(json, "armed")),
          seen(detail::member<int>(json, "seen")),
          fired(detail::member<int>(json, "fired")),
          at(detail::member<std::vector<double>>(json, "at")) {}
};
/// The virtual time and how it passes.
struct Clock {
    std::string mode;  ///< How time passes: `real`, `xN`, `stepped`, `auto`.
    double now;  ///< Virtual time in seconds since the emulator was started or reset.
    std::string calendar;  ///< Date and time as the error history writes them.
    explicit Clock(const Json& json)
        : mode(detail::member<std::string>(json, "mode")),
          now(detail::member<double>(json, "now")),
          calendar(detail::member<std::string>(json, "calendar")) {}
};
/// The end of a wait.
struct Reached {
    double now;  ///< Virtual time at the end of the wait, in seconds.
    double passed;  ///< Virtual time that passed during the wait, in seconds.
    explicit Reached(const Json& json)
        : now(detail::member<double>(json, "now")),
          passed(detail::member<double>(json, "passed")) {}
};
/// Joints in degrees (the third of a SCARA in mm), and the tool point in the world in mm and degrees.
struct Pose {
    std::vector<double> joints;  ///< Joint values: degrees, of the SCARA's third axis mm.
    std::vector<double> world;  ///< The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees.
    bool moving;  ///< Whether a motion is under way or held.
    double percent;  ///< Completed percentage of the motion; 100 without a motion.
    explicit Pose(const Json& json)
        : joints(detail::member<std::vector<double>>(json, "joints")),
          world(detail::member<std::vector<double>>(json, "world")),
          moving(detail::member<bool>(json, "moving")),
          percent(detail::member<double>(json, "percent")) {}
};

namespace detail {

/// Method and URI template of an operation; empty if there is no such operation.
inline std::string operation(const std::string& name) {
    static const std::map<std::string, std::string> all = {
        {"get_alarms", "GET /alarms"},
        {"raise_alarm", "POST /alarms"},
        {"reset_alarms", "POST /alarms/reset"},
        {"get_alarm_table", "GET /alarms/table"},
        {"get_alarm_row", "GET /alarms/table/{number}"},
        {"get_arm", "GET /arm"},
        {"get_pose", "GET /arm/pose"},
        {"get_battery", "GET /battery"},
        {"put_battery", "PUT /battery"},
        {"get_breakpoints", "GET /breakpoints"},
        {"put_breakpoints", "PUT /breakpoints"},
        {"get_channels", "GET /channels"},
        {"get_channel", "GET /channels/{port}"},
        {"drop_peer", "POST /channels/{port}/drop"},
        {"inject_bytes", "POST /channels/{port}/inject"},
        {"check_program", "POST /check"},
        {"get_clock", "GET /clock"},
        {"put_clock", "PUT /clock"},
        {"advance_time", "POST /clock/advance"},
        {"advance_time_until", "POST /clock/advance-until"},
        {"get_control_right", "GET /control-right"},
        {"put_control_right", "PUT /control-right"},
        {"get_coverage", "GET /coverage"},
        {"decode_text", "POST /decode"},
        {"get_emergency_stop", "GET /emergency-stop"},
        {"put_emergency_stop", "PUT /emergency-stop"},
        {"get_events", "GET /events{?since,count,state}"},
        {"get_faults", "GET /faults"},
        {"arm_fault", "POST /faults"},
        {"clear_faults", "DELETE /faults"},
        {"get_fault_kinds", "GET /faults/kinds"},
        {"get_fault", "GET /faults/{number}"},
        {"disarm_fault", "DELETE /faults/{number}"},
        {"get_feed_hold", "GET /feed-hold"},
        {"put_feed_hold", "PUT /feed-hold"},
        {"press_feed_hold", "POST /feed-hold/press"},
        {"get_files", "GET /files"},
        {"get_file", "GET /files/{name}"},
        {"put_file", "PUT /files/{name}"},
        {"delete_file", "DELETE /files/{name}"},
        {"select_file", "POST /files/{name}/select"},
        {"get_findings", "GET /findings"},
        {"get_health", "GET /health"},
        {"get_inputs", "GET /inputs"},
        {"get_input", "GET /inputs/{line}"},
        {"put_input", "PUT /inputs/{line}"},
        {"force_input", "PUT /inputs/{line}/force"},
        {"release_input", "DELETE /inputs/{line}/force"},
        {"pulse_input", "POST /inputs/{line}/pulse"},
        {"jog_arm", "POST /jog"},
        {"stop_jog", "POST /jog/stop"},
        {"get_key_switch", "GET /key-switch"},
        {"put_key_switch", "PUT /key-switch"},
        {"get_lines", "GET /lines"},
        {"get_machine_lock", "GET /machine-lock"},
        {"put_machine_lock", "PUT /machine-lock"},
        {"get_metrics", "GET /metrics"},
        {"get_outputs", "GET /outputs"},
        {"get_output", "GET /outputs/{line}"},
        {"put_output", "PUT /outputs/{line}"},
        {"force_output", "PUT /outputs/{line}/force"},
        {"release_output", "DELETE /outputs/{line}/force"},
        {"pulse_output", "POST /outputs/{line}/pulse"},
        {"get_override", "GET /override"},
        {"put_override", "PUT /override"},
        {"get_parameters", "GET /parameters"},
        {"get_pendant", "GET /pendant"},
        {"press_keys", "POST /pendant/keys"},
        {"get_positions", "GET /positions"},
        {"get_position", "GET /positions/{name}"},
        {"put_position", "PUT /positions/{name}"},
        {"teach_position", "POST /positions/{name}/teach"},
        {"get_power", "GET /power"},
        {"power_cycle", "POST /power/cycle"},
        {"power_off", "POST /power/off"},
        {"power_on", "POST /power/on"},
        {"get_program", "GET /program"},
        {"assign_variable", "POST /program/assign"},
        {"evaluate_expression", "POST /program/evaluate"},
        {"reset_program", "POST /program/reset"},
        {"run_program_to", "POST /program/run-to"},
        {"get_program_stack", "GET /program/stack"},
        {"start_program", "POST /program/start"},
        {"step_program", "POST /program/step"},
        {"step_task", "POST /program/step-task"},
        {"stop_program", "POST /program/stop"},
        {"reset_emulator", "POST /reset"},
        {"get_robots", "GET /robots"},
        {"get_robot", "GET /robots/{name}"},
        {"get_run_mode", "GET /run-mode"},
        {"put_run_mode", "PUT /run-mode"},
        {"get_safety_switch", "GET /safety-switch"},
        {"put_safety_switch", "PUT /safety-switch"},
        {"get_scenario", "GET /scenario"},
        {"get_servo", "GET /servo"},
        {"put_servo", "PUT /servo"},
        {"get_snapshot", "GET /snapshot"},
        {"load_snapshot", "PUT /snapshot"},
        {"get_snapshots", "GET /snapshots"},
        {"get_named_snapshot", "GET /snapshots/{name}"},
        {"put_snapshot", "PUT /snapshots/{name}"},
        {"delete_snapshot", "DELETE /snapshots/{name}"},
        {"restore_snapshot", "POST /snapshots/{name}/restore"},
        {"get_state", "GET /state"},
        {"get_status_frame", "GET /status-frame"},
        {"get_transcript", "GET /transcript{?format}"},
        {"get_variables", "GET /variables"},
        {"get_variable", "GET /variables/{name}"},
        {"put_variable", "PUT /variables/{name}"},
        {"get_version", "GET /version"},
        {"wait_until", "POST /wait"},
        {"get_wires", "GET /wires"},
        {"put_outside", "PUT /wires/outside/{name}"},
    };
    const auto found = all.find(name);
    return found == all.end() ? "" : found->second;
}

}  // namespace detail
// end of generated

/// A finding in two sentences.
inline std::string describe(const Finding& finding) {
    static const char* const words[] = {"note", "warning", "error"};
    return finding.port + ": " + finding.message + " (" + finding.rule + ", " + words[static_cast<int>(finding.severity)] + "). " + finding.remedy;
}

/// The control interface of the emulator. A call returns when its effect is there; call() reaches what has no method.
class Robot {
public:
    /// `url` is that of the ready line or of TS3100_CONTROL_URL; it ends in /robots/NAME for one of several robots.
    explicit Robot(const std::string& url, std::string token = "") : token_(std::move(token)) {
        const std::string scheme = "http://";
        const std::size_t slash = url.find('/', scheme.size());
        const std::string place = url.substr(0, slash);
        const std::size_t colon = place.rfind(':');
        if (url.compare(0, scheme.size(), scheme) != 0 || colon < scheme.size()) throw Error(url + ": expected http://ADDRESS:PORT");
        address_ = place.substr(scheme.size(), colon - scheme.size());
        port_ = std::atoi(place.c_str() + colon + 1);
        base_ = slash == std::string::npos ? "" : detail::trimmed(url.substr(slash), '/');
    }

    /// The robot that `ts3100 exec` has started around this process.
    static Robot from_environment() {
        const char *const url = std::getenv("TS3100_CONTROL_URL"), *const token = std::getenv("TS3100_CONTROL_TOKEN");
        if (url == nullptr) throw Error("TS3100_CONTROL_URL is not set: run the tests by `ts3100 exec -- ctest`");
        return Robot(url, token != nullptr ? token : "");
    }

    /// The URL of the control interface.
    std::string url() const { return "http://" + address_ + ":" + std::to_string(port_) + base_; }

    /// Makes a call by its operation in the OpenAPI document: call("put_input", {{"line", 5}, {"on", true}}). The
    /// arguments are the parameters of the path and the query, and the fields of the body. An answer that is not JSON
    /// is returned as a string.
    Json call(const std::string& operation, Json::Members values = {}) const {
        const std::string row = detail::operation(operation);
        if (row.empty()) throw Error("unknown operation " + operation);
        const std::size_t blank = row.find(' '), query = std::min(row.find("{?"), row.size());
        const std::string method = row.substr(0, blank);
        std::string path;
        for (std::size_t at = blank + 1; at < query; ++at) {
            if (row[at] != '{') {
                path += row[at];
                continue;
            }
            const std::string name = row.substr(at + 1, row.find('}', at) - at - 1);
            if (values.count(name) == 0) throw Error(operation + " needs the argument " + name);
            path += encoded(plain(values.extract(name).mapped()));
            at += name.size() + 1;
        }
        char between = '?';
        for (const std::string& name : detail::split(query < row.size() ? row.substr(query + 2, row.size() - query - 3) : "", ','))
            if (values.count(name) != 0) path += std::exchange(between, '&') + name + "=" + encoded(plain(values.extract(name).mapped()));
        const bool body = method == "PUT" || method == "POST";
        if (!body && !values.empty()) throw Error(operation + " has no argument " + values.begin()->first);
        return request(method, path, body ? Json(std::move(values)).text() : "");
    }

    // Settings
    /// teaching, internal or ext.
    std::string key_switch() const { return call("get_key_switch")["position"].as_string(); }
    void set_key_switch(const std::string& position) const { call("put_key_switch", {{"position", position}}); }
    /// sig, rs232c or ether.
    std::string control_right() const { return call("get_control_right")["holder"].as_string(); }
    void set_control_right(const std::string& holder) const { call("put_control_right", {{"holder", holder}}); }
    bool emergency_stop() const { return call("get_emergency_stop")["pressed"].as_bool(); }
    void set_emergency_stop(bool pressed) const { call("put_emergency_stop", {{"pressed", pressed}}); }
    bool safety_switch() const { return call("get_safety_switch")["open"].as_bool(); }
    void set_safety_switch(bool open) const { call("put_safety_switch", {{"open", open}}); }
    bool servo() const { return call("get_servo")["on"].as_bool(); }
    void set_servo(bool on) const { call("put_servo", {{"on", on}}); }
    bool feed_hold() const { return call("get_feed_hold")["on"].as_bool(); }
    void set_feed_hold(bool on) const { call("put_feed_hold", {{"on", on}}); }
    bool machine_lock() const { return call("get_machine_lock")["on"].as_bool(); }
    void set_machine_lock(bool on) const { call("put_machine_lock", {{"on", on}}); }
    bool battery() const { return call("get_battery")["low"].as_bool(); }
    void set_battery(bool low) const { call("put_battery", {{"low", low}}); }
    int override() const { return call("get_override")["percent"].as_int(); }
    void set_override(int percent) const { call("put_override", {{"percent", percent}}); }
    /// continuous, cycle, step or segment.
    std::string run_mode() const { return call("get_run_mode")["mode"].as_string(); }
    void set_run_mode(const std::string& mode) const { call("put_run_mode", {{"mode", mode}}); }
    std::vector<double> breakpoints() const { return call("get_breakpoints")["lines"].as_doubles(); }
    void set_breakpoints(const std::vector<int>& lines) const { call("put_breakpoints", {{"lines", lines}}); }
    /// real, x10, stepped or auto.
    std::string time_mode() const { return clock().mode; }
    void set_time_mode(const std::string& mode) const { call("put_clock", {{"mode", mode}}); }

    // Panel, program, arm
    /// Everything at one moment.
    Json state() const { return call("get_state"); }
    /// Presses the button, which turns feed hold on or off.
    void press_feed_hold() const { call("press_feed_hold"); }
    void power_off() const { call("power_off"); }
    void power_on() const { call("power_on"); }
    void power_cycle() const { call("power_cycle"); }
    /// As when the emulator was started. Hosts are disconnected; findings and the transcript begin again.
    void reset() const { call("reset_emulator"); }
    void reset(const std::string& time_mode) const { call("reset_emulator", {{"mode", time_mode}}); }
    Program program() const { return Program(call("get_program")); }
    /// running, stop (reset), stop (retry) or stop (continue).
    std::string status() const { return program().status; }
    void select_file(const std::string& name) const { call("select_file", {{"name", name}}); }
    void start_program() const { call("start_program"); }
    void stop_program() const { call("stop_program"); }
    /// Goes back to the first step, with the initial values of the file.
    void reset_program() const { call("reset_program"); }
    void step_program() const { call("step_program"); }
    /// Runs the program and stops before this line.
    void run_program_to(int line) const { call("run_program_to", {{"line", line}}); }
    /// What programs have printed on the teach pendant.
    std::string pendant() const { return call("get_pendant")["text"].as_string(); }
    /// Types at the teach pendant, for INPUT without a channel; \r ends a value.
    void press_keys(const std::string& keys) const { call("press_keys", {{"keys", keys}}); }
    /// Presses a key that moves the arm, plus or minus, until stop_jog() or for one step.
    void jog(int axis, const std::string& direction, const std::string& coordinates = "joint", const std::string& speed = "slow", bool inching = false) const {
        call("jog_arm", {{"axis", axis}, {"direction", direction}, {"coordinates", coordinates}, {"speed", speed}, {"inching", inching}});
    }
    void stop_jog() const { call("stop_jog"); }
    Pose pose() const { return Pose(call("get_pose")); }

    // Alarms and faults
    /// The active alarms, oldest first.
    std::vector<Alarm> alarms() const { return all<Alarm>(call("get_alarms")["active"]); }
    /// The error history, newest first.
    std::vector<Alarm> alarm_history() const { return all<Alarm>(call("get_alarms")["history"]); }
    void raise_alarm(const std::string& number, const std::string& detail = "") const { call("raise_alarm", {{"number", number}, {"detail", detail}}); }
    void reset_alarms() const { call("reset_alarms"); }
    std::vector<Fault> faults() const { return all<Fault>(call("get_faults")["faults"]); }
    /// Arms a fault: no-reply:command=SU.
    void arm_fault(const std::string& spec) const { call("arm_fault", {{"spec", spec}}); }
    void disarm_fault(int id) const { call("disarm_fault", {{"number", id}}); }
    void clear_faults() const { call("clear_faults"); }

    // Lines, variables, files
    bool input(int line) const { return call("get_input", {{"line", line}})["on"].as_bool(); }
    /// The numbers of the inputs that are on.
    std::vector<double> inputs() const { return call("get_inputs")["on"].as_doubles(); }
    void set_input(int line, bool on) const { call("put_input", {{"line", line}, {"on", on}}); }
    /// Sets a line and sets it back after this much virtual time.
    void pulse_input(int line, double seconds, bool on = true) const { call("pulse_input", {{"line", line}, {"seconds", seconds}, {"on", on}}); }
    /// The line shows this state, whatever drives it, until it is released.
    void force_input(int line, bool on) const { call("force_input", {{"line", line}, {"on", on}}); }
    void release_input(int line) const { call("release_input", {{"line", line}}); }
    bool output(int line) const { return call("get_output", {{"line", line}})["on"].as_bool(); }
    std::vector<double> outputs() const { return call("get_outputs")["on"].as_doubles(); }
    void set_output(int line, bool on) const { call("put_output", {{"line", line}, {"on", on}}); }
    /// Turns a user output on, and off after this much virtual time.
    void pulse_output(int line, double seconds) const { call("pulse_output", {{"line", line}, {"seconds", seconds}}); }
    void force_output(int line, bool on) const { call("force_output", {{"line", line}, {"on", on}}); }
    void release_output(int line) const { call("release_output", {{"line", line}}); }
    /// The values of a variable of the selected file.
    std::vector<double> variable(const std::string& name) const { return call("get_variable", {{"name", name}})["value"].as_doubles(); }
    Json variables() const { return call("get_variables"); }
    /// Sets a variable; with `restore` also in its file.
    void set_variable(const std::string& name, const Json& value, bool restore = false) const { call("put_variable", {{"name", name}, {"value", value}, {"restore", restore}}); }
    std::vector<double> position(const std::string& name) const { return call("get_position", {{"name", name}})["value"].as_doubles(); }
    Json positions() const { return call("get_positions"); }
    void set_position(const std::string& name, const std::vector<double>& value, bool restore = false) const {
        call("put_position", {{"name", name}, {"value", value}, {"restore", restore}});
    }
    /// A position becomes the present one.
    void teach_position(const std::string& name, bool restore = false) const { call("teach_position", {{"name", name}, {"restore", restore}}); }
    std::string file(const std::string& name) const { return call("get_file", {{"name", name}})["text"].as_string(); }
    /// The names of the files of the RAM drive.
    std::vector<std::string> files() const { return names(call("get_files")["files"]); }
    void put_file(const std::string& name, const std::string& text) const { call("put_file", {{"name", name}, {"text", text}}); }
    void erase_file(const std::string& name) const { call("delete_file", {{"name", name}}); }

    // Ports
    /// Where ip0 to ip3, or a serial line that is served as bare TCP, accepts a connection.
    std::pair<std::string, int> address(const std::string& port = "ip0") const {
        const Json document = call("get_robots");
        const std::vector<Json>& rows = document["robots"].elements();
        const std::size_t slash = base_.rfind('/');
        auto row = std::find_if(rows.begin(), rows.end(), [&](const Json& one) { return slash != std::string::npos && base_.substr(slash + 1) == encoded(one["name"].as_string()); });
        if (row == rows.end()) row = rows.begin();
        const std::string group = (*row)["ports"].has(port) ? "ports" : "serial";
        if (!row->has(group) || !(*row)[group].has(port)) throw Error(port + " has no TCP address");
        std::string place = (*row)[group][port].as_string();
        place = place.substr(place.find("://") == std::string::npos ? 0 : place.find("://") + 3);
        const std::size_t colon = place.rfind(':');
        const std::string host = place.substr(0, colon);
        // An address of all interfaces is reached where the control interface is.
        return {host == "0.0.0.0" || host == "[::]" ? address_ : host, std::atoi(place.c_str() + colon + 1)};
    }
    /// A host that is connected to IP0.
    Host host() const {
        const auto [host, port] = address();
        return Host(host, port, [robot = *this] { return robot.describe(); });
    }
    /// A peer that is connected to ip1 or ip2, or to com1 where it is served as bare TCP.
    Channel channel(const std::string& name = "ip1") const {
        const auto [host, port] = address(name);
        return Channel(host, port, upper(name), [robot = *this] { return robot.describe(); });
    }
    /// A communication port (HOST, COM1, IP0 to IP3): its peer, its exchange, its buffer.
    Json channel_state(const std::string& port) const { return call("get_channel", {{"port", upper(port)}}); }
    /// Text as if the peer of a SCOL channel had sent it.
    void inject(const std::string& port, const std::string& text) const { call("inject_bytes", {{"port", upper(port)}, {"text", text}}); }
    /// Closes the connection of the peer of a port.
    void drop_peer(const std::string& port) const { call("drop_peer", {{"port", upper(port)}}); }

    // Time, snapshots, records
    Clock clock() const { return Clock(call("get_clock")); }
    /// Advances a stopped clock.
    void advance(double seconds) const { call("advance_time", {{"seconds", seconds}, {"wall", wall_seconds}}); }
    /// Advances a stopped clock until a condition is met, such as "output 5 on". Throws NotReached after `within`
    /// seconds of virtual time.
    Reached advance_until(const std::string& condition, double within = 60) const { return await("advance_time_until", condition, within); }
    /// Waits for a condition while time passes by itself. Throws NotReached.
    Reached wait_until(const std::string& condition, double within = 60) const { return await("wait_until", condition, within); }
    std::vector<std::string> snapshots() const { return names(call("get_snapshots")["snapshots"]); }
    void take_snapshot(const std::string& name) const { call("put_snapshot", {{"name", name}}); }
    /// Returns to a snapshot; hosts stay connected, findings and transcript continue.
    void restore_snapshot(const std::string& name) const { call("restore_snapshot", {{"name", name}}); }
    void delete_snapshot(const std::string& name) const { call("delete_snapshot", {{"name", name}}); }
    /// The mistakes of hosts since the start or the last reset, oldest first.
    std::vector<Finding> findings() const { return all<Finding>(call("get_findings")); }
    /// What went over the ports since the start or the last reset.
    std::string transcript() const { return call("get_transcript", {{"format", "text"}}).as_string(); }

    /// Clock, program, alarms, outputs and the last printed lines in a sentence, for the message of a test that fails.
    std::string describe() const {
        const Json now = state();
        const std::string mode = now["time_mode"].as_string(), file = now["file"].as_string();
        std::string text = "the clock " + (mode == "stepped" ? "is stepped and stopped at " : "runs (" + mode + ") and is at ") + Json::number(now["t"].as_double()) + " s; ";
        text += file.empty() ? "no file is selected" : file + " is " + now["status"].as_string() + ", line " + std::to_string(now["line"].as_int());
        for (const Json& task : now["tasks"].elements())
            if (!file.empty() && task.has("reads")) text += ", an INPUT waits for " + task["reads"].as_string();
        std::string alarms, outputs, printed, pendant;
        for (const Json& alarm : now["alarms"].elements()) alarms += " " + alarm["number"].as_string();
        for (double line : now["outputs"]["on"].as_doubles()) outputs += " " + Json::number(line);
        std::map<std::string, std::string> last;
        for (const std::string& line : detail::split(transcript(), '\n'))
            for (const char* port : {"COM1 ", "IP1 ", "IP2 "})
                if (line.compare(0, 2, "< ") == 0 && line.compare(2, std::strlen(port), port) == 0) last[port] = line.substr(2 + std::strlen(port));
        for (const auto& [port, line] : last) printed += port + "printed " + line + ", ";
        for (const std::string& line : detail::split(now["pendant"].as_string(), '\n')) pendant = detail::trimmed(line, '\r');
        return text + "; alarms:" + (alarms.empty() ? " none" : alarms) + "; outputs on:" + (outputs.empty() ? " none" : outputs) + "; " + printed + "the pendant " +
               (printed.empty() ? "printed " : "") + (pendant.empty() ? "nothing" : pendant);
    }

private:
    static constexpr milliseconds longest_call{60000};
    static constexpr int wall_seconds = 30, too_long = 408;
    static constexpr std::size_t longest_answer = 256u << 20;
    std::string address_, base_, token_;
    int port_ = 0;

    template <typename T>
    static std::vector<T> all(const Json& list) {
        std::vector<T> records;
        for (const Json& row : list.elements()) records.emplace_back(row);
        return records;
    }
    static std::vector<std::string> names(const Json& list) {
        std::vector<std::string> words;
        for (const Json& row : list.elements()) words.push_back(row["name"].as_string());
        return words;
    }
    static std::string upper(std::string word) {
        std::transform(word.begin(), word.end(), word.begin(), [](unsigned char letter) { return static_cast<char>(std::toupper(letter)); });
        return word;
    }
    static std::string plain(const Json& value) { return value.type() == Json::Type::string ? value.as_string() : value.text(); }
    static std::string encoded(const std::string& name) {
        std::string text;
        for (char letter : name) {
            char code[4];
            std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned>(static_cast<unsigned char>(letter)));
            text += std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '-' ? std::string(1, letter) : std::string(code);
        }
        return text;
    }
    Reached await(const std::string& operation, const std::string& condition, double within) const {
        std::string limit = Json::number(within) + " s of virtual time";
        try {
            const Json result = call(operation, {{"condition", condition}, {"within", within}, {"wall", wall_seconds}});
            if (result["reached"].as_bool()) return Reached(result);
        } catch (const ControlError& error) {
            if (error.status != too_long) throw;
            limit = std::to_string(wall_seconds) + " s of wall-clock time";
        }
        throw NotReached("`" + condition + "` was not met within " + limit + ": " + describe());
    }

    /// One connection for each request: the answer ends where the emulator closes it.
    Json request(const std::string& method, const std::string& path, const std::string& body) const {
        detail::Connection link(address_, port_, longest_call);
        std::string head = method + " " + base_ + path + " HTTP/1.1\r\nHost: " + address_ + ":" + std::to_string(port_) + "\r\nConnection: close\r\n";
        if (!token_.empty()) head += "Authorization: Bearer " + token_ + "\r\n";
        if (!body.empty()) head += "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
        link.write(head + "\r\n" + body);
        std::string answer;
        for (int next = link.read_or_end(); next >= 0; next = link.read_or_end()) {
            answer += static_cast<char>(next);
            if (answer.size() > longest_answer) throw Error(path + ": the answer is too long");
        }
        const std::size_t end = answer.find("\r\n\r\n");
        if (answer.compare(0, 5, "HTTP/") != 0 || end == std::string::npos) throw Error(path + ": the answer is not HTTP; is this the control interface?");
        std::string fields = answer.substr(0, end);
        std::transform(fields.begin(), fields.end(), fields.begin(), [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
        std::string content = answer.substr(end + 4);
        if (fields.find("\r\ntransfer-encoding: chunked") != std::string::npos) content = dechunked(content);
        const std::size_t length = fields.find("\r\ncontent-length: ");
        if (length != std::string::npos && std::strtoul(fields.c_str() + length + 18, nullptr, 10) != content.size()) throw Error(path + ": the answer was cut off");
        const int status = std::atoi(answer.c_str() + answer.find(' '));
        const bool is_json = fields.find("\r\ncontent-type: application/json") != std::string::npos;
        if (status >= 200 && status < 300) return is_json ? Json::parse(content) : Json(content);
        std::string reason = method + " " + path + ": HTTP status " + std::to_string(status);
        if (is_json) {
            const Json problem = Json::parse(content);
            if (problem.has("error")) reason = problem["error"].as_string();
        }
        throw ControlError(status, reason);
    }
    static std::string dechunked(const std::string& content) {
        std::string whole;
        for (std::size_t at = 0;;) {
            const std::size_t line = content.find("\r\n", at);
            const std::size_t size = line == std::string::npos ? 0 : std::strtoul(content.c_str() + at, nullptr, 16);
            if (size == 0) return whole;
            whole += content.substr(line + 2, size);
            at = line + 2 + size + 2;
            if (at > content.size()) throw Error("the answer of the control interface was cut off");
        }
    }
};

/// A running `ts3100 serve` on free ports.
class Process {
public:
    /// Options of `ts3100 serve`; variables that set options have no effect. The binary is that of TS3100_BINARY, otherwise `ts3100` in PATH.
    explicit Process(const std::vector<std::string>& options = {}) {
        std::vector<std::string> words = {binary(), "serve", "--ports", "auto", "--ready-json"};
        words.insert(words.end(), options.begin(), options.end());
        start(words);
        try {
            ready_ = Json::parse(ready_line());
        } catch (...) {
            end();
            throw;
        }
    }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;
    ~Process() { end(); }

    /// The binary: that of TS3100_BINARY, otherwise `ts3100` in PATH.
    static std::string binary() {
        const char* const named = std::getenv("TS3100_BINARY");
        return named != nullptr ? named : "ts3100";
    }

    std::string control_url() const { return ready_["control"].as_string(); }
    /// The TCP port of ip0 to ip3.
    int port(const std::string& channel) const { return ready_["ports"][channel].as_int(); }
    /// The log of the emulator so far.
    std::string log() const {
        std::string text;
        if (std::FILE* const file = std::fopen(log_.c_str(), "rb")) {
            char piece[4096];
            for (std::size_t count = std::fread(piece, 1, sizeof piece, file); count > 0; count = std::fread(piece, 1, sizeof piece, file)) text.append(piece, count);
            std::fclose(file);
        }
        return text;
    }

private:
    // It is up in milliseconds; a machine under load takes longer.
    static constexpr milliseconds start_limit{20000}, end_limit{5000}, look{10};
    static constexpr std::size_t longest_line = 65536;
    Json ready_;
    std::string log_;

    // A variable such as TS3100_DRIVE is a setting too; tests say their settings to the constructor.
    static bool is_setting(const char* variable) { return std::strncmp(variable, "TS3100_", 7) == 0; }
    [[noreturn]] void not_ready() const {
        throw Error("ts3100 serve did not become ready within " + std::to_string(start_limit.count()) + " ms, or ended:\n" + log());
    }
    [[noreturn]] static void not_started(const std::string& binary) {
        throw Error("cannot run " + binary + ": install ts3100, or set TS3100_BINARY to its path");
    }

#ifdef _WIN32
    HANDLE process_ = nullptr, output_ = nullptr, job_ = nullptr;

    static std::string quoted(const std::string& word) {
        std::string text = "\"";
        std::size_t slashes = 0;
        for (char letter : word) {
            // Backslashes count double before a quotation mark only.
            if (letter == '"') text.append(slashes + 1, '\\');
            slashes = letter == '\\' ? slashes + 1 : 0;
            text += letter;
        }
        return text.append(slashes, '\\') + "\"";
    }
    void start(const std::vector<std::string>& words) {
        SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
        HANDLE input = nullptr;
        if (!CreatePipe(&output_, &input, &inherited, 0)) throw Error("cannot create a pipe");
        SetHandleInformation(output_, HANDLE_FLAG_INHERIT, 0);
        char folder[MAX_PATH + 1], name[MAX_PATH + 1];
        if (GetTempPathA(sizeof folder, folder) == 0 || GetTempFileNameA(folder, "ts3", 0, name) == 0) throw Error("cannot create a file for the log");
        log_ = name;
        const HANDLE log = CreateFileA(name, FILE_APPEND_DATA, FILE_SHARE_READ | FILE_SHARE_DELETE, &inherited, OPEN_EXISTING, FILE_ATTRIBUTE_TEMPORARY, nullptr);
        std::string line;
        for (const std::string& word : words) line += quoted(word) + " ";
        std::string variables;
        char* const all = GetEnvironmentStringsA();
        for (const char* one = all; *one != 0; one += std::strlen(one) + 1)
            if (!is_setting(one)) variables.append(one).push_back('\0');
        FreeEnvironmentStringsA(all);
        STARTUPINFOA how{};
        how.cb = sizeof how;
        how.dwFlags = STARTF_USESTDHANDLES;
        how.hStdOutput = input;
        how.hStdError = log;
        PROCESS_INFORMATION made{};
        const BOOL started = CreateProcessA(nullptr, line.data(), nullptr, nullptr, TRUE, CREATE_SUSPENDED, variables.data(), nullptr, &how, &made);
        CloseHandle(input);
        CloseHandle(log);
        if (!started) {
            CloseHandle(output_);
            output_ = nullptr;
            not_started(words[0]);
        }
        // The job ends the emulator with the test, however the test ends.
        job_ = CreateJobObjectA(nullptr, nullptr);
        JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
        limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
        SetInformationJobObject(job_, JobObjectExtendedLimitInformation, &limits, sizeof limits);
        AssignProcessToJobObject(job_, made.hProcess);
        ResumeThread(made.hThread);
        CloseHandle(made.hThread);
        process_ = made.hProcess;
    }
    std::string ready_line() {
        std::string line;
        for (const auto until = std::chrono::steady_clock::now() + start_limit; std::chrono::steady_clock::now() < until;) {
            DWORD waiting = 0, count = 0;
            char next = 0;
            if (!PeekNamedPipe(output_, nullptr, 0, nullptr, &waiting, nullptr)) break;
            if (waiting == 0) {
                std::this_thread::sleep_for(look);
            } else if (ReadFile(output_, &next, 1, &count, nullptr) && count == 1) {
                if (next == '\n') return line;
                line += next;
                if (line.size() > longest_line) break;
            }
        }
        not_ready();
    }
    void end() {
        if (process_ != nullptr) {
            TerminateProcess(process_, 1);
            WaitForSingleObject(process_, static_cast<DWORD>(end_limit.count()));
        }
        for (HANDLE* handle : {&process_, &output_, &job_})
            if (*handle != nullptr) {
                CloseHandle(*handle);
                *handle = nullptr;
            }
        std::remove(log_.c_str());
    }
#else
    pid_t process_ = -1, guard_ = -1;
    int output_ = -1, lifeline_ = -1;

    /// Starts a program with one end of a new pipe as its input or output. The other end is `ours`.
    static pid_t spawn(const std::vector<std::string>& words, int theirs, int& ours, int log = STDERR_FILENO) {
        int ends[2];
        if (pipe(ends) != 0) throw Error("cannot create a pipe");
        for (int end : ends) fcntl(end, F_SETFD, FD_CLOEXEC);
        const int side = theirs == STDOUT_FILENO ? 1 : 0;
        ours = ends[1 - side];
        std::vector<char*> arguments, variables;
        for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
        arguments.push_back(nullptr);
        for (char** one = environ; *one != nullptr; ++one)
            if (!is_setting(*one)) variables.push_back(*one);
        variables.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, ends[side], theirs);
        if (log != STDERR_FILENO) posix_spawn_file_actions_adddup2(&actions, log, STDERR_FILENO);
        pid_t process = -1;
        const int error = posix_spawnp(&process, words[0].c_str(), &actions, nullptr, arguments.data(), variables.data());
        posix_spawn_file_actions_destroy(&actions);
        close(ends[side]);
        return error == 0 ? process : -1;
    }
    void start(const std::vector<std::string>& words) {
        const char* const folder = std::getenv("TMPDIR");
        log_ = std::string(folder != nullptr ? folder : "/tmp") + "/ts3100-XXXXXX";
        const int log = mkstemp(log_.data());
        if (log < 0) throw Error("cannot create a file for the log: " + log_);
        fcntl(log, F_SETFD, FD_CLOEXEC);
        process_ = spawn(words, STDOUT_FILENO, output_, log);
        close(log);
        if (process_ < 0) {
            end();
            not_started(words[0]);
        }
        // Ends the emulator with the test, however the test ends: `read` ends with the pipe from here.
        guard_ = spawn({"/bin/sh", "-c", "read -r _; kill \"$0\" 2>/dev/null", std::to_string(process_)}, STDIN_FILENO, lifeline_);
    }
    std::string ready_line() {
        std::string line;
        for (const auto until = std::chrono::steady_clock::now() + start_limit; line.size() < longest_line;) {
            const auto left = std::chrono::duration_cast<milliseconds>(until - std::chrono::steady_clock::now());
            pollfd entry{output_, POLLIN, 0};
            char next = 0;
            if (left.count() <= 0 || poll(&entry, 1, static_cast<int>(left.count())) <= 0 || ::read(output_, &next, 1) != 1) break;
            if (next == '\n') return line;
            line += next;
        }
        not_ready();
    }
    void end() {
        // A process number below 1 would address other processes, or all of them.
        if (const pid_t guard = std::exchange(guard_, -1); guard > 0) {
            kill(guard, SIGKILL);
            waitpid(guard, nullptr, 0);
        }
        if (const pid_t process = std::exchange(process_, -1); process > 0) {
            // SIGTERM lets it write its reports.
            kill(process, SIGTERM);
            const auto until = std::chrono::steady_clock::now() + end_limit;
            while (waitpid(process, nullptr, WNOHANG) == 0) {
                if (std::chrono::steady_clock::now() > until) kill(process, SIGKILL);
                std::this_thread::sleep_for(look);
            }
        }
        for (int* descriptor : {&output_, &lifeline_})
            if (*descriptor >= 0) close(std::exchange(*descriptor, -1));
        unlink(log_.c_str());
    }
#endif
};

/// Which tests leave the run of their robot as a transcript and a page for a browser.
enum class Trace { off, on, retain_on_failure };

/// One emulator for many tests: fresh() before each, mistakes() after it.
class Fixture {
public:
    /// Options as for Process.
    explicit Fixture(const std::vector<std::string>& options = {}) : process(options), robot(process.control_url()) {}

    static constexpr std::size_t last_texts = 6, longest_shown = 120;
    const Process process;
    const Robot robot;
    /// Which tests leave their run, and in which directory.
    Trace trace = Trace::retain_on_failure;
    std::string artifacts = "ts3100-transcripts";

    /// As the robot was started, without connections and findings; in less than a millisecond.
    const Robot& fresh() const {
        robot.reset();
        return robot;
    }

    /// The findings of this severity and worse, except of the allowed rules, the last texts, and the command that shows the run;
    /// nothing if there are none. `test` names the files of the run.
    std::string mistakes(Severity deny = Severity::warning, const std::vector<std::string>& allowed = {}, const std::string& test = "test") const {
        std::string report, rule;
        for (const Finding& finding : robot.findings())
            if (finding.caused_by.empty() && finding.severity >= deny && std::find(allowed.begin(), allowed.end(), finding.rule) == allowed.end()) {
                if (rule.empty()) rule = finding.rule;
                report += "\n  " + describe(finding);
            }
        if (report.empty()) {
            if (trace == Trace::on) keep(test);
            return report;
        }
        std::vector<std::string> texts;
        for (const std::string& line : detail::split(robot.transcript(), '\n'))
            if (line.compare(0, 2, "> ") == 0 || line.compare(0, 2, "< ") == 0)
                texts.push_back(line.size() > longest_shown ? line.substr(0, longest_shown) + "..." : line);
        report = "protocol mistakes of the host:" + report + "\nlast texts:";
        for (std::size_t at = texts.size() > last_texts ? texts.size() - last_texts : 0; at < texts.size(); ++at) report += "\n  " + texts[at];
        const std::string kept = keep(test, rule);
        return kept.empty() ? report : report + "\n" + kept;
    }

    /// Keeps the run of a test that has failed for another reason. Returns the command that shows it at the finding of this rule,
    /// otherwise at the first NG or the last that a host sent, and where its page is; nothing with Trace::off.
    std::string keep(const std::string& test = "test", const std::string& rule = "") const {
        namespace files = std::filesystem;
        if (trace == Trace::off) return "";
        std::string name = test + "-" + std::to_string(process_id()) + "-" + std::to_string(++kept_);
        for (char& letter : name)
            if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '-';
        const files::path file = files::path(artifacts) / (name + ".txt"), page = files::path(file).replace_extension(".html");
        const std::string transcript = robot.transcript();
        std::error_code ignored;
        files::create_directories(file.parent_path(), ignored);
        std::ofstream out(file, std::ios::binary);
        out << transcript;
        out.close();
        if (!out) return "the run is not kept: cannot write " + file.string();
        const std::string words = " view " + quoted(shown(file));
        // What view has to say against it is on stderr.
        const bool is_made = execute(quoted(Process::binary()) + words + " --html " + quoted(shown(page)));
        return "ts3100" + words + moment(transcript, rule) + "\n" + (is_made ? "page: " : "no page: cannot write ") + shown(page);
    }

private:
    mutable int kept_ = 0;

    static std::string moment(const std::string& transcript, const std::string& rule) {
        if (!rule.empty()) return " --first " + rule;
        bool was_sent = false;
        for (const std::string& line : detail::split(transcript, '\n')) {
            const std::size_t port = line.find(' '), text = port == std::string::npos ? port : line.find(' ', port + 1);
            if (line.compare(0, 1, "<") == 0 && text != std::string::npos && line.compare(text, 7, " NG<CR>") == 0) return " --first ng";
            was_sent = was_sent || line.compare(0, 1, ">") == 0;
        }
        return was_sent ? " --last received" : "";
    }
    /// A path, relative to the working directory if it is below.
    static std::string shown(const std::filesystem::path& file) {
        const std::filesystem::path below = std::filesystem::absolute(file).lexically_relative(std::filesystem::current_path());
        return below.empty() || *below.begin() == ".." ? file.string() : below.string();
    }
    /// A word for a shell.
    static std::string quoted(const std::string& word) {
        const auto is_bare = [](char letter) { return std::isalnum(static_cast<unsigned char>(letter)) != 0 || std::strchr("/\\._-:", letter) != nullptr; };
        if (std::all_of(word.begin(), word.end(), is_bare)) return word;
#ifdef _WIN32
        return "\"" + word + "\"";
#else
        std::string text = "'";
        for (char letter : word) text += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
        return text + "'";
#endif
    }
#ifdef _WIN32
    static unsigned long process_id() { return GetCurrentProcessId(); }
    // cmd takes off the outer quotation marks of a line that begins with one.
    static bool execute(const std::string& line) { return std::system(("\"" + line + "\"").c_str()) == 0; }
#else
    static long process_id() { return getpid(); }
    static bool execute(const std::string& line) { return std::system(line.c_str()) == 0; }
#endif
};

}  // namespace ts3100

#endif
