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

    explicit Client(const std::string& name) : name_(name)
    {
        auto& orders = stand_in::world().orders;
        orders[{"accept", name}] = [this](std::istream&) {
            handle_ = std::make_shared<GoalHandle>();
            options_.goal_response_callback(handle_);
        };
        orders[{"status", name}] = [this](std::istream& in) {
            int status = 0;
            in >> status;
            handle_->status = static_cast<int8_t>(status);
        };
        orders[{"reject", name}] = [this](std::istream&) { options_.goal_response_callback(nullptr); };
        orders[{"feedback", name}] = [this](std::istream& in) {
            options_.feedback_callback(
                handle_, std::make_shared<const Feedback>(stand_in::parsed<typename ActionT::Feedback>(in)));
        };
        orders[{"result", name}] = [this](std::istream& in) {
            int code = 0;
            in >> code;
            WrappedResult result;
            result.code = static_cast<ResultCode>(code);
            result.result = std::make_shared<typename ActionT::Result>(stand_in::parsed<typename ActionT::Result>(in));
            handle_.reset();
            options_.result_callback(result);
        };
        orders[{"refuse", name}] = [this](std::istream& in) {
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

    bool action_server_is_ready() const { return stand_in::world().servers[name_]; }

    std::shared_future<typename GoalHandle::SharedPtr> async_send_goal(
        const Goal& goal, const SendGoalOptions& options = SendGoalOptions())
    {
        options_ = options;
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
    std::string name_;
    SendGoalOptions options_;
    CancelCallback cancel_callback_;
    typename GoalHandle::SharedPtr handle_;
};

template <typename ActionT, typename NodeT>
typename Client<ActionT>::SharedPtr create_client(
    NodeT node, const std::string& name, rclcpp::CallbackGroup::SharedPtr = nullptr)
{
    return std::make_shared<Client<ActionT>>(node->resolved(name));
}

}  // namespace rclcpp_action
