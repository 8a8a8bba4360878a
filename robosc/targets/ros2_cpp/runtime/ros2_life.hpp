/* The life of a node, alone in a process or as a component among others: a managed node, and the thread in which its
   controller does everything. */

#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lifecycle_msgs/msg/state.hpp>
#include <rcl_interfaces/msg/set_parameters_result.hpp>
#include <rclcpp/rclcpp.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

#include "controller.hpp"
#include "ros2.hpp"
#include "run.hpp"

namespace robosc {

/* A controller with its connections. */
class Host {
public:
    virtual ~Host() = default;
    virtual Controller& controller() = 0;
    /* Give the last messages time to arrive. */
    virtual void wait_until_delivered() = 0;
};

/* The thread in which everything of a controller happens. It spins the node's callback group by itself: whatever
   executor the node is added to, nothing is decided before all that has come is taken in, and no other component can
   keep the controller from its work. */
class Loop {
public:
    Loop(const rclcpp::node_interfaces::NodeBaseInterface::SharedPtr& base, const rclcpp::CallbackGroup::SharedPtr& group)
        : executor_(in_context(base->get_context()))
    {
        executor_.add_callback_group(group, base);
        thread_ = std::thread([this] { work(); });
    }

    Loop(const Loop&) = delete;
    Loop& operator=(const Loop&) = delete;

    ~Loop()
    {
        perform([this] { is_ended_ = true; });
        thread_.join();
    }

    /* Do it in the thread, and wait for its end; what it throws is thrown. */
    template <class Action>
    void perform(Action action)
    {
        if (std::this_thread::get_id() == thread_.get_id()) {
            action();
            return;
        }
        std::packaged_task<void()> task(std::move(action));
        auto done = task.get_future();
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            tasks_.push_back(std::move(task));
        }
        changed_.notify_all();
        done.get();
    }

    /* Handle all that has come, waiting at most so many microseconds for the first of it; runs in
       the thread. */
    void spin(std::uint64_t wait_us)
    {
        executor_.spin_once(std::chrono::microseconds(wait_us));
        executor_.spin_all(std::chrono::microseconds(DRAIN_US));
    }

    /* The controller that is at work; in the thread only. */
    std::unique_ptr<Host> host;

    /* True while nothing that has come is looked at; in the thread only. */
    bool is_waiting = false;

    /* True once a fault has stopped the controller. */
    std::atomic<bool> has_fault{false};

private:
    static rclcpp::ExecutorOptions in_context(const rclcpp::Context::SharedPtr& context)
    {
        rclcpp::ExecutorOptions options;
        options.context = context;
        return options;
    }

    void work()
    {
        while (!is_ended_) {
            std::deque<std::packaged_task<void()>> tasks;
            {
                std::unique_lock<std::mutex> lock(mutex_);
                changed_.wait(lock, [this] { return is_at_work() || !tasks_.empty(); });
                tasks.swap(tasks_);
            }
            for (auto& task : tasks) {
                task();
            }
            if (is_at_work()) {
                step();
            }
        }
    }

    bool is_at_work() const { return host != nullptr && !is_waiting; }

    void step()
    {
        try {
            spin(host->controller().idle_us());
            host->controller().run_due();
        } catch (const std::exception& failure) {
            host->controller().stop(failure.what(), true);
            /* The failure will not be over at once. */
            std::this_thread::sleep_for(std::chrono::microseconds(WATCH_US));
        }
        has_fault = host->controller().fault() != nullptr;
    }

    rclcpp::executors::SingleThreadedExecutor executor_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::packaged_task<void()>> tasks_;
    bool is_ended_ = false;
    std::thread thread_;
};

/* The node, which others may manage: inactive it listens and the robot is at rest, active it runs. */
class ManagedNode : public rclcpp_lifecycle::LifecycleNode {
public:
    using CallbackReturn = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface::CallbackReturn;
    using MakeHost = std::function<std::unique_ptr<Host>(
        rclcpp_lifecycle::LifecycleNode&, const rclcpp::CallbackGroup::SharedPtr&, const Parameters&)>;

