/* Uses of roscpp by the node: services off its thread, actions through actionlib, parameters, an orderly end. */

#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/connection.h>
#include <ros/poll_manager.h>
#include <ros/ros.h>
#include <ros/service_manager.h>
#include <ros/service_server_link.h>
#include <ros/xmlrpc_manager.h>

#include "controller.hpp"
#include "signals.hpp"

namespace robosc {

/* Calls of one service whose reply is still listened for, so that a late one is noticed. */
constexpr std::size_t MAXIMUM_PENDING = 16;
/* Threads of one service; one that is connecting cannot be ended before its connection has failed. */
constexpr std::size_t MAXIMUM_THREADS = 2 * MAXIMUM_PENDING;

/* Wakes the node's thread. */
class Wake : public ros::CallbackInterface {
public:
    CallResult call() override { return Success; }
};

/* Data that threads that outlive the node may still touch. */
struct Shared {
    ros::CallbackQueue queue;
    Reports reports;
    std::atomic<int> calls{0};
    std::atomic<bool> is_asked_to_end{false};

    void report(Reports::Report report)
    {
        reports.add(std::move(report));
        queue.addCallback(boost::make_shared<Wake>());
    }
};

/* The handle to make things with, and the rest of the name: `~/x` belongs to the node. */
inline std::pair<ros::NodeHandle, std::string> place(const std::shared_ptr<Shared>& shared, const std::string& name)
{
    const bool is_private = name.front() == '~';
    ros::NodeHandle handle(is_private ? "~" : "");
    handle.setCallbackQueue(&shared->queue);
    return {handle, is_private ? name.substr(name.find_first_not_of("~/")) : name};
}

#if ROBOT_SERVICE_COUNT > 0
/* The calls of one service that wait. Of calls that never end, only so many are kept. */
class Pending {
public:
    /* Add a call, for which the oldest may be given up; false if too many threads have not ended.
       */
    bool begin(std::uint32_t id)
    {
        ros::ServiceServerLinkPtr oldest;
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            if (threads_ >= MAXIMUM_THREADS) {
                return false;
            }
            if (links_.size() >= MAXIMUM_PENDING) {
                oldest = links_.begin()->second;
                links_.erase(links_.begin());
            }
            links_[id] = nullptr;
            threads_++;
        }
        if (oldest) {
            /* Its call ends without a reply. */
            oldest->getConnection()->drop(ros::Connection::Destructing);
        }
        return true;
    }

    /* Return true if it has not been given up before it was connected. */
    bool connected(std::uint32_t id, const ros::ServiceServerLinkPtr& link)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto found = links_.find(id);
        if (found == links_.end()) {
            return false;
        }
        found->second = link;
        return true;
    }

    /* The thread of a call ends: whether it has not been given up. */
    bool end(std::uint32_t id)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        threads_--;
        return links_.erase(id) > 0;
    }

private:
    std::mutex mutex_;
    std::map<std::uint32_t, ros::ServiceServerLinkPtr> links_;
    std::size_t threads_ = 0;
};

/* The calls of one service. roscpp's call waits for the reply: each has a thread of its own. */
template <class Service>
class ServiceCalls {
public:
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    using Answer = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Response&, Notes&);

    ServiceCalls(std::shared_ptr<Shared> shared, const std::string& name, Answer answer)
        : shared_(std::move(shared)), answer_(answer)
    {
        const auto [handle, rest] = place(shared_, name);
        name_ = handle.resolveName(rest);
    }

    const std::string& name() const { return name_; }

    /* Return true if the master knows a server. */
    bool is_ready() const
    {
        std::string host;
        std::uint32_t port = 0;
        return ros::ServiceManager::instance()->lookupService(name_, host, port);
    }

    void call(std::uint32_t id, const Request& request)
    {
        if (!pending_->begin(id)) {
            fail(*shared_, id);
            return;
        }
        ++shared_->calls;
        try {
            std::thread(work, shared_, pending_, name_, answer_, id, request).detach();
        } catch (const std::system_error&) {
            pending_->end(id);
            --shared_->calls;
            fail(*shared_, id);
        }
    }

private:
    static void fail(Shared& shared, std::uint32_t id)
    {
        shared.report([id](robot_t* robot, std::uint64_t now, Notes&) { robot_call_failed(robot, now, id); });
    }

    /* Connect, call and wait; false if there is no reply. */
    static bool asked(
        Pending& pending, const std::string& name, std::uint32_t id, const Request& request, Response& response)
    {
        const std::string digest = ros::service_traits::md5sum<Service>();
        const ros::ServiceServerLinkPtr link
            = ros::ServiceManager::instance()->createServiceServerLink(name, false, digest, digest, {});
        ros::SerializedMessage reply;
        if (!link || !pending.connected(id, link)
            || !link->call(ros::serialization::serializeMessage(request), reply)) {
            return false;
        }
        ros::serialization::deserializeMessage(reply, response);
        return true;
    }

    static void work(std::shared_ptr<Shared> shared, std::shared_ptr<Pending> pending, std::string name, Answer answer,
        std::uint32_t id, Request request)
    {
        const auto response = std::make_shared<Response>();
        bool is_answered = false;
        try {
            is_answered = asked(*pending, name, id, request, *response);
        } catch (const std::exception& failure) {
            ROS_WARN("the call of %s failed: %s", name.c_str(), failure.what());
        }
        if (!pending->end(id)) {
            /* It was given up. */
        } else if (is_answered) {
            shared->report([answer, id, response](robot_t* robot, std::uint64_t now, Notes& notes) {
                answer(robot, now, id, *response, notes);
            });
        } else {
            fail(*shared, id);
        }
        --shared->calls;
    }

    std::shared_ptr<Shared> shared_;
    std::shared_ptr<Pending> pending_ = std::make_shared<Pending>();
    std::string name_;
    Answer answer_;
};
#endif

