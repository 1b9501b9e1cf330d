#include "precompute/modal/boundary_quadrature.h"

#include <cmath>

namespace archetide {
namespace {

/// Barycentric points and weights (of area 1) on a triangle, degree 5 [Rad48].
struct TriangleRule {
  std::vector<Vec3> points;
  std::vector<double> weights;

  TriangleRule() {
    const double r = std::sqrt(15.0);
    add(1.0 / 3.0, 9.0 / 40.0, 1);
    add((6.0 - r) / 21.0, (155.0 - r) / 1200.0, 3);
    add((6.0 + r) / 21.0, (155.0 + r) / 1200.0, 3);
  }
  /// The points with two coordinates `a`.
  void add(double a, double weight, int count) {
    for (int k = 0; k < count; ++k) {
      Vec3 L = Vec3::Constant(a);
      L[k] = 1.0 - 2.0 * a;
      points.push_back(L);
      weights.push_back(weight);
    }
  }
};

/// Shape functions and their derivatives along L1 and L2 (L0 = 1 - L1 - L2) of a triangle with 3 or
/// 6 nodes.
void shape(const Vec3& L, int count, Eigen::Matrix<double, 6, 1>& N,
           Eigen::Matrix<double, 6, 2>& dN) {
  const Eigen::Matrix<double, 3, 2> dL =
      (Eigen::Matrix<double, 3, 2>() << -1, -1, 1, 0, 0, 1).finished();
  N.setZero();
  dN.setZero();
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    N[k] = count == 3 ? L[k] : L[k] * (2.0 * L[k] - 1.0);
    dN.row(k) = (count == 3 ? 1.0 : 4.0 * L[k] - 1.0) * dL.row(k);
    if (count == 3) continue;
    N[3 + k] = 4.0 * L[k] * L[next];
    dN.row(3 + k) = 4.0 * (L[k] * dL.row(next) + L[next] * dL.row(k));
  }
}

/// Nodes of every boundary face; boundary_surface() gives four flat triangles for a quadratic one:
/// corner, middle, middle three times, then the middles.
std::vector<std::array<int, 6>> faces(const TetMesh& mesh) {
  std::vector<int> node;
  const TriMesh surface = boundary_surface(mesh, node);
  std::vector<std::array<int, 6>> result;
  const std::size_t step = mesh.order() == 1 ? 1 : 4;
  for (std::size_t t = 0; t < surface.triangles.size(); t += step) {
    const Vec3i* flat = &surface.triangles[t];
    if (step == 1)
      result.push_back({node[flat[0][0]], node[flat[0][1]], node[flat[0][2]], 0, 0, 0});
    else
      result.push_back({node[flat[0][0]], node[flat[1][0]], node[flat[2][0]], node[flat[3][0]],
                        node[flat[3][1]], node[flat[3][2]]});
  }
  return result;
}

}  // namespace

std::vector<BoundaryPoint> boundary_points(const TetMesh& mesh) {
  static const TriangleRule rule;
  const int count = mesh.order() == 1 ? 3 : 6;
  std::vector<BoundaryPoint> result;
  for (const auto& face : faces(mesh))
    for (std::size_t k = 0; k < rule.points.size(); ++k) {
      BoundaryPoint p{face, count, {}, Vec3::Zero(), Vec3::Zero()};
      Eigen::Matrix<double, 6, 2> dN;
      shape(rule.points[k], count, p.N, dN);
      Eigen::Matrix<double, 3, 2> tangents = Eigen::Matrix<double, 3, 2>::Zero();
      for (int i = 0; i < count; ++i) {
        p.position += p.N[i] * mesh.nodes[face[i]];
        tangents += mesh.nodes[face[i]] * dN.row(i);
      }
      p.area = 0.5 * rule.weights[k] * tangents.col(0).cross(tangents.col(1));
      result.push_back(p);
    }
  return result;
}

}  // namespace archetide
