#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <cmath>

#include "precompute/intake/repair_steps.h"

namespace archetide {

double farthest_distance(const TriMesh& from, const TriMesh& to) {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Triangles = std::vector<Kernel::Triangle_3>;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
  const auto point = [](const Vec3& x) { return Kernel::Point_3(x[0], x[1], x[2]); };
  Triangles triangles;
  for (const Vec3i& t : to.triangles) {
    triangles.emplace_back(point(to.vertices[t[0]]), point(to.vertices[t[1]]),
                           point(to.vertices[t[2]]));
  }
  Tree tree(triangles.begin(), triangles.end());
  tree.accelerate_distance_queries();
  double farthest = 0.0;  // squared
  const auto look = [&](const Vec3& x) {
    farthest = std::max(farthest, tree.squared_distance(point(x)));
  };
  for (const Vec3& x : from.vertices) look(x);
  for (const Vec3i& t : from.triangles)
    look((from.vertices[t[0]] + from.vertices[t[1]] + from.vertices[t[2]]) / 3.0);
  return std::sqrt(farthest);
}

}  // namespace archetide
