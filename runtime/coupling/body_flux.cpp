#include "runtime/coupling/body_flux.h"

#include <algorithm>
#include <cmath>

#include "runtime/coupling/clip.h"

namespace archetide {
namespace {

// Box of cells around a surface, clamped to one layer outside the grid.
struct CellBox {
  Vec3i low = Vec3i::Zero(), size = Vec3i::Zero();
  std::size_t index(const Vec3i& c) const {
    const Vec3i d = c - low;
    return d[0] +
           static_cast<std::size_t>(size[0]) * (d[1] + static_cast<std::size_t>(size[1]) * d[2]);
  }
  std::size_t count() const { return static_cast<std::size_t>(size[0]) * size[1] * size[2]; }
};

CellBox cell_box(const Grid& g, const std::vector<Vec3>& points) {
  Vec3 lo = Vec3::Constant(INFINITY), hi = -lo;
  for (const Vec3& p : points) lo = lo.cwiseMin(p), hi = hi.cwiseMax(p);
  CellBox box;
  for (int a = 0; a < 3; ++a) {
    const auto cell = [&](double x) {
      return static_cast<int>(
          std::floor(std::clamp((x - g.origin[a]) / g.dx, -1.0, double(g.size(a)))));
    };
    box.low[a] = cell(lo[a]);
    box.size[a] = cell(hi[a]) - box.low[a] + 1;
  }
  return box;
}

// What a surface leaves in each cell of a box: vector area and first moment of the area, in cells.
struct CellMoments {
  Vec3 area = Vec3::Zero();  // integral of n
  double moment_x = 0.0;     // integral of (x - cell centre) n_x
};

// Area fractions by the divergence theorem: along each axis the solid fraction of a face is that of
// the previous face minus the surface's projected area in the cell between them.
void sweep_fractions(const Grid& g, const CellBox& box, const std::vector<CellMoments>& moments,
                     SolidFractions& fractions) {
  constexpr double kSnap = 1e-12;  // round-off of the sums; measured below 1e-13 on 24k triangles
  const auto snap = [](double s) { return s < kSnap ? 0.0 : s > 1.0 - kSnap ? 1.0 : s; };
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (int n = 0; n < box.size[c]; ++n)
      for (int m = 0; m < box.size[b]; ++m) {
        Vec3i cell = box.low;
        cell[b] += m, cell[c] += n;
        if (cell[b] < 0 || cell[b] >= g.size(b) || cell[c] < 0 || cell[c] >= g.size(c)) continue;
        double solid = 0.0;  // fraction of the face below `cell`
        for (int l = 0; l < box.size[axis]; ++l, ++cell[axis]) {
          const CellMoments& in_cell = moments[box.index(cell)];
          const double above = solid - in_cell.area[axis];
          const int face = cell[axis] + 1;
          if (axis == 0 && cell[0] >= 0 && cell[0] < g.nx) {
            const double volume = 0.5 * (solid + above) + in_cell.moment_x;
            fractions.cell(cell[0], cell[1], cell[2]) += snap(volume);
          }
          solid = above;
          if (face >= 0 && face <= g.size(axis)) {
            Vec3i f = cell;
            f[axis] = face;
            fractions.face[axis](f[0], f[1], f[2]) += snap(solid);
          }
        }
      }
  }
}

Vec3 to_grid(const Grid& g, const Vec3& x) { return (x - g.origin) / g.dx; }

}  // namespace

BodySurface body_surface(const ReducedBody& body, ModalMass mass) {
  BodySurface s;
  s.body = &body;
  s.terms = configuration_terms(body, {body.rotation, body.q, body.q_dot}, mass);
  s.R = body.rotation.toRotationMatrix();
  s.centre = body.position;
  surface_points(body, s.points);
  return s;
}

