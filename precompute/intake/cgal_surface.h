#pragma once

// Shared by the CGAL translation units that work on surfaces.

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <vector>

#include "common/mesh/tri_mesh.h"

namespace archetide::cgal {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;

struct Soup {
  std::vector<Kernel::Point_3> points;
  std::vector<std::vector<std::size_t>> faces;
};

inline Soup to_soup(const TriMesh& mesh) {
  Soup soup;
  for (const Vec3& x : mesh.vertices) soup.points.emplace_back(x[0], x[1], x[2]);
  for (const Vec3i& t : mesh.triangles)
    soup.faces.push_back({std::size_t(t[0]), std::size_t(t[1]), std::size_t(t[2])});
  return soup;
}

/// The soup must be manifold and consistently oriented.
inline SurfaceMesh to_surface_mesh(const Soup& soup) {
  SurfaceMesh mesh;
  CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(soup.points, soup.faces, mesh);
  return mesh;
}

inline TriMesh to_tri_mesh(const SurfaceMesh& surface) {
  TriMesh mesh;
  std::vector<int> number(surface.num_vertices() + surface.number_of_removed_vertices(), -1);
  for (const auto v : surface.vertices()) {
    number[v] = static_cast<int>(mesh.vertices.size());
    const Kernel::Point_3& p = surface.point(v);
    mesh.vertices.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : surface.faces()) {
    Vec3i corners;
    int i = 0;
    for (const auto v : surface.vertices_around_face(surface.halfedge(f))) corners[i++] = number[v];
    mesh.triangles.push_back(corners);
  }
  return mesh;
}

}  // namespace archetide::cgal
