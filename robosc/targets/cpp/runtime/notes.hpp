/* Notes of the event log about the data of events. */

#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "../engine.h"

namespace robosc {

/* The data of events under way, as JSON for the log. */
class Notes {
public:
    bool is_active = false;

    void note(int event, std::string json) { data_[static_cast<std::size_t>(event)] = std::move(json); }

    const std::string& of(int event) const { return data_[static_cast<std::size_t>(event)]; }

    void clear()
    {
        if (is_active) {
            for (std::string& text : data_) {
                text.clear();
            }
        }
    }

private:
    std::vector<std::string> data_ = std::vector<std::string>(ROBOT_EVENT_COUNT + 1);
};

}  // namespace robosc
