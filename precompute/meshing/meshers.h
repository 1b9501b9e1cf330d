#pragma once

#include <vector>

#include "common/mesh/tet_mesh.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Back ends of tetrahedralize(), one translation unit each; they throw NumericsError when they
/// give up. tetrahedralize() runs each in a process of its own: some never end on some surfaces.
struct MeshRequest {
  /// Triangles that the mesh must not overlook: some of every shell, when there are several.
  std::vector<int> seeds;
  double size = 0.0;            // edge length inside, m
  double facet_distance = 0.0;  // largest distance of a boundary facet's centre to the surface, m
  double sliver_bound = 12.0;   // cgal: smaller dihedral angles are perturbed away, degrees
  unsigned seed = 1;
};

/// Smooth surfaces: boundary points anywhere on the surface.
TetMesh mesh_with_cgal(const TriMesh& surface, const MeshRequest& request);

/// Surfaces with sharp edges, which the mesh follows. `sharp_angle`: degrees between face normals.
TetMesh mesh_with_cgal_sharp(const TriMesh& surface, double sharp_angle,
                             const MeshRequest& request);

/// Tets by Gmsh [GR09].
/// Keeps the surface's triangles as they are; inside, edges grow no longer than `size`, but a finer
/// surface makes finer tets whatever the size. Aborts on some surfaces, and only the first call of
/// a process is reproducible.
TetMesh mesh_with_gmsh(const TriMesh& surface, const MeshRequest& request);

}  // namespace archetide
