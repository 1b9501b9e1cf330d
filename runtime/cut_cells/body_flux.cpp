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

bool MemberTriangle::start(const WetSurface& surface, const WetSurface::Member& member,
                           const Vec3i& t) {
  body_ = member.body;
  if (body_->nodes) {
    for (int v = 0; v < 3; ++v) row_[v] = t[v];
    return true;
  }
  if (!member.share) {
    modes_ = &wet_modes(*body_->body);
    for (int v = 0; v < 3; ++v) {
      weight_[v] = 1.0;
      row_[v] = t[v];
      arm_[v] = (*surface.points)[t[v]] - body_->centre;
    }
    return true;
  }
  modes_ = &member.share->modes;
  bool any = false;
  for (int v = 0; v < 3; ++v) {
    const int row = member.share->row[t[v]];
    any = any || row >= 0;
    weight_[v] = row >= 0 ? member.share->weights[row] : 0.0;
    row_[v] = std::max(row, 0);
    arm_[v] = row >= 0 ? member.arms[row] : Vec3::Zero();
  }
  return any;
}

// Jᵀ of Eq. 4 with the weights of Section 7, times the load.
void MemberTriangle::add(const Vec3& corner, const Vec3& n, double* f) const {
  if (body_->nodes) {
    for (int v = 0; v < 3; ++v)
      Eigen::Map<Vec3>(f + 3 * static_cast<std::ptrdiff_t>(row_[v])) += corner[v] * n;
    return;
  }
  const Vec3 w = corner.cwiseProduct(weight_);
  const Vec3 arm = w[0] * arm_[0] + w[1] * arm_[1] + w[2] * arm_[2];
  Eigen::Map<Vec3>(f) += w.sum() * n;
  Eigen::Map<Vec3>(f + 3) += arm.cross(n);
  const ShapeCorrection& shape = body_->terms.shape;
  const Vec3 n_body = body_->R.transpose() * n, n_scaled = shape.s * n_body,
             n_total = w.sum() * n_body;
  const double spread = arm.dot(n);
  for (int i = 0; i < body_->body->r; ++i) {
    const double* phi = modes_->col(i).data();
    double sum = shape.slope[i] * spread + shape.shift_rate.col(i).dot(n_total);
    for (int v = 0; v < 3; ++v) {
      const double* p = phi + 3 * static_cast<std::ptrdiff_t>(row_[v]);
      sum += w[v] * (p[0] * n_scaled[0] + p[1] * n_scaled[1] + p[2] * n_scaled[2]);
    }
    f[6 + i] += sum;
  }
}

void MovingTriangle::start(const Vec3i& triangle) {
  moving_.clear();
  for (std::size_t m = 0; m < members_.size(); ++m)
    if (members_[m].start(surface_, surface_.members[m], triangle)) moving_.push_back(m);
}

std::vector<VecX> no_forces(const WetSurface& surface) {
  std::vector<VecX> forces;
  for (const WetSurface::Member& m : surface.members)
    forces.push_back(
        VecX::Zero(m.body->nodes ? 3 * m.body->nodes->vertices() : m.body->body->dofs()));
  return forces;
}

std::vector<VecX> sum_of_parts(const WetSurface& surface,
                               const std::vector<std::vector<VecX>>& parts) {
  std::vector<VecX> sum = no_forces(surface);
  for (std::size_t m = 0; m < sum.size(); ++m) {
    for (const std::vector<VecX>& part : parts) sum[m] += part[m];
    const BodySurface& body = *surface.members[m].body;
    if (body.nodes)
      sum[m] = body.nodes->force(sum[m]);
    else
      without_spin(body, sum[m]);
  }
  return sum;
}

MatX seen_flux(const NodalSurface& nodes, const SurfaceFlux& surface) {
  const MatX& J = nodes.seen_jacobian();
  MatX flux = MatX::Zero(J.cols(), static_cast<Eigen::Index>(surface.ends.size()));
  for (std::size_t m = 0; m < surface.ends.size(); ++m)
    for (std::size_t e = surface.begin(m); e < surface.ends[m]; ++e)
      flux.col(static_cast<Eigen::Index>(m)).noalias() +=
          J.middleRows<3>(3L * surface.vertex[e]).transpose() * surface.area[e];
  return flux;
}