/* A value of the parameter server. */
inline Value value_of(const XmlRpc::XmlRpcValue& given)
{
    XmlRpc::XmlRpcValue value = given;
    switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
        return Value(std::in_place_type<bool>, static_cast<bool&>(value));
    case XmlRpc::XmlRpcValue::TypeInt:
        return Value(std::in_place_type<std::int64_t>, static_cast<int&>(value));
    case XmlRpc::XmlRpcValue::TypeDouble:
        return Value(std::in_place_type<double>, static_cast<double&>(value));
    case XmlRpc::XmlRpcValue::TypeString:
        return Value(std::in_place_type<std::string>, static_cast<std::string&>(value));
    case XmlRpc::XmlRpcValue::TypeArray: {
        Texts texts;
        for (int k = 0; k < value.size(); k++) {
            if (value[k].getType() != XmlRpc::XmlRpcValue::TypeString) {
                break;
            }
            texts.push_back(static_cast<std::string&>(value[k]));
        }
        if (texts.size() == static_cast<std::size_t>(value.size())) {
            return texts;
        }
        break;
    }
    default:
        break;
    }
    std::ostringstream text;
    text << value;
    return OtherValue{text.str()};
}

/* The value of every declared parameter: what the parameter server has in the node's name, else its default. */
inline Given given_parameters(const std::vector<Declaration>& declarations)
{
    const ros::NodeHandle handle("~");
    Given given;
    for (const Declaration& item : declarations) {
        XmlRpc::XmlRpcValue value;
        given[item.name] = handle.getParam(item.name, value) ? value_of(value) : item.value;
    }
    /* A misspelt parameter would leave a default in force. */
    Texts names;
    handle.getParamNames(names);
    const std::string start = handle.getNamespace() + "/";
    for (const std::string& name : names) {
        if (name.compare(0, start.size(), start) == 0) {
            const std::string own = name.substr(start.size());
            if (own.find('/') == std::string::npos && given.find(own) == given.end()) {
                ROS_WARN("there is no parameter '%s'", own.c_str());
            }
        }
    }
    return given;
}

/* Another node of the same name, or `rosnode kill`, would end the process before the robot was stopped. */
inline void take_over_shutdown(const std::shared_ptr<Shared>& shared)
{
    ros::XMLRPCManager::instance()->unbind("shutdown");
    ros::XMLRPCManager::instance()->bind(
        "shutdown", [shared](XmlRpc::XmlRpcValue&, XmlRpc::XmlRpcValue& result) {
            shared->is_asked_to_end = true;
            result = ros::xmlrpc::responseInt(1, "", 0);
        });
}

/* Wait for the master; false if a signal came first. */
inline bool found_master()
{
    bool is_reported = false;
    while (!ros::master::check()) {
        if (signal_name() != nullptr) {
            return false;
        }
        if (!is_reported) {
            ROS_WARN("waiting for the master at %s", ros::master::getURI().c_str());
            is_reported = true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return true;
}

/* Let what was published arrive. roscpp sends in a thread of its own: it has sent it once it has turned twice, for it may
   be in the midst of a turn. Who receives it needs time as well, for it may leave when the master says that this node has
   gone. */
inline void wait_until_delivered()
{
    const auto turns = std::make_shared<std::atomic<int>>(0);
    const ros::PollManagerPtr& poll = ros::PollManager::instance();
    const auto listener = poll->addPollThreadListener([turns] { ++*turns; });
    const std::uint64_t limit = now_us() + CANCEL_WAIT_US;
    while (*turns < 2 && now_us() < limit) {
        poll->getPollSet().signal();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    poll->removePollThreadListener(listener);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

/* End the process at once. */
[[noreturn]] inline void leave(int status)
{
    std::cerr.flush();
    std::cout.flush();
    std::_Exit(status);
}

/* End roscpp, without waiting for unanswered calls. */
inline void end_ros(const Shared& shared, int status)
{
    ros::shutdown();
    const std::uint64_t limit = now_us() + CANCEL_WAIT_US;
    while (shared.calls > 0 && now_us() < limit) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (shared.calls > 0) {
        leave(status);
    }
}

}  // namespace robosc
