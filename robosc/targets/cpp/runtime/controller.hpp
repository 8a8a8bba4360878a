/* The controller: the supervisor's engine on one side, a middleware on the other. Everything in it runs in one thread;
   only `Reports` may be filled from others. */

#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "../model.hpp"
#include "event_log.hpp"
#include "health.hpp"
#include "json.hpp"
#include "notes.hpp"
#include "parameters.hpp"
#include "state.hpp"
#include "values.hpp"

namespace robosc {

inline std::uint64_t now_us()
{
    using micros = std::chrono::microseconds;
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(std::chrono::duration_cast<micros>(now).count());
}

/* A server that was not seen for so long is lost. */
constexpr std::uint64_t LOST_US = 1000000;
constexpr std::uint64_t CANCEL_WAIT_US = 500000;
/* Time for which it is awaited, at a stop, that a server answers a goal or its cancel. */
constexpr std::uint64_t UNDO_US = 5000000;
/* Time without an answer of a server after which that is worth a warning. */
constexpr std::uint64_t ANSWER_US = 2000000;
/* Maximum interval at which it is noticed that time has passed, in microseconds. */
constexpr std::uint64_t WATCH_US = 50000;
constexpr std::uint64_t DIAGNOSTICS_US = 1000000;

constexpr int EXIT_OK = 0;
constexpr int EXIT_FAULT = 1;
constexpr int EXIT_USAGE = 2;

/* Reports of what became of calls and goals, kept until the engine may receive them: it must not be called from within
   itself. */
class Reports {
public:
    using Report = std::function<void(robot_t*, std::uint64_t, Notes&)>;

    void add(Report report)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        waiting_.push_back(std::move(report));
    }

    std::deque<Report> take()
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        return std::exchange(waiting_, {});
    }

private:
    std::mutex mutex_;
    std::deque<Report> waiting_;
};

/* Presence of a server, asked again and again: it decides when the server is lost. */
class Presence {
public:
    bool is_lost(bool is_ready, std::uint64_t now)
    {
        if (is_ready) {
            is_missed_ = false;
            return false;
        }
        missed_since_us_ = is_missed_ ? missed_since_us_ : now;
        is_missed_ = true;
        return now >= missed_since_us_ + LOST_US;
    }

    void forget() { is_missed_ = false; }

private:
    bool is_missed_ = false;
    std::uint64_t missed_since_us_ = 0;
};

/* Operations that the controller asks of the middleware. Those that fail throw. */
class Middleware {
public:
    virtual ~Middleware() = default;

#if ROBOT_IS_LAYER
#if ROBOT_LIMIT_COUNT > 0
    /* Write a number into what was sent, before that goes out. */
    virtual void set_number(const void* message, int number, double value) = 0;
#endif
    /* The robot's side: a message goes out as it came. */
    virtual void publish(int topic, const void* message) = 0;
    virtual void call(std::uint32_t id, int service, const void* message) = 0;
    virtual void send_goal(std::uint32_t id, int action, const void* message) = 0;

    /* The caller's side; a message that is NULL is the default one, with the reason in it. */
    virtual void pass_on(int source, const void* message) = 0;
    virtual void blocked(const std::string& identifier, const std::string& why) = 0;
    virtual void answer(int service, std::uint32_t caller, const void* message, const std::string& why) = 0;
    virtual void accept_goal(int action, std::uint32_t caller) = 0;
    virtual void reject_goal(int action, std::uint32_t caller, const std::string& why) = 0;
    virtual void pass_feedback(int action, std::uint32_t caller, const void* message) = 0;
    virtual void end_goal(
        int action, std::uint32_t caller, robot_end_t end, const void* message, const std::string& why) = 0;
    /* Notice callers that are gone. */
    virtual void check_callers() = 0;
#else
    /* Throws Misfit if the data of a request does not fit its message. */
    virtual void prepare(const robot_request_t& request) = 0;
    virtual void publish(const robot_request_t& request) = 0;
    virtual void call(std::uint32_t id, const robot_request_t& request) = 0;
    virtual void send_goal(std::uint32_t id, const robot_request_t& request) = 0;
#endif
    virtual void publish_default(int topic) = 0;
    virtual void cancel_goal(int action, std::uint32_t id) = 0;

    /* Names of services and actions without a server. */
    virtual Texts missing_servers() = 0;
    /* `now` is of the steady clock: a server's end is noticed also where simulated time stands still. */
    virtual void check_servers(std::uint64_t now) = 0;
    /* What keeps the node's surroundings from being of use to it, in words. */
    virtual Texts troubles() { return {}; }
    /* What may begin or run on although its cancel is wanted, in words; ask for the cancel of what may begin. */
    virtual Texts unsettled() const = 0;
    virtual void cancel_unanswered() = 0;
    /* Return true if a goal that was reported lost may be running; ask for the cancel of each. */
    virtual bool has_abandoned() const = 0;
    virtual void cancel_abandoned() = 0;

    /* The time of periods, ages and timeouts: steady, or simulated. It never goes back. */
    virtual std::uint64_t time_us() { return now_us(); }
    /* False as long as no time is known. */
    virtual bool has_time() { return true; }
    /* Return the time by which it should have gone back since this was last asked. */
    virtual std::uint64_t take_jump_us() { return 0; }
    /* Longest time, on the steady clock, until the next watch. */
    virtual std::uint64_t longest_wait_us() const { return WATCH_US; }

    virtual void publish_state(const StateReport& report) = 0;
    virtual void publish_health(const Health& health) = 0;
    virtual void info(const std::string& text) = 0;
    virtual void warn(const std::string& text) = 0;
    virtual void error(const std::string& text) = 0;
};

class Controller {
public:
    using Take = std::function<void(robot_t*, std::uint64_t, Notes&)>;

