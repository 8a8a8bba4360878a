/* What an existing controller asks of a supervision layer in place of the robot: messages, service calls, goals. Nothing
   waits: answers and ends come later. A caller that is gone is a warning and no fault: the robot must not stop for it. */

#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <locale>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <utility>

#include <rclcpp/rclcpp.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>
#if ROBOT_ACTION_COUNT > 0
#include <rclcpp_action/rclcpp_action.hpp>
#endif

#include "callers.hpp"
#include "controller.hpp"
#include "ros2.hpp"

namespace robosc {

/* Looks at every number of a message that is written to a stream, and writes none of them. */
class FiniteNumbers final : public std::num_put<char> {
public:
    /* It belongs to who made it, not to the locale. */
    FiniteNumbers() : std::num_put<char>(1) {}

    bool is_finite() const { return is_finite_; }

protected:
    iter_type do_put(iter_type out, std::ios_base&, char_type, double value) const override
    {
        is_finite_ = is_finite_ && std::isfinite(value);
        return out;
    }

    iter_type do_put(iter_type out, std::ios_base&, char_type, long double value) const override
    {
        is_finite_ = is_finite_ && std::isfinite(value);
        return out;
    }

private:
    mutable bool is_finite_ = true;
};

/* Throws away what is written. */
class Nowhere final : public std::streambuf {
protected:
    int_type overflow(int_type one) override { return traits_type::not_eof(one); }

    std::streamsize xsputn(const char*, std::streamsize count) override { return count; }
};

/* Description of a message that the caller sends. Messages of ROS 2 in C++ name their fields only as text. */
template <class M>
robot_sent_t sent_of(const M& message)
{
    const FiniteNumbers numbers;
    Nowhere nowhere;
    std::ostream out(&nowhere);
    out.imbue(std::locale(std::locale::classic(), const_cast<FiniteNumbers*>(&numbers)));
    to_flow_style_yaml(message, out);
    return {&message, numbers.is_finite(), is_plain(message, 0)};
}

#if ROBOT_SERVICE_COUNT > 0
/* The calls of one service that the layer offers. */
template <class Service>
class CalledService {
public:
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    using Ask = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Request&, robot_sent_t, Notes&);

    CalledService(rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group,
        const Parameters& parameters, const std::string& name, Ask ask)
        : node_(node), ask_(ask), name_(prefixed(parameters.topic_prefix, name))
    {
        service_ = node.create_service<Service>(
            name_,
            [this](const std::shared_ptr<rmw_request_id_t> header, const std::shared_ptr<Request> request) {
                came(*header, *request);
            },
            rclcpp::ServicesQoS(), group);
    }

    /* From now on hand on what comes. */
    void serve(Controller& controller) { controller_ = &controller; }

    void add_troubles(Texts& found, const std::map<std::string, std::vector<std::string>>& offered) const
    {
        const std::string service = node_.get_node_services_interface()->resolve_service_name(name_);
        add_other_types(found, offered, name_, service, rosidl_generator_traits::name<Service>());
    }

    /* Answer a call; NULL: with the default response, and the reason in it. */
    void answer(std::uint32_t number, const void* message, const std::string& why)
    {
        const auto found = calls_.find(number);
        if (found == calls_.end()) {
            return;
        }
        rmw_request_id_t header = found->second;
        calls_.erase(found);
        Response response;
        if (message != nullptr) {
            response = *static_cast<const Response*>(message);
        } else {
            give_reason(response, why);
        }
        try {
            service_->send_response(header, response);
        } catch (const std::exception& failure) {
            RCLCPP_WARN(node_.get_logger(), "no answer to a call of %s: %s", name_.c_str(), failure.what());
        }
    }

    /* Answer every call: nobody else would. */
    void take_leave()
    {
        while (!calls_.empty()) {
            answer(calls_.begin()->first, nullptr, "the layer has ended");
        }
    }

private:
    void came(const rmw_request_id_t& header, const Request& request)
    {
        const std::uint32_t number = ++count_;
        calls_[number] = header;
        if (controller_ == nullptr) {
            answer(number, nullptr, "not started");
            return;
        }
        controller_->judge([this, number, &request](robot_t* robot, std::uint64_t now, Notes& notes) {
            ask_(robot, now, number, request, sent_of(request), notes);
        });
    }

    rclcpp_lifecycle::LifecycleNode& node_;
    Ask ask_;
    std::string name_;
    typename rclcpp::Service<Service>::SharedPtr service_;
    Controller* controller_ = nullptr;
    std::map<std::uint32_t, rmw_request_id_t> calls_;
    std::uint32_t count_ = 0;
};
#endif
#if ROBOT_ACTION_COUNT > 0

