// Loops over work items and image tiles on any number of threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <stop_token>
#include <string_view>

#include "porthole/base/image.h"

namespace porthole {

/// Handed last to long functions.
struct Control {
    std::stop_token stop;                                               ///< asks for an early, clean end
    std::function<void(std::string_view stage, double share)> progress; ///< called from any thread; share in [0, 1]
    int threads = 0;                                                    ///< 0: one per processor
};

/// Thrown by long functions when `Control::stop` was requested.
struct Cancelled {};

/// Threads that `Control::threads` asks for, at least 1.
[[nodiscard]] int thread_count(const Control& control);

/// Calls body(i) once for every i in [0, n), from up to `thread_count` threads. Items are
/// handed out in increasing order; the first exception a body throws is rethrown here after
/// all threads have stopped. Denormals are flushed to zero in every worker, as Embree asks.
/// @throws Cancelled when stop was requested before the last item began.
void parallel_for(std::size_t n, const Control& control, const std::function<void(std::size_t)>& body);

/// Calls body(tile) for every `tile_px`-sized tile of `window`; a body writes only its own
/// pixels. Tiles start at multiples of tile_px in absolute pixel coordinates, whatever the
/// window, so that a crop and the full picture share them.
void parallel_for_tiles(Rect window, int tile_px, const Control& control, const std::function<void(Rect)>& body);

/// Flush-to-zero and denormals-are-zero for the calling thread, restored at the end of scope.
class FlushDenormals {
public:
    FlushDenormals();
    ~FlushDenormals();
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;

private:
    unsigned saved_;
};

} // namespace porthole
