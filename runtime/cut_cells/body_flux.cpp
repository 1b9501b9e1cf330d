#include "runtime/cut_cells/body_flux.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "runtime/cut_cells/clip.h"
#include "runtime/cut_cells/surface_sweep.h"
#include "runtime/numerics/parallel.h"

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
  wet_points(body, s.points);
  if (body.nodes) s.nodes = std::make_shared<const NodalSurface>(body, s.terms, s.points);
  return s;
}

DualFaces add_solid_fractions(const Grid& g, const std::vector<Vec3>& points,
                              const std::vector<Vec3i>& triangles, SolidFractions& fractions) {
  SurfaceCells cells = cell_moments(g, points, triangles, mean_curvature(points, triangles));
  return sweep_surface(g, cells, fractions);
}

WetSurface wet_surface(const BodySurface& s) {
  return {&s.points, &wet_triangles(*s.body), {{&s}}};
}

WetSurface wet_surface(const SkinnedBodies& skin, const std::vector<BodySurface>& surfaces,
                       const std::vector<Vec3>& points) {
  WetSurface wet{&points, &skin.wet_shape().skin->surface.triangles, {}};
  for (std::size_t p = 0; p < skin.bodies.size(); ++p) {
    wet.members.push_back({&surfaces[skin.bodies[p]], &skin.wet_shape().shares[p]});
    skin_arms(skin.wet_shape().shares[p], *wet.members.back().body->body, wet.members.back().arms);
  }
  return wet;
}

void move_with_members(const SkinnedBodies& skin, const std::vector<BodySurface>& surfaces,
                       const std::vector<const std::vector<Vec3>*>& to, std::vector<Vec3>& points) {
  for (std::size_t p = 0; p < skin.bodies.size(); ++p) {
    const SkinShare& share = skin.wet_shape().shares[p];
    const std::vector<Vec3>&from = surfaces[skin.bodies[p]].points, &there = *to[p];
    if (&from == &there) continue;
    for (std::size_t k = 0; k < share.vertices.size(); ++k)
      for (int c = 0; c < 3; ++c) {
        const int v = share.corners[k][c];
        points[share.vertices[k]] += share.weights[k] * share.bary[k][c] * (there[v] - from[v]);
      }
  }
}

MemberJacobian::MemberJacobian(const WetSurface& surface, const WetSurface::Member& member)
    : surface_(surface),
      member_(member),
      body_(*member.body),
      share_(member.share),
      modes_(share_ ? share_->modes : wet_modes(*body_.body)) {}

// Jᵀ of Eq. 4. Mode by mode over all columns: the places of one mode stay in the cache.
MatX MemberJacobian::transposed(const SurfaceFlux& columns) const {
  struct Entry {
    std::ptrdiff_t row;  // of the modes
    Vec3 load;           // s R^T w f
  };
  std::vector<Entry> entries;
  entries.reserve(columns.vertex.size());
  std::vector<std::size_t> ends;
  const ShapeCorrection& shape = body_.terms.shape;
  const int r = body_.body->r;
  const auto count = static_cast<Eigen::Index>(columns.ends.size());
  MatX out = MatX::Zero(6 + r, count);
  for (Eigen::Index m = 0; m < count; ++m) {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    double spread = 0.0;
    for (std::size_t e = columns.begin(m); e < columns.ends[m]; ++e) {
      const int v = columns.vertex[e], row = share_ ? share_->row[v] : v;
      if (row < 0) continue;
      const Vec3 f = share_ ? Vec3(share_->weights[row] * columns.area[e]) : columns.area[e];
      const Vec3 arm = share_ ? member_.arms[row] : Vec3((*surface_.points)[v] - body_.centre);
      force += f, torque += arm.cross(f), spread += arm.dot(f);
      entries.push_back({3 * static_cast<std::ptrdiff_t>(row), shape.s * body_.R.transpose() * f});
    }
    ends.push_back(entries.size());
    out.col(m).head<3>() = force;
    out.col(m).segment<3>(3) = torque;
    if (r > 0)
      out.col(m).tail(r) = spread * shape.slope.head(r) +
                           shape.shift_rate.leftCols(r).transpose() * (body_.R.transpose() * force);
  }
  for (int i = 0; i < r; ++i) {
    const double* phi = modes_.col(i).data();
    for (std::size_t m = 0, e = 0; m < ends.size(); ++m) {
      double sum = 0.0;
      for (; e < ends[m]; ++e) {
        const double* p = phi + entries[e].row;
        sum += p[0] * entries[e].load[0] + p[1] * entries[e].load[1] + p[2] * entries[e].load[2];
      }
      out(6 + i, static_cast<Eigen::Index>(m)) += sum;
    }
  }
  return out;
}

