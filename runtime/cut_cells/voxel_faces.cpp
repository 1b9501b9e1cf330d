#include "runtime/cut_cells/voxel_faces.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace archetide {
namespace {

// Rays go through cell centres moved by an irrational trifle, so that none meets an edge of a
// surface that is aligned with the grid.
constexpr double kRayShiftX = 1.4142135e-7, kRayShiftY = 1.7320508e-7;  // cells

struct Crossing {
  double z;  // grid coordinate
  int sign;  // -1 entering (normal down), +1 leaving
};

// Barycentric weights of the point of triangle (a, b, c) closest to p [Eri05], 5.1.5.
Vec3 closest_weights(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp);
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

using CellKey = std::array<int, 3>;
using TriangleBuckets = std::map<CellKey, std::vector<int>>;

TriangleBuckets bucket_triangles(const Grid& g, const BodySurface& s) {
  TriangleBuckets buckets;
  const auto& triangles = s.body->archetype->surface.triangles;
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    Vec3 lo = Vec3::Constant(INFINITY), hi = -lo;
    for (int v : triangles[t]) lo = lo.cwiseMin(s.points[v]), hi = hi.cwiseMax(s.points[v]);
    const Eigen::Array3i a = ((lo - g.origin) / g.dx).array().floor().cast<int>();
    const Eigen::Array3i b = ((hi - g.origin) / g.dx).array().floor().cast<int>();
    for (int k = a[2]; k <= b[2]; ++k)
      for (int j = a[1]; j <= b[1]; ++j)
        for (int i = a[0]; i <= b[0]; ++i) buckets[{i, j, k}].push_back(t);
  }
  return buckets;
}

// The surface crosses between the two cell centres, so the nearest point is within half a cell of
// the face.
void find_nearest_point(const Grid& g, const BodySurface& s, const TriangleBuckets& buckets,
                        ConstraintFace& f) {
  const Vec3 x = g.face_centre(f.axis, f.face[0], f.face[1], f.face[2]);
  double best = INFINITY;
  for (int dk = -2; dk <= 1; ++dk)
    for (int dj = -2; dj <= 1; ++dj)
      for (int di = -2; di <= 1; ++di) {
        const auto it = buckets.find({f.face[0] + di, f.face[1] + dj, f.face[2] + dk});
        if (it == buckets.end()) continue;
        for (int t : it->second) {
          const Vec3i& v = s.body->archetype->surface.triangles[t];
          const Vec3 &a = s.points[v[0]], &b = s.points[v[1]], &c = s.points[v[2]];
          const Vec3 w = closest_weights(x, a, b, c);
          const double d = (w[0] * a + w[1] * b + w[2] * c - x).squaredNorm();
          if (d < best) best = d, f.triangle = t, f.bary = w;
        }
      }
}

}  // namespace

std::vector<Vec3i> cells_inside(const Grid& g, const std::vector<Vec3>& points,
                                const std::vector<Vec3i>& triangles) {
  std::map<std::pair<int, int>, std::vector<Crossing>> columns;
  for (const Vec3i& t : triangles) {
    Vec3 x[3];
    for (int v = 0; v < 3; ++v) x[v] = (points[t[v]] - g.origin) / g.dx;
    const Vec3 normal = (x[1] - x[0]).cross(x[2] - x[0]);
    if (normal[2] == 0.0) continue;
    const auto range = [&](int a, int n) {
      const double lo = std::min({x[0][a], x[1][a], x[2][a]}),
                   hi = std::max({x[0][a], x[1][a], x[2][a]});
      return std::pair(static_cast<int>(std::ceil(std::max(lo, 0.0) - 0.51)),
                       std::min(static_cast<int>(std::floor(std::min(hi, n + 1.0) - 0.49)), n - 1));
    };
    const auto [i0, i1] = range(0, g.nx);
    const auto [j0, j1] = range(1, g.ny);
    for (int j = std::max(j0, 0); j <= j1; ++j)
      for (int i = std::max(i0, 0); i <= i1; ++i) {
        const double px = i + 0.5 + kRayShiftX, py = j + 0.5 + kRayShiftY;
        bool in = true;
        for (int e = 0; e < 3 && in; ++e) {
          const Vec3 &a = x[e], &b = x[(e + 1) % 3];
          const double side = (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]);
          in = normal[2] > 0 ? side > 0 : side < 0;
        }
        if (!in) continue;
        const double z =
            x[0][2] - (normal[0] * (px - x[0][0]) + normal[1] * (py - x[0][1])) / normal[2];
        columns[{j, i}].push_back({z, normal[2] > 0 ? 1 : -1});
      }
  }
  std::vector<Vec3i> inside;
  for (auto& [column, crossings] : columns) {
    std::sort(crossings.begin(), crossings.end(),
              [](const Crossing& a, const Crossing& b) { return a.z < b.z; });
    int winding = 0;
    std::size_t next = 0;
    const int k_low = std::max(0, static_cast<int>(std::floor(crossings.front().z - 0.5)));
    for (int k = k_low; k < g.nz && next <= crossings.size(); ++k) {
      while (next < crossings.size() && crossings[next].z <= k + 0.5)
        winding -= crossings[next++].sign;
      if (winding > 0) inside.emplace_back(column.second, column.first, k);
      if (next == crossings.size() && winding <= 0) break;
    }
  }
  return inside;
}

