/* The goals of one action, through rclcpp_action: nothing waits, and every end is reported to the engine. */

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <rclcpp_action/rclcpp_action.hpp>

#include "ros2.hpp"

namespace robosc {

/* Time after a refused cancel during which the goal's end may still be on its way, in microseconds. */
constexpr std::uint64_t REFUSAL_US = 250000;

template <class Action>
class ActionGoals {
public:
    using Client = rclcpp_action::Client<Action>;
    using Handle = typename rclcpp_action::ClientGoalHandle<Action>::SharedPtr;
    using WrappedResult = typename rclcpp_action::ClientGoalHandle<Action>::WrappedResult;
    using Goal = typename Action::Goal;
    using Result = typename Action::Result;
    using Feedback = typename Action::Feedback;
    using TakeResult = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Result&, Notes&);
    using TakeFeedback = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Feedback&, Notes&);

    ActionGoals(rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group, NodeTime& time,
        Reports& reports, const Parameters& parameters, const std::string& name, TakeResult result,
        TakeFeedback feedback)
        : time_(time)
        , reports_(reports)
        , name_(prefixed(parameters.topic_prefix, name))
        , result_(result)
        , feedback_(feedback)
        , client_(rclcpp_action::create_client<Action>(&node, name_, group))
    {
    }

    const std::string& name() const { return name_; }

    bool is_ready() const { return client_->action_server_is_ready(); }

    void send(std::uint32_t id, const Goal& goal)
    {
        if (!is_ready()) {
            end(id, ROBOT_OUTCOME_LOST);
            return;
        }
        typename Client::SendGoalOptions options;
        options.goal_response_callback = [this, id](Handle handle) { answered(id, handle); };
        options.feedback_callback
            = [this, id](Handle, const std::shared_ptr<const Feedback> feedback) { on_feedback(id, feedback); };
        options.result_callback = [this, id](const WrappedResult& result) { came(id, result); };
        goals_[id] = Sent{};
        client_->async_send_goal(goal, options);
    }

    /* Ask for the cancel of an accepted goal. Its end may be known here and wait to be reported. */
    void cancel(std::uint32_t id)
    {
        const auto found = goals_.find(id);
        if (found != goals_.end() && found->second.handle) {
            ask(found->second.handle, [this, id](const auto& response) { cancel_answered(id, *response); });
        }
    }

    /* Notice a lost server, one that is back, and refused cancels of goals that do not end. */
    void check(std::uint64_t now)
    {
        if (goals_.empty()) {
            presence_.forget();
        } else if (presence_.is_lost(is_ready(), now)) {
            for (const auto& [id, goal] : std::exchange(goals_, {})) {
                if (goal.handle) {
                    abandoned_[id] = Abandoned{goal.handle, false};
                }
                end(id, ROBOT_OUTCOME_LOST);
            }
        }
        look_for_server();
        for (auto& [id, goal] : goals_) {
            if (goal.is_refused && now >= goal.refused_us + REFUSAL_US) {
                goal.is_refused = false;
                if (goal.is_unknown) {
                    gone_.push_back(id);
                } else {
                    refuse(id, false);
                }
            }
        }
        for (const std::uint32_t id : std::exchange(gone_, {})) {
            goals_.erase(id);
            end(id, ROBOT_OUTCOME_LOST);
        }
    }

    bool has_abandoned() const { return !abandoned_.empty(); }

    /* Ask for the cancel of every goal that was reported lost: its server may be there and only be unseen. */
    void cancel_abandoned()
    {
        for (auto& [id, goal] : std::map<std::uint32_t, Abandoned>(abandoned_)) {
            cancel_one(id);
        }
    }

