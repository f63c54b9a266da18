#include "signals.h"

#include <atomic>
#include <csignal>
#include <unistd.h>

#include "session.h"

namespace porthole::cli {

namespace {

constexpr int kWake = SIGUSR2; ///< from the destructor: stop waiting

sigset_t watched() {
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGINT, SIGTERM, kWake}) sigaddset(&set, signal);
    return set;
}

/// A large model is mapped; pages that another program has cut off its end cannot be read.
[[noreturn]] void on_lost_page(int) {
    static std::atomic_flag said; // by the first of several threads
    while (said.test_and_set()) ::pause();
    constexpr char message[] = "porthole: error[E0202]: the model file was cut short while it was being read\n";
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, message, sizeof message - 1);
    ::_exit(kExitInput);
}

} // namespace

Signals::Signals() {
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGBUS, on_lost_page);
    const sigset_t set = watched();
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    thread_ = std::thread([this, set] {
        while (true) {
            int signal = 0;
            if (sigwait(&set, &signal) != 0 || signal == kWake) return;
            if (received_ != 0) _exit(128 + signal);
            received_ = signal;
            stop_.request_stop();
        }
    });
}

Signals::~Signals() {
    pthread_kill(thread_.native_handle(), kWake);
    thread_.join();
}

} // namespace porthole::cli