void add_voxel_fractions(const std::vector<Vec3i>& inside, SolidFractions& fractions) {
  for (const Vec3i& c : inside) {
    fractions.cell(c[0], c[1], c[2]) = 1.0;
    for (int a = 0; a < 3; ++a) {
      Vec3i high = c;
      ++high[a];
      fractions.face[a](c[0], c[1], c[2]) = 1.0;
      fractions.face[a](high[0], high[1], high[2]) = 1.0;
    }
  }
}

VoxelBody voxel_body(const Grid& g, const BodySurface& s, SolidFractions& fractions) {
  VoxelBody body;
  body.inside = cells_inside(g, s.points, s.body->archetype->surface.triangles);
  if (body.inside.empty()) return body;
  add_voxel_fractions(body.inside, fractions);

  std::map<CellKey, bool> is_inside;
  for (const Vec3i& c : body.inside) is_inside[{c[0], c[1], c[2]}] = true;
  const TriangleBuckets buckets = bucket_triangles(g, s);
  for (const Vec3i& c : body.inside)
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        Vec3i outer = c;
        outer[axis] += side ? 1 : -1;
        if (outer[axis] < 0 || outer[axis] >= g.size(axis) ||
            is_inside.count({outer[0], outer[1], outer[2]}))
          continue;
        ConstraintFace f{axis, c, outer, side ? 1.0 : -1.0, -1, Vec3::Zero(), VecX()};
        f.face[axis] += side;
        find_nearest_point(g, s, buckets, f);
        if (f.triangle < 0) continue;
        if (!s.nodes) f.Q = interpolated_jacobian(s, f.triangle, f.bary).row(axis).transpose();
        body.faces.push_back(std::move(f));
      }
  return body;
}

VoxelCoupling voxel_coupling(const Grid& g, const VoxelBody& body, int dofs, double density,
                             const MacField& u_star, const Array3<CellKind>& kind) {
  VoxelCoupling c{{}, MatX::Zero(dofs, dofs), VecX::Zero(dofs)};
  const double b = density * g.dx * g.dx * g.dx;  // dual-cell fluid mass, kg
  std::map<std::int64_t, VecX> columns;
  for (const ConstraintFace& f : body.faces) {
    const std::int64_t outer =
        static_cast<std::int64_t>(kind.index(f.outer[0], f.outer[1], f.outer[2]));
    if (kind[outer] != CellKind::kUnknown) continue;
    VecX& column = columns.try_emplace(outer, VecX::Zero(dofs)).first->second;
    column +=
        f.sign * g.dx * g.dx * f.Q;  // a body moving towards the outer cell pushes flux into it
    c.fluid_mass += b * f.Q * f.Q.transpose();
    c.fluid_momentum += b * u_star[f.axis](f.face[0], f.face[1], f.face[2]) * f.Q;
  }
  c.flux.flux.resize(dofs, static_cast<Eigen::Index>(columns.size()));
  for (const auto& [cell, column] : columns) {
    c.flux.flux.col(static_cast<Eigen::Index>(c.flux.cell.size())) = column;
    c.flux.cell.push_back(cell);
  }
  return c;
}

NodalVoxelCoupling nodal_voxel_coupling(const Grid& g, const VoxelBody& body, const BodySurface& s,
                                        double density, const MacField& u_star,
                                        const Array3<CellKind>& kind) {
  std::map<std::int64_t, std::vector<const ConstraintFace*>> faces_of;
  std::vector<const ConstraintFace*> wet;
  for (const ConstraintFace& f : body.faces) {
    const auto outer = static_cast<std::int64_t>(kind.index(f.outer[0], f.outer[1], f.outer[2]));
    if (kind[outer] == CellKind::kUnknown) faces_of[outer].push_back(&f), wet.push_back(&f);
  }
  const auto corners = [&](const ConstraintFace& f) -> const Vec3i& {
    return s.body->archetype->surface.triangles[f.triangle];
  };
  NodalVoxelCoupling c;
  c.b = density * g.dx * g.dx * g.dx;
  for (const auto& [cell, faces] : faces_of) {
    c.flux.cell.push_back(cell);
    for (const ConstraintFace* f : faces)
      for (int v = 0; v < 3; ++v)
        c.flux.surface.add(corners(*f)[v],
                           f->sign * g.dx * g.dx * f->bary[v] * Vec3::Unit(f->axis));
    c.flux.surface.end_column();
  }
  c.flux.flux = reduced_flux(*s.nodes, c.flux.surface);
  const auto count = static_cast<Eigen::Index>(wet.size());
  MatX G = MatX::Zero(3L * s.nodes->vertices(), count);
  c.momentum.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const ConstraintFace& f = *wet[k];
    for (int v = 0; v < 3; ++v) G(3L * corners(f)[v] + f.axis, k) += f.bary[v];
    c.momentum[k] = c.b * u_star[f.axis](f.face[0], f.face[1], f.face[2]);
  }
  c.Q = s.nodes->force(G);
  return c;
}

double face_speed(const ConstraintFace& f, const BodySurface& s, const VecX& velocities) {
  double speed = 0.0;
  for (int v = 0; v < 3; ++v)
    speed +=
        f.bary[v] * velocities[3L * s.body->archetype->surface.triangles[f.triangle][v] + f.axis];
  return speed;
}

}  // namespace archetide
