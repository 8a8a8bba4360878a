// A stand-in for rclcpp of ROS 2 Jazzy within one process: of what generated nodes use, the same signatures.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <future>
#include <initializer_list>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "builtin_interfaces/msg/time.hpp"
#include "rcl_interfaces/msg/parameter_descriptor.hpp"
#include "rcl_interfaces/msg/set_parameters_result.hpp"
#include "rosidl_runtime_cpp/traits.hpp"
#include "rmw/types.h"
#include "stand_in.hpp"

#define RCLCPP_STAND_IN_LOG(level, logger, ...)                                                                        \
    do {                                                                                                               \
        (void)(logger);                                                                                                \
        std::fprintf(stderr, "[" level "] " __VA_ARGS__);                                                              \
        std::fprintf(stderr, "\n");                                                                                    \
    } while (0)
#define RCLCPP_INFO(logger, ...)                                                                                       \
    do {                                                                                                               \
        if (rclcpp::detail::tells_info()) {                                                                            \
            RCLCPP_STAND_IN_LOG("INFO", logger, __VA_ARGS__);                                                          \
        }                                                                                                              \
    } while (0)
#define RCLCPP_WARN(logger, ...) RCLCPP_STAND_IN_LOG("WARN", logger, __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) RCLCPP_STAND_IN_LOG("ERROR", logger, __VA_ARGS__)

// The middleware of the variable that chooses one; none of them is there.
extern "C" inline const char* rmw_get_implementation_identifier(void)
{
    const char* const chosen = std::getenv("RMW_IMPLEMENTATION");
    return chosen != nullptr ? chosen : "rmw_fastrtps_cpp";
}

namespace rclcpp {

class InitOptions {};

enum class SignalHandlerOptions { All, SigInt, SigTerm, None };

class PreShutdownCallbackHandle {
public:
    std::size_t number = 0;
};

class Context {
public:
    using SharedPtr = std::shared_ptr<Context>;

    template <typename FunctionT>
    PreShutdownCallbackHandle add_pre_shutdown_callback(FunctionT callback)
    {
        PreShutdownCallbackHandle handle;
        handle.number = ++last_;
        before_shutdown[handle.number] = std::move(callback);
        return handle;
    }

    bool remove_pre_shutdown_callback(const PreShutdownCallbackHandle& callback_handle)
    {
        return before_shutdown.erase(callback_handle.number) != 0U;
    }

    std::map<std::size_t, std::function<void()>> before_shutdown;

private:
    std::size_t last_ = 0;
};

namespace detail {

inline const Context::SharedPtr& context()
{
    static const auto made = std::make_shared<Context>();
    return made;
}


inline std::vector<std::string>& arguments()
{
    static std::vector<std::string> made;
    return made;
}

// Unlike there, only if the arguments ask for it.
inline bool tells_info()
{
    const std::vector<std::string>& given = arguments();
    for (std::size_t k = 0; k + 1 < given.size(); k++) {
        if (given[k] == "--log-level" && given[k + 1] == "info") {
            return true;
        }
    }
    return false;
}

inline std::atomic<bool>& is_running()
{
    static std::atomic<bool> made{false};
    return made;
}

}  // namespace detail

inline bool ok(std::shared_ptr<Context> = nullptr) { return detail::is_running(); }

inline bool shutdown(std::shared_ptr<Context> = nullptr, const std::string& = "user called rclcpp::shutdown()")
{
    for (const auto& [number, callback] : detail::context()->before_shutdown) {
        callback();
    }
    return detail::is_running().exchange(false);
}

inline void init(int argc, char const* const* argv, const InitOptions& = InitOptions(),
    SignalHandlerOptions options = SignalHandlerOptions::All)
{
    if (options != SignalHandlerOptions::None) {
        throw std::runtime_error("the handlers of rclcpp would end the context before the robot is stopped");
    }
    detail::arguments().assign(argv, argv + argc);
    detail::is_running() = true;
    stand_in::world().manager["end"] = [](std::istream&) { shutdown(); };
}

namespace exceptions {

class InvalidParameterValueException : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace exceptions

class Logger {};

class Time {
public:
    explicit Time(int64_t nanoseconds = 0) : nanoseconds_(nanoseconds) {}

