/* The goals of one action, through actionlib. */

#pragma once

#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <actionlib/client/action_client.h>
#include <actionlib_msgs/GoalStatusArray.h>

#include "ros1.hpp"

namespace robosc {

/* A server that still reports a goal as running so long after its cancel does not mean to cancel it. */
constexpr std::uint64_t REFUSAL_US = 1000000;
/* A goal whose receipt, or whose result after its end, was not heard of for so long is lost. */
constexpr std::uint64_t SILENCE_US = 5000000;

template <class Action>
class ActionGoals {
public:
    ACTION_DEFINITION(Action)
    using Handle = actionlib::ClientGoalHandle<Action>;
    using TakeResult = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Result&, Notes&);
    using TakeFeedback = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Feedback&, Notes&);

    ActionGoals(std::shared_ptr<Shared> shared, const std::string& name, TakeResult result, TakeFeedback feedback)
        : shared_(std::move(shared)), result_(result), feedback_(feedback)
    {
        const auto [handle, rest] = place(shared_, name);
        name_ = handle.resolveName(rest);
        client_ = std::make_unique<actionlib::ActionClient<Action>>(handle, rest, &shared_->queue);
        /* The client comes first: when a message counts as heard, it has reported what it says about goals. */
        ros::NodeHandle listener = handle;
        const boost::function<void(const actionlib_msgs::GoalStatusArray::ConstPtr&)> hear
            = [this](const actionlib_msgs::GoalStatusArray::ConstPtr&) { heard_us_ = now_us(); };
        statuses_ = listener.subscribe<actionlib_msgs::GoalStatusArray>(rest + "/status", 100, hear);
    }

    const std::string& name() const { return name_; }

    bool is_ready() const { return client_->isServerConnected(); }

    void send(std::uint32_t id, const Goal& goal)
    {
        if (!is_ready()) {
            end(id, ROBOT_OUTCOME_LOST);
            return;
        }
        Handle handle = client_->sendGoal(
            goal, [this, id](Handle handle) { changed(id, handle); },
            [this, id](Handle, const FeedbackConstPtr& feedback) { on_feedback(id, feedback); });
        goals_[id] = Sent{handle, now_us()};
    }

    /* Ask for the cancel of an accepted goal; there is no answer. Its end may be known here and wait to be reported. */
    void cancel(std::uint32_t id)
    {
        const auto found = goals_.find(id);
        if (found != goals_.end()) {
            found->second.is_cancelled = !has_heard_cancel(found->second.handle.getCommState());
            found->second.cancelled_us = now_us();
            found->second.handle.cancel();
        }
    }

    /* Notice a lost server, one that is back, goals that nothing is heard of, and cancels that are ignored. */
    void check(std::uint64_t now)
    {
        ended_.clear();
        if (goals_.empty()) {
            presence_.forget();
        } else if (presence_.is_lost(is_ready(), now)) {
            while (!goals_.empty()) {
                abandon(goals_.begin()->first);
            }
        }
        for (const std::uint32_t id : silent(now)) {
            abandon(id);
        }
        for (auto& [id, goal] : goals_) {
            /* Its server goes on to report, and has not taken notice of the cancel. */
            if (goal.is_cancelled && heard_us_ >= goal.cancelled_us + REFUSAL_US) {
                goal.is_cancelled = false;
                refuse(id);
            }
        }
        /* A lost goal that runs on would never be stopped otherwise. */
        if (!abandoned_.empty() && is_ready()) {
            cancel_abandoned();
        }
    }

    bool has_abandoned() const { return !abandoned_.empty(); }

    /* Ask for the cancel of every goal that was reported lost; a server that is seen has heard it. */
    void cancel_abandoned()
    {
        const bool is_heard = is_ready();
        for (auto& [id, handle] : abandoned_) {
            handle.cancel();
            if (is_heard) {
                ended_.push_back(handle);
            }
        }
        if (is_heard) {
            abandoned_.clear();
        }
    }