namespace {

/// Takes from generalised forces ((6 + r) x columns) the spin that modes carry: B_i = R phi_i -
/// (I^-1 D_i) x x instead of R phi_i (Eq. 16).
void without_spin(const BodySurface& body, MatX& forces) {
  forces.bottomRows(body.body->r).noalias() -=
      body.terms.spin_of_modes.transpose() * forces.middleRows(3, 3);
}

}  // namespace

std::vector<VecX> generalised_forces(const WetSurface& surface,
                                     const std::vector<std::vector<Mat3>>& parts) {
  SurfaceFlux on_points;  // one column, of all points
  for (int v = 0; v < static_cast<int>(surface.points->size()); ++v) on_points.add(v, Vec3::Zero());
  on_points.end_column();
  auto triangle = surface.triangles->begin();
  for (const std::vector<Mat3>& part : parts)
    for (const Mat3& load : part) {
      for (int v = 0; v < 3; ++v) on_points.area[(*triangle)[v]] += load.col(v);
      ++triangle;
    }
  std::vector<VecX> forces;
  for (const WetSurface::Member& m : surface.members) {
    if (m.body->nodes) {
      const auto n = static_cast<Eigen::Index>(3 * on_points.area.size());
      forces.emplace_back(
          m.body->nodes->force(Eigen::Map<const VecX>(on_points.area.data()->data(), n)));
      continue;
    }
    MatX f = MemberJacobian(surface, m).transposed(on_points);
    without_spin(*m.body, f);
    forces.emplace_back(f.col(0));
  }
  return forces;
}

MatX reduced_flux(const NodalSurface& nodes, const SurfaceFlux& surface) {
  const MatX& J = nodes.reduced_jacobian();
  MatX flux = MatX::Zero(J.cols(), static_cast<Eigen::Index>(surface.ends.size()));
  for (std::size_t m = 0; m < surface.ends.size(); ++m)
    for (std::size_t e = surface.begin(m); e < surface.ends[m]; ++e)
      flux.col(static_cast<Eigen::Index>(m)).noalias() +=
          J.middleRows<3>(3L * surface.vertex[e]).transpose() * surface.area[e];
  return flux;
}

namespace {

/// A piece of a triangle within a cell. Every quantity is linear on a piece, so its value at the
/// centroid times the area is exact.
struct SweptPiece {
  Vec3i cell, triangle;
  Vec3 weights;     // of the centroid
  Vec3 area;        // cells^2
  double at, bend;  // of CellMoments::add
  Vec3 squares;     // the same
};

std::vector<SweptPiece> sweep_some(const Grid& g, const WetSurface& s,
                                   const std::vector<double>& kappa,
                                   std::span<const Vec3i> triangles) {
  const std::vector<Vec3>& points = *s.points;
  std::vector<SweptPiece> pieces;
  for (const Vec3i& t : triangles) {
    const Vec3 x[3] = {to_grid(g, points[t[0]]), to_grid(g, points[t[1]]),
                       to_grid(g, points[t[2]])};
    const Vec3 bend = g.dx * Vec3(kappa[t[0]], kappa[t[1]], kappa[t[2]]);
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 w = centroid_weights(piece);
      const double at = w[0] * x[0][0] + w[1] * x[1][0] + w[2] * x[2][0];
      const Vec3 centre = cell.cast<double>() + Vec3::Constant(0.5);
      pieces.push_back({cell, t, w, vector_area(piece), at - centre[0], w.dot(bend),
                        mean_squares(piece, centre)});
    });
  }
  return pieces;
}

