/* The goals of one action, through rclcpp_action: nothing waits, and every end is reported to the engine. */

#pragma once

#include <algorithm>
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
/* A goal that its server shows as ended, and whose result does not come for so long, is over. */
constexpr std::uint64_t RESULT_US = 5000000;
/* action_msgs/msg/GoalStatus. */
constexpr int SUCCEEDED = 4;
constexpr int CANCELED = 5;
constexpr int ABORTED = 6;

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

    ActionGoals(rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group, NodeTime&,
        Reports& reports, const Parameters& parameters, const std::string& name, TakeResult result,
        TakeFeedback feedback)
        : reports_(reports)
        , name_(prefixed(parameters.topic_prefix, name))
        , result_(result)
        , feedback_(feedback)
        , client_(rclcpp_action::create_client<Action>(&node, name_, group))
        , servers_(node, name_ + "/_action/status", false)
        , inquiry_(node, group, name_)
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
        goals_[id].sent_us = now_us();
        add_servers(goals_[id], servers_.look());
        client_->async_send_goal(goal, options);
    }

    /* Ask for the cancel of an accepted goal. Its end may be known here and wait to be reported. */
    void cancel(std::uint32_t id)
    {
        const auto found = goals_.find(id);
        if (found != goals_.end() && found->second.handle) {
            found->second.is_asked = true;
            ask(found->second.handle, [this, id](const auto& response) { cancel_answered(id, *response); });
        }
    }

    /* Notice a lost server, one that is back, and goals that have ended or are not cancelled. */
    void check(std::uint64_t now)
    {
        if (goals_.empty()) {
            presence_.forget();
        } else if (presence_.is_lost(is_served(), now)) {
            while (!goals_.empty()) {
                abandon(goals_.begin()->first);
            }
        }
        ask_about_goal(now);
        look_for_server();
        for (auto& [id, goal] : goals_) {
            await_result(id, goal, now);
        }
        for (auto& [id, goal] : goals_) {
            if (goal.is_refused && now >= goal.refused_us + REFUSAL_US) {
                goal.is_refused = false;
                if (goal.is_unknown) {
                    gone_.emplace_back(id, ROBOT_OUTCOME_LOST);
                } else {
                    refuse(id, false);
                }
            }
        }
        for (const auto& [id, outcome] : std::exchange(gone_, {})) {
            if (goals_.erase(id) > 0) {
                end(id, outcome);
            }
        }
    }

    void add_troubles(Texts& found, const std::map<std::string, std::vector<std::string>>& offered)
    {
        const char* const type = rosidl_generator_traits::name<typename Action::Impl::SendGoalService>();
        add_other_types(found, offered, name_, inquiry_.service("send_goal"), type);
        servers_.add_several(name_, found);
        if (!no_result_.empty()) {
            found.push_back(no_result_);
        }
        const std::uint64_t now = now_us();
        for (const auto& [id, goal] : goals_) {
            if (!goal.handle && now >= goal.sent_us + ANSWER_US) {
                found.push_back("no server of " + name_ + " has accepted or rejected a goal so far");
            } else if (goal.has_ended && now >= goal.ended_us + ANSWER_US) {
                found.push_back("the server of " + name_ + " gives no result of a goal that ended");
            }
        }
    }

    /* A goal that its server has not answered, and one whose cancel it has not answered. */
    void add_unsettled(Texts& found) const
    {
        for (const auto& [id, goal] : goals_) {
            if (!goal.handle || goal.is_asked || goal.is_refused) {
                found.push_back("a goal of " + name_ + " may be running: its server has not answered "
                    + (goal.handle ? "its cancel" : "it"));
            }
        }
    }

    /* rclcpp does not tell what a goal is called before it is accepted. */
    void cancel_unanswered() {}

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
        /* Endpoints of the servers that it was sent to; empty if none are shown. */
        std::set<std::string> servers;
        std::uint64_t sent_us = 0;
        /* Its cancel was asked for and not answered. */
        bool is_asked = false;
        std::uint64_t refused_us = 0;
        bool is_refused = false;
        bool is_unknown = false;
        /* Time of its last feedback; its server shows it as ended since then. */
        std::uint64_t heard_us = 0;
        std::uint64_t ended_us = 0;
        bool has_ended = false;
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

    static void add_servers(Sent& goal, const Endpoints::Nodes& seen)
    {
        for (const auto& [gid, node] : seen) {
            goal.servers.insert(gid);
        }
    }

    /* Whether a server that some goal was sent to is there. */
    bool is_served()
    {
        if (!is_ready()) {
            return false;
        }
        const Endpoints::Nodes& seen = servers_.seen();
        return std::any_of(goals_.begin(), goals_.end(), [&](const auto& item) {
            const std::set<std::string>& servers = item.second.servers;
            return seen.empty() || servers.empty()
                || std::any_of(
                    servers.begin(), servers.end(), [&](const std::string& gid) { return seen.count(gid) > 0; });
        });
    }

    /* Find a goal that no living server knows, where more than one server is shown: one of them may be dead, or both may
       be at work. There is at most one goal of an action at a time. */
    void ask_about_goal(std::uint64_t now)
    {
        if (servers_.seen().size() < 2 || goals_.empty() || !goals_.begin()->second.handle) {
            inquiry_.end();
            return;
        }
        const auto& [id, goal] = *goals_.begin();
        if (inquiry_.is_unknown(goal.handle->get_goal_id(), now) && now >= goal.heard_us + MEMORY_US) {
            inquiry_.end();
            abandon(std::uint32_t(id));
        }
    }

    /* End a goal whose server shows that it has ended, and gives no result. */
    void await_result(std::uint32_t id, Sent& goal, std::uint64_t now)
    {
        if (goal.handle && !goal.has_ended && goal.handle->get_status() >= SUCCEEDED) {
            goal.has_ended = true;
            goal.ended_us = now;
        } else if (goal.has_ended && now >= goal.ended_us + RESULT_US) {
            no_result_ = "the server of " + name_ + " gave no result of a goal that ended";
            /* What is not known of a success makes it a failure. */
            const int status = goal.handle->get_status();
            gone_.emplace_back(id,
                status == CANCELED      ? ROBOT_OUTCOME_CANCELLED
                    : status == ABORTED ? ROBOT_OUTCOME_ABORTED
                                        : ROBOT_OUTCOME_LOST);
        }
    }

    /* Report a goal as lost, and keep it if it was accepted: it may still be running. */
    void abandon(std::uint32_t id)
    {
        if (goals_.at(id).handle) {
            abandoned_[id] = Abandoned{goals_.at(id).handle, false};
        }
        goals_.erase(id);
        end(id, ROBOT_OUTCOME_LOST);
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
            if (!found->second.servers.empty()) {
                /* One that was found in between may be the one that accepted it. */
                add_servers(found->second, servers_.seen());
            }
            reports_.add([id](robot_t* robot, std::uint64_t now, Notes&) { robot_goal_accepted(robot, now, id); });
        }
    }

    void on_feedback(std::uint32_t id, const std::shared_ptr<const Feedback>& feedback)
    {
        const auto found = goals_.find(id);
        if (found != goals_.end()) {
            found->second.heard_us = now_us();
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
            return;
        }
        no_result_.clear();
        if (result.code == rclcpp_action::ResultCode::UNKNOWN) {
            /* It was started anew, or keeps no results. */
            no_result_ = "the server of " + name_ + " did not know a goal that it had accepted";
        }
        if (result.code == rclcpp_action::ResultCode::SUCCEEDED) {
            reports_.add([take = result_, id, data = result.result](robot_t* robot, std::uint64_t now, Notes& notes) {
                take(robot, now, id, *data, notes);
            });
        } else {
            const robot_outcome_t outcome = result.code == rclcpp_action::ResultCode::CANCELED ? ROBOT_OUTCOME_CANCELLED
                : result.code == rclcpp_action::ResultCode::ABORTED                            ? ROBOT_OUTCOME_ABORTED
                                                                                               : ROBOT_OUTCOME_LOST;
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
        if (found == goals_.end()) {
            return;
        }
        found->second.is_asked = false;
        if (!response.goals_canceling.empty()) {
            return;
        }
        if (response.return_code == CancelResponse::ERROR_GOAL_TERMINATED) {
            refuse(id, true);
        } else {
            /* The server may say so because the goal has just ended: its result may be on its way. */
            found->second.is_refused = true;
            found->second.refused_us = now_us();
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

    Reports& reports_;
    std::string name_;
    TakeResult result_;
    TakeFeedback feedback_;
    typename Client::SharedPtr client_;
    std::map<std::uint32_t, Sent> goals_;
    std::map<std::uint32_t, Abandoned> abandoned_;
    std::vector<std::pair<std::uint32_t, robot_outcome_t>> gone_;
    Presence presence_;
    std::string no_result_;
    Endpoints servers_;
    Inquiry<Action> inquiry_;
};

}  // namespace robosc