private:
    struct Sent {
        Handle handle;
        /* Time at which something was heard of it last, in microseconds. */
        std::uint64_t since_us = 0;
        bool is_accepted = false;
        /* Its cancel was asked for then, and not heard of. */
        bool is_cancelled = false;
        std::uint64_t cancelled_us = 0;
    };

    static bool has_heard_cancel(const actionlib::CommState& state)
    {
        return state == actionlib::CommState::WAITING_FOR_RESULT || state == actionlib::CommState::RECALLING
            || state == actionlib::CommState::PREEMPTING || state == actionlib::CommState::DONE;
    }

    /* The goals whose receipt or result nothing was heard of for too long. */
    std::vector<std::uint32_t> silent(std::uint64_t now) const
    {
        std::vector<std::uint32_t> found;
        for (const auto& [id, goal] : goals_) {
            const actionlib::CommState state = goal.handle.getCommState();
            if ((state == actionlib::CommState::WAITING_FOR_GOAL_ACK
                    || state == actionlib::CommState::WAITING_FOR_RESULT)
                && now >= goal.since_us + SILENCE_US) {
                found.push_back(id);
            }
        }
        return found;
    }

    /* Report a goal as lost, and keep it: it may be running, or on its way to the server. */
    void abandon(std::uint32_t id)
    {
        abandoned_.emplace(id, goals_.at(id).handle);
        goals_.erase(id);
        end(id, ROBOT_OUTCOME_LOST);
    }

    void changed(std::uint32_t id, Handle handle)
    {
        const auto found = goals_.find(id);
        if (found == goals_.end()) {
            if (handle.getCommState() == actionlib::CommState::DONE) {
                forget_abandoned(id);
            }
            return;
        }
        const actionlib::CommState state = handle.getCommState();
        found->second.since_us = now_us();
        if (has_heard_cancel(state)) {
            found->second.is_cancelled = false;
        }
        if (state == actionlib::CommState::DONE) {
            finish(id, handle);
            /* A handle must not be let go of in its own callback. */
            ended_.push_back(found->second.handle);
            goals_.erase(found);
        } else if (!found->second.is_accepted && state != actionlib::CommState::WAITING_FOR_GOAL_ACK
            && state != actionlib::CommState::WAITING_FOR_CANCEL_ACK) {
            accept(id, found->second);
        }
    }

    void accept(std::uint32_t id, Sent& goal)
    {
        goal.is_accepted = true;
        shared_->report([id](robot_t* robot, std::uint64_t now, Notes&) { robot_goal_accepted(robot, now, id); });
    }

    void finish(std::uint32_t id, Handle& handle)
    {
        const auto result = handle.getResult();
        const actionlib::TerminalState state = handle.getTerminalState();
        if (state == actionlib::TerminalState::SUCCEEDED && result) {
            shared_->report([take = result_, id, result](robot_t* robot, std::uint64_t now, Notes& notes) {
                take(robot, now, id, *result, notes);
            });
            return;
        }
        robot_outcome_t outcome = ROBOT_OUTCOME_ABORTED;
        if (state == actionlib::TerminalState::PREEMPTED || state == actionlib::TerminalState::RECALLED) {
            outcome = ROBOT_OUTCOME_CANCELLED;
        } else if (state == actionlib::TerminalState::REJECTED) {
            outcome = ROBOT_OUTCOME_REJECTED;
        } else if (state == actionlib::TerminalState::LOST) {
            outcome = ROBOT_OUTCOME_LOST;
        }
#if ROBOT_IS_LAYER
        end(id, outcome, result);
#else
        end(id, outcome);
#endif
    }

    void on_feedback(std::uint32_t id, const FeedbackConstPtr& feedback)
    {
        if (goals_.find(id) != goals_.end()) {
            shared_->report([take = feedback_, id, feedback](robot_t* robot, std::uint64_t now, Notes& notes) {
                take(robot, now, id, *feedback, notes);
            });
        }
    }

    void forget_abandoned(std::uint32_t id)
    {
        const auto found = abandoned_.find(id);
        if (found != abandoned_.end()) {
            ended_.push_back(found->second);
            abandoned_.erase(found);
        }
    }

    void refuse(std::uint32_t id)
    {
        shared_->report(
            [id](robot_t* robot, std::uint64_t now, Notes&) { robot_cancel_refused(robot, now, id, false); });
    }

#if ROBOT_IS_LAYER
    void end(std::uint32_t id, robot_outcome_t outcome, const ResultConstPtr& result = {})
    {
        shared_->report([id, outcome, result](robot_t* robot, std::uint64_t now, Notes&) {
            robot_goal_ended(robot, now, id, outcome, result.get());
        });
    }
#else
    void end(std::uint32_t id, robot_outcome_t outcome)
    {
        shared_->report([id, outcome](robot_t* robot, std::uint64_t now, Notes&) {
            robot_goal_ended(robot, now, id, outcome);
        });
    }
#endif

    std::shared_ptr<Shared> shared_;
    TakeResult result_;
    TakeFeedback feedback_;
    std::string name_;
    std::unique_ptr<actionlib::ActionClient<Action>> client_;
    std::map<std::uint32_t, Sent> goals_;
    std::map<std::uint32_t, Handle> abandoned_;
    std::list<Handle> ended_;
    ros::Subscriber statuses_;
    std::uint64_t heard_us_ = 0;
    Presence presence_;
};

}  // namespace robosc
