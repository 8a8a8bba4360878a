// Publishing through rclcpp, as `driving.cpp` does it.
#pragma once

#include <cstddef>
#include <memory>

#include "geometry_msgs/msg/twist.hpp"
#include "rclcpp/rclcpp.hpp"

namespace middleware {

using Twist = geometry_msgs::msg::Twist;

class Publishing {
public:
    Publishing(int argc, char **argv, const char *topic)
    {
        rclcpp::init(argc, argv, rclcpp::InitOptions(), rclcpp::SignalHandlerOptions::None);
        node_ = std::make_shared<rclcpp::Node>("measured");
        publisher_ = rclcpp::create_publisher<Twist>(*node_, topic, rclcpp::QoS(10));
    }

    ~Publishing() { rclcpp::shutdown(); }

    std::size_t subscribers() const { return publisher_->get_subscription_count(); }

    void publish(const Twist &message) { publisher_->publish(message); }

private:
    std::shared_ptr<rclcpp::Node> node_;
    rclcpp::Publisher<Twist>::SharedPtr publisher_;
};

}  // namespace middleware