/// A surface as the grid cuts it: moments of the cells, and what its points push into those cells
/// that stand in `slots`, in the tank or beside it (the rest of them get nothing).
struct SweptSurface {
  SurfaceCells cells;
  CellSlots slots;
  SurfaceFlux flux;
};

/// Sums the pieces of each cell point by point.
void sum_pieces(const Grid& g, const std::vector<const SweptPiece*>& pieces, std::size_t points,
                SweptSurface& swept) {
  std::vector<std::vector<const SweptPiece*>> of_cell;
  for (const SweptPiece* piece : pieces) {
    const auto slot = static_cast<std::size_t>(swept.slots.slot(piece->cell));
    if (of_cell.size() <= slot) of_cell.resize(slot + 1);
    of_cell[slot].push_back(piece);
  }
  std::vector<std::size_t> place(points, 0);  // of a point among the entries, if in this column
  for (const auto& column : of_cell) {
    const std::size_t first = swept.flux.vertex.size();
    for (const SweptPiece* piece : column)
      for (int v = 0; v < 3; ++v) {
        const int point = piece->triangle[v];
        const Vec3 area = (g.dx * g.dx * piece->weights[v]) * piece->area;  // m^2
        std::size_t& at = place[point];
        if (at >= first && at < swept.flux.vertex.size() && swept.flux.vertex[at] == point) {
          swept.flux.area[at] += area;
        } else {
          at = swept.flux.vertex.size();
          swept.flux.add(point, area);
        }
      }
    swept.flux.end_column();
  }
}

SweptSurface sweep_members(const Grid& g, const WetSurface& s) {
  const std::vector<double> kappa = mean_curvature(*s.points, *s.triangles);
  const CellBox box = cell_box(g, *s.points);
  SweptSurface swept{SurfaceCells(box), CellSlots(box), {}};
  const auto parts = parts_of(
      *s.triangles, [&](std::span<const Vec3i> some) { return sweep_some(g, s, kappa, some); });
  std::vector<const SweptPiece*> all;
  for (const std::vector<SweptPiece>& part : parts)
    for (const SweptPiece& piece : part) {
      swept.cells.at(piece.cell).add(piece.area, piece.at, piece.squares, piece.bend);
      all.push_back(&piece);
    }
  sum_pieces(g, all, s.points->size(), swept);
  return swept;
}

std::vector<std::int64_t> cell_indices(const Grid& g, const std::vector<Vec3i>& cells) {
  std::vector<std::int64_t> index;
  index.reserve(cells.size());
  const Vec3i last(g.nx - 1, g.ny - 1, g.nz - 1);
  for (const Vec3i& c : cells) {
    const Vec3i in = c.cwiseMax(0).cwiseMin(last);
    const std::int64_t n =
        in[0] + static_cast<std::int64_t>(g.nx) * (in[1] + static_cast<std::int64_t>(g.ny) * in[2]);
    index.push_back(in == c ? n : cell_beyond(n));
  }
  return index;
}

/// Gᵀ Wᵀ J of Eq. 45 with areas instead of 0 and 1, of a body that is alone on its surface.
BodyFlux body_flux(const Grid& g, const BodySurface& body, SweptSurface& swept) {
  BodyFlux f{cell_indices(g, swept.slots.cells()), {}, {}};
  while (swept.flux.ends.size() < f.cell.size()) swept.flux.end_column();
  if (body.nodes) {
    f.flux = reduced_flux(*body.nodes, swept.flux);
    f.surface = std::move(swept.flux);
    return f;
  }
  const WetSurface wet = wet_surface(body);
  f.flux = MemberJacobian(wet, wet.members[0]).transposed(swept.flux);
  without_spin(body, f.flux);
  return f;
}

