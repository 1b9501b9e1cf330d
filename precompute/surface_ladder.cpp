#include "precompute/surface_ladder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/LU>

#include "common/mesh/closest_point.h"
#include "common/mesh/tet_shape.h"
#include "precompute/intake/simplify_surface.h"
#include "precompute/modal/normal_motion.h"

namespace archetide {
namespace {

constexpr std::size_t kFewest = 48;  // triangles of a rung
constexpr double kBarely = 0.8;      // of the triangles before: no coarser surface is to be had

/// Gives `surface` the volume and the centroid of `whole`.
void match(const TriMesh& whole, TriMesh& surface) {
  const double scale = std::cbrt(enclosed_volume(whole) / enclosed_volume(surface));
  const Vec3 from = enclosed_centroid(surface), to = enclosed_centroid(whole);
  for (Vec3& x : surface.vertices) x = to + scale * (x - from);
}

/// Root mean square distance of a surface's vertices and triangles' middles from another, m.
double deviation(const TriMesh& surface, const ClosestPoint& whole) {
  double sum = 0.0;
  const auto add = [&](const Vec3& x) {
    const double d = whole.find(x, std::numeric_limits<double>::infinity()).distance;
    sum += d * d;
  };
  for (const Vec3& x : surface.vertices) add(x);
  for (const Vec3i& t : surface.triangles)
    add((surface.vertices[t[0]] + surface.vertices[t[1]] + surface.vertices[t[2]]) / 3.0);
  return std::sqrt(sum / static_cast<double>(surface.vertices.size() + surface.triangles.size()));
}

/// Surfaces with ever fewer triangles, as Rung{surface, .., deviation}.
template <class Rung>
std::vector<Rung> coarser_surfaces(const TriMesh& whole, const ClosestPoint& nearest) {
  std::vector<Rung> ladder;
  TriMesh last = whole;
  while (last.triangles.size() / 2 >= kFewest) {
    const std::size_t before = last.triangles.size();
    last = simplify_surface(last, before / 2);
    if (static_cast<double>(last.triangles.size()) > kBarely * static_cast<double>(before)) break;
    if (!(enclosed_volume(last) > 0.0)) break;
    Rung rung;
    rung.surface = last;
    match(whole, rung.surface);
    rung.deviation = deviation(rung.surface, nearest);
    ladder.push_back(std::move(rung));
  }
  return ladder;
}

/// Place x in the reference tet, by Newton's method from that of the straight tet.
template <int N>
Vec3 reference_place(const Eigen::Matrix<double, 3, N>& nodes, const Vec3& x) {
  constexpr int kPasses = 4;
  Vec3 L = Vec3::Constant(0.25);
  for (int pass = 0; pass < kPasses; ++pass) {
    const Mat3 slope = nodes * TetShape<N>::gradients(L).transpose();
    L += slope.inverse() * (x - nodes * TetShape<N>::values(L));
    if (!L.allFinite()) return Vec3::Constant(0.25);
    L = L.cwiseMax(0.0).cwiseMin(1.0);  // x lies in the tet
  }
  return L;
}

/// Rows of the modes at `x`, whose nearest point of the surface is `at` in `tet`: the modes there,
/// continued along their gradient.
template <int N>
MatX modes_beside(const Archetype& a, int tet, const Vec3& at, const Vec3& x) {
  const std::array<int, N> nodes = element_nodes<N>(a.tets, tet);
  const Eigen::Matrix<double, 3, N> places = element_positions<N>(a.tets, nodes);
  const Vec3 L = reference_place<N>(places, at);
  const auto slopes = TetShape<N>::gradients(L);
  const Mat3 slope = places * slopes.transpose();
  // Weights of the nodes: N(L) + (dN/dx) (x - at).
  const Vec3 step = slope.inverse() * (x - at);
  const auto weights = (TetShape<N>::values(L) + slopes.transpose() * step).eval();
  MatX rows = MatX::Zero(3, a.r());
  for (int n = 0; n < N; ++n)
    rows += weights[n] * a.node_modes.middleRows<3>(3 * static_cast<Eigen::Index>(nodes[n]));
  return rows;
}

MatX modes_of(const Archetype& a, const ClosestPoint& nearest, const std::vector<int>& tet_behind,
              const std::vector<Vec3>& vertices) {
  MatX modes(3 * static_cast<Eigen::Index>(vertices.size()), a.r());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const auto hit = nearest.find(vertices[v], std::numeric_limits<double>::infinity());
    const int tet = tet_behind[static_cast<std::size_t>(hit.triangle)];
    modes.middleRows<3>(3 * static_cast<Eigen::Index>(v)) =
        a.tets.order() == 2 ? modes_beside<10>(a, tet, hit.point, vertices[v])
                            : modes_beside<4>(a, tet, hit.point, vertices[v]);
  }
  return modes;
}

/// Integrals over a surface of the normal displacement of each mode, times 1, x, y and z: what
/// uniform pressure and hydrostatic pressure do to it. 4 x r, m^3 and m^4 per unit q. With `modes`
/// = n_v b_c(x_v) that of the four fields b = 1, x, y, z along the vertices' normals.
Eigen::Matrix<double, 4, Eigen::Dynamic> loads(const TriMesh& surface, const MatX& modes) {
  Eigen::Matrix<double, 4, Eigen::Dynamic> sum(4, modes.cols());
  sum.setZero();
  for (const Vec3i& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
               &c = surface.vertices[t[2]];
    const Vec3 area = 0.5 * (b - a).cross(c - a);
    for (int v = 0; v < 3; ++v) {
      // Of a linear function, over a triangle: (sum of the corners + its own) / 12, times the area.
      Eigen::Vector4d weight;
      weight << 1.0 / 3.0, (a + b + c + surface.vertices[t[v]]) / 12.0;
      sum += weight * (area.transpose() * modes.middleRows<3>(3 * static_cast<Eigen::Index>(t[v])));
    }
  }
  return sum;
}

/// Straight edges between the places of a bent mode draw it too small, and its added mass with it:
/// gives every mode the mean square normal displacement that it has on the whole surface.
void match_size(const Archetype& a, SurfaceRung& rung) {
  constexpr double kLargestChange = 0.1;  // change; beyond it the mode hardly moves along the normal
  const VecX whole = normal_motion_squared(a.surface, a.surface_modes),
             coarse = normal_motion_squared(rung.surface, rung.modes);
  for (Eigen::Index i = 0; i < whole.size(); ++i) {
    const double scale = std::sqrt(whole[i] / coarse[i]);
    if (std::abs(scale - 1.0) < kLargestChange) rung.modes.col(i) *= scale;
  }
}

/// Moves the modes along the normals, by a linear function of place each, so that pressures that
/// are linear in space do to them what they do to those of the whole surface. A mode that keeps its
/// volume to rounding would otherwise be held by a closed tank.
void match_loads(const Archetype& a, SurfaceRung& rung) {
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(rung.surface, normals, areas);
  MatX fields(rung.modes.rows(), 4);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    auto rows = fields.middleRows<3>(3 * static_cast<Eigen::Index>(v));
    rows.col(0) = normals[v];
    for (int k = 0; k < 3; ++k) rows.col(1 + k) = rung.surface.vertices[v][k] * normals[v];
  }
  const Eigen::Matrix4d of_fields = loads(rung.surface, fields);
  const MatX missing = loads(a.surface, a.surface_modes) - loads(rung.surface, rung.modes);
  rung.modes += fields * of_fields.fullPivLu().solve(missing);
}