private:
    struct Sent {
        Handle handle;
        std::uint64_t refused_us = 0;
        bool is_refused = false;
        bool is_unknown = false;
    };

    struct Abandoned {
        Handle handle;
        bool is_asked = false;
    };

    using CancelResponse = typename Client::CancelResponse;

    template <class Callback>
    void ask(const Handle& handle, const Callback& callback)
    {
        try {
            client_->async_cancel_goal(
                handle, [callback](typename CancelResponse::SharedPtr response) { callback(response); });
        } catch (const rclcpp_action::exceptions::UnknownGoalHandleError&) {
            /* It has ended, which is about to be reported. */
        }
    }

    void look_for_server()
    {
        if (abandoned_.empty()) {
            return;
        }
        const bool is_there = is_ready();
        for (auto& [id, goal] : std::map<std::uint32_t, Abandoned>(abandoned_)) {
            if (!is_there) {
                abandoned_[id].is_asked = false;
            } else if (!goal.is_asked) {
                cancel_one(id);
            }
        }
    }

    void cancel_one(std::uint32_t id)
    {
        Abandoned& goal = abandoned_[id];
        goal.is_asked = true;
        /* The server has heard it, whatever it says. */
        ask(Handle(goal.handle), [this, id](const auto&) { abandoned_.erase(id); });
    }

    /* The server accepted or rejected a goal. */
    void answered(std::uint32_t id, const Handle& handle)
    {
        const auto found = goals_.find(id);
        if (!handle) {
            if (found != goals_.end()) {
                goals_.erase(found);
                end(id, ROBOT_OUTCOME_REJECTED);
            }
        } else if (found == goals_.end()) {
            /* Its server counted as lost: nobody would ever stop this one. */
            abandoned_[id] = Abandoned{handle, false};
            cancel_one(id);
        } else {
            found->second.handle = handle;
            reports_.add([id](robot_t* robot, std::uint64_t now, Notes&) { robot_goal_accepted(robot, now, id); });
        }
    }

    void on_feedback(std::uint32_t id, const std::shared_ptr<const Feedback>& feedback)
    {
        if (goals_.find(id) != goals_.end()) {
            reports_.add([take = feedback_, id, feedback](robot_t* robot, std::uint64_t now, Notes& notes) {
                take(robot, now, id, *feedback, notes);
            });
        }
    }

    void came(std::uint32_t id, const WrappedResult& result)
    {
        if (goals_.erase(id) == 0) {
            /* It was reported lost; now it has really ended. */
            abandoned_.erase(id);
        } else if (result.code == rclcpp_action::ResultCode::SUCCEEDED) {
            reports_.add([take = result_, id, data = result.result](robot_t* robot, std::uint64_t now, Notes& notes) {
                take(robot, now, id, *data, notes);
            });
        } else {
            const bool is_cancelled = result.code == rclcpp_action::ResultCode::CANCELED;
            const robot_outcome_t outcome = is_cancelled ? ROBOT_OUTCOME_CANCELLED : ROBOT_OUTCOME_ABORTED;
#if ROBOT_IS_LAYER
            end(id, outcome, result.result);
#else
            end(id, outcome);
#endif
        }
    }

    void cancel_answered(std::uint32_t id, const CancelResponse& response)
    {
        const auto found = goals_.find(id);
        if (found == goals_.end() || !response.goals_canceling.empty()) {
            return;
        }
        if (response.return_code == CancelResponse::ERROR_GOAL_TERMINATED) {
            refuse(id, true);
        } else {
            /* The server may say so because the goal has just ended: its result may be on its way. */
            found->second.is_refused = true;
            found->second.refused_us = time_.us();
            found->second.is_unknown = response.return_code == CancelResponse::ERROR_UNKNOWN_GOAL_ID;
        }
    }

    void refuse(std::uint32_t id, bool has_ended)
    {
        reports_.add([id, has_ended](robot_t* robot, std::uint64_t now, Notes&) {
            robot_cancel_refused(robot, now, id, has_ended);
        });
    }

#if ROBOT_IS_LAYER
    void end(std::uint32_t id, robot_outcome_t outcome, const std::shared_ptr<const Result>& result = nullptr)
    {
        reports_.add([id, outcome, result](robot_t* robot, std::uint64_t now, Notes&) {
            robot_goal_ended(robot, now, id, outcome, result.get());
        });
    }
#else
    void end(std::uint32_t id, robot_outcome_t outcome)
    {
        reports_.add([id, outcome](robot_t* robot, std::uint64_t now, Notes&) {
            robot_goal_ended(robot, now, id, outcome);
        });
    }
#endif

    NodeTime& time_;
    Reports& reports_;
    std::string name_;
    TakeResult result_;
    TakeFeedback feedback_;
    typename Client::SharedPtr client_;
    std::map<std::uint32_t, Sent> goals_;
    std::map<std::uint32_t, Abandoned> abandoned_;
    std::vector<std::uint32_t> gone_;
    Presence presence_;
};

}  // namespace robosc