    Controller(Middleware& middleware, Reports& reports, const Parameters& parameters)
        : middleware_(middleware), reports_(reports), parameters_(parameters)
    {
        if (!parameters.log_folder.empty()) {
            try {
                log_.open(parameters.log_folder, model::PACKAGE);
            } catch (const LogError& failure) {
                throw ParameterError(std::string("parameter 'log_folder': ") + failure.what());
            }
        }
        notes_.is_active = log_.is_active();
        robot_callbacks_t callbacks{};
        callbacks.context = this;
        callbacks.publish = on_publish;
        callbacks.publish_default = on_publish_default;
        callbacks.call = on_call;
        callbacks.send_goal = on_send_goal;
        callbacks.cancel_goal = on_cancel_goal;
#if ROBOT_IS_LAYER
#if ROBOT_LIMIT_COUNT > 0
        callbacks.set_number = on_set_number;
#endif
        callbacks.pass_on = on_pass_on;
        callbacks.blocked = on_blocked;
        callbacks.answer = on_answer;
        callbacks.answer_default = on_answer_default;
        callbacks.accept_goal = on_accept_goal;
        callbacks.reject_goal = on_reject_goal;
        callbacks.pass_feedback = on_pass_feedback;
        callbacks.end_goal = on_end_goal;
#else
        callbacks.fits = on_fits;
#endif
        callbacks.log = on_log;
        if (!robot_init(&robot_, &parameters_.settings, &callbacks)) {
            throw ParameterError("the engine refuses the parameters");
        }
        before_ = robot_.state;
        last_ = robot_.counters;
        period_us_ = std::max<std::uint64_t>(detail::microseconds(parameters.period_s), 1);
        next_tick_us_ = now() + period_us_;
        next_watch_us_ = now_us() + WATCH_US;
        next_diagnosis_us_ = now_us() + DIAGNOSTICS_US;
    }

    Controller(const Controller&) = delete;
    Controller& operator=(const Controller&) = delete;

    /* Begin as soon as every server is there, or not much later without it. */
    void start()
    {
        middleware_.take_jump_us();
        if (!middleware_.has_time()) {
            middleware_.warn("use_sim_time is true: no time passes before the first message on /clock");
        }
        start_by_us_ = now() + detail::microseconds(parameters_.server_wait_s);
        is_starting_ = true;
        start_if_ready();
    }

    /* A message came on the topic with this number among those received; of each as many are held as its depth. */
    void receive(int topic, std::size_t depth, Take take)
    {
        begin_anew_after_jump();
        if (is_held_) {
            held_.push_back({topic, now(), std::move(take)});
            const auto is_same = [topic](const Held& item) { return item.topic == topic; };
            if (static_cast<std::size_t>(std::count_if(held_.begin(), held_.end(), is_same)) > depth) {
                held_.erase(std::find_if(held_.begin(), held_.end(), is_same));
            }
            return;
        }
        /* News of calls and goals came earlier. */
        advance();
        take_in(take);
        report_reasons();
    }

#if ROBOT_IS_LAYER
    /* Judge what the existing controller sends. */
    void judge(const Take& take)
    {
        begin_anew_after_jump();
        advance();
        const std::uint64_t began = now_us();
        take_in(take);
        decision_us_ = static_cast<double>(now_us() - began);
        report_reasons();
    }

#endif
    /* Do whatever is due: reports of calls and goals, decisions, time that has passed. */
    void run_due()
    {
        advance();
        begin_anew_after_jump();
        const std::uint64_t time = this->now();
        if (time >= next_tick_us_) {
            next_tick_us_ = next_after(next_tick_us_, period_us_, time);
            tick();
        }
        const std::uint64_t now = now_us();
        if (now >= next_watch_us_) {
            next_watch_us_ = next_after(next_watch_us_, WATCH_US, now);
            watch();
        }
        if (now >= next_diagnosis_us_) {
            next_diagnosis_us_ = next_after(next_diagnosis_us_, DIAGNOSTICS_US, now);
            look_around();
            publish_health();
            last_ = robot_.counters;
            last_dropped_ = log_.dropped();
        }
        advance();
    }

    /* Return the time during which nothing will be due, in microseconds; never long, so that signals are noticed. */
    std::uint64_t idle_us() const
    {
        const auto until = [](std::uint64_t next, std::uint64_t now) { return next > now ? next - now : 0; };
        return std::min({until(next_tick_us_, now()), until(next_watch_us_, now_us()),
            until(next_diagnosis_us_, now_us()), middleware_.longest_wait_us()});
    }

    /* Return the reason why a fault stopped it; NULL if none did. */
    const std::string* fault() const
    {
        for (const auto& [key, reason] : reasons_) {
            if (key == FAULT_KEY) {
                return &reason;
            }
        }
        return nullptr;
    }

    /* Bring the robot to rest: the default message on every release identifier, then the cancel of every goal. */
    void stop(const std::string& reason, bool is_fault = false)
    {
        is_starting_ = false;
        is_active_ = false;
        reason_ = reason;
        begin();
        robot_stop(&robot_, now(), is_fault);
        cancel_abandoned();
        reported_ = reasons_;
        publish_health();
    }

    /* Bring the robot to rest until `start`; what comes meanwhile is held, as before the first one. */
    void pause(const std::string& reason = "deactivated")
    {
        stop(reason);
        is_held_ = true;
    }

    /* Return true if it is at rest, but the ends of cancelled goals are awaited. */
    bool is_stopping() const
    {
        return robot_status(&robot_, now()) == ROBOT_STATUS_STOPPING || middleware_.has_abandoned();
    }

    /* Report the results of calls and goals to the engine. */
    void advance()
    {
        for (const Take& report : reports_.take()) {
            take_in(report);
            report_reasons();
        }
    }

    /* Notice what has become of servers, while it ends. */
    void check()
    {
        middleware_.check_servers(now_us());
        advance();
    }

    bool is_unsettled() const { return !middleware_.unsettled().empty(); }

    /* Report as a fault what may begin or run on, and leave its cancel to its servers. */
    void give_up()
    {
        const Texts found = middleware_.unsettled();
        guarded("no cancel of a goal", [this] { middleware_.cancel_unanswered(); });
        if (!found.empty()) {
            stop(joined(found, "; "), true);
        }
    }

