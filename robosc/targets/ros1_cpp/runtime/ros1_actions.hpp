/* The goals of one action, through actionlib. */

#pragma once

#include <algorithm>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <actionlib/client/client_helpers.h>
#include <actionlib/client/connection_monitor.h>
#include <actionlib/destruction_guard.h>
#include <actionlib_msgs/GoalID.h>
#include <actionlib_msgs/GoalStatusArray.h>

#include "ros1.hpp"

namespace robosc {

/* A server that still reports a goal as running so long after its cancel does not mean to cancel it. */
constexpr std::uint64_t REFUSAL_US = 1000000;
/* A goal whose receipt, or whose result after its end, was not heard of for so long is lost. */
constexpr std::uint64_t SILENCE_US = 5000000;
/* A server that reports for so long without naming a goal that was sent to it does not have it. */
constexpr std::uint64_t UNLISTED_US = 2500000;

/* A client of an action as actionlib's, made of its parts: it does not take a goal for lost as soon as another server
   of that name reports without it, and does not wait for simulated time. */
template <class Action>
class ActionClient {
public:
    ACTION_DEFINITION(Action)
    using Handle = actionlib::ClientGoalHandle<Action>;
    using Transition = boost::function<void(Handle)>;
    using TakeFeedback = boost::function<void(Handle, const FeedbackConstPtr&)>;

    ActionClient(const ros::NodeHandle& node, const std::string& name, ros::CallbackQueue* queue)
        : node_(node, name), guard_(boost::make_shared<actionlib::DestructionGuard>()), manager_(guard_)
    {
        node_.setCallbackQueue(queue);
        statuses_ = listen<actionlib_msgs::GoalStatusArray>(
            "status", [this](const ros::MessageEvent<const actionlib_msgs::GoalStatusArray>& event) {
                take_status(event.getConstMessage(), event.getPublisherName());
            });
        feedbacks_ = listen<ActionFeedback>("feedback", [this](const ros::MessageEvent<const ActionFeedback>& event) {
            manager_.updateFeedbacks(event.getConstMessage());
        });
        results_ = listen<ActionResult>("result", [this](const ros::MessageEvent<const ActionResult>& event) {
            manager_.updateResults(event.getConstMessage());
        });
        using Monitor = actionlib::ConnectionMonitor;
        monitor_ = boost::make_shared<Monitor>(feedbacks_, results_);
        goals_ = advertise<ActionGoal>("goal", &Monitor::goalConnectCallback, &Monitor::goalDisconnectCallback);
        cancels_ = advertise<actionlib_msgs::GoalID>(
            "cancel", &Monitor::cancelConnectCallback, &Monitor::cancelDisconnectCallback);
        manager_.registerSendGoalFunc([this](const ActionGoalConstPtr& goal) {
            sent_ = goal->goal_id.id;
            goals_.publish(goal);
        });
        manager_.registerCancelFunc([this](const actionlib_msgs::GoalID& goal) { cancels_.publish(goal); });
    }

    ActionClient(const ActionClient&) = delete;
    ActionClient& operator=(const ActionClient&) = delete;

    ~ActionClient() { guard_->destruct(); }

    bool is_ready() const { return monitor_->isServerConnected(); }

    Handle send(const Goal& goal, const Transition& changed, const TakeFeedback& feedback)
    {
        owner_.clear();
        return manager_.initGoal(goal, changed, feedback);
    }

    /* Names of the nodes that have reported since a time. */
    std::set<std::string> reporters(std::uint64_t since_us) const
    {
        std::set<std::string> found;
        for (const auto& [name, heard_us] : heard_us_) {
            if (heard_us >= since_us) {
                found.insert(name);
            }
        }
        return found;
    }

    /* Time of the last report that the goals of this client were told of. */
    std::uint64_t heard_us() const { return told_us_; }

private:
    void take_status(const actionlib_msgs::GoalStatusArrayConstPtr& statuses, const std::string& reporter)
    {
        const std::uint64_t now = now_us();
        heard_us_[reporter] = now;
        const auto is_own
            = [this](const actionlib_msgs::GoalStatus& status) { return !sent_.empty() && status.goal_id.id == sent_; };
        if (std::any_of(statuses->status_list.begin(), statuses->status_list.end(), is_own)) {
            owner_ = reporter;
        } else if (!owner_.empty() && owner_ != reporter && now < heard_us_[owner_] + LOST_US) {
            return;
        }
        monitor_->processStatus(statuses, reporter);
        manager_.updateStatuses(statuses);
        told_us_ = now;
    }

    template <class Message, class Take>
    ros::Subscriber listen(const std::string& topic, const Take& take)
    {
        const boost::function<void(const ros::MessageEvent<const Message>&)> callback = take;
        return node_.subscribe<Message>(topic, 0, callback);
    }

    using Change = void (actionlib::ConnectionMonitor::*)(const ros::SingleSubscriberPublisher&);

    template <class Message>
    ros::Publisher advertise(const std::string& topic, Change joins, Change leaves)
    {
        const auto call = [this](Change change) -> ros::SubscriberStatusCallback {
            return [this, change](const ros::SingleSubscriberPublisher& peer) { ((*monitor_).*change)(peer); };
        };
        return node_.advertise<Message>(topic, 10, call(joins), call(leaves));
    }

