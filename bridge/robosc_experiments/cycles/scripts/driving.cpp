/* Measures cycles of generated C that drives and publishes a Twist through roscpp or rclcpp. `@...@` is filled in.

   Usage: driving RUNS CYCLES; prints a line of JSON: seconds of each `cycle`, and of each `publish` alone. */
#include "driving_@middleware@.hpp"
#include "model.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

namespace {

constexpr int WARM_UP = 50;
constexpr double LIMIT_S = 20.0;
constexpr auto PAUSE = std::chrono::milliseconds(1);
const double ranges[] = {@ranges@};

middleware::Twist message;

bool publish(void *context, const @p@_request_t *request)
{
    if (request->communication == @communication@) {
        message = middleware::Twist();
        @package@::model::@fill@(*request, message);
        static_cast<middleware::Publishing *>(context)->publish(message);
    }
    return true;
}

bool publish_default(void *, @p@_topic_t)
{
    return true;
}

std::chrono::nanoseconds now()
{
    return std::chrono::steady_clock::now().time_since_epoch();
}

template <class Work>
double timed(Work work)
{
    std::this_thread::sleep_for(PAUSE);
    const auto begin = now();
    work();
    return std::chrono::duration<double>(now() - begin).count();
}

void print(const char *name, const std::vector<double> &samples)
{
    std::printf("\"%s\": [", name);
    for (std::size_t place = 0; place < samples.size(); place++) {
        std::printf("%s%.9f", place ? ", " : "", samples[place]);
    }
    std::printf("]");
}

}  // namespace

int main(int argc, char **argv)
{
    if (argc != 3) {
        return 2;
    }
    middleware::Publishing publishing(argc, argv, "@topic@");
    const auto began = now();
    while (publishing.subscribers() == 0) {
        if (std::chrono::duration<double>(now() - began).count() > LIMIT_S) {
            std::fprintf(stderr, "no subscriber came\n");
            return 1;
        }
        std::this_thread::sleep_for(10 * PAUSE);
    }
    @p@_callbacks_t callbacks = @p@_callbacks_t();
    callbacks.context = &publishing;
    callbacks.publish = publish;
    callbacks.publish_default = publish_default;
    @p@_data_Scan_t scan = @p@_data_Scan_t();
    scan.ranges.items = ranges;
    scan.ranges.length = sizeof ranges / sizeof *ranges;
    std::vector<double> cycles, alone;
    uint64_t now_us = 0;
    static @p@_t r;
    for (int run = 0; run < std::atoi(argv[1]); run++) {
        if (!@p@_init(&r, nullptr, &callbacks)) {
            return 1;
        }
        @p@_start(&r, now_us);
        @p@_receive_@first@;
        for (int number = -WARM_UP; number < std::atoi(argv[2]); number++) {
            @p@_receive_scan(&r, ++now_us, &scan);
            const double cycle_s = timed([&] { @p@_tick(&r, ++now_us); });
            const double publish_s = timed([&] { publishing.publish(message); });
            if (number >= 0) {
                cycles.push_back(cycle_s);
                alone.push_back(publish_s);
            }
        }
    }
    if (message.linear.x <= 0.0) {
        std::fprintf(stderr, "the robot did not move\n");
        return 1;
    }
    std::printf("\n{");
    print("cycle", cycles);
    std::printf(", ");
    print("publish", alone);
    std::printf("}\n");
    return 0;
}