    void close() { log_.close(); }

private:
    using Reasons = std::vector<std::pair<std::string, std::string>>;

    struct Held {
        int topic;
        std::uint64_t came_us;
        Take take;
    };

    static constexpr const char* FAULT_KEY = "fault";

    static std::uint64_t next_after(std::uint64_t due, std::uint64_t period, std::uint64_t now)
    {
        return due + ((now - due) / period + 1) * period;
    }

    std::uint64_t now() const { return middleware_.time_us(); }

    void begin()
    {
        began_us_ = now();
        began_steady_us_ = now_us();
    }

    /* Begin in the initial state if time has gone back: a simulation or a replayed bag has begun anew. */
    void begin_anew_after_jump()
    {
        const std::uint64_t jump_us = middleware_.take_jump_us();
        if (jump_us > 0 && is_active_ && fault() == nullptr) {
            char text[80];
            std::snprintf(text, sizeof text, "time has gone back by %.3f s", static_cast<double>(jump_us) * 1e-6);
            middleware_.warn(std::string(text) + ": beginning anew");
            pause(text);
            start();
        }
    }

    void take_in(const Take& take)
    {
        begin();
        /* A message is foreign data: a failure with it stops the robot, not the process. */
        try {
            take(&robot_, began_us_, notes_);
        } catch (const std::exception& failure) {
            reason_ = failure.what();
            robot_stop(&robot_, now(), true);
        }
#if ROBOT_IS_LAYER
        answer_failed();
#endif
        notes_.clear();
    }

    void start_if_ready()
    {
        const Texts missed = std::exchange(missing_, middleware_.missing_servers());
        if (!missing_.empty() && now() < start_by_us_) {
            if (missing_ != missed) {
                middleware_.info("waiting for the servers of " + joined(missing_));
            }
            return;
        }
        is_starting_ = false;
        if (!missing_.empty()) {
            middleware_.warn("starting without a server of " + joined(missing_));
        } else if (!missed.empty()) {
            middleware_.info("every server is there");
        }
        missing_.clear();
        begin();
        if (reasons_.empty()) {
            robot_start(&robot_, began_us_);
        } else {
            /* It was stopped; whatever it did before, it begins anew. */
            robot_restart(&robot_, began_us_);
        }
        before_ = robot_.state;
        take_held();
        is_active_ = true;
        reported_status_ = ROBOT_STATUS_NEW;
        report_reasons();
    }

