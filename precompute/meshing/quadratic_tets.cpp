#include "precompute/meshing/quadratic_tets.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <unordered_map>

#include "common/mesh/closest_point.h"
#include "common/mesh/surface_topology.h"
#include "precompute/base/tet_element.h"

namespace archetide {
namespace {

/// Largest move of a middle node in units of its edge; a half circle would need 0.5.
constexpr double kReach = 0.3;
/// Cosine between the surface there and the mean of the two boundary faces: other sheets are out.
constexpr double kSameSheet = 0.4;
/// Cosine between two boundary faces along a sharp edge, at most (30 degrees).
constexpr double kFolded = 0.866;
constexpr double kOnSharpEdge = 1e-6;  // distance of a corner on a sharp edge, in units of the edge
constexpr int kHalvings = 4;           // on the way back to a straight edge

std::uint64_t edge_key(int a, int b) {
  return (std::uint64_t(std::min(a, b)) << 32) | std::uint64_t(std::max(a, b));
}

struct Segment {
  Vec3 a, b;
  Vec3 closest(const Vec3& x) const {
    const Vec3 d = b - a;
    return a + std::clamp((x - a).dot(d) / d.squaredNorm(), 0.0, 1.0) * d;
  }
};

/// The surface as a target: its sheets and its sharp edges.
class Target {
 public:
  Target(const TriMesh& surface, double sharp_angle) : surface_(surface), tree_(surface) {
    const double limit = std::cos(sharp_angle * std::numbers::pi / 180.0);
    for (const SurfaceEdge& e : surface_edges(surface))
      if (e.triangles.size() == 2 &&
          unit_normal(surface, e.triangles[0]).dot(unit_normal(surface, e.triangles[1])) < limit)
        sharp_.push_back({surface.vertices[e.a], surface.vertices[e.b]});
  }

  /// Where the middle of the boundary edge a-b belongs; `normals`: of its two faces.
  Vec3 place(const Vec3& a, const Vec3& b, const Vec3& normal1, const Vec3& normal2) const {
    const Vec3 middle = 0.5 * (a + b);
    const double length = (b - a).norm();
    if (normal1.dot(normal2) < kFolded && on_sharp_edge(a, length) && on_sharp_edge(b, length)) {
      const Vec3 p = closest_sharp(middle);
      return (p - middle).norm() < kReach * length ? p : middle;
    }
    const ClosestPoint::Hit hit = tree_.find(middle, kReach * length);
    if (hit.triangle < 0) return middle;
    const double cosine = unit_normal(surface_, hit.triangle).dot((normal1 + normal2).normalized());
    return cosine > kSameSheet ? hit.point : middle;
  }

 private:
  Vec3 closest_sharp(const Vec3& x) const {
    Vec3 best = Vec3::Constant(std::numeric_limits<double>::infinity());
    for (const Segment& s : sharp_)
      if (const Vec3 p = s.closest(x); (p - x).squaredNorm() < (best - x).squaredNorm()) best = p;
    return best;
  }
  bool on_sharp_edge(const Vec3& x, double length) const {
    return !sharp_.empty() && (closest_sharp(x) - x).norm() < kOnSharpEdge * length;
  }

  const TriMesh& surface_;
  ClosestPoint tree_;
  std::vector<Segment> sharp_;
};

/// A middle node on the boundary: straight place and how far it was moved from there.
struct BoundaryMiddle {
  int node;
  Vec3 straight, move;
  double part = 1.0;  // of the move that is made

  Vec3 position() const { return straight + part * move; }
};

/// The middle nodes of the boundary's edges, with their moves.
std::vector<BoundaryMiddle> boundary_middles(const TetMesh& mesh, const Target& target) {
  std::unordered_map<std::uint64_t, int> middle;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (int e = 0; e < 6; ++e)
      middle[edge_key(mesh.tets[t][kTetEdges[e][0]], mesh.tets[t][kTetEdges[e][1]])] =
          mesh.mids[t][e];
  const TetMesh corners{mesh.nodes, mesh.tets, {}};
  std::vector<int> node;
  const TriMesh faces = boundary_surface(corners, node);
  std::vector<BoundaryMiddle> result;
  for (const SurfaceEdge& e : surface_edges(faces)) {
    if (e.triangles.size() != 2) continue;
    const Vec3 a = faces.vertices[e.a], b = faces.vertices[e.b], straight = 0.5 * (a + b);
    const Vec3 place =
        target.place(a, b, unit_normal(faces, e.triangles[0]), unit_normal(faces, e.triangles[1]));
    if ((place - straight).norm() > 1e-9 * (b - a).norm())
      result.push_back({middle.at(edge_key(node[e.a], node[e.b])), straight, place - straight});
  }
  return result;
}

}  // namespace

TetMesh with_middle_nodes(const TetMesh& linear) {
  TetMesh mesh{linear.nodes, linear.tets, {}};
  std::unordered_map<std::uint64_t, int> middle;
  middle.reserve(2 * linear.tets.size());
  for (const auto& tet : linear.tets) {
    std::array<int, 6> mids;
    for (int e = 0; e < 6; ++e) {
      const int a = tet[kTetEdges[e][0]], b = tet[kTetEdges[e][1]];
      const auto [entry, is_new] = middle.try_emplace(edge_key(a, b), int(mesh.nodes.size()));
      if (is_new) mesh.nodes.push_back(0.5 * (linear.nodes[a] + linear.nodes[b]));
      mids[e] = entry->second;
    }
    mesh.mids.push_back(mids);
  }
  return mesh;
}

CurveReport curve_boundary(TetMesh& mesh, const TriMesh& surface, double sharp_angle) {
  std::vector<BoundaryMiddle> middles = boundary_middles(mesh, Target(surface, sharp_angle));
  std::vector<int> middle_of_node(mesh.nodes.size(), -1);
  for (std::size_t i = 0; i < middles.size(); ++i) {
    middle_of_node[middles[i].node] = int(i);
    mesh.nodes[middles[i].node] = middles[i].position();
  }

  // Poor tets pull back; every node is halved at most once a round.
  CurveReport report;
  for (int round = 0;; ++round) {
    std::vector<char> pulled(middles.size(), 0);
    report.smallest_jacobian = 1.0;
    for (int t = 0; t < int(mesh.tets.size()); ++t) {
      const auto x = element_positions<10>(mesh, element_nodes<10>(mesh, t));
      if (is_straight(x)) continue;
      const double jacobian = smallest_jacobian(x);
      report.smallest_jacobian = std::min(report.smallest_jacobian, jacobian);
      if (jacobian >= kSmallestJacobian) continue;
      for (const int node : mesh.mids[t])
        if (middle_of_node[node] >= 0) pulled[middle_of_node[node]] = 1;
    }
    if (std::count(pulled.begin(), pulled.end(), 1) == 0) break;
    for (std::size_t i = 0; i < middles.size(); ++i) {
      if (!pulled[i]) continue;
      middles[i].part = round < kHalvings ? 0.5 * middles[i].part : 0.0;
      mesh.nodes[middles[i].node] = middles[i].position();
    }
  }
  report.moved = int(middles.size());
  for (const BoundaryMiddle& m : middles) report.held_back += m.part < 1.0;
  return report;
}

}  // namespace archetide
