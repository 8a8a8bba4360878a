/* Measures cycles of a generated controller while its sensors change; prints the seconds of each. `@...@` is filled in. */
#define _POSIX_C_SOURCE 199309L
#include "@p@.h"
#include <stdio.h>
#include <time.h>

static double ranges[2][360];
static volatile unsigned sink;
static @p@_t r;

static bool publish(void *context, const @p@_request_t *request)
{
    (void)context;
    sink += (unsigned)request->communication;
    return true;
}

static bool publish_default(void *context, @p@_topic_t topic)
{
    (void)context;
    sink += (unsigned)topic;
    return true;
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

int main(void)
{
    @p@_callbacks_t callbacks = {0};
    uint64_t now_us = 0;
    callbacks.publish = publish;
    callbacks.publish_default = publish_default;
    for (int beam = 0; beam < 360; beam++) {
        ranges[0][beam] = 3.0;
        ranges[1][beam] = 0.2;
    }
    for (int run = 0; run < @runs@; run++) {
        if (!@p@_init(&r, NULL, &callbacks)) {
            return 1;
        }
        @p@_start(&r, now_us);
        for (int number = 0; number < @cycles@; number++) {
            double begin;
            if (number % 2) {
                const @p@_data_Scan_t scan = {{ranges[number / 50 % 2], 360}};
                @p@_receive_scan(&r, ++now_us, &scan);
            } else {
                @p@_receive_@other@;
            }
            begin = now_s();
            @p@_tick(&r, ++now_us);
            printf("%.9f\n", now_s() - begin);
        }
    }
    return 0;
}