    /* Take in what came early: nothing is decided before the last of it, and ages count from when it came. */
    void take_held()
    {
#if !ROBOT_IS_LAYER
        const bool decides = robot_.settings.decides_after_batch;
        robot_.settings.decides_after_batch = false;
#endif
        const std::uint64_t started = began_us_;
        is_held_ = false;
        for (const Held& item : std::exchange(held_, {})) {
            take_in(item.take);
            for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
                if (model::SENSOR_TOPICS[sensor] == item.topic) {
                    robot_.sensors[sensor].seen_us = std::min(item.came_us, started);
                }
            }
        }
#if !ROBOT_IS_LAYER
        robot_.settings.decides_after_batch = decides;
#endif
        /* A sensor whose last message is too old by now is stale already. */
        begin();
        robot_.deadline_us = began_us_;
        robot_watch(&robot_, began_us_);
    }

    void tick()
    {
        begin();
#if ROBOT_IS_LAYER
        robot_watch(&robot_, began_us_);
        answer_failed();
#else
        const bool decides = robot_status(&robot_, now()) == ROBOT_STATUS_RUNNING;
        robot_tick(&robot_, began_us_);
        if (decides) {
            decision_us_ = static_cast<double>(now_us() - began_steady_us_);
        }
#endif
        notes_.clear();
        report_reasons();
        if (parameters_.publish_state) {
            guarded("no state", [this] { middleware_.publish_state(state_report()); });
        }
    }

    void watch()
    {
        if (is_starting_) {
            start_if_ready();
        }
        middleware_.check_servers(now_us());
#if ROBOT_IS_LAYER
        middleware_.check_callers();
#endif
        begin();
        robot_watch(&robot_, began_us_);
#if ROBOT_IS_LAYER
        answer_failed();
#endif
        report_reasons();
    }

    /* Report why the robot is stopped, and when it no longer is; the console shows a fault only at the end. */
    void report_reasons()
    {
        report_status();
        if (reasons_ == reported_) {
            return;
        }
        reported_ = reasons_;
        if (!reasons_.empty()) {
            cancel_abandoned();
        }
        publish_health();
        if (fault() != nullptr && parameters_.ends_by_fault) {
            return;
        }
        if (reasons_.empty()) {
            middleware_.info("no longer stopped");
        } else {
            middleware_.error("stopped: " + reasons_text());
        }
    }

    /* Log what the robot waits for, and when it begins to run. */
    void report_status()
    {
        const robot_status_t status = robot_status(&robot_, now());
        if (status == reported_status_) {
            return;
        }
        if (status == ROBOT_STATUS_WAITING) {
            Texts unseen;
            for (int sensor = 0; sensor < ROBOT_SENSOR_COUNT; sensor++) {
                const Nameable& item = model::SENSORS[static_cast<std::size_t>(sensor)];
                const bool is_awaited = robot_.settings.max_age_us[item.number] > 0 && !robot_.sensors[sensor].was_seen;
                if (is_awaited && std::find(unseen.begin(), unseen.end(), item.identifier) == unseen.end()) {
                    unseen.emplace_back(item.identifier);
                }
            }
            if (!unseen.empty()) {
                middleware_.info("waiting for the first message of " + joined(unseen));
            }
            if (!cancelled(Stage::OLD).empty()) {
                middleware_.info("waiting for the end of the last goal of " + joined(cancelled(Stage::OLD)));
            }
            if (!old_calls().empty()) {
                middleware_.info("waiting for the end of the last call of " + joined(old_calls()));
            }
        } else if (status == ROBOT_STATUS_RUNNING && reported_status_ <= ROBOT_STATUS_WAITING) {
            middleware_.info("running");
        }
        reported_status_ = status;
    }

    /* The engine knows nothing any more of goals that were reported lost, but they may be running. */
    void cancel_abandoned()
    {
        guarded("no cancel of a lost goal", [this] { middleware_.cancel_abandoned(); });
    }

    /* Perform an action that must not stop the controller. */
    template <class Action>
    void guarded(const char* what, const Action& action)
    {
        try {
            action();
        } catch (const std::exception& failure) {
            middleware_.warn(std::string(what) + ": " + failure.what());
        }
    }

    static std::string joined(const Texts& texts, const std::string& between = ", ")
    {
        std::string result;
        for (const std::string& text : texts) {
            result += (result.empty() ? "" : between) + text;
        }
        return result;
    }

    /* Ask what keeps the surroundings from being of use, and log what is new of it. */
    void look_around()
    {
        guarded("nothing is known of other nodes", [this] {
            const Texts before = std::exchange(troubles_, middleware_.troubles());
            for (const std::string& text : troubles_) {
                if (std::find(before.begin(), before.end(), text) == before.end()) {
                    middleware_.warn(text);
                }
            }
        });
    }

    std::string reasons_text() const
    {
        std::string result;
        for (const auto& [key, reason] : reasons_) {
            result += (result.empty() ? "" : "; ") + reason;
        }
        return result;
    }

    void add_reason(const std::string& key, const std::string& reason)
    {
        for (const auto& item : reasons_) {
            if (item.first == key) {
                return;
            }
        }
        reasons_.emplace_back(key, reason);
    }

    /* Health. */

    void publish_health()
    {
        guarded("no diagnostics", [this] { middleware_.publish_health(health()); });
    }

    const char* status_text() const
    {
        static const char* const TEXTS[] = {"new", "waiting", "running", "stopping", "stopped"};
        return TEXTS[robot_status(&robot_, now())];
    }

    Health health() const
    {
        Health result;
        const robot_status_t status = robot_status(&robot_, now());
        const std::uint64_t dropped = log_.dropped();
        result.values = {
            {"status", status_text()},
            {"reason", reasons_text()},
            {"unknown", std::to_string(robot_.counters.unknown)},
            {"unexpected", std::to_string(robot_.counters.unexpected)},
            {"faults", std::to_string(robot_.counters.faults)},
            {"dropped", std::to_string(dropped)},
#if ROBOT_LIMIT_COUNT > 0
            {"limited", std::to_string(robot_.counters.limited)},
#else
            {"limited", "0"},
#endif
            {"cancelling", joined(cancelled(Stage::ASKED))},
            {"last decision (us)", decision_us_ < 0.0 ? "" : number_text(decision_us_)},
        };
        std::string news;
        const auto add_news = [&news](std::uint64_t count, const char* what) {
            if (count > 0) {
                news += (news.empty() ? "" : ", ") + std::to_string(count) + " " + what;
            }
        };
        add_news(robot_.counters.unknown - last_.unknown, "unknown");
        add_news(robot_.counters.unexpected - last_.unexpected, "unexpected");
        add_news(robot_.counters.faults - last_.faults, "faults");
        add_news(dropped - last_dropped_, "dropped");
        if (!news.empty()) {
            news = "since the last report: " + news;
        }
#if ROBOT_HAS_STRATEGY
        const std::string owed = add_progress(result);
        if (!owed.empty()) {
            news = owed + (news.empty() ? "" : "; ") + news;
        }
#endif
        result.level = Level::WARN;
        std::string faults = reasons_.empty() ? "" : "stopped: " + reasons_text();
        for (const std::string& action : cancelled(Stage::OVERDUE)) {
            faults += (faults.empty() ? "" : "; ") + ("the goal of " + action)
                + " has not ended although its cancel was asked for";
        }
        const Texts old_goals = cancelled(Stage::OLD);
        Texts warnings = troubles_;
        if (!faults.empty()) {
            result.level = Level::FAULTY;
            warnings = {faults};
        } else if (status == ROBOT_STATUS_NEW) {
            warnings.insert(
                warnings.begin(), missing_.empty() ? "not started" : "waiting for servers: " + joined(missing_));
        } else if (status == ROBOT_STATUS_WAITING && !old_goals.empty()) {
            warnings.insert(
                warnings.begin(), "waiting for the end of goals from before the restart: " + joined(old_goals));
        } else if (status == ROBOT_STATUS_WAITING && !old_calls().empty()) {
            warnings.insert(
                warnings.begin(), "waiting for the end of calls from before the restart: " + joined(old_calls()));
        } else if (status == ROBOT_STATUS_WAITING) {
            warnings.insert(warnings.begin(), "waiting for the first message of every sensor with a maximum age");
        } else if (!news.empty()) {
            warnings.push_back(news);
        } else if (warnings.empty()) {
            const Texts cancelling = cancelled(Stage::ASKED);
            result.level = Level::OK;
            warnings = {cancelling.empty() ? "running" : "running, cancelling " + joined(cancelling)};
        }
        result.message = joined(warnings, "; ");
        return result;
    }

    /* The transitions are those since the last report. */
    StateReport state_report()
    {
        StateReport report;
        report.status = status_text();
        for (const auto& [key, reason] : reasons_) {
            report.reasons.push_back(reason);
        }
        model::visit_state(robot_.state, report);
        model::visit_communications(robot_.state, report);
        report.cancelling = cancelled(Stage::ASKED);
        report.transitions = std::exchange(transitions_, {});
#if ROBOT_HAS_STRATEGY
        report.progress = progress_json();
#endif
        return report;
    }
