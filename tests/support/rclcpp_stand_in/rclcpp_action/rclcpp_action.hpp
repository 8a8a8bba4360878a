// A stand-in for rclcpp_action of ROS 2 Jazzy within one process: of what generated nodes use, the same signatures.

#pragma once

#include <array>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "action_msgs/srv/cancel_goal.hpp"
#include "rclcpp/rclcpp.hpp"

struct rcl_action_server_options_t {};

inline rcl_action_server_options_t rcl_action_server_get_default_options() { return {}; }

namespace rclcpp_action {

enum class ResultCode : int8_t { UNKNOWN = 0, SUCCEEDED = 4, CANCELED = 5, ABORTED = 6 };

namespace exceptions {

class UnknownGoalHandleError : public std::invalid_argument {
public:
    UnknownGoalHandleError() : std::invalid_argument("Goal handle is not known to this client.") {}
};

}  // namespace exceptions

template <typename ActionT>
class ClientGoalHandle {
public:
    using SharedPtr = std::shared_ptr<ClientGoalHandle>;

    struct WrappedResult {
        ResultCode code;
        typename ActionT::Result::SharedPtr result;
    };

    std::array<uint8_t, 16> get_goal_id() const { return {}; }
    int8_t get_status() { return status; }
    int8_t status = 2;
};

template <typename ActionT>
class Client {
public:
    using SharedPtr = std::shared_ptr<Client>;
    using Goal = typename ActionT::Goal;
    using Feedback = typename ActionT::Feedback;
    using GoalHandle = ClientGoalHandle<ActionT>;
    using WrappedResult = typename GoalHandle::WrappedResult;
    using GoalResponseCallback = std::function<void(typename GoalHandle::SharedPtr)>;
    using FeedbackCallback = std::function<void(typename GoalHandle::SharedPtr, const std::shared_ptr<const Feedback>)>;
    using ResultCallback = std::function<void(const WrappedResult&)>;
    using CancelRequest = typename ActionT::Impl::CancelGoalService::Request;
    using CancelResponse = typename ActionT::Impl::CancelGoalService::Response;
    using CancelCallback = std::function<void(typename CancelResponse::SharedPtr)>;

    struct SendGoalOptions {
        GoalResponseCallback goal_response_callback;
        FeedbackCallback feedback_callback;
        ResultCallback result_callback;
    };

    explicit Client(const std::string& name) : name_(name) { listen(); }

    bool action_server_is_ready() const { return stand_in::world().servers[name_]; }

    std::shared_future<typename GoalHandle::SharedPtr> async_send_goal(
        const Goal& goal, const SendGoalOptions& options = SendGoalOptions())
    {
        options_ = options;
        // Of several clients of an action the one that sent a goal last is answered.
        listen();
        stand_in::print("goal", name_, to_yaml(goal, true));
        return {};
    }

    std::shared_future<typename CancelResponse::SharedPtr> async_cancel_goal(
        typename GoalHandle::SharedPtr goal_handle, CancelCallback cancel_callback = nullptr)
    {
        if (goal_handle != handle_) {
            throw exceptions::UnknownGoalHandleError();
        }
        cancel_callback_ = cancel_callback;
        stand_in::print("cancel", name_, "");
        return {};
    }

private:
    void listen()
    {
        auto& orders = stand_in::world().orders;
        orders[{"accept", name_}] = [this](std::istream&) {
            handle_ = std::make_shared<GoalHandle>();
            options_.goal_response_callback(handle_);
        };
        orders[{"status", name_}] = [this](std::istream& in) {
            int status = 0;
            in >> status;
            handle_->status = static_cast<int8_t>(status);
        };
        orders[{"reject", name_}] = [this](std::istream&) { options_.goal_response_callback(nullptr); };
        orders[{"feedback", name_}] = [this](std::istream& in) {
            options_.feedback_callback(
                handle_, std::make_shared<const Feedback>(stand_in::parsed<typename ActionT::Feedback>(in)));
        };
        orders[{"result", name_}] = [this](std::istream& in) {
            int code = 0;
            in >> code;
            WrappedResult result;
            result.code = static_cast<ResultCode>(code);
            result.result = std::make_shared<typename ActionT::Result>(stand_in::parsed<typename ActionT::Result>(in));
            handle_.reset();
            options_.result_callback(result);
        };
        orders[{"refuse", name_}] = [this](std::istream& in) {
            int code = 0;
            in >> code;
            const auto response = std::make_shared<CancelResponse>();
            response->return_code = static_cast<int8_t>(code);
            if (code == 0) {
                response->goals_canceling.emplace_back();
            }
            cancel_callback_(response);
        };
    }

