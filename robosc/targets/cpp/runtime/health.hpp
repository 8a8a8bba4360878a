/* Report on /diagnostics about the controller. */

#pragma once

#include <string>
#include <utility>
#include <vector>

#include "../model.hpp"

namespace robosc {

/* The levels of diagnostic_msgs/DiagnosticStatus. */
enum class Level { OK = 0, WARN = 1, FAULTY = 2 };

/* A report for /diagnostics. */
struct Health {
    Level level = Level::OK;
    std::string message;
    std::vector<std::pair<std::string, std::string>> values;
};

/* Fill in a diagnostic_msgs/DiagnosticArray of either ROS, but for its stamp. */
template <class Message>
void fill_health(Message& message, const Health& health, const std::string& node)
{
    message.status.resize(1);
    auto& status = message.status.front();
    status.level = static_cast<decltype(status.level)>(health.level);
#if ROBOT_IS_LAYER
    status.name = node + ": layer";
#else
    status.name = node + ": controller";
#endif
    status.message = health.message;
    status.hardware_id = model::ROBOT;
    status.values.resize(health.values.size());
    for (std::size_t k = 0; k < health.values.size(); k++) {
        status.values[k].key = health.values[k].first;
        status.values[k].value = health.values[k].second;
    }
}

}  // namespace robosc