#if ROBOT_HAS_STRATEGY

    /* Progress of the strategy. */

    static std::string or_null(const char* text)
    {
        std::string json = "null";
        if (text != nullptr) {
            json.clear();
            put_json(json, text);
        }
        return json;
    }

    const char* approached_name() const
    {
        const int aim = robot_approached(&robot_);
        return aim < 0 ? nullptr : robot_standing(&robot_, aim, 0).name;
    }

    std::string standings_json(int first, int end, std::uint64_t time_us) const
    {
        std::string text = "[";
        for (int number = first; number < end; number++) {
            const robot_standing_t found = robot_standing(&robot_, number, time_us);
            text += number > first ? ", {\"name\": " : "{\"name\": ";
            put_json(text, found.name);
            text += ", \"words\": ";
            put_json(text, found.words);
            text += ", \"is_met\": ";
            put_json(text, found.is_met);
            text += ", \"times\": " + std::to_string(found.count) + ", \"unmet_s\": ";
            text += found.is_unmet ? number_text(static_cast<double>(found.unmet_us / 1000) / 1000.0) : "null";
            text += ", \"mission\": " + or_null(found.mission) + "}";
        }
        return text + "]";
    }

    std::string missions_json() const
    {
        std::string text = "[";
        /* Nothing is known before the first stable state. */
        for (int number = 0; number < ROBOT_MISSION_COUNT && robot_.has_observed; number++) {
            const robot_mission_t found = robot_mission(&robot_, number);
            text += number > 0 ? ", {\"name\": " : "{\"name\": ";
            put_json(text, found.name);
            text += ", \"visit\": " + std::to_string(found.visit) + ", \"is_round\": ";
            put_json(text, found.is_round);
            text += ", \"rounds\": " + std::to_string(found.rounds) + ", \"detours\": [";
            for (int detour = 0; detour < found.detours; detour++) {
                text += (detour > 0 ? ", " : "") + std::to_string(robot_detour(&robot_, number, detour));
            }
            text += "]}";
        }
        return text + "]";
    }

    /* Where a mission is, in words. */
    std::string mission_text(int number) const
    {
        const robot_mission_t found = robot_mission(&robot_, number);
        std::string text = "not asked for";
        if (found.visit > 0) {
            const std::string title = std::string("mission ") + found.name;
            text = found.is_round ? "every visit is true" : at_visit(found.visit, title);
            for (int detour = 0; detour < found.detours; detour++) {
                const int visit = robot_detour(&robot_, number, detour);
                if (visit > 0) {
                    const std::string name = "detour " + std::to_string(detour + 1);
                    text += "; " + name + " under way, " + at_visit(visit, name + " of " + title);
                }
            }
        }
        return text + "; rounds made: " + std::to_string(found.rounds);
    }

    std::string at_visit(int visit, const std::string& title) const
    {
        const std::string name = "visit " + std::to_string(visit) + " of " + title;
        std::string words;
        for (int number = 0; number < ROBOT_AIM_COUNT; number++) {
            const robot_standing_t found = robot_standing(&robot_, number, 0);
            if (name == found.name) {
                words = found.words;
            }
        }
        return "at visit " + std::to_string(visit) + ", " + words;
    }

    std::string progress_json() const
    {
        const std::uint64_t time_us = now();
        const int count = ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT;
        const int chosen = robot_chosen(&robot_);
        std::string text = "{\"aims\": " + standings_json(0, ROBOT_AIM_COUNT, time_us);
        text += ", \"assumptions\": " + standings_json(ROBOT_AIM_COUNT, count, time_us) + ", \"overdue\": [";
        const char* between = "";
        for (int number = ROBOT_AIM_COUNT; number < count; number++) {
            const robot_standing_t found = robot_standing(&robot_, number, time_us);
            if (found.is_overdue) {
                text += between;
                put_json(text, found.name);
                between = ", ";
            }
        }
        text += "], \"is_followed\": ";
        put_json(text, robot_.settings.policy == ROBOT_POLICY_STRATEGY);
        text += ", \"approached\": " + or_null(approached_name());
        text += ", \"chosen\": " + or_null(chosen < 0 ? nullptr : robot_communication_name(chosen));
        text += ", \"missions\": " + missions_json();
        return text + "}";
    }

    /* Add the progress to a report; returns in words what is owed for too long. */
    std::string add_progress(Health& report) const
    {
        const std::uint64_t time_us = now();
        std::string owed;
        for (int number = 0; number < ROBOT_AIM_COUNT + ROBOT_ASSUMPTION_COUNT; number++) {
            const robot_standing_t found = robot_standing(&robot_, number, time_us);
            const std::string seconds = std::to_string((found.unmet_us + 500000) / 1000000) + " s";
            const bool is_visit = found.mission != nullptr;
            const std::string state = found.is_unmet ? (is_visit ? "wanted for " : "not for ") + seconds
                : is_visit                           ? std::string(found.is_met ? "made in this round" : "not wanted now")
                                                     : std::string(found.is_met ? "true" : "not known");
            report.values.emplace_back(
                found.name, state + ", reached " + std::to_string(found.count) + " times: " + found.words);
            if (found.is_overdue) {
                owed += (owed.empty() ? "" : "; ") + std::string(found.name) + " has been owed for " + seconds + ": "
                    + found.words;
            }
        }
        for (int number = 0; number < ROBOT_MISSION_COUNT && robot_.has_observed; number++) {
            report.values.emplace_back(
                std::string("mission ") + robot_mission(&robot_, number).name, mission_text(number));
        }
        const char* const approached = approached_name();
        const int chosen = robot_chosen(&robot_);
        report.values.emplace_back("approached", approached == nullptr ? "" : approached);
        report.values.emplace_back("chosen", chosen < 0 ? "" : robot_communication_name(chosen));
        return owed;
    }
#endif

    /* Operations that the engine asks for. */

    static Controller& self(void* context) { return *static_cast<Controller*>(context); }

    template <class Action>
    static bool attempted(void* context, const Action& action)
    {
        Controller& controller = self(context);
        try {
            action(controller.middleware_);
            return true;
        } catch (const std::exception& failure) {
            controller.failure_ = failure.what();
        } catch (...) {
            controller.failure_ = "something was thrown that is no exception";
        }
        return false;
    }