void add_solid_fractions(const Grid& g, const std::vector<Vec3>& points,
                         const std::vector<Vec3i>& triangles, SolidFractions& fractions) {
  const CellBox box = cell_box(g, points);
  std::vector<CellMoments> moments(box.count());
  for (const Vec3i& t : triangles) {
    const Vec3 x[3] = {to_grid(g, points[t[0]]), to_grid(g, points[t[1]]),
                       to_grid(g, points[t[2]])};
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 area = vector_area(piece), w = centroid_weights(piece);
      CellMoments& m = moments[box.index(cell)];
      m.area += area;
      m.moment_x += area[0] * (w[0] * x[0][0] + w[1] * x[1][0] + w[2] * x[2][0] - cell[0] - 0.5);
    });
  }
  sweep_fractions(g, box, moments, fractions);
}

BodyFlux cut_body(const Grid& g, const BodySurface& s, SolidFractions& fractions) {
  const Archetype& archetype = *s.body->archetype;
  const int r = s.body->r;
  const CellBox box = cell_box(g, s.points);
  std::vector<CellMoments> moments(box.count());
  std::vector<int> slot_of(box.count(), -1);
  std::vector<Vec3i> cells;
  std::vector<double>
      columns;  // (6 + r) per cell: rigid columns in world axes, raw modes phi_i . n

  // Raw fluxes: every quantity is linear on a piece, so its value at the centroid times the area is
  // exact.
  for (const Vec3i& t : archetype.surface.triangles) {
    const Vec3 x[3] = {to_grid(g, s.points[t[0]]), to_grid(g, s.points[t[1]]),
                       to_grid(g, s.points[t[2]])};
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 area = vector_area(piece), w = centroid_weights(piece);
      const Vec3 at = w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
      const std::size_t n = box.index(cell);
      moments[n].area += area;
      moments[n].moment_x += area[0] * (at[0] - cell[0] - 0.5);
      if ((cell.array() < 0).any() || cell[0] >= g.nx || cell[1] >= g.ny || cell[2] >= g.nz) return;

      if (slot_of[n] < 0) {
        slot_of[n] = static_cast<int>(cells.size());
        cells.push_back(cell);
        columns.resize(columns.size() + 6 + r, 0.0);
      }
      double* column = columns.data() + static_cast<std::size_t>(slot_of[n]) * (6 + r);
      const Vec3 a = area * (g.dx * g.dx);                             // m^2
      const Vec3 torque = (g.origin + g.dx * at - s.centre).cross(a);  // (w x x) . a = w . (x x a)
      for (int d = 0; d < 3; ++d) column[d] += a[d], column[3 + d] += torque[d];
      const Vec3 a_body = s.R.transpose() * a;
      for (int i = 0; i < r; ++i) {
        const double* phi = archetype.surface_modes.col(i).data();
        double sum = 0.0;
        for (int v = 0; v < 3; ++v) {
          const double* p = phi + 3 * t[v];
          sum += w[v] * (p[0] * a_body[0] + p[1] * a_body[1] + p[2] * a_body[2]);
        }
        column[6 + i] += sum;
      }
    });
  }
  sweep_fractions(g, box, moments, fractions);

  // B_i = R phi_i - (I^-1 D_i) x x  takes the rigid spin out of each mode.
  BodyFlux f;
  f.flux = Eigen::Map<const MatX>(columns.data(), 6 + r, static_cast<Eigen::Index>(cells.size()));
  f.flux.bottomRows(r).noalias() -= s.terms.spin_of_modes.transpose() * f.flux.middleRows(3, 3);
  f.cell.reserve(cells.size());
  for (const Vec3i& c : cells)
    f.cell.push_back(c[0] + static_cast<std::int64_t>(g.nx) *
                                (c[1] + static_cast<std::int64_t>(g.ny) * c[2]));
  return f;
}

MatX interpolated_jacobian(const BodySurface& s, int triangle, const Vec3& bary) {
  const Vec3i& t = s.body->archetype->surface.triangles[triangle];
  MatX J = MatX::Zero(3, s.body->dofs());
  for (int v = 0; v < 3; ++v) J += bary[v] * point_jacobian(*s.body, s.terms, t[v]);
  return J;
}

}  // namespace archetide