    int64_t nanoseconds() const { return nanoseconds_; }

    operator builtin_interfaces::msg::Time() const
    {
        builtin_interfaces::msg::Time message;
        message.sec = static_cast<int32_t>(nanoseconds_ / 1000000000);
        message.nanosec = static_cast<uint32_t>(nanoseconds_ % 1000000000);
        return message;
    }

private:
    int64_t nanoseconds_;
};

struct KeepLast {
    explicit KeepLast(size_t given) : depth(given) {}
    size_t depth;
};

enum class DurabilityPolicy { Volatile, TransientLocal };

enum class ReliabilityPolicy { Reliable, BestEffort };

enum class LivelinessPolicy { Automatic, ManualByTopic };

class Duration {
public:
    explicit Duration(int64_t nanoseconds) : nanoseconds_(nanoseconds) {}
    int64_t nanoseconds() const { return nanoseconds_; }

private:
    int64_t nanoseconds_;
};

class QoS {
public:
    QoS(const KeepLast& history) : depth_(history.depth) {}  // NOLINT: it is implicit there, too
    QoS(size_t depth) : depth_(depth) {}                     // NOLINT
    QoS& reliable() { return *this; }
    QoS& best_effort()
    {
        reliability_ = ReliabilityPolicy::BestEffort;
        return *this;
    }
    QoS& durability_volatile() { return *this; }
    QoS& transient_local()
    {
        durability_ = DurabilityPolicy::TransientLocal;
        return *this;
    }
    DurabilityPolicy durability() const { return durability_; }
    ReliabilityPolicy reliability() const { return reliability_; }
    // Only others have limits, as the line `shown` gives them; of a node's own profile they are 0.
    QoS& deadline(const Duration& duration)
    {
        deadline_ = duration;
        return *this;
    }
    QoS& liveliness_lease_duration(const Duration& duration)
    {
        lease_ = duration;
        return *this;
    }
    QoS& liveliness(LivelinessPolicy policy)
    {
        liveliness_ = policy;
        return *this;
    }
    Duration deadline() const { return deadline_; }
    Duration liveliness_lease_duration() const { return lease_; }
    LivelinessPolicy liveliness() const { return liveliness_; }
    size_t depth() const { return depth_; }
    int get_rmw_qos_profile() const { return 0; }

private:
    size_t depth_;
    ReliabilityPolicy reliability_ = ReliabilityPolicy::Reliable;
    DurabilityPolicy durability_ = DurabilityPolicy::Volatile;
    LivelinessPolicy liveliness_ = LivelinessPolicy::Automatic;
    Duration deadline_{0};
    Duration lease_{0};
};

class ServicesQoS : public QoS {
public:
    ServicesQoS() : QoS(10) {}
};

enum class QosPolicyKind { Depth, Durability, History, Reliability };

struct QosOverridingOptions {
    QosOverridingOptions() = default;
    QosOverridingOptions(std::initializer_list<QosPolicyKind> given) : kinds(given) {}
    std::vector<QosPolicyKind> kinds;
};

enum class IntraProcessSetting { Enable, Disable, NodeDefault };

enum class CallbackGroupType { MutuallyExclusive, Reentrant };

class CallbackGroup {
public:
    using SharedPtr = std::shared_ptr<CallbackGroup>;
};

struct PublisherOptions {
    QosOverridingOptions qos_overriding_options;
    IntraProcessSetting use_intra_process_comm = IntraProcessSetting::NodeDefault;
};

struct SubscriptionOptions {
    QosOverridingOptions qos_overriding_options;
    IntraProcessSetting use_intra_process_comm = IntraProcessSetting::NodeDefault;
    CallbackGroup::SharedPtr callback_group;
};

class NodeOptions {};

// An end of a topic, as the line `shown` gives it.
class TopicEndpointInfo {
public:
    explicit TopicEndpointInfo(const std::string& given)
    {
        std::istringstream in(given);
        std::string process;
        std::string policy;
        std::getline(in, process, ':');
        std::getline(in, name_, ':');
        std::getline(in, type_, ':');
        std::getline(in, policy, ':');
        gid_.fill(static_cast<uint8_t>(std::stoi(process)));
        // Where others have no limit, the middleware shows the longest time.
        quality_.deadline(Duration(INT64_MAX)).liveliness_lease_duration(Duration(INT64_MAX));
        if (policy == "best_effort") {
            quality_.best_effort();
        } else if (policy == "transient_local") {
            quality_.transient_local();
        } else if (policy == "deadline") {
            quality_.deadline(Duration(500000000));
        } else if (policy == "lease") {
            quality_.liveliness_lease_duration(Duration(2000000000));
        } else if (policy == "manual") {
            quality_.liveliness(LivelinessPolicy::ManualByTopic);
        }
    }
    const std::string& node_name() const { return name_; }
    const std::string& node_namespace() const { return namespace_; }
    const std::string& topic_type() const { return type_; }
    const std::array<uint8_t, 16>& endpoint_gid() const { return gid_; }
    const QoS& qos_profile() const { return quality_; }

private:
    std::string name_;
    std::string namespace_ = "/";
    std::string type_;
    std::array<uint8_t, 16> gid_{};
    QoS quality_{1};
};

class PublisherBase {
public:
    template <typename DurationRepT = int64_t, typename DurationT = std::milli>
    bool wait_for_all_acked(
        std::chrono::duration<DurationRepT, DurationT> = std::chrono::duration<DurationRepT, DurationT>(-1)) const
    {
        return true;
    }
};

template <typename MessageT, typename AllocatorT = std::allocator<void>>
class Publisher : public PublisherBase {
public:
    using SharedPtr = std::shared_ptr<Publisher>;