#if ROBOT_IS_LAYER
    static bool on_publish(void* context, robot_topic_t topic, const void* message)
    {
        return attempted(context, [&](Middleware& middleware) { middleware.publish(static_cast<int>(topic), message); });
    }

    static bool on_call(void* context, std::uint32_t id, robot_communication_t service, const void* message)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.call(id, static_cast<int>(service), message); });
    }

    static bool on_send_goal(void* context, std::uint32_t id, robot_communication_t action, const void* message)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.send_goal(id, static_cast<int>(action), message); });
    }

#if ROBOT_LIMIT_COUNT > 0
    static bool on_set_number(void* context, const void* message, robot_number_t number, double value)
    {
        return attempted(context,
            [&](Middleware& middleware) { middleware.set_number(message, static_cast<int>(number), value); });
    }

#endif
    static bool on_pass_on(void* context, robot_source_t source, const void* message)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.pass_on(static_cast<int>(source), message); });
    }

    static bool on_blocked(void* context, const char* identifier, robot_refusal_t why)
    {
        Controller& controller = self(context);
        const std::string text = refusal_text(why);
        controller.write_blocked(identifier, text);
        const bool is_told = controller.told_refused(text);
        return attempted(context, [&](Middleware& middleware) { middleware.blocked(identifier, text); }) && is_told;
    }

    static bool on_answer(void* context, robot_communication_t service, std::uint32_t caller, const void* message)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.answer(static_cast<int>(service), caller, message, ""); });
    }

    /* Why it is refused is known a moment later. */
    static bool on_answer_default(void* context, robot_communication_t service, std::uint32_t caller)
    {
        self(context).refused_.push_back({static_cast<int>(service), caller, false});
        return true;
    }

    static bool on_accept_goal(void* context, robot_communication_t action, std::uint32_t caller)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.accept_goal(static_cast<int>(action), caller); });
    }

    static bool on_reject_goal(void* context, robot_communication_t action, std::uint32_t caller)
    {
        self(context).refused_.push_back({static_cast<int>(action), caller, true});
        return true;
    }

    static bool on_pass_feedback(void* context, robot_communication_t action, std::uint32_t caller, const void* message)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.pass_feedback(static_cast<int>(action), caller, message); });
    }

    static bool on_end_goal(
        void* context, robot_communication_t action, std::uint32_t caller, robot_end_t end, const void* message)
    {
        const char* const why = end == ROBOT_END_ABORTED ? self(context).abort_text(action) : "";
        return attempted(context,
            [&](Middleware& middleware) { middleware.end_goal(static_cast<int>(action), caller, end, message, why); });
    }

    const char* abort_text([[maybe_unused]] robot_communication_t action) const
    {
#if ROBOT_ACTION_COUNT > 0
        switch (robot_abort_reason(&robot_, action)) {
        case ROBOT_ABORT_REJECTED:
            return "its server: rejected";
        case ROBOT_ABORT_ABORTED:
            return "its server: aborted";
        case ROBOT_ABORT_CANCELLED:
            return "its server: cancelled";
        case ROBOT_ABORT_LOST:
            return "its server: lost";
        case ROBOT_ABORT_TURNED:
            return "the supervisor cancelled it: a requirement no longer holds";
        case ROBOT_ABORT_STOP:
            return "it was cancelled, because the robot was stopped";
        case ROBOT_ABORT_FAILED:
            break;
        }
#endif
        return "it took too long, or the layer began anew";
    }

    /* Tell the callers whose calls and goals were refused; false if that failed. */
    bool told_refused(const std::string& why)
    {
        bool is_well = true;
        for (const Refused& item : std::exchange(refused_, {})) {
            const bool is_told = attempted(this, [&](Middleware& middleware) {
                if (item.is_goal) {
                    middleware.reject_goal(item.communication, item.caller, why);
                } else {
                    middleware.answer(item.communication, item.caller, nullptr, why);
                }
            });
            is_well = is_told && is_well;
        }
        return is_well;
    }

    /* Answer the calls that failed. */
    void answer_failed()
    {
        if (!told_refused("the call failed or took too long")) {
            reason_ = std::exchange(failure_, {});
            robot_stop(&robot_, now(), true);
        }
    }

    static const char* refusal_text(robot_refusal_t why)
    {
        switch (why) {
        case ROBOT_REFUSAL_NOT_ALLOWED:
            return "not allowed now";
        case ROBOT_REFUSAL_NOT_FINITE:
            return "a NaN or an infinity";
        case ROBOT_REFUSAL_NOT_KNOWN:
            return "no message of the model";
#if ROBOT_LIMIT_COUNT > 0
        case ROBOT_REFUSAL_NOT_WITHIN:
            return "no number is within all limits";
#endif
        case ROBOT_REFUSAL_STILL_RUNNING:
            return "its last goal may still be under way";
        case ROBOT_REFUSAL_NOT_STARTED:
            return "not started";
        case ROBOT_REFUSAL_WAITING:
            return "waiting for sensors";
        case ROBOT_REFUSAL_OLD_GOALS:
            return "goals from before the restart have not ended";
        case ROBOT_REFUSAL_OLD_CALLS:
            return "calls from before the restart have not been answered";
        case ROBOT_REFUSAL_STOPPED:
            return "stopped";
        default:
            return "a fault";
        }
    }

    void write_blocked(const char* identifier, const std::string& why)
    {
        if (log_.is_active()) {
            std::string line = head("blocked") + ",\"identifier\":";
            put_json(line, identifier);
            line += ",\"why\":";
            put_json(line, why);
            log_.write(line + "}");
        }
    }
#else
    static bool on_publish(void* context, const robot_request_t* request)
    {
        return attempted(context, [&](Middleware& middleware) { middleware.publish(*request); });
    }

    static bool on_call(void* context, std::uint32_t id, const robot_request_t* request)
    {
        return attempted(context, [&](Middleware& middleware) { middleware.call(id, *request); });
    }

    static bool on_send_goal(void* context, std::uint32_t id, const robot_request_t* request)
    {
        return attempted(context, [&](Middleware& middleware) { middleware.send_goal(id, *request); });
    }

    static bool on_fits(void* context, const robot_request_t* request)
    {
        Controller& controller = self(context);
        controller.failure_.clear();
        const int event = model::REQUEST_EVENTS[request->communication];
        const bool fits = attempted(context, [&](Middleware& middleware) { middleware.prepare(*request); });
        if (fits && controller.notes_.is_active) {
            std::string text;
            model::put_request(text, *request);
            controller.notes_.note(event, std::move(text));
        }
        return fits;
    }
