#pragma once

#include <memory>
#include <vector>

#include "common/archetype/archetype.h"
#include "runtime/contact/wall_contact.h"
#include "runtime/solid/nodal_rows.h"

namespace archetide {

/// A point of a surface that is tried against other solids: a vertex, or a point on a long edge or
/// in a large face.
struct SurfaceSample {
  Vec3i vertices = Vec3i::Zero();
  Vec3 weights = Vec3::UnitX();  // sum 1
  Vec3 normal = Vec3::Zero();    // outward at rest, body frame
  int order = 0;                 // vertices first: of equally deep samples the lower one is kept
};

/// m, of a sample on this surface.
Vec3 rest_place(const TriMesh& mesh, const SurfaceSample& s);

/// Where a sample of a body under a cover is.
struct CoverPlace {
  Vec3i vertices = Vec3i::Zero();  // of the cover
  Vec3 weights = Vec3::UnitX();    // sum 1
  Vec3 offset = Vec3::Zero();      // at rest, from the body's nearest point, body frame, m
};

/// Samples that lie close together, so that many are dismissed at once.
struct SampleCluster {
  int begin = 0, end = 0;  // of ContactShape::samples
};

/// Nodes in a box, x fastest.
struct BoxLattice {
  Vec3 origin = Vec3::Zero();  // of node (0, 0, 0), m
  double spacing = 0.0;        // m
  Vec3i nodes = Vec3i::Zero();

  Vec3 place(int i, int j, int k) const { return origin + spacing * Vec3(i, j, k); }
  long index(int i, int j, int k) const {
    return i + static_cast<long>(nodes[0]) * (j + static_cast<long>(nodes[1]) * k);
  }
  /// The eight nodes around a place and their trilinear weights (the place is clamped to the box).
  struct Stencil {
    int node[8];
    double weight[8];
    Vec3 slope[8];  // gradient of the weight, 1/m; zero along clamped axes
  };
  Stencil stencil(const Vec3& x) const;
};

/// Around a surface, `cells` along its longest side and two beyond each side.
BoxLattice lattice_around(const TriMesh& surface, int cells);

/// Modes on a coarse lattice around the surface, continued smoothly beyond it: what turns a place
/// in space back to the rest shape at a cost that knows neither the tets nor the surface.
struct ModeLattice : BoxLattice {
  MatX modes;  // 3 nodes.prod() x r, m per unit q; row 3 n + axis; of bodies of nodes instead ..
  VertexShares shares = {};  // .. the vertices that move each node, ..
  int shares_each = 0;       // .. so many, node after node

  /// Displacements of the nodes from those of the surface's vertices (3 a vertex), by `shares`.
  VecX displacements(const VecX& surface) const;
};

/// What contact needs to know of an archetype, derived once and shared by its instances. Samples lie
/// on the surface that the water meets: the body's own, or a rung of its ladder [D57]; distances are
/// those of the body's own. The samples of a body under a cover lie on the cover, where it moves most
/// with this body; they move with the body's nearest point.
struct ContactShape {
  std::shared_ptr<const Archetype> archetype;
  const SurfaceRung* rung = nullptr;  // of the archetype; null: samples of its own surface
  GridSdf sampled;                    // used where the archetype stores no distances
  std::vector<SurfaceSample> samples;
  std::vector<CoverPlace> places;  // by SurfaceSample::order; empty without a cover
  std::vector<SampleCluster> clusters;
  ModeLattice lattice;   // empty without modes
  double spacing = 0.0;  // m, largest distance of neighbouring samples on edges and faces
  BodyReach reach;

  bool covered() const { return !places.empty(); }
  const TriMesh& surface() const { return rung ? rung->surface : archetype->surface; }
  /// Of the surface's vertices, row 3 v + axis.
  const MatX& modes() const { return rung ? rung->modes : archetype->surface_modes; }
  const GridSdf& sdf() const { return archetype->sdf.values.empty() ? sampled : archetype->sdf; }
};

/// `rung`: of the archetype, ReducedBody::rung of the instances. `nodes`: they are bodies of nodes.
std::shared_ptr<const ContactShape> contact_shape(std::shared_ptr<const Archetype> archetype,
                                                  const SurfaceRung* rung = nullptr,
                                                  bool nodes = false);

/// A closed surface over several bodies that were cut out of it (a skin), met by contact instead
/// of theirs. Shared by all instances.
struct CoverShape {
  GridSdf distance;                                         // at rest, coordinates of the whole
  BoxLattice lattice;                                       // of ..
  MatX weights;                                             // .. bodies x nodes.prod(), sum 1
  std::vector<Vec3> centres;                                // of the bodies' rest frames, m
  std::vector<std::shared_ptr<const ContactShape>> shapes;  // of the bodies

  /// How much of the motion at a place of the whole is each body's.
  VecX weights_at(const Vec3& x) const;
};
/// `surface`: m, in coordinates in which each body's rest frame begins at its archetype's centre.
/// `weights`: n x bodies, how much of each vertex's motion is a body's, sum 1.
std::shared_ptr<const CoverShape> cover_shape(
    const TriMesh& surface, const MatX& weights,
    const std::vector<std::shared_ptr<const Archetype>>& bodies);

/// Vertices first, then points on edges longer than `spacing` and in faces of such edges.
std::vector<SurfaceSample> surface_samples(const TriMesh& surface, double spacing);

/// The motion of the surface, fitted by weighted linear least squares over the nearest vertices:
/// that of the stored modes, or (`nodes`) of every vertex.
ModeLattice mode_lattice(const Archetype& archetype, int cells, bool nodes);

}  // namespace archetide