    ros::NodeHandle node_;
    boost::shared_ptr<actionlib::DestructionGuard> guard_;
    actionlib::GoalManager<Action> manager_;
    ros::Subscriber feedbacks_;
    ros::Subscriber results_;
    boost::shared_ptr<actionlib::ConnectionMonitor> monitor_;
    ros::Publisher goals_;
    ros::Publisher cancels_;
    ros::Subscriber statuses_;
    /* Id of the last goal, and the node that named it last. */
    std::string sent_;
    std::string owner_;
    std::map<std::string, std::uint64_t> heard_us_;
    std::uint64_t told_us_ = 0;
};

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
        client_ = std::make_unique<ActionClient<Action>>(handle, rest, &shared_->queue);
    }

    const std::string& name() const { return name_; }

    bool is_ready() const { return client_->is_ready(); }

    void send(std::uint32_t id, const Goal& goal)
    {
        if (!is_ready()) {
            end(id, ROBOT_OUTCOME_LOST);
            return;
        }
        Handle handle = client_->send(
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
            if (goals_.at(id).handle.getCommState() == actionlib::CommState::WAITING_FOR_RESULT) {
                no_result_ = "the server of " + name_ + " gave no result of a goal that ended";
            }
            unheard_.emplace(id, goals_.at(id).handle);
            abandon(id);
        }
        for (auto& [id, goal] : goals_) {
            /* Its server goes on to report, and has not taken notice of the cancel. */
            if (goal.is_cancelled && client_->heard_us() >= goal.cancelled_us + REFUSAL_US) {
                goal.is_cancelled = false;
                refuse(id);
            }
        }
        /* A lost goal that runs on would never be stopped otherwise. */
        if (!abandoned_.empty() && is_ready()) {
            cancel_abandoned();
        }
    }

    void add_troubles(Texts& found) const
    {
        const std::uint64_t now = now_us();
        const std::set<std::string> nodes = client_->reporters(now < ANSWER_US ? 0 : now - ANSWER_US);
        if (nodes.size() > 1) {
            std::string text = std::to_string(nodes.size()) + " servers of " + name_;
            for (const std::string& node : nodes) {
                text += (node == *nodes.begin() ? ": " : ", ") + node;
            }
            found.push_back(text);
        }
        if (!no_result_.empty()) {
            found.push_back(no_result_);
        }
        for (const auto& [id, goal] : goals_) {
            const actionlib::CommState state = goal.handle.getCommState();
            if (state == actionlib::CommState::WAITING_FOR_GOAL_ACK && now >= goal.since_us + ANSWER_US) {
                found.push_back("no server of " + name_ + " has accepted or rejected a goal so far");
            } else if (state == actionlib::CommState::WAITING_FOR_RESULT && now >= goal.since_us + ANSWER_US) {
                found.push_back("the server of " + name_ + " gives no result of a goal that ended");
            } else if (now >= std::max(goal.since_us, client_->heard_us()) + ANSWER_US) {
                found.push_back("the server of " + name_ + " reports nothing about a goal");
            }
        }
    }

    /* A goal that its server has not named, and one whose cancel it has not heard. */
    void add_unsettled(Texts& found) const
    {
        for (const auto& [id, goal] : goals_) {
            if (goal.handle.getCommState() == actionlib::CommState::WAITING_FOR_GOAL_ACK || goal.is_cancelled) {
                found.push_back("a goal of " + name_ + " may be running: its server has not answered "
                    + (goal.is_accepted ? "its cancel" : "it"));
            }
        }
        for (std::size_t k = 0; k < unheard_.size(); k++) {
            found.push_back("a goal of " + name_ + " may be running: its server has not answered it");
        }
    }

    /* Ask for the cancel of goals that may still be accepted: a server remembers it. */
    void cancel_unanswered()
    {
        for (auto& [id, goal] : goals_) {
            if (goal.handle.getCommState() == actionlib::CommState::WAITING_FOR_GOAL_ACK) {
                goal.handle.cancel();
            }
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
            const bool is_unnamed = state == actionlib::CommState::WAITING_FOR_GOAL_ACK;
            const bool is_silent = is_unnamed || state == actionlib::CommState::WAITING_FOR_RESULT;
            if ((is_silent && now >= goal.since_us + SILENCE_US)
                || (is_unnamed && client_->heard_us() >= goal.since_us + UNLISTED_US)) {
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
                forget(id, abandoned_);
            }
            if (has_heard_cancel(handle.getCommState())) {
                forget(id, unheard_);
            }
            return;
        }
        const actionlib::CommState state = handle.getCommState();
        found->second.since_us = now_us();
        if (has_heard_cancel(state)) {
            found->second.is_cancelled = false;
        }
        if (state == actionlib::CommState::DONE) {
            no_result_.clear();
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

    /* A handle must not be let go of in its own callback. */
    void forget(std::uint32_t id, std::map<std::uint32_t, Handle>& goals)
    {
        const auto found = goals.find(id);
        if (found != goals.end()) {
            ended_.push_back(found->second);
            goals.erase(found);
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
    std::unique_ptr<ActionClient<Action>> client_;
    std::map<std::uint32_t, Sent> goals_;
    std::map<std::uint32_t, Handle> abandoned_;
    /* Those of them whose server may be there, and has only not been heard of. */
    std::map<std::uint32_t, Handle> unheard_;
    std::list<Handle> ended_;
    std::string no_result_;
    Presence presence_;
};

}  // namespace robosc
