#pragma once

namespace porthole::bench {

/// Frames in every way of refinement against `full`: shadows and ambient light, one thread. Counters: PSNR
/// of the 8-bit pictures in dB, ids that differ in percent, parts that are seen in `full` alone, pixels traced.
void add_refine_benchmarks();

} // namespace porthole::bench