    Publisher(std::string topic, const QoS& qos) : topic_(std::move(topic)), qos_(qos) {}

    const char* get_topic_name() const { return topic_.c_str(); }
    QoS get_actual_qos() const { return qos_; }

    // One always listens.
    size_t get_subscription_count() const { return 1; }

    void publish(std::unique_ptr<MessageT> message) { publish(*message); }

    void publish(const MessageT& message) { stand_in::print("publish", topic_, to_yaml(message, true)); }

private:
    std::string topic_;
    QoS qos_;
};

class SubscriptionBase {
public:
    using SharedPtr = std::shared_ptr<SubscriptionBase>;
    virtual ~SubscriptionBase() = default;
    QoS get_actual_qos() const { return qos; }
    const char* get_topic_name() const { return topic.c_str(); }
    QoS qos{10};
    std::string topic;
};

template <typename MessageT>
class Subscription : public SubscriptionBase {
public:
    using SharedPtr = std::shared_ptr<Subscription>;
};

}  // namespace rclcpp

// Of rcl and rmw, what clients are made with.
struct rcl_client_options_t {
    int qos;
};

inline rcl_client_options_t rcl_client_get_default_options() { return {0}; }

namespace rclcpp {

namespace node_interfaces {

class NodeBaseInterface;
class NodeGraphInterface {
public:
    using SharedPtr = std::shared_ptr<NodeGraphInterface>;
};

}  // namespace node_interfaces

class ClientBase {
public:
    virtual ~ClientBase() = default;
    virtual void handle_response(std::shared_ptr<rmw_request_id_t> request_header, std::shared_ptr<void> response) = 0;
};

template <typename ServiceT>
class Client : public ClientBase {
public:
    using SharedPtr = std::shared_ptr<Client>;
    using SharedRequest = std::shared_ptr<typename ServiceT::Request>;
    using SharedResponse = std::shared_ptr<typename ServiceT::Response>;
    using Promise = std::promise<SharedResponse>;
    using SharedFuture = std::shared_future<SharedResponse>;

    struct SharedFutureAndRequestId {
        SharedFuture future;
        int64_t request_id;
    };