    /* `make` makes the host; `about` describes the node in one line; `is_program` is true if a fault ends the process,
       unless others manage the node. Throws ParameterError if the node starts itself and a parameter is wrong. */
    ManagedNode(const rclcpp::NodeOptions& options, const std::vector<Declaration>& declarations, MakeHost make,
        const char* about, bool is_program)
        : LifecycleNode(model::PACKAGE, options)
        , declarations_(declarations)
        , make_(std::move(make))
        , group_(create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive, false))
        , loop_(get_node_base_interface(), group_)
    {
        declare_parameters_of(*this, declarations_);
        starts_itself_ = detail::boolean(given_parameters(*this, declarations_), AUTOSTART);
        ends_by_fault_ = is_program && starts_itself_;
        RCLCPP_INFO(get_logger(), "%s", about);
        may_set_ = add_on_set_parameters_callback(
            [this](const std::vector<rclcpp::Parameter>& parameters) { return may_set(parameters); });
        if (starts_itself_) {
            /* It begins at once: nothing that comes is held as by an inactive node. */
            loop_.perform([this] { loop_.is_waiting = true; });
            configure();
            if (get_current_state().id() != lifecycle_msgs::msg::State::PRIMARY_STATE_INACTIVE) {
                throw ParameterError(problem_);
            }
            activate();
            loop_.perform([this] { loop_.is_waiting = false; });
        }
        /* A signal to a container ends its context: the last moment in which the robot can be stopped. */
        shutdown_ = get_node_base_interface()->get_context()->add_pre_shutdown_callback([this] { leave("shutdown"); });
    }

    ~ManagedNode() override
    {
        get_node_base_interface()->get_context()->remove_pre_shutdown_callback(shutdown_);
        leave("unloaded");
    }

    /* Check parameters, and begin to listen. */
    CallbackReturn on_configure(const rclcpp_lifecycle::State&) override
    {
        problem_.clear();
        try {
            loop_.perform([this] {
                Parameters parameters = validated(
                    given_parameters(*this, declarations_), model::REQUESTS, model::SENSORS, model::SENT);
                parameters.ends_by_fault = ends_by_fault_;
                loop_.host = make_(*this, group_, parameters);
                loop_.has_fault = false;
            });
            is_configured_ = true;
            return CallbackReturn::SUCCESS;
        } catch (const ParameterError& failure) {
            problem_ = failure.what();
        } catch (const std::exception& failure) {
            problem_ = std::string("cannot start: ") + failure.what();
        }
        if (!starts_itself_) {
            RCLCPP_ERROR(get_logger(), "%s", problem_.c_str());
        }
        return CallbackReturn::FAILURE;
    }

    /* Begin in the initial state. */
    CallbackReturn on_activate(const rclcpp_lifecycle::State&) override
    {
        bool is_good = false;
        loop_.perform([this, &is_good] {
            if (loop_.host != nullptr) {
                loop_.host->controller().start();
                is_good = loop_.host->controller().fault() == nullptr;
                loop_.has_fault = !is_good;
            }
        });
        return is_good ? CallbackReturn::SUCCESS : CallbackReturn::FAILURE;
    }

    /* Bring the robot to rest; what it sends is still listened to. */
    CallbackReturn on_deactivate(const rclcpp_lifecycle::State&) override
    {
        loop_.perform([this] {
            if (loop_.host != nullptr) {
                loop_.host->controller().pause();
            }
        });
        return CallbackReturn::SUCCESS;
    }

    /* Listen no more, once goals that were cancelled have ended. */
    CallbackReturn on_cleanup(const rclcpp_lifecycle::State&) override
    {
        loop_.perform([this] { forget(); });
        return CallbackReturn::SUCCESS;
    }

    /* Bring the robot to rest, and end. */
    CallbackReturn on_shutdown(const rclcpp_lifecycle::State&) override
    {
        leave("shutdown");
        is_shut_down_ = true;
        return CallbackReturn::SUCCESS;
    }

    /* A transition was broken off: bring the robot to rest, and begin with nothing. */
    CallbackReturn on_error(const rclcpp_lifecycle::State&) override
    {
        leave("a transition was broken off", true);
        return CallbackReturn::SUCCESS;
    }

    /* Bring the robot to rest, and listen no more; does nothing the second time. */
    void leave(const std::string& reason, bool is_fault = false)
    {
        loop_.perform([&] {
            if (loop_.host != nullptr) {
                loop_.host->controller().stop(reason, is_fault);
                forget();
            }
        });
    }

    bool is_shut_down() const { return is_shut_down_; }

    /* True if a fault has ended a program whose node nobody else manages. */
    bool is_ended_by_fault() const { return ends_by_fault_ && loop_.has_fault; }

    /* The fault that had stopped the controller when it was left; empty if there was none. */
    const std::string& fault() const { return fault_; }

private:
    /* Finish what has been stopped. */
    void forget()
    {
        if (loop_.host == nullptr) {
            return;
        }
        finish(
            loop_.host->controller(), [this](std::uint64_t wait_us) { loop_.spin(wait_us); },
            [this] { loop_.host->wait_until_delivered(); });
        const std::string* fault = loop_.host->controller().fault();
        fault_ = fault == nullptr ? "" : *fault;
        loop_.host.reset();
        is_configured_ = false;
    }

    /* Parameters take effect when the node is configured; afterwards a new value would say what is not so. */
    rcl_interfaces::msg::SetParametersResult may_set(const std::vector<rclcpp::Parameter>& parameters) const
    {
        rcl_interfaces::msg::SetParametersResult result;
        result.successful = true;
        for (const rclcpp::Parameter& parameter : parameters) {
            if (parameter.get_name() == "use_sim_time" && is_configured_) {
                result.successful = false;
                result.reason = "use_sim_time cannot be changed while the node is configured";
            }
            for (const Declaration& item : declarations_) {
                if (parameter.get_name() == item.name
                    && (starts_itself_ || is_configured_ || parameter.get_name() == AUTOSTART)) {
                    result.successful = false;
                    result.reason = "a node takes its parameters when it is configured";
                }
            }
        }
        return result;
    }

    const std::vector<Declaration>& declarations_;
    MakeHost make_;
    rclcpp::CallbackGroup::SharedPtr group_;
    OnSetParametersCallbackHandle::SharedPtr may_set_;
    rclcpp::PreShutdownCallbackHandle shutdown_;
    std::string problem_;
    std::string fault_;
    bool starts_itself_ = true;
    bool ends_by_fault_ = false;
    std::atomic<bool> is_configured_{false};
    std::atomic<bool> is_shut_down_{false};
    Loop loop_;
};

}  // namespace robosc
