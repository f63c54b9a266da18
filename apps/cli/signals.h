// Interrupts: the first asks the work to stop cleanly, the second ends the process.
#pragma once

#include <atomic>
#include <pthread.h>
#include <stop_token>
#include <thread>

namespace porthole::cli {

/// Turns SIGINT and SIGTERM into a stop request. To be made before any other thread starts:
/// signals are blocked in all of them and taken by one of its own, so that the request may
/// run callbacks, which a signal handler may not. SIGPIPE is ignored (writes report it).
class Signals {
public:
    Signals();
    ~Signals();
    Signals(const Signals&) = delete;
    Signals& operator=(const Signals&) = delete;

    [[nodiscard]] std::stop_token token() const { return stop_.get_token(); }
    /// The first signal that came, 0 if none did.
    [[nodiscard]] int received() const { return received_; }

private:
    std::stop_source stop_;
    std::atomic<int> received_{0};
    std::thread thread_;
};

} // namespace porthole::cli