#endif

    static bool on_publish_default(void* context, robot_topic_t topic)
    {
        return attempted(context, [&](Middleware& middleware) { middleware.publish_default(static_cast<int>(topic)); });
    }

    static bool on_cancel_goal(void* context, robot_communication_t action, std::uint32_t id)
    {
        return attempted(
            context, [&](Middleware& middleware) { middleware.cancel_goal(static_cast<int>(action), id); });
    }

    static void on_log(void* context, robot_log_t kind, int what)
    {
        /* Exceptions must not pass through C. */
        try {
            self(context).log(kind, what);
        } catch (const std::exception&) {
            return;
        }
    }

    void log(robot_log_t kind, int what)
    {
        std::string rest;
        switch (kind) {
        case ROBOT_LOG_EVENT:
            happened(what);
            return;
        case ROBOT_LOG_UNEXPECTED:
            if (what == ROBOT_NO_EVENT) {
                write("unexpected", "what", "an answer to no request");
            } else {
                write("unexpected", "event", robot_event_name(what));
            }
            return;
        case ROBOT_LOG_UNKNOWN:
            rest = failure_.empty() ? "part of the data or of an update" : failure_;
            failure_.clear();
            if (log_.is_active()) {
                std::string line = head("unknown");
                line += ",\"event\":";
                put_json(line, robot_event_name(what));
                line += ",\"unknown\":[";
                put_json(line, rest);
                log_.write(line + "]}");
            }
            return;
#if ROBOT_LIMIT_COUNT > 0
        case ROBOT_LOG_LIMITED:
            if (log_.is_active()) {
                std::string line = head("limited");
                line += ",\"event\":";
                put_json(line, robot_event_name(what));
                log_.write(line + ",\"limited\":[\"numbers that limits move\"]}");
            }
            return;
#endif
        case ROBOT_LOG_RELEASE:
            write("release", "identifier", robot_topic_name(what));
            return;
        case ROBOT_LOG_FAULT:
            rest = fault_text(static_cast<robot_fault_t>(what));
            add_reason(FAULT_KEY, rest);
            write("fault", "what", rest);
            return;
        case ROBOT_LOG_STOP:
            rest = what < 0 ? reason_
                            : std::string(robot_communication_name(what)) + " on " + model::IDENTIFIERS[what]
                    + " is stale";
            add_reason(what < 0 ? "stop" : stale_key(what), rest);
            write("stop", "what", rest);
            return;
        case ROBOT_LOG_RESUME:
            reasons_.erase(std::remove_if(reasons_.begin(), reasons_.end(),
                               [&](const auto& item) { return item.first == stale_key(what); }),
                reasons_.end());
            write("resume", "what", std::string(robot_communication_name(what)) + " is back");
            return;
        case ROBOT_LOG_RESTART:
            reasons_.clear();
            write("restart", "what", "");
            return;
#if ROBOT_IS_LAYER
        case ROBOT_LOG_BLOCKED:
            /* The callback `blocked` has the identifier, too. */
            return;
#endif
#if ROBOT_ACTION_COUNT > 0
        case ROBOT_LOG_CANCELLING:
#if ROBOT_IS_LAYER
            is_own_cancel_[what] = cancelling(what).why == ROBOT_CANCEL_REQUIREMENT;
#endif
            put_json(rest, cancel_text(what));
            write_cancel("cancelling", what, "why", rest);
            return;
        case ROBOT_LOG_CANCEL_OVERDUE:
            write_cancel("cancel_overdue", what, "asked_s", number_text(asked_s(what)));
            return;
#else
        case ROBOT_LOG_CANCELLING:
        case ROBOT_LOG_CANCEL_OVERDUE:
            return;
#endif
#if ROBOT_HAS_STRATEGY
        case ROBOT_LOG_REACHED:
            write_item("reached", "aim", what);
            return;
        case ROBOT_LOG_APPROACH:
            write_item("approach", "aim", what);
            return;
        case ROBOT_LOG_OWED:
            write_item("owed", "assumption", ROBOT_AIM_COUNT + what);
            return;
        case ROBOT_LOG_MET:
            write_item("met", "assumption", ROBOT_AIM_COUNT + what);
            return;
#endif
        }
    }

    /* The services with a call from before a restart. */
    Texts old_calls() const
    {
        Texts found;
#if ROBOT_SERVICE_COUNT > 0
        for (int service = 0; service < ROBOT_COMMUNICATION_COUNT; service++) {
            if (robot_is_call_old(&robot_, static_cast<robot_communication_t>(service))) {
                found.emplace_back(robot_communication_name(service));
            }
        }
#endif
        return found;
    }

    /* Stages of the cancel of a goal that has not ended. */
    enum class Stage { ASKED, OVERDUE, OLD };

    /* The actions whose goal is to be cancelled and has reached a stage. */
    Texts cancelled([[maybe_unused]] Stage stage) const
    {
        Texts found;
#if ROBOT_ACTION_COUNT > 0
        for (int action = 0; action < ROBOT_COMMUNICATION_COUNT; action++) {
            const robot_cancelling_t cancel = cancelling(action);
            if (stage == Stage::ASKED         ? cancel.why != ROBOT_CANCEL_NONE
                    : stage == Stage::OVERDUE ? cancel.is_overdue
                                              : cancel.is_old) {
                found.emplace_back(robot_communication_name(action));
            }
        }
#endif
        return found;
    }