/* The goals of one action that the layer offers. */
template <class Action>
class ServedAction {
public:
    using Handle = std::shared_ptr<rclcpp_action::ServerGoalHandle<Action>>;
    using Goal = typename Action::Goal;
    using Result = typename Action::Result;
    using Feedback = typename Action::Feedback;
    using Ask = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Goal&, robot_sent_t, Notes&);
    using Cancel = void (*)(robot_t*, std::uint64_t, std::uint32_t);

    ServedAction(rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group,
        const Parameters& parameters, const std::string& name, Ask ask, Cancel cancel)
        : node_(node), ask_(ask), cancel_(cancel), name_(prefixed(parameters.topic_prefix, name))
    {
        server_ = rclcpp_action::create_server<Action>(
            &node, name_,
            [this](const rclcpp_action::GoalUUID&, std::shared_ptr<const Goal> goal) {
                return came(*goal) ? rclcpp_action::GoalResponse::ACCEPT_AND_EXECUTE
                                   : rclcpp_action::GoalResponse::REJECT;
            },
            [this](const Handle handle) {
                return withdrawn(*handle) ? rclcpp_action::CancelResponse::ACCEPT
                                          : rclcpp_action::CancelResponse::REJECT;
            },
            [this](const Handle handle) { begun(handle); }, rcl_action_server_get_default_options(), group);
    }

    void serve(Controller& controller) { controller_ = &controller; }

    void add_troubles(Texts& found, const std::map<std::string, std::vector<std::string>>& offered) const
    {
        const std::string service
            = node_.get_node_services_interface()->resolve_service_name(name_ + "/_action/send_goal");
        const char* const type = rosidl_generator_traits::name<typename Action::Impl::SendGoalService>();
        add_other_types(found, offered, name_, service, type);
    }

    void accept(std::uint32_t number) { goals_[number] = Served{}; }

    /* A goal that is not accepted is rejected; rclcpp has no place for a reason. */
    void reject(std::uint32_t, const std::string&) {}

    void feedback(std::uint32_t number, const void* message)
    {
        const auto found = goals_.find(number);
        if (found != goals_.end() && found->second.handle) {
            attempt("feedback", [&] {
                found->second.handle->publish_feedback(
                    std::make_shared<Feedback>(*static_cast<const Feedback*>(message)));
            });
        }
    }

    /* End a goal; NULL: with the default result, and the reason in it. */
    void end(std::uint32_t number, robot_end_t end, const void* message, const std::string& why)
    {
        const auto found = goals_.find(number);
        if (found == goals_.end()) {
            /* Its caller was gone. */
            return;
        }
        auto result = std::make_shared<Result>();
        if (message != nullptr) {
            *result = *static_cast<const Result*>(message);
        } else {
            give_reason(*result, why);
        }
        if (!found->second.handle) {
            found->second.end = {end, result};
            return;
        }
        const Handle handle = found->second.handle;
        numbers_.erase(handle->get_goal_id());
        goals_.erase(found);
        conclude(handle, end, result);
    }

    /* A goal whose caller was gone before it could learn that it is accepted is cancelled: nobody else would. */
    void check()
    {
        const std::optional<std::uint32_t> lonely = std::exchange(beginning_, std::nullopt);
        if (lonely && controller_ != nullptr) {
            goals_.erase(*lonely);
            RCLCPP_WARN(node_.get_logger(), "a goal of %s is cancelled: its caller is gone", name_.c_str());
            withdraw(*lonely);
        }
    }

    /* End every goal: nobody else would. */
    void take_leave()
    {
        while (!goals_.empty()) {
            const std::uint32_t number = goals_.begin()->first;
            end(number, ROBOT_END_ABORTED, nullptr, "the layer has ended");
            goals_.erase(number);
        }
    }

private:
    struct Served {
        Handle handle;
        /* How it ended, if that came before its handle. */
        std::optional<std::pair<robot_end_t, std::shared_ptr<Result>>> end;
    };

    bool came(const Goal& goal)
    {
        const std::uint32_t number = ++count_;
        if (controller_ == nullptr) {
            return false;
        }
        controller_->judge([this, number, &goal](robot_t* robot, std::uint64_t now, Notes& notes) {
            ask_(robot, now, number, goal, sent_of(goal), notes);
        });
        if (goals_.count(number) == 0) {
            return false;
        }
        beginning_ = number;
        return true;
    }

    /* The goal that was just accepted has got its handle. */
    void begun(const Handle& handle)
    {
        const std::optional<std::uint32_t> number = std::exchange(beginning_, std::nullopt);
        if (!number || goals_.count(*number) == 0) {
            return;
        }
        Served& goal = goals_.at(*number);
        goal.handle = handle;
        numbers_[handle->get_goal_id()] = *number;
        if (goal.end) {
            const auto [end, result] = *goal.end;
            numbers_.erase(handle->get_goal_id());
            goals_.erase(*number);
            conclude(handle, end, result);
        }
    }

    /* Whether the cancel is about to happen: if not, the goal's end is on the way. */
    bool withdrawn(const rclcpp_action::ServerGoalHandle<Action>& handle)
    {
        const auto found = numbers_.find(handle.get_goal_id());
        if (found == numbers_.end() || controller_ == nullptr) {
            return false;
        }
        withdraw(found->second);
        return true;
    }

    void withdraw(std::uint32_t number)
    {
        controller_->judge(
            [this, number](robot_t* robot, std::uint64_t now, Notes&) { cancel_(robot, now, number); });
    }

    void conclude(const Handle& handle, robot_end_t end, const std::shared_ptr<Result>& result)
    {
        attempt("end", [&] {
            if (end == ROBOT_END_SUCCEEDED) {
                handle->succeed(result);
            } else if (end == ROBOT_END_CANCELLED && handle->is_canceling()) {
                handle->canceled(result);
            } else {
                handle->abort(result);
            }
        });
    }

    template <class Report>
    void attempt(const char* what, const Report& report)
    {
        try {
            report();
        } catch (const std::exception& failure) {
            RCLCPP_WARN(node_.get_logger(), "no %s of a goal of %s: %s", what, name_.c_str(), failure.what());
        }
    }

    rclcpp_lifecycle::LifecycleNode& node_;
    Ask ask_;
    Cancel cancel_;
    std::string name_;
    typename rclcpp_action::Server<Action>::SharedPtr server_;
    Controller* controller_ = nullptr;
    std::map<std::uint32_t, Served> goals_;
    std::map<rclcpp_action::GoalUUID, std::uint32_t> numbers_;
    std::optional<std::uint32_t> beginning_;
    std::uint32_t count_ = 0;
};
#endif

}  // namespace robosc