/// The parts that move the nearest point of the skin, and how much; as many as a vertex can have.
void blend_weights(const Skin& skin, const ClosestPoint& nearest, const Vec3& x, SkinRung& rung) {
  const auto hit = nearest.find(x, std::numeric_limits<double>::infinity());
  const Vec3i& corners = skin.surface.triangles[static_cast<std::size_t>(hit.triangle)];
  const Vec3 bary = nearest.weights(hit);
  std::map<int, double> by_part;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < Skin::kMostParts; ++k) {
      const auto v = static_cast<std::size_t>(corners[c]);
      const double w = bary[c] * skin.weights[Skin::kMostParts * v + static_cast<std::size_t>(k)];
      if (w > 0.0) by_part[skin.part_of[v][static_cast<std::size_t>(k)]] += w;
    }
  std::vector<std::pair<double, int>> largest;
  for (const auto& [part, w] : by_part) largest.emplace_back(w, part);
  std::stable_sort(largest.begin(), largest.end(),
                   [](const auto& p, const auto& q) { return p.first > q.first; });
  largest.resize(std::min<std::size_t>(largest.size(), Skin::kMostParts));
  double sum = 0.0;
  for (const auto& [w, part] : largest) sum += w;
  std::array<int, Skin::kMostParts> parts{};
  std::array<double, Skin::kMostParts> weights{};
  for (std::size_t k = 0; k < largest.size(); ++k)
    parts[k] = largest[k].second, weights[k] = largest[k].first / sum;
  rung.part_of.push_back(parts);
  rung.weights.insert(rung.weights.end(), weights.begin(), weights.end());
}

}  // namespace

std::vector<SurfaceRung> surface_ladder(const Archetype& a) {
  const ClosestPoint nearest(a.surface);
  std::vector<SurfaceRung> ladder = coarser_surfaces<SurfaceRung>(a.surface, nearest);
  const std::vector<int> tet_behind = tets_at_boundary(a.tets);
  for (SurfaceRung& rung : ladder) {
    rung.modes = modes_of(a, nearest, tet_behind, rung.surface.vertices);
    match_size(a, rung);
    match_loads(a, rung);
  }
  return ladder;
}

std::vector<SkinRung> surface_ladder(const Skin& skin) {
  const ClosestPoint nearest(skin.surface);
  std::vector<SkinRung> ladder = coarser_surfaces<SkinRung>(skin.surface, nearest);
  for (SkinRung& rung : ladder)
    for (const Vec3& x : rung.surface.vertices) blend_weights(skin, nearest, x, rung);
  return ladder;
}

}  // namespace archetide
