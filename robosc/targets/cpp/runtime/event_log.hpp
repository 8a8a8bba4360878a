/* The event log: JSON Lines in a file, written by a thread of its own; what it cannot take is dropped and counted. */

#pragma once

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <deque>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <sys/stat.h>
#include <thread>

#include "json.hpp"

namespace robosc {

/* The computer's time, in seconds since 1970-01-01 UTC. */
inline double wall_s()
{
    using seconds = std::chrono::duration<double>;
    return std::chrono::duration_cast<seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/* The folder or the file cannot be made. */
class LogError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

class EventLog {
public:
    static constexpr std::size_t MAXIMUM_WAITING = 10000;
    static constexpr std::chrono::seconds CLOSE_TIMEOUT{5};

    EventLog() = default;
    EventLog(const EventLog&) = delete;
    EventLog& operator=(const EventLog&) = delete;
    ~EventLog() { close(); }

    /* Begin a new file `<name>-<date>-<time>.jsonl` (UTC) in a folder, which is made if it is not there. */
    void open(const std::string& folder, const std::string& name)
    {
        make_folder(folder);
        const std::time_t now = std::time(nullptr);
        std::tm parts{};
        gmtime_r(&now, &parts);
        char stamp[32];
        std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", &parts);
        const std::string base = folder + "/" + name + "-" + stamp;
        std::FILE* file = nullptr;
        for (int number = 1; file == nullptr; number++) {
            const std::string path = base + (number == 1 ? "" : "-" + std::to_string(number)) + ".jsonl";
            file = std::fopen(path.c_str(), "wx");
            if (file == nullptr && errno != EEXIST) {
                throw LogError(path + ": " + std::strerror(errno));
            }
        }
        shared_ = std::make_shared<Shared>();
        shared_->file = file;
        std::thread(run, shared_).detach();
    }

    bool is_active() const { return shared_ != nullptr; }

    std::uint64_t dropped() const { return shared_ ? shared_->refused.load() + shared_->lost.load() : 0; }

    /* Hand a line to the thread, or drop and count it if too many are waiting. */
    void write(std::string line)
    {
        if (!shared_) {
            return;
        }
        {
            const std::lock_guard<std::mutex> lock(shared_->mutex);
            if (shared_->is_closing || shared_->waiting.size() >= MAXIMUM_WAITING) {
                shared_->refused++;
                return;
            }
            shared_->waiting.push_back(std::move(line));
        }
        shared_->changed.notify_all();
    }

    /* Write what waits and close the file; a disk that hangs does not keep the process from ending. */
    void close()
    {
        if (!shared_) {
            return;
        }
        std::unique_lock<std::mutex> lock(shared_->mutex);
        shared_->is_closing = true;
        shared_->changed.notify_all();
        shared_->changed.wait_for(lock, CLOSE_TIMEOUT, [this] { return shared_->is_closed; });
    }

private:
    struct Shared {
        std::mutex mutex;
        std::condition_variable changed;
        std::deque<std::string> waiting;
        std::FILE* file = nullptr;
        bool is_closing = false;
        bool is_closed = false;
        std::atomic<std::uint64_t> refused{0};
        std::atomic<std::uint64_t> lost{0};
    };

    static void make_folder(const std::string& folder)
    {
        for (std::size_t end = folder.find('/', 1); ; end = folder.find('/', end + 1)) {
            const std::string part = folder.substr(0, end);
            if (mkdir(part.c_str(), 0777) != 0 && errno != EEXIST) {
                throw LogError(part + ": " + std::strerror(errno));
            }
            if (end == std::string::npos) {
                return;
            }
        }
    }

    static bool put(std::FILE* file, const std::string& line)
    {
        return std::fwrite(line.data(), 1, line.size(), file) == line.size();
    }

    static void run(std::shared_ptr<Shared> shared)
    {
        bool is_torn = false;
        std::unique_lock<std::mutex> lock(shared->mutex);
        for (;;) {
            shared->changed.wait(lock, [&] { return shared->is_closing || !shared->waiting.empty(); });
            if (shared->waiting.empty()) {
                break;
            }
            std::deque<std::string> lines;
            lines.swap(shared->waiting);
            lock.unlock();
            for (const std::string& line : lines) {
                /* After a failure the last line may be cut off: the next one must not become part of it. */
                if (put(shared->file, (is_torn ? "\n" : "") + line + "\n")) {
                    is_torn = false;
                } else {
                    is_torn = true;
                    shared->lost++;
                    std::clearerr(shared->file);
                }
            }
            if (std::fflush(shared->file) != 0) {
                is_torn = true;
            }
            lock.lock();
        }
        lock.unlock();
        const std::uint64_t dropped = shared->refused.load() + shared->lost.load();
        if (dropped > 0) {
            put(shared->file,
                (is_torn ? "\n" : "") + std::string("{\"time\":") + number_text(wall_s())
                    + ",\"kind\":\"dropped\",\"count\":" + std::to_string(dropped) + "}\n");
        }
        std::fclose(shared->file);
        lock.lock();
        shared->is_closed = true;
        shared->changed.notify_all();
    }

    std::shared_ptr<Shared> shared_;
};

}  // namespace robosc
