// Measures cycles of generated C that publishes a Twist through roscpp; prints a line of JSON. `@...@` is filled in.

#include "@p@.h"

#include <geometry_msgs/Twist.h>
#include <ros/ros.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

static ros::Publisher publisher;
static geometry_msgs::Twist message;
static double ranges[360];
static @p@_t r;
static uint64_t now_us = 0;

static bool publish(void *, const @p@_request_t *request)
{
    if (request->communication == @P@_COMMUNICATION_move) {
        message.linear.x = request->data.move.linear.x;
        publisher.publish(message);
    }
    return true;
}

static bool publish_default(void *, @p@_topic_t)
{
    return true;
}

static double now_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

static void print(const char *name, const std::vector<double> &samples)
{
    std::printf("\"%s\": [", name);
    for (std::size_t place = 0; place < samples.size(); place++) {
        std::printf("%s%.9f", place ? ", " : "", samples[place]);
    }
    std::printf("]");
}

int main(int argc, char **argv)
{
    ros::init(argc, argv, "measured");
    ros::NodeHandle node;
    publisher = node.advertise<geometry_msgs::Twist>("/cmd_vel", 10);
    const double limit_s = now_s() + 20.0;
    while (publisher.getNumSubscribers() == 0) {
        if (now_s() > limit_s) {
            return 1;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    @p@_callbacks_t callbacks = @p@_callbacks_t();
    callbacks.publish = publish;
    callbacks.publish_default = publish_default;
    for (double &range : ranges) {
        range = 3.0;
    }
    std::vector<double> cycles, alone;
    for (int run = 0; run < 3; run++) {
        if (!@p@_init(&r, nullptr, &callbacks)) {
            return 1;
        }
        @p@_start(&r, now_us);
        @other@;
        @p@_data_Scan_t scan = @p@_data_Scan_t();
        scan.ranges.items = ranges;
        scan.ranges.length = 360;
        @p@_receive_scan(&r, ++now_us, &scan);
        for (int number = -50; number < 1000; number++) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            const double begin = now_s();
            @p@_tick(&r, ++now_us);
            const double middle = now_s();
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            const double again = now_s();
            publisher.publish(message);
            const double end = now_s();
            if (number >= 0) {
                cycles.push_back(middle - begin);
                alone.push_back(end - again);
            }
        }
    }
    if (message.linear.x <= 0.0) {
        return 1;
    }
    std::printf("\n{");
    print("cycle", cycles);
    std::printf(", ");
    print("publish", alone);
    std::printf("}\n");
    return 0;
}