void without_spin(const BodySurface& body, VecX& force) {
  force.tail(body.body->r).noalias() -= body.terms.spin_of_modes.transpose() * force.segment<3>(3);
}

namespace {

/// A piece of a triangle of a body of nodes.
struct CornerFlux {
  Vec3i vertices;
  Vec3 weights;  // of its centroid
  Vec3 area;     // m^2
};

/// F of one body as its surface is swept: a column for each cell that was requested.
class FluxColumns {
 public:
  FluxColumns(const CellBox& box, const BodySurface& body)
      : dofs_(seen_dofs(*body.body)), slots_(box) {}

  int slot(const Vec3i& cell) {
    const int at = slots_.slot(cell);
    columns_.resize(slots_.cells().size() * dofs_, 0.0);
    return at;
  }
  double* column(const Vec3i& cell) {
    const auto first = static_cast<std::size_t>(slot(cell)) * dofs_;  // may move the columns
    return columns_.data() + first;
  }
  void add(const Vec3i& cell, const CornerFlux& corner) {
    const auto at = static_cast<std::size_t>(slot(cell));
    if (corners_.size() <= at) corners_.resize(at + 1);
    corners_[at].push_back(corner);
  }
  /// Eq. 16: B_i = R phi_i - (I^-1 D_i) x x takes the rigid spin out of each mode.
  BodyFlux finish(const Grid& g, const BodySurface& body) const {
    BodyFlux f;
    f.cell.reserve(slots_.cells().size());
    for (const Vec3i& c : slots_.cells())
      f.cell.push_back(c[0] + static_cast<std::int64_t>(g.nx) *
                                  (c[1] + static_cast<std::int64_t>(g.ny) * c[2]));
    if (body.nodes) {
      for (std::size_t m = 0; m < f.cell.size(); ++m) end_column(m, f.surface);
      f.flux = seen_flux(*body.nodes, f.surface);
      return f;
    }
    f.flux =
        Eigen::Map<const MatX>(columns_.data(), dofs_, static_cast<long>(slots_.cells().size()));
    f.flux.bottomRows(dofs_ - 6).noalias() -=
        body.terms.spin_of_modes.transpose() * f.flux.middleRows(3, 3);
    return f;
  }

 private:
  // The vertices of column m, ascending, each once.
  void end_column(std::size_t m, SurfaceFlux& surface) const {
    std::vector<std::pair<int, Vec3>> all;
    if (m < corners_.size())
      for (const CornerFlux& c : corners_[m])
        for (int v = 0; v < 3; ++v) all.emplace_back(c.vertices[v], c.weights[v] * c.area);
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& p, const auto& q) { return p.first < q.first; });
    for (std::size_t n = 0; n < all.size(); ++n)
      if (n > 0 && all[n].first == all[n - 1].first)
        surface.area.back() += all[n].second;
      else
        surface.add(all[n].first, all[n].second);
    surface.end_column();
  }

  int dofs_;
  CellSlots slots_;
  std::vector<double> columns_;                   // dofs per cell
  std::vector<std::vector<CornerFlux>> corners_;  // per cell, of a body of nodes
};

/// What the pieces of some triangles leave in their cells.
struct SweptPieces {
  struct Piece {
    Vec3i cell;
    Vec3 area;            // cells^2
    double at, bend;      // of CellMoments::add
    std::size_t members;  // the first of `member` that moves the next piece
    std::size_t corners;  // the first of `corners` of the next piece
  };
  std::vector<Piece> pieces;
  std::vector<std::size_t> member;  // of each piece those that move it ..
  std::vector<double> flux;         // .. and what each of its dofs pushes into the cell
  std::vector<CornerFlux> corners;  // of a body of nodes, alone on its surface
};

