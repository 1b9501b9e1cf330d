#include "common/mesh/enclosed_moments.h"

namespace archetide {

// With D = a . (b x c) and s = a + b + c of the corners of each triangle, V = sum D / 6 and the first
// moment is sum D s / 24.
EnclosedMoments displaced_moments(const TriMesh& surface, const VecX& u) {
  using Rates = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  EnclosedMoments sum;
  sum.rates.setZero(u.size(), 4);
  for (const Vec3i& t : surface.triangles) {
    Vec3 x[3];
    for (int a = 0; a < 3; ++a) x[a] = surface.vertices[t[a]] + u.segment<3>(3L * t[a]);
    const Vec3 s = (x[0] + x[1] + x[2]) / 4.0;
    const Vec3 normals[3] = {x[1].cross(x[2]) / 6.0, x[2].cross(x[0]) / 6.0,
                             x[0].cross(x[1]) / 6.0};
    const double V = x[0].dot(normals[0]);
    sum.volume += V;
    sum.first += V * s;
    for (int a = 0; a < 3; ++a) {
      Rates rates;
      rates.col(0) = normals[a];
      rates.rightCols<3>().noalias() = normals[a] * s.transpose();
      rates.rightCols<3>().diagonal().array() += 0.25 * V;
      sum.rates.middleRows<3>(3L * t[a]) += rates;
    }
  }
  return sum;
}

}  // namespace archetide
