#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace archetide {

/// A cube's corner c sits at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge e runs along axis e / 4 from
/// corner `cube_edge_low(e)`.
constexpr int kCubeEdges = 12;
constexpr int cube_edge_axis(int e) { return e / 4; }
constexpr int cube_edge_low(int e) {
  const int axis = e / 4, a = e & 1, b = e >> 1 & 1;
  return axis == 0 ? 2 * a + 4 * b : axis == 1 ? a + 4 * b : a + 2 * b;
}
constexpr int cube_edge_high(int e) { return cube_edge_low(e) | 1 << cube_edge_axis(e); }

/// Triangles, as triples of cube edges, that separate the inside corners (set bits of the index)
/// from the others, facing outside. Derived from one rule, so that neighbours always agree on the
/// shared face: on an ambiguous face every inside corner is cut off by itself.
using CubeCases = std::array<std::vector<std::array<std::int8_t, 3>>, 256>;
const CubeCases& cube_cases();

}  // namespace archetide