    // Of an action's own services, as `asked` says, each server answers every request.
    Client(node_interfaces::NodeBaseInterface*, node_interfaces::NodeGraphInterface::SharedPtr,
        const std::string& service_name, rcl_client_options_t&)
        : name_(service_name)
    {
    }

    explicit Client(const std::string& name) : name_(name) { listen(); }

    bool service_is_ready() const { return stand_in::world().servers[name_]; }

    const char* get_service_name() const { return name_.c_str(); }

    struct FutureAndRequestId {
        std::future<SharedResponse> future;
        int64_t request_id;
    };

    FutureAndRequestId async_send_request(SharedRequest)
    {
        const int64_t number = ++last_;
        const size_t mark = name_.find("/_action/");
        const auto counts = stand_in::world().asked[name_.substr(0, mark)];
        const int count = name_.substr(mark) == "/_action/cancel_goal" ? counts.first : counts.second;
        for (int k = 0; k < count; k++) {
            stand_in::world().answers.push_back([this, number] {
                auto header = std::make_shared<rmw_request_id_t>();
                header->sequence_number = number;
                handle_response(header, std::make_shared<typename ServiceT::Response>());
            });
        }
        return {{}, number};
    }

    void handle_response(std::shared_ptr<rmw_request_id_t>, std::shared_ptr<void>) override {}

    template <typename CallbackT>
    SharedFutureAndRequestId async_send_request(SharedRequest request, CallbackT&& callback)
    {
        const int64_t number = ++last_;
        // Of several clients of a service the one that called last is answered.
        listen();
        stand_in::print("call", name_, to_yaml(*request, true));
        pending_[number] = std::forward<CallbackT>(callback);
        return {{}, number};
    }

    bool remove_pending_request(int64_t request_id) { return pending_.erase(request_id) != 0U; }

private:
    void listen()
    {
        stand_in::world().orders[{"answer", name_}] = [this](std::istream& in) {
            if (pending_.empty()) {
                stand_in::print("nobody waits for", name_, "");
                return;
            }
            Promise promise;
            promise.set_value(std::make_shared<typename ServiceT::Response>(
                stand_in::parsed<typename ServiceT::Response>(in)));
            const auto callback = pending_.begin()->second;
            pending_.erase(pending_.begin());
            callback(promise.get_future().share());
        };
    }

    std::string name_;
    int64_t last_ = 0;
    std::map<int64_t, std::function<void(SharedFuture)>> pending_;
};

template <typename ServiceT>
class Service {
public:
    using SharedPtr = std::shared_ptr<Service>;
    using Request = typename ServiceT::Request;
    using Response = typename ServiceT::Response;
    using Callback = std::function<void(std::shared_ptr<rmw_request_id_t>, std::shared_ptr<Request>)>;

    Service(const std::string& name, Callback callback) : name_(name)
    {
        stand_in::world().orders[{"ask_call", name}] = [callback](std::istream& in) {
            const auto header = std::make_shared<rmw_request_id_t>();
            in >> header->sequence_number;
            callback(header, std::make_shared<Request>(stand_in::parsed<Request>(in)));
        };
    }

    void send_response(rmw_request_id_t& req_id, Response& response)
    {
        stand_in::print("answer", name_, std::to_string(req_id.sequence_number) + " " + to_yaml(response, true));
    }

private:
    std::string name_;
};

enum ParameterType : uint8_t {
    PARAMETER_NOT_SET,
    PARAMETER_BOOL,
    PARAMETER_INTEGER,
    PARAMETER_DOUBLE,
    PARAMETER_STRING,
    PARAMETER_BYTE_ARRAY,
    PARAMETER_BOOL_ARRAY,
    PARAMETER_INTEGER_ARRAY,
    PARAMETER_DOUBLE_ARRAY,
    PARAMETER_STRING_ARRAY,
};

class ParameterValue {
public:
    ParameterValue() = default;
    explicit ParameterValue(bool value) : value_(value) {}
    explicit ParameterValue(int value) : value_(static_cast<int64_t>(value)) {}
    explicit ParameterValue(int64_t value) : value_(value) {}
    explicit ParameterValue(double value) : value_(value) {}
    explicit ParameterValue(const std::string& value) : value_(value) {}
    explicit ParameterValue(const char* value) : value_(std::string(value)) {}
    explicit ParameterValue(const std::vector<std::string>& value) : value_(value) {}

