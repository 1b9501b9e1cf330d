#include "precompute/modal/normal_motion.h"

namespace archetide {

// Of a linear function with the corner values f: area / 12 (sum f^2 + (sum f)^2).
VecX normal_motion_squared(const TriMesh& surface, const MatX& modes) {
  VecX sum = VecX::Zero(modes.cols());
  MatX at(3, modes.cols());  // at the corners
  for (const Vec3i& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
               &c = surface.vertices[t[2]];
    const Vec3 twice = (b - a).cross(c - a);
    const double area = 0.5 * twice.norm();
    if (!(area > 0.0)) continue;
    for (int v = 0; v < 3; ++v)
      at.row(v) = twice.transpose() * modes.middleRows<3>(3 * static_cast<Eigen::Index>(t[v]));
    at /= 2.0 * area;
    sum +=
        (area / 12.0) * (at.colwise().squaredNorm() + at.colwise().sum().cwiseAbs2()).transpose();
  }
  return sum;
}

}  // namespace archetide
