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
/// extra term. Voxel: F = G^T W^T Q on constraint faces. Of a body of nodes `flux` is that of its
/// reduced velocity, and F^T y = (flux, surface)^T NodalSurface::to_solve(y).
struct BodyFlux {
  std::vector<std::int64_t> cell;  // m, index into the grid; < 0: beyond the tank
  MatX flux;                       // (6 + r) x m
  SurfaceFlux surface = {};        // bodies of nodes
};

/// A cell beyond the tank as BodyFlux::cell names it, by the nearest cell of the tank, and that cell.
inline std::int64_t cell_beyond(std::int64_t beside) { return -1 - beside; }
inline std::int64_t cell_beside(std::int64_t beyond) { return -1 - beyond; }

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

/// J^T of what one body moves of a surface: J of Section 5.3 with the weights of Section 7, w_b [1,
/// -[x_b - t_b]x, d place_b / dq] at each of its points. Of a reduced body.
class MemberJacobian {
 public:
  /// Both must outlive it.
  MemberJacobian(const WetSurface& surface, const WetSurface::Member& member);
  /// Whether the body moves point v.
  bool moves(int v) const { return !share_ || share_->row[v] >= 0; }
  /// J^T of every column, (6 + r) x columns.
  MatX transposed(const SurfaceFlux& columns) const;

 private:
  const WetSurface& surface_;
  const WetSurface::Member& member_;
  const BodySurface& body_;
  const SkinShare* share_;
  const MatX& modes_;
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

/// Of every member, the generalised force (6 + r, or 6 + 3 n of a body of nodes) of forces at the
/// corners of the triangles of a surface: column v of a matrix at corner v, `parts` as of parts_of().
std::vector<VecX> generalised_forces(const WetSurface& surface,
                                     const std::vector<std::vector<Mat3>>& parts);

/// Of the reduced velocity of a body of nodes (BodyFlux::flux), m^2 per unit y.
MatX reduced_flux(const NodalSurface& nodes, const SurfaceFlux& surface);

/// Fractions that solids take of the grid: of each face's area and of each cell's volume, in [0,1].
struct SolidFractions {
  FaceField<double> face;
  Array3<double> cell;
  /// What a surface cuts off in a cell: first moment of its volume about the cell's centre, cells^4.
  /// Cells that several surfaces cut stand there several times; none of voxels.
  struct Moment {
    std::size_t cell;
    Vec3 of_solid;
  };
  std::vector<Moment> moments = {};
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
