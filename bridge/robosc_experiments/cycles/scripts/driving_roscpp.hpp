// Publishing through roscpp, as `driving.cpp` does it.
#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/ros.h>

#include <cstddef>
#include <memory>

namespace middleware {

using Twist = geometry_msgs::Twist;

class Publishing {
public:
    Publishing(int argc, char **argv, const char *topic)
    {
        ros::init(argc, argv, "measured");
        node_ = std::make_unique<ros::NodeHandle>();
        publisher_ = node_->advertise<Twist>(topic, 10);
    }

    std::size_t subscribers() const { return publisher_.getNumSubscribers(); }

    void publish(const Twist &message) { publisher_.publish(message); }

private:
    std::unique_ptr<ros::NodeHandle> node_;
    ros::Publisher publisher_;
};

}  // namespace middleware