    ParameterType get_type() const
    {
        static const ParameterType types[] = {PARAMETER_NOT_SET, PARAMETER_BOOL, PARAMETER_INTEGER, PARAMETER_DOUBLE,
            PARAMETER_STRING, PARAMETER_STRING_ARRAY};
        return types[value_.index()];
    }

    template <typename T>
    const T& get() const
    {
        return std::get<T>(value_);
    }

private:
    std::variant<std::monostate, bool, int64_t, double, std::string, std::vector<std::string>> value_;
};

inline std::string to_string(const ParameterValue&) { return "not set"; }

class Parameter {
public:
    Parameter(std::string name, ParameterValue value) : name_(std::move(name)), value_(std::move(value)) {}
    const std::string& get_name() const { return name_; }
    const ParameterValue& get_parameter_value() const { return value_; }

private:
    std::string name_;
    ParameterValue value_;
};

namespace node_interfaces {

class NodeBaseInterface {
public:
    using SharedPtr = std::shared_ptr<NodeBaseInterface>;
    Context::SharedPtr get_context() { return detail::context(); }
};

struct OnSetParametersCallbackHandle {
    using SharedPtr = std::shared_ptr<OnSetParametersCallbackHandle>;
    std::function<rcl_interfaces::msg::SetParametersResult(const std::vector<Parameter>&)> callback;
};

class NodeServicesInterface {
public:
    using SharedPtr = std::shared_ptr<NodeServicesInterface>;
    void add_client(std::shared_ptr<ClientBase>, CallbackGroup::SharedPtr) {}
    std::string resolve_service_name(const std::string& name) const { return name.front() == '/' ? name : "/" + name; }
};

class NodeParametersInterface {
public:
    using SharedPtr = std::shared_ptr<NodeParametersInterface>;

    const std::map<std::string, ParameterValue>& get_parameter_overrides() const { return overrides; }

    std::map<std::string, ParameterValue> overrides;
};

}  // namespace node_interfaces

// Members of nodes of every kind; the text is the same for rclcpp::Node and rclcpp_lifecycle::LifecycleNode there.
class StandInNode {
public:
    using OnSetParametersCallbackHandle = node_interfaces::OnSetParametersCallbackHandle;

    explicit StandInNode(const std::string& name)
        : name_(name)
        , base_(std::make_shared<node_interfaces::NodeBaseInterface>())
        , parameters_(std::make_shared<node_interfaces::NodeParametersInterface>())
    {
        const std::vector<std::string>& given = detail::arguments();
        for (size_t k = 0; k + 1 < given.size(); k++) {
            const size_t mark = given[k + 1].find(":=");
            if (given[k] == "-r" && given[k + 1].substr(0, mark) == "__ns") {
                namespace_ = given[k + 1].substr(mark + 2);
            } else if (given[k] == "-p" && mark != std::string::npos) {
                parameters_->overrides[given[k + 1].substr(0, mark)] = parsed(given[k + 1].substr(mark + 2));
            }
        }
        const auto simulated = parameters_->overrides.find("use_sim_time");
        declared_["use_sim_time"] = simulated == parameters_->overrides.end() ? ParameterValue(false) : simulated->second;
        stand_in::world().manager["set"] = [this](std::istream& in) { set(in); };
    }

    // Relative names are found in the namespace.
    std::string resolved(const std::string& name) const
    {
        const std::string space = namespace_ == "/" ? "" : namespace_;
        return name.front() == '/' ? name
            : name.front() == '~'  ? space + "/" + name_ + name.substr(1)
                                   : space + "/" + name;
    }

    const char* get_fully_qualified_name() const
    {
        full_ = resolved(name_);
        return full_.c_str();
    }

    Logger get_logger() const { return {}; }

