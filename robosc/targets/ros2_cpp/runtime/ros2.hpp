/* Uses of rclcpp by the node: qualities of service, services without waiting, parameters. */

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <rclcpp/rclcpp.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

#include "controller.hpp"
#include "ros2_peers.hpp"

namespace robosc {

/* Calls of one service whose reply is still listened for, so that a late one is noticed. */
constexpr std::size_t MAXIMUM_PENDING = 16;

/* Time for the last messages where the middleware does not say when they have arrived. */
constexpr int UNACKNOWLEDGED_MS = 300;

/* Whether the answer of a middleware to `wait_for_all_acked` is no empty one: Zenoh says at once that all has arrived.
   Others are not known, and get the same time. */
inline bool acknowledges(const std::string& middleware)
{
    for (const char* const known : {"rmw_fastrtps", "rmw_cyclonedds", "rmw_connextdds"}) {
        if (middleware.rfind(known, 0) == 0) {
            return true;
        }
    }
    return false;
}

enum class Quality { RELIABLE, BEST_EFFORT, LATCHED };

inline rclcpp::QoS profile(Quality quality, std::size_t depth)
{
    rclcpp::QoS result{rclcpp::KeepLast(depth)};
    if (quality == Quality::BEST_EFFORT) {
        result.best_effort();
    } else {
        result.reliable();
    }
    if (quality == Quality::LATCHED) {
        result.transient_local();
    } else {
        result.durability_volatile();
    }
    return result;
}

/* Time of periods, ages and timeouts: the steady clock, or with `use_sim_time` that of ROS. No simulated time passes
   before the first message on /clock, which would seem to be years after zero. Where it jumps back, as a replayed bag
   does at its end, time goes on from where it was. */
class NodeTime {
public:
    explicit NodeTime(const rclcpp_lifecycle::LifecycleNode& node)
        : node_(node), is_simulated_(node.get_parameter("use_sim_time").get_parameter_value().get<bool>())
    {
    }

    bool is_simulated() const { return is_simulated_; }

    bool has_begun()
    {
        us();
        return !is_simulated_ || last_ns_ > 0;
    }

    std::uint64_t us()
    {
        if (!is_simulated_) {
            return now_us();
        }
        const std::int64_t now_ns = node_.now().nanoseconds();
        if (now_ns > 0) {
            if (last_ns_ > 0 && now_ns >= last_ns_) {
                passed_ns_ += now_ns - last_ns_;
            } else if (last_ns_ > 0) {
                went_back_ns_ += last_ns_ - now_ns;
            }
            last_ns_ = now_ns;
        }
        return static_cast<std::uint64_t>(passed_ns_ / 1000);
    }

    std::uint64_t take_jump_us()
    {
        us();
        return static_cast<std::uint64_t>(std::exchange(went_back_ns_, 0) / 1000);
    }

private:
    const rclcpp_lifecycle::LifecycleNode& node_;
    bool is_simulated_;
    std::int64_t last_ns_ = 0;
    std::int64_t passed_ns_ = 0;
    std::int64_t went_back_ns_ = 0;
};

/* Policies that a parameter file may override for a topic. */
inline rclcpp::QosOverridingOptions overridable()
{
    return rclcpp::QosOverridingOptions({rclcpp::QosPolicyKind::Depth, rclcpp::QosPolicyKind::Durability,
        rclcpp::QosPolicyKind::History, rclcpp::QosPolicyKind::Reliability});
}

/* Messages that are kept for who comes later cannot be handed over within a process in every distribution. */
inline rclcpp::IntraProcessSetting within_process(const rclcpp::QoS& quality)
{
    return quality.durability() == rclcpp::DurabilityPolicy::TransientLocal ? rclcpp::IntraProcessSetting::Disable
                                                                            : rclcpp::IntraProcessSetting::NodeDefault;
}

#if ROBOT_SERVICE_COUNT > 0
/* The calls of one service: nothing waits. */
template <class Service>
class ServiceCalls {
public:
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    using Answer = void (*)(robot_t*, std::uint64_t, std::uint32_t, const Response&, Notes&);

