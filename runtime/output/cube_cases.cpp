#include "runtime/output/cube_cases.h"

namespace archetide {
namespace {

using Triangle = std::array<std::int8_t, 3>;
using Loop = std::vector<int>;  // cube edges

// Corners of the six faces, counter-clockwise seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int edge_between(int a, int b) {
  const int low = a & b;
  for (int e = 0; e < kCubeEdges; ++e)
    if (cube_edge_low(e) == low && cube_edge_high(e) == (a | b)) return e;
  return -1;
}

bool face_has_edge(const int (&face)[4], int e) {
  int found = 0;
  for (int corner : face) found += corner == cube_edge_low(e) || corner == cube_edge_high(e);
  return found == 2;
}

bool share_a_face(int e, int f) {
  for (const auto& face : kFaces)
    if (face_has_edge(face, e) && face_has_edge(face, f)) return true;
  return false;
}

// next[e] = the edge where the surface's outline goes after edge e, -1 where it does not pass: on
// each face, every run of inside corners is cut off by one segment.
std::array<int, kCubeEdges> outline(int inside) {
  std::array<int, kCubeEdges> next;
  next.fill(-1);
  const auto is_inside = [&](int corner) { return (inside >> corner & 1) != 0; };
  for (const auto& face : kFaces)
    for (int s = 0; s < 4; ++s) {
      if (is_inside(face[s]) || !is_inside(face[(s + 1) % 4])) continue;
      int end = s + 1;
      while (is_inside(face[(end + 1) % 4])) ++end;
      const int enters = edge_between(face[s], face[(s + 1) % 4]);
      const int leaves = edge_between(face[end % 4], face[(end + 1) % 4]);
      next[enters] = leaves;
    }
  return next;
}

std::vector<Loop> loops(int inside) {
  std::array<int, kCubeEdges> next = outline(inside);
  std::vector<Loop> found;
  for (int start = 0; start < kCubeEdges; ++start) {
    if (next[start] < 0) continue;
    Loop loop;
    for (int e = start; next[e] >= 0;) {
      loop.push_back(e);
      const int following = next[e];
      next[e] = -1;
      e = following;
    }
    found.push_back(loop);
  }
  return found;
}

// Triangulates loop[first..last] closed by its chord without diagonals inside a cube face (which
// the neighbour might draw too); false when there is no such triangulation.
bool triangulate(const Loop& loop, int first, int last, std::vector<Triangle>& out) {
  if (last - first < 2) return true;
  const int n = static_cast<int>(loop.size());
  const auto allowed = [&](int a, int b) {
    return b - a == 1 || (a == 0 && b == n - 1) || !share_a_face(loop[a], loop[b]);
  };
  const std::size_t before = out.size();
  for (int apex = first + 1; apex < last; ++apex) {
    if (!allowed(first, apex) || !allowed(apex, last)) continue;
    out.push_back({static_cast<std::int8_t>(loop[first]), static_cast<std::int8_t>(loop[apex]),
                   static_cast<std::int8_t>(loop[last])});
    if (triangulate(loop, first, apex, out) && triangulate(loop, apex, last, out)) return true;
    out.resize(before);
  }
  return false;
}

CubeCases all_cases() {
  CubeCases cases;
  for (int inside = 0; inside < 256; ++inside)
    for (const Loop& loop : loops(inside))
      triangulate(loop, 0, static_cast<int>(loop.size()) - 1, cases[inside]);
  return cases;
}

}  // namespace

const CubeCases& cube_cases() {
  static const CubeCases cases = all_cases();
  return cases;
}

}  // namespace archetide
