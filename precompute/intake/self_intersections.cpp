#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <iterator>

#include "common/base/check.h"
#include "precompute/intake/intake.h"

namespace archetide {

Crowd crowd(const TriMesh& mesh, long most) {
  struct Full {};  // thrown to stop CGAL
  using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 3, const Vec3i*>;
  std::vector<Box> boxes;
  for (const Vec3i& t : mesh.triangles) {
    CGAL::Bbox_3 box;
    for (const int v : t) {
      const Vec3& x = mesh.vertices[v];
      box += CGAL::Bbox_3(x[0], x[1], x[2], x[0], x[1], x[2]);
    }
    boxes.emplace_back(box, &t);
  }
  Crowd result;
  result.neighbours.assign(mesh.triangles.size(), 0);
  try {
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
      ++result.neighbours[a.handle() - mesh.triangles.data()];
      ++result.neighbours[b.handle() - mesh.triangles.data()];
      if (++result.pairs > most) throw Full();
    });
  } catch (const Full&) {
    result.too_many = true;
  }
  return result;
}

std::vector<std::pair<int, int>> self_intersections(const TriMesh& mesh) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  Mesh surface;
  for (const Vec3& x : mesh.vertices) surface.add_vertex(Kernel::Point_3(x[0], x[1], x[2]));
  for (const Vec3i& t : mesh.triangles) {
    using Vertex = Mesh::Vertex_index;
    const auto face = surface.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2]));
    ARCHETIDE_CHECK(face != Mesh::null_face());
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> found;
  CGAL::Polygon_mesh_processing::self_intersections(
      surface, std::back_inserter(found), CGAL::parameters::maximum_number(kMostCrossings));
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [s, t] : found) {
    pairs.push_back(std::minmax(static_cast<int>(s), static_cast<int>(t)));
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace archetide
