#include "precompute/modal/patch_loads.h"

#include <algorithm>
#include <random>

#include "precompute/base/bounding_diagonal.h"
#include "precompute/modal/boundary_quadrature.h"

namespace archetide {

void DeflectionError::add(const VecX& deflection, const VecX& better, Eigen::Index loads) {
  const double error = (deflection - better).cwiseAbs().maxCoeff() / better.cwiseAbs().maxCoeff();
  mean += error / double(loads);
  worst = std::max(worst, error);
}

MatX patch_loads(const TetMesh& mesh) {
  constexpr int kLoads = 12;
  constexpr double kRadius[2] = {0.12, 0.25};  // of the diagonal
  const double size = bounding_diagonal(mesh.nodes);
  const std::vector<BoundaryPoint> boundary = boundary_points(mesh);
  std::mt19937 random(20260102);
  std::normal_distribution<double> normal;
  MatX loads = MatX::Zero(3 * Eigen::Index(mesh.nodes.size()), kLoads);
  for (int k = 0; k < kLoads; ++k) {
    const Vec3 centre = boundary[random() % boundary.size()].position;
    Vec3 traction;  // in one order: that of a call's arguments is the compiler's
    for (int axis = 2; axis >= 0; --axis) traction[axis] = normal(random);
    for (const BoundaryPoint& p : boundary) {
      if ((p.position - centre).norm() > kRadius[k % 2] * size) continue;
      for (int i = 0; i < p.count; ++i)
        loads.col(k).segment<3>(3 * p.nodes[i]) += p.N[i] * p.area.norm() * traction;
    }
  }
  return loads;
}

}  // namespace archetide
