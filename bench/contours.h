// Finding the targets' contours: the paper's way against exact, full and fast.
#pragma once

namespace porthole::bench {

/// Registers contours/<scene>/<1, 10 or 100 targets>/<method>: CPU time of one thread at 1080p.
/// Counters: `complete`, the share of the contour pixels of the full target id buffer that were
/// found; `missed` and `false` count those that were not, and those that are none; `rays`.
void add_contour_benchmarks();

} // namespace porthole::bench
