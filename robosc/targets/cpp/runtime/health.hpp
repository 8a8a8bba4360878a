/* Report on /diagnostics about the controller. */

#pragma once

#include <cstdint>
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

/* Simulated time that stands still for so long is worth a warning. */
constexpr std::uint64_t STILL_US = 3000000;

/* Watch of simulated time, without which stamps are zero and nothing may be decided. */
class ClockWatch {
public:
    /* Why no time passes, in words; empty if it does. The time of ROS is 0 before the first message on /clock. */
    std::string trouble(std::int64_t now_ns, std::uint64_t steady_us)
    {
        if (now_ns != seen_ns_) {
            moved_us_ = steady_us;
            seen_ns_ = now_ns;
        }
        if (now_ns == 0) {
            return "use_sim_time is true, and no time has come on /clock";
        }
        return steady_us >= moved_us_ + STILL_US ? "use_sim_time is true, and the time of /clock stands still" : "";
    }

private:
    std::int64_t seen_ns_ = 0;
    std::uint64_t moved_us_ = 0;
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
