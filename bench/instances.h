// A thousand million triangles: many placements of one large mesh.
#pragma once

namespace porthole::bench {

/// Registers the benchmarks of 1000 placements of a mesh of a million triangles.
void add_instances();

} // namespace porthole::bench
