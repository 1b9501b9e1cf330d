#pragma once

#include <vector>

#include "common/archetype/elastic_cubature.h"
#include "common/archetype/tet_matrices.h"
#include "common/mesh/tet_mesh.h"

namespace archetide {

/// Elastic energy V(u) of a tet mesh of NeoHookean material, J, over the displacements u of its n
/// nodes, 3 n, m; with four points in a quadratic tet and one in a linear one. docs/method.md, P9.
class TetElasticity {
 public:
  /// `lambda`, `mu`: nt, Pa.
  TetElasticity(const TetMesh& mesh, VecX lambda, VecX mu);

  int size() const { return size_; }  // 3 n
  int tets() const { return static_cast<int>(lambda_.size()); }
  int points_in_tet() const { return points_; }
  int nodes_in_tet() const { return nodes_; }
  const int* nodes_of(int tet) const { return &node_[static_cast<std::size_t>(tet) * nodes_]; }
  /// Of point k of a tet: gradients of the shape functions, 3 x nodes_in_tet(), 1/m, and weight, m^3.
  Eigen::Ref<const Eigen::Matrix3Xd> gradients(int tet, int k) const {
    return gradients_.middleCols((static_cast<long>(tet) * points_ + k) * nodes_, nodes_);
  }
  /// du_a / dx_c there.
  Mat3 gradient(const Eigen::Ref<const VecX>& u, int tet, int k) const;
  double weight(int tet, int k) const { return weight_[static_cast<long>(tet) * points_ + k]; }
  double lambda(int tet) const { return lambda_[tet]; }
  double mu(int tet) const { return mu_[tet]; }

  double energy(const VecX& u) const;
  double least_volume(const VecX& u) const;  // of det F at the points
  VecX force(const VecX& u) const;           // dV/du, 3 n, N

  /// Where the blocks of each tet's stiffness stand in `matrices`: for add_stiffness().
  std::vector<int> places_in(const TetMatrices& matrices) const;
  /// blocks += factor d2V/du2, the blocks that TetMatrices keeps.
  void add_stiffness(const VecX& u, double factor, const std::vector<int>& places,
                     std::vector<Mat3>& blocks) const;

  /// A point of the quadrature, and all of them, tet after tet.
  struct Point {
    int tet = 0, point = 0;
  };
  std::vector<Point> points() const;
  /// The energy of a basis (3 n x r) at some points, each with its own weight times `scale`.
  ElasticCubature sampled(const MatX& basis, const std::vector<Point>& points,
                          const VecX& scale) const;

  std::size_t bytes() const;

 private:
  template <int N>
  void sample(const TetMesh& mesh);
  template <int N, class Work>
  void at_every_point(const VecX& u, const Work& work) const;
  template <class Work>
  void at_points_of_any(const VecX& u, const Work& work) const;

  int size_ = 0, nodes_ = 0, points_ = 0;
  std::vector<int> node_;  // nt x nodes_
  Eigen::Matrix3Xd gradients_;
  VecX weight_, lambda_, mu_;
};

}  // namespace archetide
