#include "assets/generate/verify.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

namespace archetide {
namespace {

constexpr double kSmallestAngle = 15.0;  // degrees; measured worst of the four shapes: 26.9

/// Every directed edge must occur once and have its reverse: then the surface is closed and
/// oriented.
std::string edge_fault(const TriMesh& mesh) {
  std::map<std::pair<int, int>, int> count;
  for (const Vec3i& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) ++count[{t[c], t[(c + 1) % 3]}];
  for (const auto& [edge, n] : count) {
    const std::string name = fmt::format("{}-{}", edge.first, edge.second);
    if (n != 1) return fmt::format("edge {} is used {} times in one direction", name, n);
    if (!count.count({edge.second, edge.first})) return "edge " + name + " is open";
  }
  return "";
}

/// The triangles around a vertex must form one fan: as many as one walk around it meets.
std::string vertex_fault(const TriMesh& mesh) {
  std::map<std::pair<int, int>, int> next;  // (vertex, neighbour) -> following neighbour
  std::vector<int> degree(mesh.vertices.size(), 0), start(mesh.vertices.size(), -1);
  for (const Vec3i& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) {
      next[{t[c], t[(c + 1) % 3]}] = t[(c + 2) % 3];
      start[t[c]] = t[(c + 1) % 3];
      ++degree[t[c]];
    }
  for (int v = 0; v < int(mesh.vertices.size()); ++v) {
    if (degree[v] == 0) return fmt::format("vertex {} is unused", v);
    int walked = 1;
    for (int n = next.at({v, start[v]}); n != start[v]; n = next.at({v, n})) ++walked;
    if (walked != degree[v]) return fmt::format("vertex {} is not manifold", v);
  }
  return "";
}

int components(const TriMesh& mesh) {
  std::vector<int> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Vec3i& t : mesh.triangles) {
    root[find(t[1])] = find(t[0]);
    root[find(t[2])] = find(t[0]);
  }
  int count = 0;
  for (int v = 0; v < int(root.size()); ++v) count += find(v) == v;
  return count;
}

}  // namespace

double smallest_angle(const TriMesh& mesh) {
  double smallest = std::numbers::pi;
  for (const Vec3i& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) {
      const Vec3 a = mesh.vertices[t[(c + 1) % 3]] - mesh.vertices[t[c]];
      const Vec3 b = mesh.vertices[t[(c + 2) % 3]] - mesh.vertices[t[c]];
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest * 180.0 / std::numbers::pi;
}

std::string surface_fault(const TriMesh& mesh) {
  if (mesh.triangles.empty()) return "no triangle";
  if (const std::string fault = edge_fault(mesh); !fault.empty()) return fault;
  if (const std::string fault = vertex_fault(mesh); !fault.empty()) return fault;
  if (const int n = components(mesh); n != 1) return fmt::format("{} components", n);
  if (enclosed_volume(mesh) <= 0.0) return "the surface is inside out";
  if (smallest_angle(mesh) < kSmallestAngle) return "a triangle has an angle below 15 degrees";
  return "";
}

}  // namespace archetide