    // Simulated time is what the last line `clock` said.
    Time now() const
    {
        if (declared_.at("use_sim_time").get<bool>()) {
            return Time(stand_in::world().clock_ns);
        }
        return Time(std::chrono::duration_cast<std::chrono::nanoseconds>(
            std::chrono::system_clock::now().time_since_epoch())
                        .count());
    }

    const ParameterValue& declare_parameter(const std::string& name, const ParameterValue& default_value,
        const rcl_interfaces::msg::ParameterDescriptor& descriptor = rcl_interfaces::msg::ParameterDescriptor(),
        bool ignore_override = false)
    {
        const auto found = parameters_->overrides.find(name);
        const bool is_given = found != parameters_->overrides.end() && !ignore_override;
        if (is_given && found->second.get_type() == PARAMETER_DOUBLE) {
            for (const auto& range : descriptor.floating_point_range) {
                const double value = found->second.get<double>();
                if (!(value >= range.from_value && value <= range.to_value)) {
                    throw exceptions::InvalidParameterValueException("out of its range: " + name);
                }
            }
        }
        read_only_[name] = descriptor.read_only;
        return declared_[name] = is_given ? found->second : default_value;
    }

    bool has_parameter(const std::string& name) const { return declared_.count(name) > 0; }

    Parameter get_parameter(const std::string& name) const { return Parameter(name, declared_.at(name)); }

    [[nodiscard]] OnSetParametersCallbackHandle::SharedPtr add_on_set_parameters_callback(
        std::function<rcl_interfaces::msg::SetParametersResult(const std::vector<Parameter>&)> callback)
    {
        const auto handle = std::make_shared<OnSetParametersCallbackHandle>();
        handle->callback = std::move(callback);
        may_set_ = handle;
        return handle;
    }

    node_interfaces::NodeBaseInterface::SharedPtr get_node_base_interface() { return base_; }

    CallbackGroup::SharedPtr create_callback_group(
        CallbackGroupType, bool automatically_add_to_executor_with_node = true)
    {
        (void)automatically_add_to_executor_with_node;
        return std::make_shared<CallbackGroup>();
    }

    node_interfaces::NodeParametersInterface::SharedPtr get_node_parameters_interface() { return parameters_; }

    node_interfaces::NodeGraphInterface::SharedPtr get_node_graph_interface() { return nullptr; }

    node_interfaces::NodeServicesInterface::SharedPtr get_node_services_interface()
    {
        return std::make_shared<node_interfaces::NodeServicesInterface>();
    }

    std::vector<TopicEndpointInfo> get_publishers_info_by_topic(const std::string& topic_name, bool no_mangle = false) const
    {
        std::vector<TopicEndpointInfo> found;
        for (const std::string& end : stand_in::world().shown[no_mangle ? topic_name : resolved(topic_name)]) {
            found.emplace_back(end);
        }
        return found;
    }

    std::vector<TopicEndpointInfo> get_subscriptions_info_by_topic(
        const std::string& topic_name, bool no_mangle = false) const
    {
        return get_publishers_info_by_topic(topic_name, no_mangle);
    }

    std::map<std::string, std::vector<std::string>> get_service_names_and_types() const
    {
        return stand_in::world().offered;
    }

    template <typename MessageT, typename CallbackT>
    typename Subscription<MessageT>::SharedPtr create_subscription(
        const std::string& topic_name, const QoS& qos, CallbackT&& callback, const SubscriptionOptions& = {})
    {
        const auto made = std::make_shared<Subscription<MessageT>>();
        made->qos = qos;
        made->topic = resolved(topic_name);
        stand_in::world().topics[resolved(topic_name)].push_back(
            [made = std::weak_ptr<Subscription<MessageT>>(made),
                function = std::function<void(typename MessageT::ConstSharedPtr)>(callback)](std::istream& in) {
                if (made.lock() != nullptr) {
                    function(std::make_shared<const MessageT>(stand_in::parsed<MessageT>(in)));
                }
            });
        return made;
    }

    template <typename ServiceT>
    typename Client<ServiceT>::SharedPtr create_client(
        const std::string& service_name, const QoS& = ServicesQoS(), CallbackGroup::SharedPtr = nullptr)
    {
        return std::make_shared<Client<ServiceT>>(resolved(service_name));
    }

