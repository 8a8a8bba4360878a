/* The goals of one action, through actionlib. */

#pragma once

#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <actionlib/client/action_client.h>

#include "ros1.hpp"

namespace robosc {

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
    }

    const std::string& name() const { return name_; }

    bool is_ready() const { return client_->isServerConnected(); }

    void send(std::uint32_t id, const Goal& goal)
    {
        if (!is_ready()) {
            end(id);
            return;
        }
        goals_[id].handle = client_->sendGoal(
            goal, [this, id](Handle handle) { changed(id, handle); },
            [this, id](Handle, const FeedbackConstPtr& feedback) { told(id, feedback); });
    }

    void cancel(std::uint32_t id)
    {
        const auto found = goals_.find(id);
        if (found != goals_.end()) {
            found->second.handle.cancel();
        }
    }

    /* Notice a lost server, and one that is back. */
    void check(std::uint64_t now)
    {
        ended_.clear();
        if (goals_.empty()) {
            presence_.forget();
        } else if (presence_.is_lost(is_ready(), now)) {
            for (auto& [id, goal] : goals_) {
                end(id);
                abandoned_.emplace(id, goal.handle);
            }
            goals_.clear();
        }
        /* Nobody else would ever stop a lost goal that runs on. */
        if (!abandoned_.empty() && is_ready()) {
            cancel_abandoned();
        }
    }

    bool has_abandoned() const { return !abandoned_.empty(); }

    /* Ask for the cancel of every goal that was told to be lost; who is seen has heard it. */
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
        bool is_accepted = false;
    };

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
        if (handle.getTerminalState() == actionlib::TerminalState::SUCCEEDED && result) {
            shared_->report([take = result_, id, result](robot_t* robot, std::uint64_t now, Notes& notes) {
                take(robot, now, id, *result, notes);
            });
        } else {
            end(id);
        }
    }

    void told(std::uint32_t id, const FeedbackConstPtr& feedback)
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

    void end(std::uint32_t id)
    {
        shared_->report([id](robot_t* robot, std::uint64_t now, Notes&) { robot_goal_ended(robot, now, id); });
    }

    std::shared_ptr<Shared> shared_;
    TakeResult result_;
    TakeFeedback feedback_;
    std::string name_;
    std::unique_ptr<actionlib::ActionClient<Action>> client_;
    std::map<std::uint32_t, Sent> goals_;
    std::map<std::uint32_t, Handle> abandoned_;
    std::list<Handle> ended_;
    Presence presence_;
};

}  // namespace robosc
