#pragma once

// Shared by the two CGAL translation units only: one mesh domain type per unit keeps the compiler
// small.

// CGAL dumps files into the current folder when it fails: not here.
#define CGAL_MESH_3_DUMP_C3T3_H
#include <string>
namespace CGAL {
template <class C3t3>
void dump_c3t3(const C3t3&, const std::string&) {}
}  // namespace CGAL

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_polyhedron_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Random.h>
#include <CGAL/make_mesh_3.h>

#include <unordered_map>

#include "common/base/input_error.h"
#include "precompute/meshing/meshers.h"

namespace archetide::cgal {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;

/// Smallest angle of boundary triangles, degrees.
constexpr double kFacetAngle = 25.0;

inline Polyhedron to_polyhedron(const TriMesh& surface) {
  std::vector<Kernel::Point_3> points;
  for (const Vec3& x : surface.vertices) points.emplace_back(x[0], x[1], x[2]);
  std::vector<std::array<std::size_t, 3>> faces;
  for (const Vec3i& t : surface.triangles)
    faces.push_back({std::size_t(t[0]), std::size_t(t[1]), std::size_t(t[2])});
  Polyhedron polyhedron;
  CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, faces, polyhedron);
  return polyhedron;
}

/// A point on the surface and a short way across it.
struct Seed {
  Kernel::Point_3 point;
  Kernel::Vector_3 across;
};

inline std::vector<Seed> seeds(const TriMesh& surface, const MeshRequest& request) {
  std::vector<Seed> list;
  for (const int t : request.seeds) {
    const Vec3 &a = surface.vertices[surface.triangles[t][0]],
               &b = surface.vertices[surface.triangles[t][1]],
               &c = surface.vertices[surface.triangles[t][2]];
    const Vec3 x = (a + b + c) / 3.0, n = 1e-3 * (b - a).cross(c - a).normalized() * (b - a).norm();
    list.push_back({{x[0], x[1], x[2]}, {n[0], n[1], n[2]}});
  }
  return list;
}

/// Nodes in the order in which the cells mention them, so unused points vanish.
template <class C3t3>
TetMesh to_tet_mesh(const C3t3& c3t3) {
  TetMesh mesh;
  std::unordered_map<const void*, int> index;
  index.reserve(c3t3.triangulation().number_of_vertices());
  for (auto cell = c3t3.cells_in_complex_begin(); cell != c3t3.cells_in_complex_end(); ++cell) {
    std::array<int, 4> tet;
    for (int k = 0; k < 4; ++k) {
      const auto vertex = cell->vertex(k);
      const auto [entry, is_new] = index.try_emplace(&*vertex, int(mesh.nodes.size()));
      const auto& p = vertex->point();
      if (is_new) mesh.nodes.emplace_back(p.x(), p.y(), p.z());
      tet[k] = entry->second;
    }
    mesh.tets.push_back(tet);
  }
  return mesh;
}

/// Delaunay refinement and sliver perturbation. No exudation (85 % of the default time for +0.02
/// mean radius ratio) and no time limit, so the same input gives the same mesh.
template <class Domain>
TetMesh mesh_domain(const Domain& domain, const MeshRequest& request) {
  namespace params = CGAL::parameters;
  using Triangulation =
      typename CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
  using C3t3 = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
  using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

  const Criteria criteria(params::edge_size = request.size, params::facet_angle = kFacetAngle,
                          params::facet_size = request.size,
                          params::facet_distance = request.facet_distance,
                          params::cell_radius_edge_ratio = 2.0, params::cell_size = request.size);
  try {
    return to_tet_mesh(CGAL::make_mesh_3<C3t3>(
        domain, criteria, params::no_lloyd(), params::no_odt(),
        params::perturb(params::time_limit = 0.0, params::sliver_bound = request.sliver_bound),
        params::no_exude(), params::manifold()));
  } catch (const CGAL::Failure_exception& error) {
    throw NumericsError("CGAL could not fill the surface: " + error.message());
  }
}

}  // namespace archetide::cgal
