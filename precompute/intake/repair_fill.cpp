#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <fmt/core.h>

#include "common/base/input_error.h"
#include "precompute/intake/cgal_surface.h"
#include "precompute/intake/repair_steps.h"

namespace archetide {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using cgal::SurfaceMesh;

constexpr std::size_t kLongestLoop = 2000;  // fairing solves a system of the filled part

void fill_hole(SurfaceMesh& mesh, SurfaceMesh::Halfedge_index border) {
  std::size_t length = 0;
  for ([[maybe_unused]] const auto h : CGAL::halfedges_around_face(border, mesh)) ++length;
  std::vector<SurfaceMesh::Face_index> faces;
  std::vector<SurfaceMesh::Vertex_index> vertices;
  if (length > 3 && length <= kLongestLoop) {
    pmp::triangulate_refine_and_fair_hole(mesh, border, std::back_inserter(faces),
                                          std::back_inserter(vertices));
  } else {
    pmp::triangulate_hole(mesh, border, std::back_inserter(faces));
  }
  if (faces.empty()) {
    throw InputError(fmt::format("a hole of {} edges could not be filled", length),
                     "set repair = \"wrap\"");
  }
}

}  // namespace

TriMesh fill_holes(const TriMesh& mesh, RepairReport& report) {
  cgal::Soup soup = cgal::to_soup(mesh);
  // Cuts at non-manifold edges and vertices; what stays open there is filled like any hole.
  pmp::orient_polygon_soup(soup.points, soup.faces);
  SurfaceMesh surface = cgal::to_surface_mesh(soup);
  std::vector<SurfaceMesh::Halfedge_index> borders;
  pmp::extract_boundary_cycles(surface, std::back_inserter(borders));
  for (const auto border : borders) fill_hole(surface, border);
  report.holes = static_cast<int>(borders.size());
  return cgal::to_tri_mesh(surface);
}

}  // namespace archetide
