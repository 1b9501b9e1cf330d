#pragma once

#include <memory>
#include <vector>

#include "common/archetype.h"
#include "runtime/contact/wall_contact.h"

namespace archetide {

/// A point of a surface that is tried against other solids: a vertex, or a point on a long edge or
/// in a large face.
struct SurfaceSample {
  Vec3i vertices = Vec3i::Zero();
  Vec3 weights = Vec3::UnitX();  // sum 1
  Vec3 normal = Vec3::Zero();    // outward at rest, body frame
  int order = 0;                 // vertices first: of equally deep samples the lower one is kept
};

/// Samples that lie close together, so that many are dismissed at once.
struct SampleCluster {
  int begin = 0, end = 0;  // of ContactShape::samples
};

/// Modes on a coarse lattice around the surface, continued smoothly beyond it: what turns a place
/// in space back to the rest shape at a cost that knows neither the tets nor the surface.
struct ModeLattice {
  Vec3 origin = Vec3::Zero();  // of node (0, 0, 0), m
  double spacing = 0.0;        // m
  Vec3i nodes = Vec3i::Zero();
  MatX modes;  // 3 nodes.prod() x r, m per unit q; row 3 n + axis, x fastest

  /// The eight nodes around a place and their trilinear weights (the place is clamped to the box).
  struct Stencil {
    int node[8];
    double weight[8];
    Vec3 slope[8];  // gradient of the weight, 1/m; zero along clamped axes
  };
  Stencil stencil(const Vec3& x) const;
};

/// What contact needs to know of an archetype, derived once and shared by its instances.
struct ContactShape {
  std::shared_ptr<const Archetype> archetype;
  GridSdf sampled;  // used where the archetype stores no distances
  std::vector<SurfaceSample> samples;
  std::vector<SampleCluster> clusters;
  ModeLattice lattice;   // empty without modes
  double spacing = 0.0;  // m, largest distance of neighbouring samples on edges and faces
  BodyReach reach;

  const GridSdf& sdf() const { return archetype->sdf.values.empty() ? sampled : archetype->sdf; }
};

std::shared_ptr<const ContactShape> contact_shape(std::shared_ptr<const Archetype> archetype);

/// Vertices first, then points on edges longer than `spacing` and in faces of such edges.
std::vector<SurfaceSample> surface_samples(const TriMesh& surface, double spacing);

/// Modes fitted to those of the surface (weighted linear least squares over the nearest vertices).
ModeLattice mode_lattice(const Archetype& archetype, int cells);

}  // namespace archetide