#if ROBOT_ACTION_COUNT > 0
    robot_cancelling_t cancelling(int action) const
    {
        return robot_cancelling(&robot_, static_cast<robot_communication_t>(action));
    }

    /* Seconds since the cancel of an action's goal was decided. */
    double asked_s(int action) const
    {
        return static_cast<double>((robot_.now_us - cancelling(action).asked_us + 500) / 1000) / 1000.0;
    }

    /* Why an action's goal is to be cancelled. */
    std::string cancel_text(int action) const
    {
        const robot_cancelling_t found = cancelling(action);
        if (found.why == ROBOT_CANCEL_TIMEOUT) {
            return "timeout";
        }
        if (found.why == ROBOT_CANCEL_STOP) {
            return "stop";
        }
#if ROBOT_IS_LAYER
        if (found.why == ROBOT_CANCEL_CALLER) {
            return "the caller";
        }
#endif
        std::string numbers;
        for (int place = 0; place < ROBOT_REQUIREMENT_COUNT; place++) {
            if (found.turned[place]) {
                numbers += (numbers.empty() ? "" : ", ") + std::to_string(place + 1);
            }
        }
        const bool is_one = numbers.find(',') == std::string::npos;
        return is_one ? "requirement " + numbers + " no longer holds" : "requirements " + numbers + " no longer hold";
    }

    void write_cancel(const char* kind, int action, const char* key, const std::string& json)
    {
        if (log_.is_active()) {
            std::string line = head(kind) + ",\"action\":";
            put_json(line, robot_communication_name(action));
            log_.write(line + ",\"" + key + "\":" + json + "}");
        }
    }

#endif
#if ROBOT_HAS_STRATEGY
    /* Write what has happened to an aim or an assumption; -1: there is none. */
    void write_item(const char* kind, const char* key, int number)
    {
        if (!log_.is_active()) {
            return;
        }
        std::string line = head(kind) + ",\"" + key + "\":";
        if (number < 0) {
            log_.write(line + "null,\"what\":\"all are met\"}");
            return;
        }
        const robot_standing_t found = robot_standing(&robot_, number, robot_.now_us);
        put_json(line, found.name);
        if (number >= ROBOT_AIM_COUNT) {
            line += ",\"owed_s\":" + number_text(static_cast<double>(found.unmet_us / 1000) / 1000.0);
        } else if (std::string(kind) == "reached") {
            line += ",\"count\":" + std::to_string(found.count);
        }
        line += ",\"what\":";
        put_json(line, found.words);
        log_.write(line + "}");
    }

#endif
    static std::string stale_key(int communication) { return "stale " + std::to_string(communication); }

    std::string fault_text(robot_fault_t fault)
    {
        switch (fault) {
        case ROBOT_FAULT_CALLBACK:
            return failure_.empty() ? "the middleware failed" : std::exchange(failure_, {});
        case ROBOT_FAULT_ENDLESS:
            return "resets, cancels and tau transitions do not end";
        case ROBOT_FAULT_UNKNOWN:
            return "something was unknown";
        case ROBOT_FAULT_REFUSED:
            return "an event is enabled, but the state does not accept it";
        case ROBOT_FAULT_CANCEL_REFUSED:
            return "the cancel of a running goal was refused";
        default:
            return reason_;
        }
    }

    void happened(int event)
    {
        if (parameters_.publish_state) {
            model::put_taken(transitions_, event, before_);
        }
        before_ = robot_.state;
        if (!log_.is_active()) {
            return;
        }
        std::string line = head("event");
        line += ",\"event\":";
        put_json(line, robot_event_name(event));
        line += ",\"controllable\":";
        put_json(line, is_controllable(event));
        line += ",\"data\":";
        line += notes_.of(event).empty() ? "null" : notes_.of(event);
        line += ",\"state\":";
        StateJson state(line);
        model::visit_state(robot_.state, state);
        state.finish();
        line += ",\"decision_us\":" + number_text(static_cast<double>(now_us() - began_steady_us_)) + "}";
        log_.write(std::move(line));
    }

    /* A caller's cancel is not the supervisor's to decide. */
    bool is_controllable(int event) const
    {
#if ROBOT_IS_LAYER
        const std::string name = robot_event_name(event);
        for (const auto& [action, is_own] : is_own_cancel_) {
            if (name == std::string(robot_communication_name(action)) + ".cancel") {
                return is_own;
            }
        }
#endif
        return model::IS_CONTROLLABLE[event];
    }

    static std::string head(const char* kind)
    {
        return "{\"time\":" + number_text(wall_s()) + ",\"kind\":\"" + kind + "\"";
    }

    void write(const char* kind, const char* key, const std::string& text)
    {
        if (log_.is_active()) {
            std::string line = head(kind) + ",\"" + key + "\":";
            put_json(line, text);
            log_.write(line + "}");
        }
    }

#if ROBOT_IS_LAYER
    /* A call or goal that was refused, and whose caller is to be told. */
    struct Refused {
        int communication;
        std::uint32_t caller;
        bool is_goal;
    };

#endif
    Middleware& middleware_;
    Reports& reports_;
    Parameters parameters_;
    EventLog log_;
    Notes notes_;
    robot_t robot_{};
    robot_state_t before_{};
    robot_counters_t last_{};
    std::uint64_t last_dropped_ = 0;
    std::vector<int> transitions_;
    Reasons reasons_;
    Reasons reported_;
    std::string reason_;
    std::string failure_;
    Texts missing_;
    Texts troubles_;
    std::deque<Held> held_;
    bool is_held_ = true;
    bool is_starting_ = false;
    std::uint64_t start_by_us_ = 0;
    std::uint64_t began_us_ = 0;
    std::uint64_t began_steady_us_ = 0;
    robot_status_t reported_status_ = ROBOT_STATUS_NEW;
    bool is_active_ = false;
    std::uint64_t period_us_ = 1;
    std::uint64_t next_tick_us_ = 0;
    std::uint64_t next_watch_us_ = 0;
    std::uint64_t next_diagnosis_us_ = 0;
    double decision_us_ = -1.0;
#if ROBOT_IS_LAYER
    std::vector<Refused> refused_;
    /* The actions whose goal the supervisor cancels, not their caller. */
    std::map<int, bool> is_own_cancel_;
#endif
};

}  // namespace robosc
