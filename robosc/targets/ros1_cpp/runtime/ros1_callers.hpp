/* What an existing controller asks of a supervision layer in place of the robot: messages, service calls, goals. */

#pragma once

#include <cmath>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/message_traits.h>
#include <ros/ros.h>
#include <ros/serialization.h>
#if ROBOT_ACTION_COUNT > 0
#include <actionlib/server/action_server.h>
#endif

#include "callers.hpp"
#include "ros1.hpp"

namespace robosc {

/* Looks at every number of a message, in the place of a stream that it is written to. */
class Finite {
public:
    template <class T>
    void next(const T& item)
    {
        if constexpr (std::is_floating_point<T>::value) {
            is_finite = is_finite && std::isfinite(item);
        } else if constexpr (ros::message_traits::IsMessage<T>::value) {
            ros::serialization::Serializer<T>::template allInOne<Finite, const T&>(*this, item);
        }
    }

    template <class T, class A>
    void next(const std::vector<T, A>& items)
    {
        if constexpr (!std::is_integral<T>::value) {
            for (const T& item : items) {
                next(item);
            }
        }
    }

    template <class T, std::size_t N>
    void next(const boost::array<T, N>& items)
    {
        for (const T& item : items) {
            next(item);
        }
    }

    bool is_finite = true;
};

/* Description of a message that the caller sends. */
template <class M>
robot_sent_t sent_of(const M& message)
{
    Finite finite;
    finite.next(message);
    return {&message, finite.is_finite, is_plain(message, 0)};
}

#if ROBOT_SERVICE_COUNT > 0
/* The calls of one service that the layer offers. roscpp waits for the answer in the thread of the call: of each service
   of the model with its name one call may be under way, and one more is refused at once. */
template <class Service>
class CalledService {
public:
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    using Ask = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Request&, robot_sent_t, Notes&);

    CalledService(std::shared_ptr<Shared> shared, const std::string& name, Ask ask, std::uint32_t sharing)
        : shared_(std::move(shared)), ask_(ask), spinner_(sharing + 1, &queue_)
    {
        const auto [handle, rest] = place(shared_, name);
        ros::NodeHandle own = handle;
        ros::AdvertiseServiceOptions options;
        options.init<Request, Response>(rest,
            [this](Request& request, Response& response) { return handled(request, response); });
        options.callback_queue = &queue_;
        server_ = own.advertiseService(options);
        spinner_.start();
    }

    ~CalledService()
    {
        take_leave();
        server_.shutdown();
        spinner_.stop();
    }

    CalledService(const CalledService&) = delete;
    CalledService& operator=(const CalledService&) = delete;

    /* Answer a call; NULL: with the default response, and the reason in it. */
    void answer(std::uint32_t number, const void* message, const std::string& why)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto found = waiting_.find(number);
        if (found != waiting_.end()) {
            if (message != nullptr) {
                found->second->response = *static_cast<const Response*>(message);
            } else {
                give_reason(found->second->response, why);
            }
            found->second->is_answered = true;
            waiting_.erase(found);
            changed_.notify_all();
        }
    }

    /* Answer every call, also those that come from now on. */
    void take_leave()
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        is_closed_ = true;
        changed_.notify_all();
    }

private:
    struct Call {
        Request request;
        Response response;
        bool is_answered = false;
    };

    bool handled(Request& request, Response& response)
    {
        const auto call = std::make_shared<Call>();
        call->request = request;
        std::unique_lock<std::mutex> lock(mutex_);
        const std::uint32_t number = ++count_;
        waiting_[number] = call;
        lock.unlock();
        shared_->report([ask = ask_, number, call](robot_t* robot, std::uint64_t now, Notes& notes) {
            ask(robot, now, number, call->request, sent_of(call->request), notes);
        });
        lock.lock();
        changed_.wait(lock, [&] { return call->is_answered || is_closed_; });
        if (!call->is_answered) {
            give_reason(call->response, "the layer has ended");
        }
        response = call->response;
        return true;
    }

    std::shared_ptr<Shared> shared_;
    Ask ask_;
    ros::CallbackQueue queue_;
    ros::AsyncSpinner spinner_;
    ros::ServiceServer server_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::map<std::uint32_t, std::shared_ptr<Call>> waiting_;
    std::uint32_t count_ = 0;
    bool is_closed_ = false;
};
#endif
#if ROBOT_ACTION_COUNT > 0