SweptPieces sweep_some(const Grid& g, const WetSurface& s, const std::vector<double>& kappa,
                       std::span<const Vec3i> triangles) {
  const std::vector<Vec3>& points = *s.points;
  MovingTriangle triangle(s);
  SweptPieces swept;
  const bool nodes = s.members[0].body->nodes != nullptr;
  for (const Vec3i& t : triangles) {
    const Vec3 x[3] = {to_grid(g, points[t[0]]), to_grid(g, points[t[1]]),
                       to_grid(g, points[t[2]])};
    const Vec3 bend = g.dx * Vec3(kappa[t[0]], kappa[t[1]], kappa[t[2]]);
    triangle.start(t);
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 area = vector_area(piece), w = centroid_weights(piece);
      const double at = w[0] * x[0][0] + w[1] * x[1][0] + w[2] * x[2][0];
      const bool inside =
          (cell.array() >= 0).all() && cell[0] < g.nx && cell[1] < g.ny && cell[2] < g.nz;
      const Vec3 a = area * (g.dx * g.dx);  // m^2
      if (inside && nodes)
        swept.corners.push_back({t, w, a});
      else if (inside)
        triangle.add(w, a, [&](std::size_t m) {
          const std::size_t first = swept.flux.size();
          swept.member.push_back(m);
          swept.flux.resize(first + s.members[m].body->body->dofs(), 0.0);
          return swept.flux.data() + first;
        });
      swept.pieces.push_back(
          {cell, area, at - cell[0] - 0.5, w.dot(bend), swept.member.size(), swept.corners.size()});
    });
  }
  return swept;
}

/// Raw fluxes of all members of a surface and moments of the cells.
struct SweptSurface {
  SurfaceCells cells;
  std::vector<FluxColumns> columns;  // of every member
};

/// Gᵀ Wᵀ J of Eq. 45 with areas instead of 0 and 1. Every quantity is linear on a piece, so its
/// value at the centroid times the area is exact.
SweptSurface sweep_members(const Grid& g, const WetSurface& s) {
  const std::vector<double> kappa = mean_curvature(*s.points, *s.triangles);
  SweptSurface swept{SurfaceCells(cell_box(g, *s.points)), {}};
  for (const WetSurface::Member& m : s.members)
    swept.columns.emplace_back(swept.cells.box(), *m.body);
  const std::vector<SweptPieces> parts = parts_of(
      *s.triangles, [&](std::span<const Vec3i> some) { return sweep_some(g, s, kappa, some); });
  for (const SweptPieces& part : parts) {
    const double* flux = part.flux.data();
    std::size_t n = 0, corner = 0;
    for (const SweptPieces::Piece& piece : part.pieces) {
      for (; corner < piece.corners; ++corner)
        swept.columns[0].add(piece.cell, part.corners[corner]);
      swept.cells.at(piece.cell).add(piece.area, piece.at, piece.bend);
      for (; n < piece.members; ++n) {
        const std::size_t m = part.member[n];
        const int dofs = s.members[m].body->body->dofs();
        double* column = swept.columns[m].column(piece.cell);
        for (int d = 0; d < dofs; ++d) column[d] += flux[d];
        flux += dofs;
      }
    }
  }
  return swept;
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
    FluxColumns& columns = swept[b]->columns[0];
    bound_slip(s.body->archetype->volume / (g.dx * g.dx * g.dx), *faces[b]);
    for (DualFace& face : *faces[b]) {
      face.low = columns.slot(face.face - Vec3i::Unit(face.axis));
      face.high = columns.slot(face.face);
    }
    fluxes[b] = columns.finish(g, s);
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
  for (std::size_t m = 0; m < swept.columns.size(); ++m)
    fluxes.push_back(swept.columns[m].finish(g, *skin.members[m].body));
  return fluxes;
}

MatX interpolated_jacobian(const BodySurface& s, int triangle, const Vec3& bary) {
  const Vec3i& t = s.body->archetype->surface.triangles[triangle];
  MatX J = MatX::Zero(3, s.body->dofs());
  for (int v = 0; v < 3; ++v) J += bary[v] * point_jacobian(*s.body, s.terms, t[v]);
  return J;
}

}  // namespace archetide
