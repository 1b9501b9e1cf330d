#include "common/mesh/tet_shape.h"

namespace archetide {

template <>
TetShape<4>::Values TetShape<4>::values(const Vec3& L) {
  return {1.0 - L.sum(), L[0], L[1], L[2]};
}

template <>
TetShape<4>::Gradients TetShape<4>::gradients(const Vec3&) {
  Gradients g;
  g << -Vec3::Ones(), Mat3::Identity();
  return g;
}

template <>
TetShape<10>::Values TetShape<10>::values(const Vec3& L) {
  const Eigen::Vector4d b = TetShape<4>::values(L);
  Values v;
  for (int i = 0; i < 4; ++i) v[i] = b[i] * (2.0 * b[i] - 1.0);
  for (int e = 0; e < 6; ++e) v[4 + e] = 4.0 * b[kTetEdges[e][0]] * b[kTetEdges[e][1]];
  return v;
}

template <>
TetShape<10>::Gradients TetShape<10>::gradients(const Vec3& L) {
  const Eigen::Vector4d b = TetShape<4>::values(L);
  const auto d = TetShape<4>::gradients(L);
  Gradients g;
  for (int i = 0; i < 4; ++i) g.col(i) = (4.0 * b[i] - 1.0) * d.col(i);
  for (int e = 0; e < 6; ++e) {
    const auto [p, q] = kTetEdges[e];
    g.col(4 + e) = 4.0 * (b[p] * d.col(q) + b[q] * d.col(p));
  }
  return g;
}

template <>
std::array<int, 4> element_nodes<4>(const TetMesh& mesh, int tet) {
  return mesh.tets[tet];
}

template <>
std::array<int, 10> element_nodes<10>(const TetMesh& mesh, int tet) {
  const auto& c = mesh.tets[tet];
  const auto& m = mesh.mids[tet];
  return {c[0], c[1], c[2], c[3], m[0], m[1], m[2], m[3], m[4], m[5]};
}

template <int N>
Eigen::Matrix<double, 3, N> element_positions(const TetMesh& mesh,
                                              const std::array<int, N>& nodes) {
  Eigen::Matrix<double, 3, N> x;
  for (int k = 0; k < N; ++k) x.col(k) = mesh.nodes[nodes[k]];
  return x;
}
template Eigen::Matrix<double, 3, 4> element_positions<4>(const TetMesh&,
                                                          const std::array<int, 4>&);
template Eigen::Matrix<double, 3, 10> element_positions<10>(const TetMesh&,
                                                            const std::array<int, 10>&);

}  // namespace archetide
