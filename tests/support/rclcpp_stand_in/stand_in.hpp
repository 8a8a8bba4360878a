// The world of a node on the stand-in for rclcpp: the test writes on standard input what happens to the node, a line
// each, and the node's doings are printed on standard output. No network. The executor of the controller's callback
// group takes the lines, but those of the process: these the executor takes that the node was added to.
//
//   message TOPIC DATA            a message comes
//   server NAME 1                 a service or action has a server (0: it has none)
//   shown NAME ENDPOINT...        the middleware shows these ends of others: of the topic NAME each is PROCESS:NODE:TYPE, with
//                                 a best_effort or transient_local at its end where it is one
//   asked NAME LIVING IGNORANT    from now on so many servers of an action answer at all, and do not know its goal
//   status NAME NUMBER            the server of an action shows its last goal so
//   offered NAME TYPE             a service of a type is in use
//   answer NAME DATA              the oldest call of a service is answered
//   accept NAME, reject NAME      the answer to the last goal of an action
//   feedback NAME DATA
//   result NAME CODE DATA         4: succeeded, 5: canceled, 6: aborted
//   refuse NAME CODE              the answer to a cancel (0: it is accepted)
//   ask_call NAME ID DATA         an existing controller calls a service of the node, with a number of its own
//   ask_goal NAME ID DATA         it sends a goal to an action of the node
//   ask_cancel NAME ID            it cancels the goal
//   signal NUMBER
//   clock SECONDS                 simulated time goes on, or back
//   wait WORD NAME                go on when the node has done that once more
//   change TRANSITION             whoever manages the node asks for it: configure, activate, deactivate, cleanup, shutdown
//   set NAME VALUE                somebody sets a parameter
//   end                           the context ends, as by a signal to a container
//
// DATA depends on the type: the value of `data`, the ranges of a scan, `success` and `message` of a reply, `sequence`,
// `order`, `float64_value`, x, y and z of a point, of a twist the parts of both vectors, the voltage of a battery, of
// odometry x, y, z and w of its orientation, speed and turn, four parts of a test_msgs/NestedMessage.

#pragma once

#include <atomic>
#include <csignal>
#include <cstdint>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <poll.h>
#include <sstream>
#include <string>
#include <type_traits>
#include <unistd.h>
#include <utility>
#include <vector>

