/* The parameters of the node: one clear error for a wrong value. */

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "../engine.h"
#include "json.hpp"

namespace robosc {

/* A parameter has a wrong value; says which and what it may be. */
class ParameterError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

using Texts = std::vector<std::string>;

/* A value that is none of those that parameters have. */
struct OtherValue {
    std::string shown;
};

using Value = std::variant<OtherValue, bool, std::int64_t, double, std::string, Texts>;

struct Range {
    double low;
    double high;
};

struct Declaration {
    const char* name;
    Value value;
    const char* description;
    std::optional<Range> range;        /* of a number */
};

using Given = std::map<std::string, Value>;

/* Form of the state on its topics; only ROS 2 has another than JSON. */
enum class StateMessage { JSON, TYPED, BOTH };

/* Valid values of what the engine does not know itself. */
struct Parameters {
    robot_settings_t settings{};
    double period_s = 0.0;
    double server_wait_s = 0.0;
    std::string topic_prefix;
    std::string log_folder;
    bool publish_state = false;
    StateMessage state_message = StateMessage::JSON;
    bool resample_scans = false;
    /* True if the process ends by a fault, and reports it then. */
    bool ends_by_fault = true;
};

/* Part of the model that parameters may name. */
struct Nameable {
    const char* name;
    const char* identifier;
    int number;        /* of the communication, for a request or a received message; of the topic, for a sent one */
};

namespace detail {

inline std::string quoted(const std::string& text) { return "'" + text + "'"; }

inline std::string shown(const Value& value)
{
    struct Show {
        std::string operator()(const OtherValue& item) const { return item.shown; }
        std::string operator()(bool item) const { return item ? "True" : "False"; }
        std::string operator()(std::int64_t item) const { return std::to_string(item); }
        std::string operator()(double item) const { return number_text(item); }
        std::string operator()(const std::string& item) const { return quoted(item); }
        std::string operator()(const Texts& items) const
        {
            std::string text;
            for (const std::string& item : items) {
                text += (text.empty() ? "" : ", ") + quoted(item);
            }
            return "[" + text + "]";
        }
    };
    return std::visit(Show{}, value);
}

[[noreturn]] inline void wrong(const std::string& name, const Value& value, const std::string& expected)
{
    throw ParameterError("parameter '" + name + "' is " + shown(value) + "; it must be " + expected);
}

/* The number that a value is; NaN if it is none. */
inline double number(const Value& value)
{
    if (const auto* whole = std::get_if<std::int64_t>(&value)) {
        return static_cast<double>(*whole);
    }
    const auto* real = std::get_if<double>(&value);
    return real != nullptr ? *real : std::nan("");
}

inline double seconds_or_zero(const Given& given, const std::string& name)
{
    const double value = number(given.at(name));
    if (!(value >= 0.0) || std::isinf(value)) {
        wrong(name, given.at(name), "a number of seconds, 0 or more");
    }
    return value;
}

inline bool boolean(const Given& given, const std::string& name)
{
    const auto* value = std::get_if<bool>(&given.at(name));
    if (value == nullptr) {
        wrong(name, given.at(name), "true or false");
    }
    return *value;
}

inline std::string text(const Given& given, const std::string& name)
{
    const auto* value = std::get_if<std::string>(&given.at(name));
    if (value == nullptr) {
        wrong(name, given.at(name), "a string");
    }
    return *value;
}

/* A list of strings without the empty ones, each once. */
inline Texts texts(const Given& given, const std::string& name)
{
    const auto* value = std::get_if<Texts>(&given.at(name));
    if (value == nullptr) {
        wrong(name, given.at(name), "a list of strings");
    }
    Texts result;
    for (const std::string& item : *value) {
        if (!item.empty() && std::find(result.begin(), result.end(), item) == result.end()) {
            result.push_back(item);
        }
    }
    return result;
}

inline std::size_t choice(const Given& given, const std::string& name, const Texts& choices)
{
    const auto* value = std::get_if<std::string>(&given.at(name));
    const auto found = value == nullptr ? choices.end() : std::find(choices.begin(), choices.end(), *value);
    if (found == choices.end()) {
        std::string expected;
        for (const std::string& item : choices) {
            expected += (expected.empty() ? "one of " : ", ") + item;
        }
        wrong(name, given.at(name), expected);
    }
    return static_cast<std::size_t>(found - choices.begin());
}

/* Saturates: a timeout of a million years is none. */
inline std::uint64_t microseconds(double seconds)
{
    const double value = std::round(seconds * 1e6);
    return value >= 9e18 ? UINT64_MAX : static_cast<std::uint64_t>(value);
}

inline std::uint64_t timeout(const Given& given, const std::string& name)
{
    const double seconds = seconds_or_zero(given, name);
    return seconds > 0.0 ? std::max<std::uint64_t>(microseconds(seconds), 1) : UINT64_MAX;
}

[[noreturn]] inline void unknown_name(
    const std::string& parameter, const std::string& name, const char* what, const Texts& known)
{
    std::string there;
    for (const std::string& item : known) {
        there += (there.empty() ? "there is " : ", ") + item;
    }
    throw ParameterError("parameter '" + parameter + "': '" + name + "' is not " + what + "; "
        + (there.empty() ? std::string("there is none") : there));
}

/* The entries that a word names, which must be some. */
inline std::vector<int> named(const std::string& parameter, const std::string& word,
    const std::vector<Nameable>& known, bool by_identifier, const char* what)
{
    std::vector<int> found;
    Texts there;
    for (const Nameable& item : known) {
        const char* name = by_identifier ? item.identifier : item.name;
        if (word == name) {
            found.push_back(item.number);
        }
        if (std::find(there.begin(), there.end(), name) == there.end()) {
            there.emplace_back(name);
        }
    }
    if (found.empty()) {
        unknown_name(parameter, word, what, there);
    }
    return found;
}

inline bool is_prefix(const std::string& text)
{
    bool is_start = false;
    for (std::size_t k = 0; k < text.size(); k++) {
        const char one = text[k];
        const bool is_letter = (one >= 'a' && one <= 'z') || (one >= 'A' && one <= 'Z') || one == '_';
        const bool is_digit = one >= '0' && one <= '9';
        if (k == 0 ? one != '/' : is_start ? !is_letter : !(one == '/' || is_letter || is_digit)) {
            return false;
        }
        is_start = one == '/';
    }
    return !is_start;
}

inline std::string prefix(const Given& given)
{
    std::string value = text(given, "topic_prefix");
    while (!value.empty() && value.back() == '/') {
        value.pop_back();
    }
    if (!value.empty() && !is_prefix(value)) {
        wrong("topic_prefix", value, "empty or the beginning of a topic name, such as \"/robot1\"");
    }
    return value;
}

inline void set_ages(const Given& given, const std::vector<Nameable>& sensors, robot_settings_t& settings)
{
    for (const std::string& entry : texts(given, "max_age")) {
        const std::size_t mark = entry.rfind('=');
        const std::string identifier = mark == std::string::npos ? "" : entry.substr(0, mark);
        const std::string number_part = mark == std::string::npos ? "" : entry.substr(mark + 1);
        char* end = nullptr;
        const double age = std::strtod(number_part.c_str(), &end);
        if (identifier.empty() || number_part.empty() || *end != '\0' || !(age > 0.0) || std::isinf(age)) {
            wrong("max_age", entry, "topic=seconds, such as /scan=0.5");
        }
        for (const int sensor : named("max_age", identifier, sensors, true, "the identifier of an outgoing message")) {
            settings.max_age_us[sensor] = std::max<std::uint64_t>(microseconds(age), 1);
        }
    }
}

}  // namespace detail

/* Valid parameters; throws ParameterError. */
inline Parameters validated(const Given& given, const std::vector<Nameable>& requests,
    const std::vector<Nameable>& sensors, const std::vector<Nameable>& sent)
{
    Parameters result;
    robot_settings_t& settings = result.settings;
    robot_default_settings(&settings);
    result.period_s = detail::number(given.at("period"));
    if (!(result.period_s >= 0.0001 && result.period_s <= 3600.0)) {
        detail::wrong("period", given.at("period"), "0.0001 seconds or more, and at most 3600 seconds");
    }
#if ROBOT_IS_LAYER
    static_cast<void>(requests);
    settings.command_timeout_us = detail::microseconds(detail::seconds_or_zero(given, "command_timeout"));
#else
#if ROBOT_HAS_STRATEGY
    settings.policy
        = static_cast<robot_policy_t>(detail::choice(given, "policy", {"fair", "priority", "random", "strategy"}));
#else
    settings.policy = static_cast<robot_policy_t>(detail::choice(given, "policy", {"fair", "priority", "random"}));
#endif
    for (const std::string& name : detail::texts(given, "priority")) {
        const int number = detail::named("priority", name, requests, false, "a request").front();
        settings.priority[settings.priority_count++] = static_cast<robot_communication_t>(number);
    }
    const auto* seed = std::get_if<std::int64_t>(&given.at("seed"));
    if (seed == nullptr) {
        detail::wrong("seed", given.at("seed"), "an integer");
    }
    settings.seed = static_cast<std::uint64_t>(*seed);
    settings.decides_after_batch = detail::choice(given, "every", {"period", "event"}) == 1;
#endif
    settings.on_unknown
        = static_cast<robot_on_unknown_t>(detail::choice(given, "on_unknown", {"default", "keep", "fault"}));
    settings.service_timeout_us = detail::timeout(given, "service_timeout");
    settings.action_timeout_us = detail::timeout(given, "action_timeout");
    settings.cancel_timeout_us = detail::microseconds(detail::seconds_or_zero(given, "cancel_timeout"));
#if ROBOT_HAS_STRATEGY
    settings.assumption_timeout_us = detail::microseconds(detail::seconds_or_zero(given, "assumption_timeout"));
#endif
    for (bool& releases : settings.releases) {
        releases = false;
    }
    for (const std::string& name : detail::texts(given, "release_identifiers")) {
        for (const int topic :
            detail::named("release_identifiers", name, sent, true, "the identifier of an incoming message")) {
            settings.releases[topic] = true;
        }
    }
    detail::set_ages(given, sensors, settings);
    result.server_wait_s = detail::seconds_or_zero(given, "server_wait");
    result.resample_scans = detail::boolean(given, "resample_scans");
    result.topic_prefix = detail::prefix(given);
    result.log_folder = detail::text(given, "log_folder");
    result.publish_state = detail::boolean(given, "publish_state");
    if (given.count("state_message") > 0) {
        result.state_message
            = static_cast<StateMessage>(detail::choice(given, "state_message", {"json", "typed", "both"}));
    }
    return result;
}

/* A topic's, service's or action's name on the wire; private ones (`~/x`) belong to the node and get no prefix. */
inline std::string prefixed(const std::string& prefix, const std::string& identifier)
{
    if (prefix.empty() || identifier.front() == '~') {
        return identifier;
    }
    return prefix + "/" + identifier.substr(identifier.find_first_not_of('/'));
}

}  // namespace robosc
