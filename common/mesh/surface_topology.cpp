#include "common/mesh/surface_topology.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace archetide {
namespace {

struct HalfEdge {
  int a, b;  // a < b
  int triangle;
  bool a_to_b;
};

std::vector<HalfEdge> sorted_half_edges(const TriMesh& mesh) {
  std::vector<HalfEdge> list;
  list.reserve(3 * mesh.triangles.size());
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    for (int i = 0; i < 3; ++i) {
      const int from = mesh.triangles[t][i], to = mesh.triangles[t][(i + 1) % 3];
      list.push_back({std::min(from, to), std::max(from, to), t, from < to});
    }
  }
  std::sort(list.begin(), list.end(), [](const HalfEdge& x, const HalfEdge& y) {
    return std::array{x.a, x.b, x.triangle} < std::array{y.a, y.b, y.triangle};
  });
  return list;
}

/// Disjoint sets of indices.
class Sets {
 public:
  explicit Sets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int i, int j) { parent_[std::max(root(i), root(j))] = std::min(root(i), root(j)); }

 private:
  std::vector<int> parent_;
};

/// The triangles around each triangle: across its edges, and whether both run in the same direction
/// there.
struct Neighbour {
  int triangle;
  bool same_direction;
};

std::vector<std::vector<Neighbour>> neighbours(const TriMesh& mesh,
                                               const std::vector<SurfaceEdge>& edges) {
  std::vector<std::vector<Neighbour>> around(mesh.triangles.size());
  for (const SurfaceEdge& edge : edges) {
    const int s = edge.triangles[0], t = edge.triangles[1];
    const bool same = edge.runs_a_to_b[0] == edge.runs_a_to_b[1];
    around[s].push_back({t, same});
    around[t].push_back({s, same});
  }
  return around;
}

/// Of the triangles of a shell, those marked 1 or those marked 0. Returns how many.
int turn_the_fewer(TriMesh& mesh, const std::vector<int>& shell, const std::vector<int>& mark) {
  const auto ones = std::count_if(shell.begin(), shell.end(), [&](int t) { return mark[t] == 1; });
  const int which = 2 * ones > static_cast<std::ptrdiff_t>(shell.size()) ? 0 : 1;
  int turned = 0;
  for (const int t : shell) {
    if (mark[t] != which) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    ++turned;
  }
  return turned;
}

}  // namespace

std::vector<SurfaceEdge> surface_edges(const TriMesh& mesh) {
  std::vector<SurfaceEdge> edges;
  for (const HalfEdge& half : sorted_half_edges(mesh)) {
    if (edges.empty() || edges.back().a != half.a || edges.back().b != half.b) {
      edges.push_back({half.a, half.b, {}, {}});
    }
    edges.back().triangles.push_back(half.triangle);
    edges.back().runs_a_to_b.push_back(half.a_to_b);
  }
  return edges;
}

std::vector<int> pinched_vertices(const TriMesh& mesh, const std::vector<SurfaceEdge>& edges) {
  // Corners (3 t + i) of a vertex are joined across the edges at it; one fan is one set.
  Sets corners(3 * mesh.triangles.size());
  const auto corner_of = [&](int t, int vertex) {
    int i = 0;
    while (mesh.triangles[t][i] != vertex) ++i;
    return 3 * t + i;
  };
  for (const SurfaceEdge& edge : edges) {
    for (const int v : {edge.a, edge.b}) {
      for (const int t : edge.triangles)
        corners.join(corner_of(edge.triangles[0], v), corner_of(t, v));
    }
  }
  std::vector<int> fans(mesh.vertices.size(), 0), pinched;
  for (int c = 0; c < static_cast<int>(3 * mesh.triangles.size()); ++c) {
    if (corners.root(c) == c) ++fans[mesh.triangles[c / 3][c % 3]];
  }
  for (int v = 0; v < static_cast<int>(fans.size()); ++v) {
    if (fans[v] > 1) pinched.push_back(v);
  }
  return pinched;
}

bool is_degenerate(const TriMesh& mesh, int triangle) {
  const Vec3i& t = mesh.triangles[triangle];
  const Vec3 a = mesh.vertices[t[1]] - mesh.vertices[t[0]];
  const Vec3 b = mesh.vertices[t[2]] - mesh.vertices[t[0]];
  // |a × b| of three exactly collinear doubles is at most a few ulp of |a||b|.
  return a.cross(b).norm() <= 1e-15 * a.norm() * b.norm();
}

int orient_consistently(TriMesh& mesh, const std::vector<SurfaceEdge>& edges) {
  const std::vector<std::vector<Neighbour>> around = neighbours(mesh, edges);
  std::vector<int> turned(mesh.triangles.size(), -1);  // -1: not reached yet
  int total = 0;
  for (std::size_t start = 0; start < turned.size(); ++start) {
    if (turned[start] >= 0) continue;
    turned[start] = 0;
    std::vector<int> shell = {static_cast<int>(start)};  // grows while it is walked through
    for (std::size_t i = 0; i < shell.size(); ++i) {
      const int t = shell[i];
      for (const Neighbour& next : around[t]) {
        const int wanted = next.same_direction ? 1 - turned[t] : turned[t];
        if (turned[next.triangle] < 0) {
          turned[next.triangle] = wanted;
          shell.push_back(next.triangle);
        } else if (turned[next.triangle] != wanted) {
          return -1;
        }
      }
    }
    total += turn_the_fewer(mesh, shell, turned);
  }
  return total;
}

std::vector<int> shells(const TriMesh& mesh, const std::vector<SurfaceEdge>& edges, int& count) {
  Sets sets(mesh.triangles.size());
  for (const SurfaceEdge& edge : edges) {
    for (const int t : edge.triangles) sets.join(edge.triangles[0], t);
  }
  count = 0;
  std::vector<int> shell(mesh.triangles.size());
  for (int t = 0; t < static_cast<int>(shell.size()); ++t) {
    const int root = sets.root(t);  // the lowest index of its set
    shell[t] = root == t ? count++ : shell[root];
  }
  return shell;
}

}  // namespace archetide