namespace stand_in {

#define STAND_IN_HAS(Name, field)                                                                                      \
    template <class M, class = void>                                                                                   \
    struct Name : std::false_type {};                                                                                  \
    template <class M>                                                                                                 \
    struct Name<M, std::void_t<decltype(std::declval<M&>().field)>> : std::true_type {};

STAND_IN_HAS(HasData, data)
STAND_IN_HAS(HasRanges, ranges)
STAND_IN_HAS(HasSuccess, success)
STAND_IN_HAS(HasSequence, sequence)
STAND_IN_HAS(HasPoint, z)
STAND_IN_HAS(HasVoltage, voltage)
STAND_IN_HAS(HasOdometry, child_frame_id)
STAND_IN_HAS(HasNested, nested_different_pkg)
STAND_IN_HAS(HasOrder, order)
STAND_IN_HAS(HasTwist, linear.x)
STAND_IN_HAS(HasBasicTypes, float64_value)

template <class T>
void read_list(std::istream& in, std::vector<T>& list)
{
    // Unlike `>>`, this reads nan and inf.
    for (std::string word; in >> word;) {
        list.push_back(static_cast<T>(std::stod(word)));
    }
}

template <class M>
M parsed(std::istream& in)
{
    M message;
    if constexpr (HasData<M>::value) {
        std::string rest;
        std::getline(in >> std::ws, rest);
        if constexpr (std::is_same<decltype(message.data), std::string>::value) {
            message.data = rest;
        } else {
            message.data = static_cast<decltype(message.data)>(std::stod(rest));
        }
    } else if constexpr (HasRanges<M>::value) {
        read_list(in, message.ranges);
        message.range_max = 100.0F;
        message.angle_increment = message.ranges.empty() ? 0.0F : 6.2831853F / static_cast<float>(message.ranges.size());
    } else if constexpr (HasSuccess<M>::value) {
        in >> message.success;
        std::getline(in >> std::ws, message.message);
    } else if constexpr (HasSequence<M>::value) {
        read_list(in, message.sequence);
    } else if constexpr (HasOrder<M>::value) {
        in >> message.order;
    } else if constexpr (HasBasicTypes<M>::value) {
        in >> message.float64_value;
    } else if constexpr (HasTwist<M>::value) {
        std::vector<double> numbers;
        read_list(in, numbers);
        numbers.resize(6);
        message.linear.x = numbers[0];
        message.linear.y = numbers[1];
        message.linear.z = numbers[2];
        message.angular.x = numbers[3];
        message.angular.y = numbers[4];
        message.angular.z = numbers[5];
    } else if constexpr (HasPoint<M>::value) {
        in >> message.x >> message.y >> message.z;
    } else if constexpr (HasVoltage<M>::value) {
        in >> message.voltage;
    } else if constexpr (HasOdometry<M>::value) {
        auto& pose = message.pose.pose;
        auto& twist = message.twist.twist;
        in >> pose.position.x >> pose.position.y >> pose.orientation.z >> pose.orientation.w >> twist.linear.x
            >> twist.angular.z;
    } else if constexpr (HasNested<M>::value) {
        int number = 0;
        in >> message.nested_field.bool_value >> number >> message.nested_field.float32_value
            >> message.nested_different_pkg.sec;
        message.nested_field.uint8_value = static_cast<uint8_t>(number);
    }
    return message;
}

using Handler = std::function<void(std::istream&)>;

struct World {
    std::map<std::string, std::vector<Handler>> topics;
    // By word and name.
    std::map<std::pair<std::string, std::string>, Handler> orders;
    std::map<std::string, bool> servers;
    std::map<std::string, std::vector<std::string>> shown;
    std::map<std::string, std::pair<int, int>> asked;
    std::map<std::string, std::vector<std::string>> offered;
    // Answers that are on their way to the node.
    std::vector<std::function<void()>> answers;
    std::map<std::string, int> done;
    std::atomic<std::int64_t> clock_ns{0};
    std::string input;
    std::atomic<bool> is_over{false};
    // Protects what both executors look at: what was done, and the input.
    std::recursive_mutex mutex;
    // Lines of the process, by their first word.
    std::map<std::string, Handler> manager;
};

inline World& world()
{
    static World made;
    return made;
}

inline void obey(const std::string& line)
{
    std::istringstream in(line);
    std::string word;
    std::string name;
    in >> word >> name;
    if (word == "message") {
        for (const Handler& handler : world().topics[name]) {
            std::istringstream rest(line.substr(static_cast<std::size_t>(in.tellg()) == std::string::npos
                    ? line.size()
                    : static_cast<std::size_t>(in.tellg())));
            handler(rest);
        }
    } else if (word == "clock") {
        world().clock_ns = static_cast<std::int64_t>(std::stod(name) * 1e9);
    } else if (word == "server") {
        in >> world().servers[name];
    } else if (word == "shown") {
        std::vector<std::string>& ends = world().shown[name];
        ends.clear();
        for (std::string end; in >> end;) {
            ends.push_back(end);
        }
    } else if (word == "asked") {
        in >> world().asked[name].first >> world().asked[name].second;
    } else if (word == "offered") {
        std::string type;
        in >> type;
        world().offered[name].push_back(type);
    } else if (word == "signal") {
        std::raise(std::stoi(name));
    } else {
        const auto found = world().orders.find({word, name});
        if (found == world().orders.end()) {
            std::cout << "no order: " << line << std::endl;
        } else {
            // The order may change what it does.
            const Handler handler = found->second;
            handler(in);
        }
    }
}

// Read what has come on standard input.
inline void read_input()
{
    World& here = world();
    pollfd waited{0, POLLIN, 0};
    if (!here.is_over && poll(&waited, 1, 0) > 0) {
        char buffer[65536];
        const ssize_t count = read(0, buffer, sizeof buffer);
        here.is_over = count == 0;
        if (count > 0) {
            here.input.append(buffer, static_cast<std::size_t>(count));
        }
    }
}

// Take the next line if it is there and for this executor; what a manager asks for stays in line until it is done.
inline bool take_line(bool is_manager, bool takes_clock, std::string& line)
{
    World& here = world();
    const std::lock_guard<std::recursive_mutex> lock(here.mutex);
    if (here.input.find('\n') == std::string::npos) {
        read_input();
    }
    const std::size_t end = here.input.find('\n');
    if (end == std::string::npos) {
        return false;
    }
    line = here.input.substr(0, end);
    if (!takes_clock && line.compare(0, 6, "clock ") == 0) {
        return false;
    }
    const bool is_of_manager = here.manager.count(line.substr(0, line.find(' '))) > 0;
    if (line.compare(0, 5, "wait ") == 0) {
        if (here.done[line.substr(5)]-- <= 0) {
            here.done[line.substr(5)] = 0;
            return false;
        }
    } else if (line.compare(0, 7, "signal ") != 0 && is_of_manager != is_manager) {
        return false;
    }
    if (!is_of_manager) {
        here.input.erase(0, end + 1);
    }
    return true;
}

// Handle one line, waiting for it for so long: whether there was one.
inline bool step(int timeout_ms, bool is_manager = false, bool takes_clock = true)
{
    World& here = world();
    std::string line;
    if (!is_manager) {
        for (const auto& answer : std::exchange(here.answers, {})) {
            answer();
        }
    }
    if (!take_line(is_manager, takes_clock, line)) {
        bool is_quiet = false;
        {
            const std::lock_guard<std::recursive_mutex> lock(here.mutex);
            is_quiet = here.input.empty();
        }
        pollfd waited{0, POLLIN, 0};
        if (is_quiet && !here.is_over) {
            poll(&waited, 1, timeout_ms);
        } else {
            // The other executor may be done with its line at any time.
            poll(nullptr, 0, timeout_ms < 2 || here.is_over ? timeout_ms : 2);
        }
        if (!take_line(is_manager, takes_clock, line)) {
            return false;
        }
    }
    const std::string word = line.substr(0, line.find(' '));
    if (here.manager.count(word) > 0) {
        std::istringstream in(line.substr(word.size()));
        here.manager.at(word)(in);
        const std::lock_guard<std::recursive_mutex> lock(here.mutex);
        here.input.erase(0, here.input.find('\n') + 1);
    } else if (word != "wait") {
        obey(line);
    }
    return true;
}

inline void print(const std::string& what, const std::string& name, const std::string& yaml)
{
    const std::lock_guard<std::recursive_mutex> lock(world().mutex);
    world().done[what + " " + name]++;
    std::cout << what << " " << name << " ";
    // Only texts hold ends of lines, and there YAML takes them so.
    for (const char one : yaml) {
        if (one == '\n') {
            std::cout << "\\n";
        } else {
            std::cout << one;
        }
    }
    std::cout << std::endl;
}

}  // namespace stand_in
