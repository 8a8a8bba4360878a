/* Endpoints of servers and of other ends of topics, as the middleware shows them; and whether a server that lives knows a
   goal. A process that was killed stays visible until its lease ends, while another one may have taken its name. Two
   living servers of one name look the same. So the servers are asked: each that lives answers the cancel of a goal that
   nobody has, and each that does not know the goal in question says so at once when asked for its result. If all that
   live do not know it, whoever knew it is gone. */

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <rclcpp/rclcpp.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

#include "controller.hpp"

namespace robosc {

/* Endpoints are looked at once in so long. */
constexpr std::uint64_t LOOK_US = 200000;
/* Time between two questions about a goal. */
constexpr std::uint64_t ROUND_US = 250000;
/* Answers that are older are forgotten. */
constexpr std::uint64_t MEMORY_US = 2000000;
/* All servers must have said for so long that they do not know a goal: one may be slow. */
constexpr std::uint64_t CERTAIN_US = 1200000;

/* The full name of the node of an endpoint; empty if it is not known. */
inline std::string node_of(const rclcpp::TopicEndpointInfo& info)
{
    if (info.node_name() == "_NODE_NAME_UNKNOWN_") {
        return "";
    }
    return (info.node_namespace() == "/" ? "" : info.node_namespace()) + "/" + info.node_name();
}

/* Endpoints of the servers of one name, each with its node. */
class Endpoints {
public:
    using Nodes = std::map<std::string, std::string>;

    /* `topic` is one on which each server publishes, as ROS calls it unless `is_raw`. */
    Endpoints(const rclcpp_lifecycle::LifecycleNode& node, std::string topic, bool is_raw)
        : node_(node), topic_(std::move(topic)), is_raw_(is_raw)
    {
    }

    const Nodes& look()
    {
        looked_us_ = now_us();
        nodes_.clear();
        try {
            for (const rclcpp::TopicEndpointInfo& info : node_.get_publishers_info_by_topic(topic_, is_raw_)) {
                const auto& gid = info.endpoint_gid();
                nodes_[std::string(gid.begin(), gid.end())] = node_of(info);
            }
        } catch (const std::exception&) {
            /* A middleware that shows none: servers are missed as a whole only. */
            nodes_.clear();
        }
        return nodes_;
    }

    /* The same, not older than `LOOK_US`. */
    const Nodes& seen() { return now_us() >= looked_us_ + LOOK_US ? look() : nodes_; }

    void add_several(const std::string& name, Texts& found)
    {
        if (seen().size() > 1) {
            std::multiset<std::string> nodes;
            for (const auto& [gid, node] : nodes_) {
                nodes.insert(node.empty() ? "a node" : node);
            }
            std::string text;
            for (const std::string& node : nodes) {
                text += (text.empty() ? ": " : ", ") + node;
            }
            found.push_back(std::to_string(nodes.size()) + " servers of " + name + text);
        }
    }

private:
    const rclcpp_lifecycle::LifecycleNode& node_;
    std::string topic_;
    bool is_raw_;
    std::uint64_t looked_us_ = 0;
    Nodes nodes_;
};

/* A client that hears every answer to a request: rclcpp's hands over the first one only. */
template <class Service>
class AskingClient : public rclcpp::Client<Service> {
public:
    using rclcpp::Client<Service>::Client;
    using Response = typename Service::Response;

    std::function<void(const Response&)> heard;

    void ask(const typename Service::Request& request)
    {
        const auto sent = this->async_send_request(std::make_shared<typename Service::Request>(request));
        this->remove_pending_request(sent.request_id);
    }

    void handle_response(std::shared_ptr<rmw_request_id_t> request_header, std::shared_ptr<void> response) override
    {
        const std::uint64_t now = now_us();
        auto& answers = answers_[request_header->sequence_number];
        answers = {answers.first + 1, now};
        if (heard) {
            heard(*std::static_pointer_cast<Response>(response));
        }
    }

