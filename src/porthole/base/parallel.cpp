#include "porthole/base/parallel.h"

#include <immintrin.h>

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace porthole {

FlushDenormals::FlushDenormals() : saved_(_mm_getcsr()) {
    _mm_setcsr(saved_ | 0x8040u); // FTZ | DAZ
}
FlushDenormals::~FlushDenormals() { _mm_setcsr(saved_); }

int thread_count(const Control& control) {
    if (control.threads > 0) return control.threads;
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(std::size_t n, const Control& control, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> next{0};
    std::atomic<bool> failed{false};
    std::exception_ptr error;
    std::mutex error_mutex;

    const auto work = [&] {
        const FlushDenormals flush;
        while (!failed.load(std::memory_order_relaxed)) {
            const std::size_t i = next.fetch_add(1, std::memory_order_relaxed);
            if (i >= n) return;
            try {
                if (control.stop.stop_requested()) throw Cancelled{};
                body(i);
            } catch (...) {
                const std::lock_guard lock(error_mutex);
                if (!failed.exchange(true)) error = std::current_exception();
            }
        }
    };

    const std::size_t workers = std::min(n, static_cast<std::size_t>(thread_count(control)));
    {
        std::vector<std::jthread> pool;
        for (std::size_t t = 1; t < workers; ++t) pool.emplace_back(work);
        work();
    }
    if (error) std::rethrow_exception(error);
}

void parallel_for_tiles(Rect window, int tile_px, const Control& control, const std::function<void(Rect)>& body) {
    if (window.empty()) return;
    const auto floor_div = [](int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); };
    const int tx0 = floor_div(window.x0, tile_px), tx1 = floor_div(window.x1 - 1, tile_px);
    const int ty0 = floor_div(window.y0, tile_px), ty1 = floor_div(window.y1 - 1, tile_px);
    const std::size_t across = std::size_t(tx1 - tx0 + 1), down = std::size_t(ty1 - ty0 + 1);
    parallel_for(across * down, control, [&](std::size_t i) {
        const int tx = tx0 + int(i % across), ty = ty0 + int(i / across);
        body(Rect{tx * tile_px, ty * tile_px, (tx + 1) * tile_px, (ty + 1) * tile_px}.intersected(window));
    });
}

} // namespace porthole
