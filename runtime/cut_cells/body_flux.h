#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/exception_carrier.h"
#include "common/mesh/tri_mesh.h"
#include "runtime/articulation/skinning.h"
#include "runtime/cut_cells/nodal_surface.h"
#include "runtime/cut_cells/surface_flux.h"
#include "runtime/grid/grid.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// F of one body (docs/method.md, C4; Eq. 45: G^T W^T J): the volume flux that each generalised
/// velocity pushes into each cell, (6 + r) x m, m^2 per unit y. Cut cells: F = integral over
/// (surface within the cell) of v . n, exact for the polyhedral surface, so that a uniform or rigid
/// motion obeys the discrete divergence theorem to round-off and volume-changing modes need no
/// extra term. Voxel: F = G^T W^T Q on constraint faces. Of a body of nodes `flux` is that of what
/// is seen of it, and F^T y = (flux, surface)^T NodalSurface::to_solve(y).
struct BodyFlux {
  std::vector<std::int64_t> cell;  // m, index into the grid
  MatX flux;                       // (6 + r) x m
  SurfaceFlux surface = {};        // bodies of nodes
};

/// The deformed surface of one body at one configuration, and what the coupling reads of it.
struct BodySurface {
  const ReducedBody* body = nullptr;
  ConfigurationTerms terms;                             // at this configuration
  Mat3 R;                                               // rest frame to world
  Vec3 centre;                                          // centre of mass, m
  std::vector<Vec3> points;                             // wet_points of the body, m
  std::shared_ptr<const NodalSurface> nodes = nullptr;  // of a body of nodes
};
BodySurface body_surface(const ReducedBody& body, ModalMass mass);

/// A closed surface as the water sees it, and the bodies that move it: one of its own, or those
/// under a skin. Refers to what it is made of.
struct WetSurface {
  struct Member {
    const BodySurface* body;
    const SkinShare* share = nullptr;  // null: the surface is the body's own
    std::vector<Vec3> arms = {};       // m, about the body's centre of mass, m (of a share)
  };
  const std::vector<Vec3>* points = nullptr;      // n, world, m
  const std::vector<Vec3i>* triangles = nullptr;  // nf
  std::vector<Member> members;
};
WetSurface wet_surface(const BodySurface& surface);
/// `surfaces`: of all bodies; `points`: where the skin is.
WetSurface wet_surface(const SkinnedBodies& skin, const std::vector<BodySurface>& surfaces,
                       const std::vector<Vec3>& points);

/// Moves the points of a skin by the mean of what moves its members' own surfaces, from where they
/// stand to `to[member]`.
void move_with_members(const SkinnedBodies& skin, const std::vector<BodySurface>& surfaces,
                       const std::vector<const std::vector<Vec3>*>& to, std::vector<Vec3>& points);

/// The corners of one triangle as one body moves them: J of Section 5.3 with the weights of Section
/// 7, w_b [1, -[x_b - t_b]x, d place_b / dq], linear in between.
class MemberTriangle {
 public:
  /// False: the body does not move the triangle.
  bool start(const WetSurface& surface, const WetSurface::Member& member, const Vec3i& triangle);
  /// Generalised force (6 + r, the modes still with the spin that they carry) of the load
  /// corner[v] n at the three corners: f += sum_v corner[v] J_v^T n. Of a body of nodes the forces
  /// on its vertices, 3 ns.
  void add(const Vec3& corner, const Vec3& n, double* f) const;

 private:
  const BodySurface* body_ = nullptr;
  const MatX* modes_ = nullptr;
  Vec3 weight_;
  Vec3 arm_[3];  // m
  int row_[3];   // of the modes (a body of nodes: of the surface), in vertices
};

/// One triangle as all members of a surface that move it do.
class MovingTriangle {
 public:
  /// `surface` must outlive it.
  explicit MovingTriangle(const WetSurface& surface)
      : surface_(surface), members_(surface.members.size()) {}
  void start(const Vec3i& triangle);
  /// MemberTriangle::add for every member m that moves it, to the force at f_of(m).
  template <class ForceOf>
  void add(const Vec3& corner, const Vec3& n, const ForceOf& f_of) const {
    for (const std::size_t m : moving_) members_[m].add(corner, n, f_of(m));
  }

 private:
  const WetSurface& surface_;
  std::vector<MemberTriangle> members_;
  std::vector<std::size_t> moving_;
};

/// What of_some(items) makes of a hundred or so triangles or faces at a time, on all threads; in
/// their order, so that sums over the parts do not depend on the number of threads.
template <class Item, class OfSome>
auto parts_of(const std::vector<Item>& items, const OfSome& of_some) {
  constexpr std::size_t kAtOnce = 128;
  const std::size_t count = (items.size() + kAtOnce - 1) / kAtOnce;
  std::vector<decltype(of_some(std::span<const Item>()))> parts(count);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (count > 1)
  for (std::size_t p = 0; p < count; ++p)
    carrier.run([&] {
      parts[p] = of_some(
          std::span(items).subspan(p * kAtOnce, std::min(kAtOnce, items.size() - p * kAtOnce)));
    });
  carrier.rethrow();
  return parts;
}

/// What MemberTriangle adds to, of nothing, for every member.
std::vector<VecX> no_forces(const WetSurface& surface);

/// Of every member, the sum of the parts as a generalised force, and without_spin of it.
std::vector<VecX> sum_of_parts(const WetSurface& surface,
                               const std::vector<std::vector<VecX>>& parts);

/// Takes from a generalised force (6 + r) the spin that its modes carry: B_i = R phi_i - (I^-1 D_i)
/// x x instead of R phi_i.
void without_spin(const BodySurface& body, VecX& force);

/// Of what is seen of a body of nodes (BodyFlux::flux), m^2 per unit y.
MatX seen_flux(const NodalSurface& nodes, const SurfaceFlux& surface);

/// Fractions that solids take of the grid: of each face's area and of each cell's volume, in [0,1].
struct SolidFractions {
  FaceField<double> face;
  Array3<double> cell;
};

struct DualFace;
using DualFaces = std::vector<DualFace>;

/// Adds a closed outward surface (grid-exact, by the divergence theorem) to the fractions; returns
/// the faces beside it.
DualFaces add_solid_fractions(const Grid& g, const std::vector<Vec3>& points,
                              const std::vector<Vec3i>& triangles, SolidFractions& fractions);

/// Cut cells: F of every body's surface, with a column for each cell beside its `faces`; adds their
/// fractions.
std::vector<BodyFlux> cut_bodies(const Grid& g, const std::vector<const BodySurface*>& surfaces,
                                 const std::vector<DualFaces*>& faces, SolidFractions& fractions);
/// The same of one.
BodyFlux cut_body(const Grid& g, const BodySurface& surface, SolidFractions& fractions,
                  DualFaces& faces);

/// The same of a skin: F of every member. The water that bodies carry along (DualFace) is left out:
/// it would tie the members' masses together.
std::vector<BodyFlux> cut_skin(const Grid& g, const WetSurface& skin, SolidFractions& fractions);

/// 3 x (6 + r) velocity of the point with rest-triangle weights `bary` per unit y: [1, -[x]x, B] at
/// moment arm x.
MatX interpolated_jacobian(const BodySurface& surface, int triangle, const Vec3& bary);

}  // namespace archetide
