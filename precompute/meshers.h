#pragma once

#include "common/tet_mesh.h"
#include "common/tri_mesh.h"

namespace archetide {

/// Back ends of tetrahedralize(), one translation unit each; `size` is the wanted edge length, m.
struct MeshRequest {
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

/// Keeps the surface's triangles as they are; inside, edges grow no longer than `size`, but a finer
/// surface makes finer tets whatever the size: with forced coarsening slivers failed the gate. Its
/// generator lives as long as the process, so only the first call of a process is reproducible.
TetMesh mesh_with_gmsh(const TriMesh& surface, const MeshRequest& request);

}  // namespace archetide