    template <typename ServiceT, typename CallbackT>
    typename Service<ServiceT>::SharedPtr create_service(const std::string& service_name, CallbackT&& callback,
        const QoS& = ServicesQoS(), CallbackGroup::SharedPtr = nullptr)
    {
        return std::make_shared<Service<ServiceT>>(resolved(service_name), callback);
    }

private:
    void set(std::istream& in)
    {
        std::string name;
        std::string text;
        in >> name >> text;
        const auto handle = may_set_.lock();
        auto result = handle->callback({Parameter(name, parsed(text))});
        if (read_only_[name]) {
            result.successful = false;
            result.reason = "parameter '" + name + "' cannot be set because it is read-only";
        }
        if (result.successful) {
            declared_[name] = parsed(text);
        }
        stand_in::print("set", name, result.successful ? "done" : result.reason);
    }

    static ParameterValue parsed(const std::string& text)
    {
        if (text == "true" || text == "false") {
            return ParameterValue(text == "true");
        }
        if (text.size() > 1 && text.front() == '[') {
            std::vector<std::string> items;
            std::istringstream in(text.substr(1, text.size() - 2));
            for (std::string item; std::getline(in, item, ',');) {
                items.push_back(item);
            }
            return ParameterValue(items);
        }
        size_t end = 0;
        try {
            const double number = std::stod(text, &end);
            if (end == text.size()) {
                return text.find_first_of(".e") == std::string::npos ? ParameterValue(static_cast<int64_t>(number))
                                                                     : ParameterValue(number);
            }
        } catch (const std::exception&) {
            end = 0;
        }
        return ParameterValue(text);
    }

    std::string name_;
    std::string namespace_ = "/";
    mutable std::string full_;
    node_interfaces::NodeBaseInterface::SharedPtr base_;
    std::weak_ptr<OnSetParametersCallbackHandle> may_set_;
    node_interfaces::NodeParametersInterface::SharedPtr parameters_;
    std::map<std::string, ParameterValue> declared_;
    std::map<std::string, bool> read_only_;
};

class Node : public StandInNode {
public:
    explicit Node(const std::string& node_name, const NodeOptions& = NodeOptions()) : StandInNode(node_name) {}
};

template <typename MessageT, typename NodeT>
typename Publisher<MessageT>::SharedPtr create_publisher(
    NodeT&& node, const std::string& topic_name, const QoS& qos, const PublisherOptions& = PublisherOptions())
{
    return std::make_shared<Publisher<MessageT>>(node.resolved(topic_name), qos);
}

struct ExecutorOptions {
    Context::SharedPtr context;
};

namespace executors {

class SingleThreadedExecutor {
public:
    explicit SingleThreadedExecutor(const ExecutorOptions& = ExecutorOptions()) {}

    void add_node(std::shared_ptr<node_interfaces::NodeBaseInterface> node_ptr, bool notify = true)
    {
        (void)notify;
        node_ = std::move(node_ptr);
    }

    void add_callback_group(
        CallbackGroup::SharedPtr group_ptr, node_interfaces::NodeBaseInterface::SharedPtr, bool notify = true)
    {
        (void)notify;
        group_ = std::move(group_ptr);
    }

    void spin_once(std::chrono::nanoseconds timeout = std::chrono::nanoseconds(-1))
    {
        const auto whole = std::chrono::duration_cast<std::chrono::milliseconds>(timeout);
        stand_in::step(static_cast<int>(whole.count()), node_ != nullptr);
    }

    void spin_all(std::chrono::nanoseconds max_duration)
    {
        const auto limit = std::chrono::steady_clock::now() + max_duration;
        // The node looks at the clock after each spin: none of its times goes by unseen.
        while (std::chrono::steady_clock::now() < limit && stand_in::step(0, node_ != nullptr, false)) {
        }
    }

private:
    node_interfaces::NodeBaseInterface::SharedPtr node_;
    CallbackGroup::SharedPtr group_;
};

}  // namespace executors

}  // namespace rclcpp