    ServiceCalls(rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group, NodeTime& time,
        Reports& reports, const Parameters& parameters, const std::string& name, Answer answer)
        : time_(time)
        , reports_(reports)
        , timeout_us_(parameters.settings.service_timeout_us)
        , name_(prefixed(parameters.topic_prefix, name))
        , answer_(answer)
        , client_(node.create_client<Service>(name_, rclcpp::ServicesQoS(), group))
        /* A service has the topic of its replies. */
        , servers_(node, std::string("rr") + client_->get_service_name() + "Reply", true)
    {
    }

    const std::string& name() const { return name_; }

    bool is_ready() const { return client_->service_is_ready(); }

    void call(std::uint32_t id, const Request& request)
    {
        if (!is_ready()) {
            fail(id);
            return;
        }
        const auto sent = client_->async_send_request(std::make_shared<Request>(request),
            [this, id](typename rclcpp::Client<Service>::SharedFuture future) { answered(id, future.get()); });
        const std::uint64_t now = time_.us();
        const std::uint64_t deadline = timeout_us_ > UINT64_MAX - now ? UINT64_MAX : now + timeout_us_;
        calls_[id] = {sent.request_id, deadline, servers_.look(), Presence()};
        if (calls_.size() > MAXIMUM_PENDING) {
            client_->remove_pending_request(calls_.begin()->second.number);
            calls_.erase(calls_.begin());
        }
    }

    /* Notice a lost server: every call to it has failed. */
    void check(std::uint64_t now)
    {
        std::vector<std::uint32_t> lost;
        for (auto& [id, call] : calls_) {
            if (call.presence.is_lost(is_served(call), now)) {
                lost.push_back(id);
            }
        }
        for (const std::uint32_t id : lost) {
            const Call call = calls_.at(id);
            calls_.erase(id);
            client_->remove_pending_request(call.number);
            /* The engine has counted calls that are over by then as failed. */
            if (time_.us() < call.deadline_us) {
                fail(id);
            }
        }
    }

    void add_troubles(Texts& found, const std::map<std::string, std::vector<std::string>>& offered)
    {
        const char* const type = rosidl_generator_traits::name<Service>();
        add_other_types(found, offered, name_, client_->get_service_name(), type);
        servers_.add_several(name_, found);
    }

private:
    struct Call {
        std::int64_t number;
        std::uint64_t deadline_us;
        Endpoints::Nodes servers;
        Presence presence;
    };

    /* Whether a server that was called is there. It is not where the node that had its name is another process: a server
       that works on a call need not answer questions, and names of nodes are unique. */
    bool is_served(const Call& call)
    {
        if (!is_ready()) {
            return false;
        }
        const Endpoints::Nodes& seen = servers_.seen();
        if (call.servers.empty() || seen.empty()) {
            return true;
        }
        std::set<std::string> taken;
        for (const auto& [gid, node] : seen) {
            if (call.servers.count(gid) == 0 && !node.empty()) {
                taken.insert(node);
            }
        }
        return std::any_of(call.servers.begin(), call.servers.end(), [&](const auto& server) {
            return seen.count(server.first) > 0 && taken.count(server.second) == 0;
        });
    }

    void answered(std::uint32_t id, const std::shared_ptr<Response>& response)
    {
        calls_.erase(id);
        reports_.add([answer = answer_, id, response](robot_t* robot, std::uint64_t now, Notes& notes) {
            answer(robot, now, id, *response, notes);
        });
    }

    void fail(std::uint32_t id)
    {
        reports_.add([id](robot_t* robot, std::uint64_t now, Notes&) { robot_call_failed(robot, now, id); });
    }

