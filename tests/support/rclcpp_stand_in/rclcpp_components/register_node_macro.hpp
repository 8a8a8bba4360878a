// A stand-in for rclcpp_components of ROS 2 Jazzy: a component is made from options, by its name.

#pragma once

#include <memory>

#include "rclcpp/rclcpp.hpp"

#define RCLCPP_COMPONENTS_REGISTER_NODE(NodeClass)                                                                     \
    namespace stand_in_component {                                                                                     \
    [[maybe_unused]] std::shared_ptr<NodeClass> (*const make)(const rclcpp::NodeOptions&)                              \
        = [](const rclcpp::NodeOptions& options) { return std::make_shared<NodeClass>(options); };                     \
    }
