/* The state as others see it: in the event log and on the topic state as JSON, or as a typed message. */

#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "../model.hpp"
#include "json.hpp"

namespace robosc {

/* A value as the model writes it. */
template <class T>
std::string value_text(T value)
{
    if constexpr (std::is_same<T, bool>::value) {
        return value ? "true" : "false";
    } else if constexpr (std::is_floating_point<T>::value) {
        return number_text(value);
    } else if constexpr (std::is_pointer<T>::value) {
        return value;
    } else {
        return std::to_string(value);
    }
}

/* A name and its value, as the model writes them. */
struct NamedValue {
    std::string name;
    std::string value;
};

struct ComponentState {
    std::string name;
    std::string state;
    std::vector<NamedValue> variables;
};

/* A report about the state; a visitor of the model's state. */
struct StateReport {
    const char* status = "";
    std::vector<std::string> reasons;
    std::vector<ComponentState> components;
    /* Location of each service and action. */
    std::vector<NamedValue> communications;
    /* Actions whose goal is to be cancelled and has not ended. */
    std::vector<std::string> cancelling;
    /* Numbers of the transitions taken since the last report. */
    std::vector<int> transitions;
    /* Progress of the strategy as JSON; empty: there is none. */
    std::string progress;

    void component(const char* name, const char* state) { components.push_back({name, state, {}}); }

    template <class T>
    void variable(const char* name, T value)
    {
        components.back().variables.push_back({name, value_text(value)});
    }

    void communication(const char* name, const char* location) { communications.push_back({name, location}); }
};

/* A visitor that writes the state as JSON, for the event log. */
class StateJson {
public:
    explicit StateJson(std::string& out) : out_(out) { out_ += '{'; }

    void component(const char* name, const char* state)
    {
        out_ += end_;
        put_json(out_, name);
        out_ += ":{\"state\":";
        put_json(out_, state);
        out_ += ",\"variables\":{";
        between_ = "";
        end_ = "}},";
    }

    template <class T>
    void variable(const char* name, T value)
    {
        out_ += between_;
        put_json(out_, name);
        out_ += ':';
        put_json(out_, value);
        between_ = ",";
    }

    void finish() { out_ += *end_ == '\0' ? "}" : "}}}"; }

private:
    std::string& out_;
    const char* between_ = "";
    const char* end_ = "";
};

namespace detail {

inline void put_values(std::string& out, const std::vector<NamedValue>& values)
{
    const char* between = "";
    out += '{';
    for (const NamedValue& item : values) {
        out += between;
        put_json(out, item.name);
        out += ':';
        put_json(out, item.value);
        between = ",";
    }
    out += '}';
}

}  // namespace detail

/* The text for the topic state. */
inline std::string state_json(const StateReport& report)
{
    std::string text = "{\"current\": {";
    const char* between = "";
    for (const ComponentState& item : report.components) {
        text += between;
        put_json(text, item.name);
        text += ":{\"state\":";
        put_json(text, item.state);
        text += ",\"variables\":";
        detail::put_values(text, item.variables);
        text += '}';
        between = ",";
    }
    text += "}, \"communications\": ";
    detail::put_values(text, report.communications);
    text += ", \"transitions\": [";
    between = "";
    for (const int number : report.transitions) {
        text += between + std::to_string(number);
        between = ", ";
    }
    text += "], \"cancelling\": [";
    between = "";
    for (const std::string& name : report.cancelling) {
        text += between;
        put_json(text, name);
        between = ", ";
    }
    text += "], ";
    if (!report.progress.empty()) {
        text += "\"progress\": " + report.progress + ", ";
    }
    return text + "\"definition\": " + model::DEFINITION + "}";
}

/* Fill in a robosc_msgs/SupervisorState, but for its stamp. */
template <class Message>
void fill_state(Message& message, const StateReport& report)
{
    const auto fill_values = [](auto& fields, const std::vector<NamedValue>& values) {
        fields.resize(values.size());
        for (std::size_t k = 0; k < values.size(); k++) {
            fields[k].name = values[k].name;
            fields[k].value = values[k].value;
        }
    };
    message.robot = model::ROBOT;
    message.status = report.status;
    message.reasons = report.reasons;
    message.components.resize(report.components.size());
    for (std::size_t k = 0; k < report.components.size(); k++) {
        message.components[k].name = report.components[k].name;
        message.components[k].state = report.components[k].state;
        fill_values(message.components[k].variables, report.components[k].variables);
    }
    fill_values(message.communications, report.communications);
    message.cancelling = report.cancelling;
    message.transitions.assign(report.transitions.begin(), report.transitions.end());
}

}  // namespace robosc