    NodeTime& time_;
    Reports& reports_;
    std::uint64_t timeout_us_;
    std::string name_;
    Answer answer_;
    typename rclcpp::Client<Service>::SharedPtr client_;
    std::map<std::uint32_t, Call> calls_;
    Endpoints servers_;
};
#endif

inline Value value_of(const rclcpp::ParameterValue& given)
{
    switch (given.get_type()) {
    case rclcpp::ParameterType::PARAMETER_BOOL:
        return Value(std::in_place_type<bool>, given.get<bool>());
    case rclcpp::ParameterType::PARAMETER_INTEGER:
        return Value(std::in_place_type<std::int64_t>, given.get<std::int64_t>());
    case rclcpp::ParameterType::PARAMETER_DOUBLE:
        return Value(std::in_place_type<double>, given.get<double>());
    case rclcpp::ParameterType::PARAMETER_STRING:
        return Value(std::in_place_type<std::string>, given.get<std::string>());
    case rclcpp::ParameterType::PARAMETER_STRING_ARRAY:
        return Value(std::in_place_type<Texts>, given.get<std::vector<std::string>>());
    default:
        return OtherValue{rclcpp::to_string(given)};
    }
}

inline rclcpp::ParameterValue ros_value_of(const Value& value)
{
    struct Make {
        rclcpp::ParameterValue operator()(const OtherValue& item) const { return rclcpp::ParameterValue(item.shown); }
        rclcpp::ParameterValue operator()(bool item) const { return rclcpp::ParameterValue(item); }
        rclcpp::ParameterValue operator()(std::int64_t item) const { return rclcpp::ParameterValue(item); }
        rclcpp::ParameterValue operator()(double item) const { return rclcpp::ParameterValue(item); }
        rclcpp::ParameterValue operator()(const std::string& item) const { return rclcpp::ParameterValue(item); }
        rclcpp::ParameterValue operator()(const Texts& items) const { return rclcpp::ParameterValue(items); }
    };
    return std::visit(Make{}, value);
}

constexpr const char* AUTOSTART = "autostart";

/* Declare every parameter. What nobody else manages is configured at once, and keeps its parameters: read-only. */
template <class Node>
void declare_parameters_of(Node& node, const std::vector<Declaration>& declarations)
{
    bool is_fixed = true;
    const auto declare = [&](const Declaration& item) {
        rcl_interfaces::msg::ParameterDescriptor descriptor;
        descriptor.description = item.description;
        descriptor.additional_constraints = "taken when the node is configured";
        descriptor.read_only = is_fixed;
        /* A wrong type gets the same kind of error as a wrong value, and 1 is as good as 1.0. */
        descriptor.dynamic_typing = true;
        if (item.range) {
            descriptor.floating_point_range.resize(1);
            descriptor.floating_point_range.front().from_value = item.range->low;
            descriptor.floating_point_range.front().to_value = item.range->high;
        }
        try {
            return value_of(node.declare_parameter(item.name, ros_value_of(item.value), descriptor));
        } catch (const rclcpp::exceptions::InvalidParameterValueException&) {
            /* The value that was given is out of its range: `validated` reports that. */
            descriptor.floating_point_range.clear();
            return value_of(node.declare_parameter(item.name, ros_value_of(item.value), descriptor));
        }
    };
    for (const Declaration& item : declarations) {
        if (item.name == std::string(AUTOSTART)) {
            const Value value = declare(item);
            const bool* const starts_itself = std::get_if<bool>(&value);
            is_fixed = starts_itself == nullptr || *starts_itself;
        }
    }
    for (const Declaration& item : declarations) {
        if (!node.has_parameter(item.name)) {
            declare(item);
        }
    }
    /* A misspelt parameter would leave a default in force; one file may serve several nodes, so it is no error. */
    for (const auto& [name, value] : node.get_node_parameters_interface()->get_parameter_overrides()) {
        if (!node.has_parameter(name) && name.compare(0, 14, "qos_overrides.") != 0) {
            RCLCPP_WARN(node.get_logger(), "there is no parameter '%s'", name.c_str());
        }
    }
}

/* The value of every declared parameter. */
template <class Node>
Given given_parameters(const Node& node, const std::vector<Declaration>& declarations)
{
    Given given;
    for (const Declaration& item : declarations) {
        given[item.name] = value_of(node.get_parameter(item.name).get_parameter_value());
    }
    return given;
}

}  // namespace robosc
