// A stand-in for rclcpp_lifecycle of ROS 2 Jazzy within one process: of what generated nodes use, the same signatures.

#pragma once

#include <cstdint>
#include <string>

#include "lifecycle_msgs/msg/state.hpp"
#include "rclcpp/rclcpp.hpp"

namespace rclcpp_lifecycle {

class State {
public:
    explicit State(uint8_t id) : id_(id) {}
    uint8_t id() const { return id_; }

private:
    uint8_t id_;
};

namespace node_interfaces {

class LifecycleNodeInterface {
public:
    enum class CallbackReturn : uint8_t { SUCCESS = 97, FAILURE = 98, ERROR = 99 };

    virtual CallbackReturn on_configure(const State& previous_state) = 0;
    virtual CallbackReturn on_cleanup(const State& previous_state) = 0;
    virtual CallbackReturn on_shutdown(const State& previous_state) = 0;
    virtual CallbackReturn on_activate(const State& previous_state) = 0;
    virtual CallbackReturn on_deactivate(const State& previous_state) = 0;
    virtual CallbackReturn on_error(const State& previous_state) = 0;
    virtual ~LifecycleNodeInterface() = default;
};

}  // namespace node_interfaces

class LifecycleNode : public node_interfaces::LifecycleNodeInterface, public rclcpp::StandInNode {
public:
    explicit LifecycleNode(const std::string& node_name, const rclcpp::NodeOptions& = rclcpp::NodeOptions(),
        bool enable_communication_interface = true)
        : StandInNode(node_name)
    {
        (void)enable_communication_interface;
        stand_in::world().manager["change"] = [this](std::istream& in) { change(in); };
    }

    const State& get_current_state() const { return state_; }
    const State& configure() { return change(UNCONFIGURED, INACTIVE, &LifecycleNode::on_configure); }
    const State& activate() { return change(INACTIVE, ACTIVE, &LifecycleNode::on_activate); }
    const State& deactivate() { return change(ACTIVE, INACTIVE, &LifecycleNode::on_deactivate); }
    const State& cleanup() { return change(INACTIVE, UNCONFIGURED, &LifecycleNode::on_cleanup); }
    const State& shutdown() { return change(state_.id(), FINALIZED, &LifecycleNode::on_shutdown); }

private:
    static constexpr uint8_t UNCONFIGURED = lifecycle_msgs::msg::State::PRIMARY_STATE_UNCONFIGURED;
    static constexpr uint8_t INACTIVE = lifecycle_msgs::msg::State::PRIMARY_STATE_INACTIVE;
    static constexpr uint8_t ACTIVE = lifecycle_msgs::msg::State::PRIMARY_STATE_ACTIVE;
    static constexpr uint8_t FINALIZED = lifecycle_msgs::msg::State::PRIMARY_STATE_FINALIZED;

    using Callback = CallbackReturn (LifecycleNodeInterface::*)(const State&);

    const State& change(uint8_t from, uint8_t to, Callback callback)
    {
        if (state_.id() == from) {
            const CallbackReturn result = (this->*callback)(state_);
            if (result == CallbackReturn::SUCCESS) {
                state_ = State(to);
            } else if (result == CallbackReturn::ERROR) {
                state_ = State(on_error(state_) == CallbackReturn::SUCCESS ? UNCONFIGURED : FINALIZED);
            }
        }
        return state_;
    }

    void change(std::istream& in)
    {
        std::string name;
        in >> name;
        const State& reached = name == "configure" ? configure()
            : name == "activate"                   ? activate()
            : name == "deactivate"                 ? deactivate()
            : name == "cleanup"                    ? cleanup()
                                                   : shutdown();
        stand_in::print("state", name, std::to_string(reached.id()));
    }

    State state_{UNCONFIGURED};
};

}  // namespace rclcpp_lifecycle