    /* The largest number of answers to one request that came lately. */
    int most()
    {
        const std::uint64_t now = now_us();
        int found = 0;
        for (auto item = answers_.begin(); item != answers_.end();) {
            if (now > item->second.second + MEMORY_US) {
                item = answers_.erase(item);
            } else {
                found = std::max(found, item->second.first);
                ++item;
            }
        }
        return found;
    }

    void forget() { answers_.clear(); }

private:
    std::map<std::int64_t, std::pair<int, std::uint64_t>> answers_;
};

template <class Service>
std::shared_ptr<AskingClient<Service>> asking_client(
    rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group, const std::string& name)
{
    rcl_client_options_t options = rcl_client_get_default_options();
    options.qos = rclcpp::ServicesQoS().get_rmw_qos_profile();
    auto client = std::make_shared<AskingClient<Service>>(
        node.get_node_base_interface().get(), node.get_node_graph_interface(), name, options);
    node.get_node_services_interface()->add_client(client, group);
    return client;
}

/* Questions to the servers of one action about a goal. */
template <class Action>
class Inquiry {
public:
    using Uuid = std::array<std::uint8_t, 16>;

    Inquiry(
        rclcpp_lifecycle::LifecycleNode& node, const rclcpp::CallbackGroup::SharedPtr& group, const std::string& name)
        : living_(asking_client<Cancel>(node, group, name + "/_action/cancel_goal"))
        , ignorant_(asking_client<Result>(node, group, name + "/_action/get_result"))
    {
        ignorant_->heard = [this](const typename Result::Response& answer) {
            /* Otherwise its end is known to a server, and on the way. */
            if (answer.status != 0) {
                ignorant_->forget();
            }
        };
    }

    Inquiry(const Inquiry&) = delete;
    Inquiry& operator=(const Inquiry&) = delete;

    ~Inquiry() { ignorant_->heard = nullptr; }

    /* Ask on; true if no server that lives knows the goal; to be called again and again. */
    bool is_unknown(const Uuid& goal, std::uint64_t now)
    {
        if (!is_asking_ || goal != goal_) {
            end();
            goal_ = goal;
            is_asking_ = true;
            asked_us_ = 0;
        }
        if (asked_us_ == 0 || now >= asked_us_ + ROUND_US) {
            asked_us_ = now;
            ask();
        }
        const int living = living_->most();
        if (living == 0 || living > ignorant_->most()) {
            is_denied_ = false;
        } else if (!is_denied_) {
            is_denied_ = true;
            denied_us_ = now;
        }
        return is_denied_ && now >= denied_us_ + CERTAIN_US;
    }

    /* The full name of another service of the action. */
    std::string service(const std::string& which) const
    {
        const std::string own = living_->get_service_name();
        return own.substr(0, own.rfind('/') + 1) + which;
    }

    /* Ask no more. */
    void end()
    {
        is_asking_ = false;
        is_denied_ = false;
        living_->forget();
        ignorant_->forget();
    }

private:
    using Cancel = typename Action::Impl::CancelGoalService;
    using Result = typename Action::Impl::GetResultService;

    void ask()
    {
        typename Cancel::Request nobodys;
        typename Result::Request result;
        for (std::size_t k = 0; k < goal_.size(); k++) {
            /* The complement of a goal's UUID is that of no goal. */
            nobodys.goal_info.goal_id.uuid[k] = static_cast<std::uint8_t>(255 - goal_[k]);
            result.goal_id.uuid[k] = goal_[k];
        }
        living_->ask(nobodys);
        ignorant_->ask(result);
    }

