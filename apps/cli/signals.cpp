#include "signals.h"

#include <csignal>
#include <unistd.h>

namespace porthole::cli {

namespace {

constexpr int kWake = SIGUSR2; ///< from the destructor: stop waiting

sigset_t watched() {
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGINT, SIGTERM, kWake}) sigaddset(&set, signal);
    return set;
}

} // namespace

Signals::Signals() {
    std::signal(SIGPIPE, SIG_IGN);
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
