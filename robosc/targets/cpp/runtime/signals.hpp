/* Signals end the loop instead of the process: the robot is stopped first, also when its terminal is closed. */

#pragma once

#include <csignal>

namespace robosc {

inline volatile std::sig_atomic_t received_signal = 0;

inline void take_signal(int number) { received_signal = number; }

inline void catch_signals()
{
    struct sigaction action = {};
    action.sa_handler = take_signal;
    sigemptyset(&action.sa_mask);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
        sigaction(number, &action, nullptr);
    }
}

/* The name of the signal that came, or NULL. */
inline const char* signal_name()
{
    switch (received_signal) {
    case 0:
        return nullptr;
    case SIGINT:
        return "SIGINT";
    case SIGTERM:
        return "SIGTERM";
    case SIGHUP:
        return "SIGHUP";
    default:
        return "SIGQUIT";
    }
}

}  // namespace robosc