    std::shared_ptr<AskingClient<Cancel>> living_;
    std::shared_ptr<AskingClient<Result>> ignorant_;
    Uuid goal_{};
    bool is_asking_ = false;
    bool is_denied_ = false;
    std::uint64_t asked_us_ = 0;
    std::uint64_t denied_us_ = 0;
};

/* Seconds of a limit; a node's own profile shows 0 where there is none, others show the longest time. */
inline double limit_s(const rclcpp::Duration& duration)
{
    const bool is_limited = duration.nanoseconds() > 0 && duration.nanoseconds() < INT64_MAX;
    return is_limited ? static_cast<double>(duration.nanoseconds()) / 1e9 : std::numeric_limits<double>::infinity();
}

inline std::string shown(const rclcpp::Duration& duration)
{
    const double limit = limit_s(duration);
    std::ostringstream text;
    text << "of " << limit << " s";
    return std::isinf(limit) ? "unlimited" : text.str();
}

inline std::string exceeded(const std::string& policy, const rclcpp::Duration& offered, const rclcpp::Duration& wanted)
{
    return policy + " " + shown(offered) + " is sent, " + shown(wanted) + " is taken";
}

/* Why one quality of service does not do for the other; empty if it does. */
inline std::string why_not(const rclcpp::QoS& sender, const rclcpp::QoS& receiver)
{
    if (sender.reliability() == rclcpp::ReliabilityPolicy::BestEffort
        && receiver.reliability() == rclcpp::ReliabilityPolicy::Reliable) {
        return "reliability best_effort is sent, reliable is taken";
    }
    if (sender.durability() == rclcpp::DurabilityPolicy::Volatile
        && receiver.durability() == rclcpp::DurabilityPolicy::TransientLocal) {
        return "durability volatile is sent, transient_local is taken";
    }
    /* Nobody asserts by hand that a publisher of the model lives, or promises when it sends again. */
    if (receiver.liveliness() == rclcpp::LivelinessPolicy::ManualByTopic
        && sender.liveliness() != rclcpp::LivelinessPolicy::ManualByTopic) {
        return "liveliness automatic is sent, manual_by_topic is taken";
    }
    if (limit_s(sender.deadline()) > limit_s(receiver.deadline())) {
        return exceeded("deadline", sender.deadline(), receiver.deadline());
    }
    const rclcpp::Duration lease = sender.liveliness_lease_duration();
    if (limit_s(lease) > limit_s(receiver.liveliness_lease_duration())) {
        return exceeded("liveliness_lease_duration", lease, receiver.liveliness_lease_duration());
    }
    return "";
}

/* What keeps the other ends of a topic from being connected with this node, in words. ROS 2 does not tell a node that a
   peer uses another type or quality of service: nothing is ever received. */
inline void add_misfits(Texts& found, const rclcpp_lifecycle::LifecycleNode& node, const std::string& name,
    const std::string& type, bool sends, const rclcpp::QoS& quality)
{
    std::set<std::string> texts;
    const char* const own = sends ? "sends" : "takes";
    const char* const others = sends ? "takes" : "sends";
    for (const rclcpp::TopicEndpointInfo& peer :
        sends ? node.get_subscriptions_info_by_topic(name) : node.get_publishers_info_by_topic(name)) {
        const std::string known = node_of(peer);
        const std::string start = name + ": " + (known.empty() ? "a node" : known) + " " + others;
        if (!peer.topic_type().empty() && peer.topic_type() != type) {
            texts.insert(start + " " + peer.topic_type() + ", this node " + own + " " + type);
            continue;
        }
        const std::string reason
            = sends ? why_not(quality, peer.qos_profile()) : why_not(peer.qos_profile(), quality);
        if (!reason.empty()) {
            texts.insert(start + " and this node " + own + " in vain: " + reason);
        }
    }
    found.insert(found.end(), texts.begin(), texts.end());
}

/* A service or action that others use with another type. */
inline void add_other_types(Texts& found, const std::map<std::string, std::vector<std::string>>& offered,
    const std::string& name, const std::string& service, const std::string& type)
{
    const auto types = offered.find(service);
    if (types != offered.end()) {
        for (const std::string& other : types->second) {
            if (other != type) {
                found.push_back(name + ": another node uses it as " + other + ", this node as " + type);
            }
        }
    }
}

}  // namespace robosc