/// The same of one member of a skin, in the cells where it moves something.
BodyFlux member_flux(const Grid& g, const WetSurface& skin, const WetSurface::Member& member,
                     const SweptSurface& swept) {
  const MemberJacobian jacobian(skin, member);
  std::vector<Vec3i> cells;
  SurfaceFlux own;
  for (std::size_t m = 0; m < swept.flux.ends.size(); ++m) {
    const std::size_t before = own.vertex.size();
    for (std::size_t e = swept.flux.begin(m); e < swept.flux.ends[m]; ++e)
      if (jacobian.moves(swept.flux.vertex[e])) own.add(swept.flux.vertex[e], swept.flux.area[e]);
    if (own.vertex.size() == before) continue;
    own.end_column();
    cells.push_back(swept.slots.cells()[m]);
  }
  BodyFlux f{cell_indices(g, cells), jacobian.transposed(own), {}};
  without_spin(*member.body, f.flux);
  return f;
}

// Removes the net flux of motions whose net flux is an error of the mesh: modes that keep the
// volume. A closed tank would stop such a mode [D37].
void balance_flux(MatX& flux) {
  constexpr double kNothing = 1e-3;  // net flux that is the mesh's, of the gross flux
  for (Eigen::Index d = 0; d < flux.rows(); ++d) {
    const double net = flux.row(d).sum(), gross = flux.row(d).cwiseAbs().sum();
    if (std::abs(net) < kNothing * gross) flux.row(d) -= net / gross * flux.row(d).cwiseAbs();
  }
}

}  // namespace

std::vector<BodyFlux> cut_bodies(const Grid& g, const std::vector<const BodySurface*>& surfaces,
                                 const std::vector<DualFaces*>& faces, SolidFractions& fractions) {
  const std::size_t count = surfaces.size();
  std::vector<std::optional<SweptSurface>> swept(count);
  for_each_large(count,
                 [&](std::size_t b) { swept[b] = sweep_members(g, wet_surface(*surfaces[b])); });
  for (std::size_t b = 0; b < count; ++b) *faces[b] = sweep_surface(g, swept[b]->cells, fractions);
  std::vector<BodyFlux> fluxes(count);
  for_each_large(count, [&](std::size_t b) {
    const BodySurface& s = *surfaces[b];
    CellSlots& slots = swept[b]->slots;
    bound_slip(s.body->archetype->volume / (g.dx * g.dx * g.dx), *faces[b]);
    for (DualFace& face : *faces[b]) {
      face.low = slots.slot(face.face - Vec3i::Unit(face.axis));
      face.high = slots.slot(face.face);
    }
    fluxes[b] = body_flux(g, s, *swept[b]);
    balance_flux(fluxes[b].flux);
  });
  return fluxes;
}

BodyFlux cut_body(const Grid& g, const BodySurface& s, SolidFractions& fractions,
                  DualFaces& faces) {
  return std::move(cut_bodies(g, {&s}, {&faces}, fractions)[0]);
}

std::vector<BodyFlux> cut_skin(const Grid& g, const WetSurface& skin, SolidFractions& fractions) {
  SweptSurface swept = sweep_members(g, skin);
  sweep_surface(g, swept.cells, fractions);
  std::vector<BodyFlux> fluxes;
  for (const WetSurface::Member& m : skin.members) fluxes.push_back(member_flux(g, skin, m, swept));
  return fluxes;
}

MatX interpolated_jacobian(const BodySurface& s, int triangle, const Vec3& bary) {
  const Vec3i& t = s.body->archetype->surface.triangles[triangle];
  MatX J = MatX::Zero(3, s.body->dofs());
  for (int v = 0; v < 3; ++v) J += bary[v] * point_jacobian(*s.body, s.terms, t[v]);
  return J;
}

}  // namespace archetide