/* The goals of one action that the layer offers. */
template <class Action>
class ServedAction {
public:
    ACTION_DEFINITION(Action)
    using Handle = actionlib::ServerGoalHandle<Action>;
    using Ask = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Goal&, robot_sent_t, Notes&);
    using Cancel = void (*)(robot_t*, std::uint64_t, std::uint32_t);

    ServedAction(const std::shared_ptr<Shared>& shared, const std::string& name, Ask ask, Cancel cancel)
        : ask_(ask), cancel_(cancel)
    {
        const auto [handle, rest] = place(shared, name);
        server_ = std::make_unique<actionlib::ActionServer<Action>>(
            handle, rest, [this](Handle goal) { came(goal); }, [this](Handle goal) { withdrawn(goal); }, false);
    }

    /* From now on hand on what comes. */
    void serve(Controller& controller)
    {
        controller_ = &controller;
        server_->start();
    }

    void accept(std::uint32_t number) { goals_.at(number).setAccepted(); }

    void reject(std::uint32_t number, const std::string& why)
    {
        Result result;
        give_reason(result, why);
        taken(number).setRejected(result, why);
    }

    void feedback(std::uint32_t number, const void* message)
    {
        goals_.at(number).publishFeedback(*static_cast<const Feedback*>(message));
    }

    /* End a goal; NULL: with the default result, and the reason in it. */
    void end(std::uint32_t number, robot_end_t end, const void* message, const std::string& why)
    {
        Handle goal = taken(number);
        Result result;
        if (message != nullptr) {
            result = *static_cast<const Result*>(message);
        } else {
            give_reason(result, why);
        }
        if (end == ROBOT_END_SUCCEEDED) {
            goal.setSucceeded(result, why);
        } else if (end == ROBOT_END_CANCELLED) {
            goal.setCanceled(result, why);
        } else {
            goal.setAborted(result, why);
        }
    }

    /* End every goal, and reject those that come from now on. */
    void take_leave()
    {
        controller_ = nullptr;
        while (!goals_.empty()) {
            end(goals_.begin()->first, ROBOT_END_ABORTED, nullptr, "the layer has ended");
        }
    }

private:
    Handle taken(std::uint32_t number)
    {
        Handle goal = goals_.at(number);
        goals_.erase(number);
        numbers_.erase(goal.getGoalID().id);
        return goal;
    }

    void came(Handle goal)
    {
        const std::uint32_t number = ++count_;
        goals_[number] = goal;
        numbers_[goal.getGoalID().id] = number;
        if (controller_ == nullptr) {
            reject(number, "the layer has ended");
            return;
        }
        const GoalConstPtr message = goal.getGoal();
        controller_->judge([ask = ask_, number, message](robot_t* robot, std::uint64_t now, Notes& notes) {
            ask(robot, now, number, *message, sent_of(*message), notes);
        });
    }

    void withdrawn(Handle goal)
    {
        const auto found = numbers_.find(goal.getGoalID().id);
        if (found == numbers_.end() || controller_ == nullptr) {
            /* Its end is on the way. */
            return;
        }
        controller_->judge([cancel = cancel_, number = found->second](
                               robot_t* robot, std::uint64_t now, Notes&) { cancel(robot, now, number); });
    }

    Ask ask_;
    Cancel cancel_;
    Controller* controller_ = nullptr;
    std::map<std::uint32_t, Handle> goals_;
    std::map<std::string, std::uint32_t> numbers_;
    std::uint32_t count_ = 0;
    std::unique_ptr<actionlib::ActionServer<Action>> server_;
};
#endif

}  // namespace robosc
