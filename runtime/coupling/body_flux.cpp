#include "runtime/coupling/body_flux.h"

#include <algorithm>
#include <cmath>

#include "runtime/coupling/clip.h"
#include "runtime/coupling/surface_sweep.h"

namespace archetide {
namespace {

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

DualFaces add_solid_fractions(const Grid& g, const std::vector<Vec3>& points,
                              const std::vector<Vec3i>& triangles, SolidFractions& fractions) {
  const CellBox box = cell_box(g, points);
  const std::vector<double> kappa = mean_curvature(points, triangles);
  std::vector<CellMoments> moments(box.count());
  for (const Vec3i& t : triangles) {
    const Vec3 x[3] = {to_grid(g, points[t[0]]), to_grid(g, points[t[1]]),
                       to_grid(g, points[t[2]])};
    const Vec3 bend = g.dx * Vec3(kappa[t[0]], kappa[t[1]], kappa[t[2]]);
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 w = centroid_weights(piece);
      const double at = w[0] * x[0][0] + w[1] * x[1][0] + w[2] * x[2][0];
      moments[box.index(cell)].add(vector_area(piece), at - cell[0] - 0.5, w.dot(bend));
    });
  }
  return sweep_surface(g, box, moments, fractions);
}

BodyFlux cut_body(const Grid& g, const BodySurface& s, SolidFractions& fractions,
                  DualFaces& faces) {
  const Archetype& archetype = *s.body->archetype;
  const int r = s.body->r;
  const CellBox box = cell_box(g, s.points);
  const std::vector<double> kappa = mean_curvature(s.points, archetype.surface.triangles);
  std::vector<CellMoments> moments(box.count());
  std::vector<int> slot_of(box.count(), -1);
  std::vector<Vec3i> cells;
  std::vector<double>
      columns;  // (6 + r) per cell: rigid columns in world axes, raw modes phi_i . n
  const auto slot = [&](const Vec3i& cell) {
    int& at = slot_of[box.index(cell)];
    if (at < 0) {
      at = static_cast<int>(cells.size());
      cells.push_back(cell);
      columns.resize(columns.size() + 6 + r, 0.0);
    }
    return at;
  };

  // Raw fluxes: every quantity is linear on a piece, so its value at the centroid times the area is
  // exact.
  for (const Vec3i& t : archetype.surface.triangles) {
    const Vec3 x[3] = {to_grid(g, s.points[t[0]]), to_grid(g, s.points[t[1]]),
                       to_grid(g, s.points[t[2]])};
    const Vec3 bend = g.dx * Vec3(kappa[t[0]], kappa[t[1]], kappa[t[2]]);
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 area = vector_area(piece), w = centroid_weights(piece);
      const Vec3 at = w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
      moments[box.index(cell)].add(area, at[0] - cell[0] - 0.5, w.dot(bend));
      if ((cell.array() < 0).any() || cell[0] >= g.nx || cell[1] >= g.ny || cell[2] >= g.nz) return;

      const auto first = static_cast<std::size_t>(slot(cell)) * (6 + r);
      double* column = columns.data() + first;
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
  faces = sweep_surface(g, box, moments, fractions);
  bound_slip(archetype.volume / (g.dx * g.dx * g.dx), faces);
  for (DualFace& face : faces) {
    face.low = slot(face.face - Vec3i::Unit(face.axis));
    face.high = slot(face.face);
  }

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
