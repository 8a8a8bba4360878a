/* The life of a node, whatever the middleware: its loop, its orderly end, its exit status. */

#pragma once

#include <cstdint>
#include <iostream>
#include <string>

#include "controller.hpp"
#include "signals.hpp"

namespace robosc {

/* For so long, at most, what has come is taken in before anything is decided. */
constexpr std::uint64_t DRAIN_US = 50000;

inline void complain(const std::string& text)
{
    std::string line;
    for (const char one : text) {
        line += one == '\n' || one == '\r' ? ' ' : one;
    }
    std::cerr << model::PACKAGE << ": " << line << std::endl;
}

/* Finish what was stopped: await the ends of cancelled goals, let `deliver` give what was sent last time to arrive, and
   close the event log. A goal that no server has answered may begin to run, and a server that has not answered a cancel
   may go on: this is waited for longer, and is a fault in the end. */
template <class Spin, class Deliver>
void finish(Controller& controller, const Spin& spin, const Deliver& deliver)
{
    try {
        const std::uint64_t began = now_us();
        while ((controller.is_stopping() && now_us() < began + CANCEL_WAIT_US)
            || (controller.is_unsettled() && now_us() < began + UNDO_US)) {
            spin(20000);
            controller.advance();
            controller.check();
        }
        controller.give_up();
    } catch (const std::exception& failure) {
        controller.stop(failure.what(), true);
    }
    deliver();
    controller.close();
}

/* Run until a signal, a fault or `is_over`, then stop the robot: the exit status. `spin` waits at most so many
   microseconds for the first that comes, and handles all that is there by then: nothing is decided on less. `is_over`
   throws where the end is a fault. */
template <class Spin, class IsOver, class Deliver>
int run(Controller& controller, const Spin& spin, const IsOver& is_over, const Deliver& deliver)
{
    try {
        controller.start();
        while (signal_name() == nullptr && controller.fault() == nullptr && !is_over()) {
            spin(controller.idle_us());
            controller.run_due();
        }
        /* After a fault the zero is sent again, for a receiver that missed the first one. */
        controller.stop(controller.fault() != nullptr ? "fault" : signal_name() != nullptr ? signal_name() : "shutdown");
    } catch (const std::exception& failure) {
        controller.stop(failure.what(), true);
    }
    finish(controller, spin, deliver);
    const std::string* fault = controller.fault();
    if (fault != nullptr) {
        complain(*fault);
    }
    return fault == nullptr ? EXIT_OK : EXIT_FAULT;
}

}  // namespace robosc
