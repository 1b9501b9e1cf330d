#include <algorithm>
#include <array>
#include <numeric>
#include <set>

#include "common/mesh/surface_topology.h"
#include "common/mesh/weld.h"
#include "precompute/intake/repair_steps.h"

namespace archetide {
namespace {

constexpr int kPasses = 8;  // a split makes shorter edges, which may have to be split again

void drop_improper_faces(TriMesh& mesh, RepairReport& report) {
  std::set<std::array<int, 3>> seen;
  std::vector<Vec3i> kept;
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    std::array<int, 3> key = {mesh.triangles[t][0], mesh.triangles[t][1], mesh.triangles[t][2]};
    std::sort(key.begin(), key.end());
    if (is_degenerate(mesh, t) || !seen.insert(key).second) {
      ++report.dropped;
    } else {
      kept.push_back(mesh.triangles[t]);
    }
  }
  mesh.triangles = kept;
}

std::vector<SurfaceEdge> boundary_edges(const TriMesh& mesh) {
  std::vector<SurfaceEdge> open;
  for (const SurfaceEdge& edge : surface_edges(mesh))
    if (edge.triangles.size() == 1) open.push_back(edge);
  return open;
}

/// Vertices of the boundary, by x.
std::vector<int> boundary_vertices(const TriMesh& mesh, const std::vector<SurfaceEdge>& open) {
  std::set<int> unique;
  for (const SurfaceEdge& edge : open) unique.insert({edge.a, edge.b});
  std::vector<int> list(unique.begin(), unique.end());
  std::stable_sort(list.begin(), list.end(),
                   [&](int v, int w) { return mesh.vertices[v][0] < mesh.vertices[w][0]; });
  return list;
}

/// The part of `list` (by x) between two values of x.
std::pair<std::vector<int>::const_iterator, std::vector<int>::const_iterator> within_x(
    const TriMesh& mesh, const std::vector<int>& list, double low, double high) {
  const auto first = std::lower_bound(list.begin(), list.end(), low,
                                      [&](int v, double x) { return mesh.vertices[v][0] < x; });
  const auto last = std::upper_bound(first, list.end(), high,
                                     [&](double x, int v) { return x < mesh.vertices[v][0]; });
  return {first, last};
}

void weld_boundary(TriMesh& mesh, double tolerance, RepairReport& report) {
  const std::vector<int> list = boundary_vertices(mesh, boundary_edges(mesh));
  std::vector<int> same_as(mesh.vertices.size());
  std::iota(same_as.begin(), same_as.end(), 0);
  for (const int v : list) {
    if (same_as[v] != v) continue;
    const Vec3& x = mesh.vertices[v];
    const auto [first, last] = within_x(mesh, list, x[0] - tolerance, x[0] + tolerance);
    for (auto w = first; w != last; ++w) {
      if (same_as[*w] == *w && *w != v && (mesh.vertices[*w] - x).norm() <= tolerance)
        same_as[*w] = v;
    }
  }
  // A vertex that took others in may itself have been taken in later.
  for (int& v : same_as)
    while (same_as[v] != v) v = same_as[v];
  Weld w = merge_vertices(mesh, same_as);
  report.welded += w.welded;
  mesh = std::move(w.mesh);
}

/// Vertices of the boundary on the open edge a -> b, in order from a.
std::vector<int> vertices_on(const TriMesh& mesh, const std::vector<int>& list, int a, int b,
                             double tolerance) {
  const Vec3 &p = mesh.vertices[a], d = mesh.vertices[b] - p;
  std::vector<std::pair<double, int>> found;
  const auto [first, last] = within_x(mesh, list, std::min(p[0], p[0] + d[0]) - tolerance,
                                      std::max(p[0], p[0] + d[0]) + tolerance);
  for (auto v = first; v != last; ++v) {
    if (*v == a || *v == b) continue;
    const double s = (mesh.vertices[*v] - p).dot(d) / d.squaredNorm();
    if (s <= 0 || s >= 1 || (mesh.vertices[*v] - p - s * d).norm() > tolerance) continue;
    found.emplace_back(s, *v);
  }
  std::sort(found.begin(), found.end());
  std::vector<int> order;
  for (const auto& [s, v] : found) order.push_back(v);
  return order;
}

/// Splits faces at vertices on their open edges, one edge of a face at a time; false if none was.
bool split_edges(TriMesh& mesh, double tolerance, RepairReport& report) {
  const std::vector<SurfaceEdge> open = boundary_edges(mesh);
  const std::vector<int> list = boundary_vertices(mesh, open);
  std::set<int> done;
  for (const SurfaceEdge& edge : open) {
    const int t = edge.triangles[0];
    if (done.count(t)) continue;
    const int from = edge.runs_a_to_b[0] ? edge.a : edge.b, to = edge.a + edge.b - from;
    std::vector<int> chain = vertices_on(mesh, list, from, to, tolerance);
    const int apex = mesh.triangles[t].sum() - from - to;
    if (chain.empty() || std::find(chain.begin(), chain.end(), apex) != chain.end()) continue;
    done.insert(t);
    ++report.split;
    chain.push_back(to);
    mesh.triangles[t] = Vec3i(from, chain[0], apex);
    for (std::size_t i = 1; i < chain.size(); ++i)
      mesh.triangles.emplace_back(chain[i - 1], chain[i], apex);
  }
  return !done.empty();
}

}  // namespace

void close_seams(TriMesh& mesh, double tolerance, RepairReport& report) {
  drop_improper_faces(mesh, report);
  weld_boundary(mesh, tolerance, report);
  for (int pass = 0; pass < kPasses && split_edges(mesh, tolerance, report); ++pass) {
  }
  drop_improper_faces(mesh, report);
}

}  // namespace archetide