    std::string name_;
    SendGoalOptions options_;
    CancelCallback cancel_callback_;
    typename GoalHandle::SharedPtr handle_;
};

using GoalUUID = std::array<uint8_t, 16>;

enum class GoalResponse : int8_t { REJECT = 1, ACCEPT_AND_EXECUTE = 2, ACCEPT_AND_DEFER = 3 };
enum class CancelResponse : int8_t { REJECT = 1, ACCEPT = 2 };

template <typename ActionT>
class ServerGoalHandle {
public:
    ServerGoalHandle(std::string name, GoalUUID uuid, std::string number)
        : name_(std::move(name)), uuid_(uuid), number_(std::move(number))
    {
    }

    const GoalUUID& get_goal_id() const { return uuid_; }
    bool is_canceling() const { return is_canceling_; }

    void publish_feedback(std::shared_ptr<typename ActionT::Feedback> feedback_msg)
    {
        stand_in::print("feedback", name_, number_ + " " + to_yaml(*feedback_msg, true));
    }

    void succeed(typename ActionT::Result::SharedPtr result_msg) { end("succeeded", *result_msg); }
    void abort(typename ActionT::Result::SharedPtr result_msg) { end("aborted", *result_msg); }

    void canceled(typename ActionT::Result::SharedPtr result_msg)
    {
        if (!is_canceling_) {
            throw std::runtime_error("goal_handle attempted invalid transition from state EXECUTING with event CANCELED");
        }
        end("cancelled", *result_msg);
    }

    // The stand-in's own.
    void cancel() { is_canceling_ = true; }

private:
    void end(const std::string& how, const typename ActionT::Result& result)
    {
        if (is_over_) {
            throw std::runtime_error("goal_handle attempted invalid transition");
        }
        is_over_ = true;
        stand_in::print("ended", name_, number_ + " " + how + " " + to_yaml(result, true));
    }

    std::string name_;
    GoalUUID uuid_;
    std::string number_;
    bool is_canceling_ = false;
    bool is_over_ = false;
};

template <typename ActionT>
class Server {
public:
    using SharedPtr = std::shared_ptr<Server>;
    using Handle = std::shared_ptr<ServerGoalHandle<ActionT>>;
    using GoalCallback = std::function<GoalResponse(const GoalUUID&, std::shared_ptr<const typename ActionT::Goal>)>;
    using CancelCallback = std::function<CancelResponse(const Handle)>;
    using AcceptedCallback = std::function<void(const Handle)>;

    Server(const std::string& name, GoalCallback on_goal, CancelCallback on_cancel, AcceptedCallback on_accepted)
    {
        auto& orders = stand_in::world().orders;
        orders[{"ask_goal", name}] = [this, name, on_goal, on_accepted](std::istream& in) {
            std::string number;
            in >> number;
            GoalUUID uuid{};
            uuid[0] = static_cast<uint8_t>(std::stoi(number) % 256);
            uuid[1] = static_cast<uint8_t>(std::stoi(number) / 256);
            const auto goal = std::make_shared<const typename ActionT::Goal>(
                stand_in::parsed<typename ActionT::Goal>(in));
            if (on_goal(uuid, goal) == GoalResponse::REJECT) {
                stand_in::print("reject", name, number);
                return;
            }
            stand_in::print("accept", name, number);
            handles_[number] = std::make_shared<ServerGoalHandle<ActionT>>(name, uuid, number);
            on_accepted(handles_[number]);
        };
        orders[{"ask_cancel", name}] = [this, on_cancel](std::istream& in) {
            std::string number;
            in >> number;
            const auto found = handles_.find(number);
            if (found != handles_.end() && on_cancel(found->second) == CancelResponse::ACCEPT) {
                found->second->cancel();
            }
        };
    }

private:
    std::map<std::string, Handle> handles_;
};

template <typename ActionT, typename NodeT>
typename Server<ActionT>::SharedPtr create_server(NodeT node, const std::string& name,
    typename Server<ActionT>::GoalCallback handle_goal, typename Server<ActionT>::CancelCallback handle_cancel,
    typename Server<ActionT>::AcceptedCallback handle_accepted,
    const rcl_action_server_options_t& = rcl_action_server_get_default_options(), rclcpp::CallbackGroup::SharedPtr = nullptr)
{
    return std::make_shared<Server<ActionT>>(node->resolved(name), handle_goal, handle_cancel, handle_accepted);
}

template <typename ActionT, typename NodeT>
typename Client<ActionT>::SharedPtr create_client(
    NodeT node, const std::string& name, rclcpp::CallbackGroup::SharedPtr = nullptr)
{
    return std::make_shared<Client<ActionT>>(node->resolved(name));
}

}  // namespace rclcpp_action
