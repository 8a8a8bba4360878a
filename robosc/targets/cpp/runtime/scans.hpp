/* Scans of any LiDAR as 360 ranges, one for each degree counter-clockwise from straight ahead. */

#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace robosc {

/* The same sensor_msgs/LaserScan with the smallest valid range of each degree; NaN where there is none. */
template <class Scan>
Scan resampled(const Scan& given)
{
    constexpr std::size_t BINS = 360;
    constexpr double BINS_PER_RADIAN = BINS / (2.0 * 3.14159265358979323846);
    constexpr float NONE = std::numeric_limits<float>::infinity();
    Scan scan = given;
    std::array<float, BINS> smallest;
    smallest.fill(NONE);
    const double angle = given.angle_min;
    const double increment = given.angle_increment;
    if (std::isfinite(angle) && std::isfinite(increment)) {
        const double first = angle * BINS_PER_RADIAN + 0.5;
        const double step = increment * BINS_PER_RADIAN;
        for (std::size_t beam = 0; beam < given.ranges.size(); beam++) {
            const float range = given.ranges[beam];
            /* False for NaN. */
            if (range >= given.range_min && range <= given.range_max) {
                /* A remainder before the floor: angles that are far too large stay numbers of bins. */
                double bin = std::fmod(first + static_cast<double>(beam) * step, static_cast<double>(BINS));
                bin = bin < 0.0 ? bin + static_cast<double>(BINS) : bin;
                float& known = smallest[static_cast<std::size_t>(bin) % BINS];
                known = range < known ? range : known;
            }
        }
    }
    scan.ranges.resize(BINS);
    for (std::size_t bin = 0; bin < BINS; bin++) {
        scan.ranges[bin] = smallest[bin] == NONE ? std::numeric_limits<float>::quiet_NaN() : smallest[bin];
    }
    /* The values of single beams mean nothing any more. */
    scan.intensities.clear();
    scan.time_increment = 0.0F;
    scan.angle_min = 0.0F;
    scan.angle_increment = static_cast<float>(1.0 / BINS_PER_RADIAN);
    scan.angle_max = static_cast<float>((BINS - 1) / BINS_PER_RADIAN);
    return scan;
}

}  // namespace robosc
