#include "launcher.h"

#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>

extern char** environ;

namespace porthole::bench {
namespace {

struct Reply {
    int error = 0; ///< errno; 0: the program ran
    Finished finished;
};

double seconds(timeval t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); }

Reply run_here(const std::string& message) {
    std::vector<std::string> arguments;
    for (std::size_t at = 0; at < message.size(); at += arguments.back().size() + 1)
        arguments.emplace_back(message.c_str() + at);
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);

    Reply reply;
    const auto start = std::chrono::steady_clock::now();
    pid_t pid = -1;
    reply.error = ::posix_spawn(&pid, argv[0], nullptr, nullptr, argv.data(), environ);
    if (reply.error != 0) return reply;
    rusage usage{};
    while (::wait4(pid, &reply.finished.status, 0, &usage) < 0)
        if (errno != EINTR) {
            reply.error = errno;
            return reply;
        }
    reply.finished.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    reply.finished.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    reply.finished.peak_bytes = std::int64_t(usage.ru_maxrss) * 1024;
    return reply;
}

/// Arguments arrive as one packet, each with its final zero; an empty one ends the process.
[[noreturn]] void serve(int socket) {
    std::string message(1 << 16, '\0');
    for (;;) {
        const ssize_t n = ::recv(socket, message.data(), message.size(), 0);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) ::_exit(0);
        const Reply reply = run_here(message.substr(0, std::size_t(n)));
        if (::send(socket, &reply, sizeof reply, MSG_NOSIGNAL) != sizeof reply) ::_exit(0);
    }
}

[[noreturn]] void fail(int error, const char* what) { throw std::system_error(error, std::generic_category(), what); }

} // namespace

Launcher::Launcher() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) fail(errno, "socketpair");
    pid_ = ::fork();
    if (pid_ < 0) fail(errno, "fork");
    if (pid_ == 0) {
        ::close(ends[0]);
        serve(ends[1]);
    }
    ::close(ends[1]);
    socket_ = ends[0];
}

Launcher::~Launcher() {
    ::close(socket_);
    ::waitpid(pid_, nullptr, 0);
}

Finished Launcher::run(const std::vector<std::string>& arguments) {
    std::string message;
    for (const std::string& a : arguments) message.append(a).push_back('\0');
    Reply reply;
    if (::send(socket_, message.data(), message.size(), MSG_NOSIGNAL) < 0) fail(errno, "launcher");
    if (::recv(socket_, &reply, sizeof reply, MSG_WAITALL) != sizeof reply) fail(EPIPE, "launcher");
    if (reply.error != 0) fail(reply.error, arguments.front().c_str());
    return reply.finished;
}

} // namespace porthole::bench
