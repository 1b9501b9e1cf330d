#pragma once

#include <vector>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Closest points on a triangle surface, by a tree of boxes. Keeps a reference to the surface.
class ClosestPoint {
 public:
  explicit ClosestPoint(const TriMesh& surface);

  struct Hit {
    Vec3 point = Vec3::Zero();
    int triangle = -1;  // -1: nothing within reach
    double distance = 0.0;
  };
  /// The closest point nearer than `reach` (m).
  Hit find(const Vec3& x, double reach) const;
  /// Weights of the corners of the triangle that was hit, at the point; sum 1.
  Vec3 weights(const Hit& hit) const;

 private:
  struct Box {
    Vec3 low, high;
    int first = 0, count = 0;  // of order_; count 0: an inner box
    int right = 0;             // second child; the first one is the next box
  };
  int build(int first, int count, const std::vector<Vec3>& centres);
  void search(int box, const Vec3& x, Hit& best) const;

  const TriMesh& surface_;
  std::vector<int> order_;  // triangles
  std::vector<Box> boxes_;
};

}  // namespace archetide
