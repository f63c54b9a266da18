// The paper's eight directions: 0=E 1=NE 2=N 3=NW 4=W 5=SW 6=S 7=SE, rows running down.
#pragma once

#include "porthole/base/math.h"

namespace porthole {

inline constexpr Vec2i kDirections[8] = {{1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}, {0, 1}, {1, 1}};

/// Unit step in direction `code`, modulo 8.
constexpr Vec2i direction(int code) { return kDirections[code & 7]; }
constexpr Vec2i neighbour(Vec2i p, int code) { return p + direction(code); }

} // namespace porthole
