#pragma once

#include <memory>
#include <vector>

#include <Eigen/SparseCore>

#include "common/archetype/tet_matrices.h"

namespace archetide {

/// What a Cholesky factor of blocks of 3 x 3 looks like: columns in an order of elimination, put
/// together to supernodes (neighbours with nearly the same rows below), each of which is factored
/// as one dense front [Liu92]. Made once for an archetype.
class FactorPattern {
 public:
  explicit FactorPattern(const TetMatrices& matrices);

  struct Supernode {
    int first = 0, width = 0;  // its columns
    std::vector<int> below;    // rows below its columns, ascending
    int parent = -1;           // the supernode that its update goes to; -1: none
    int rows() const { return width + static_cast<int>(below.size()); }
  };
  const std::vector<Supernode>& supernodes() const { return supernodes_; }  // children first
  int size() const { return static_cast<int>(node_.size()); }               // nodes
  std::size_t factor_bytes() const;
  int node(int column) const { return node_[static_cast<std::size_t>(column)]; }
  int column(int node) const { return column_[static_cast<std::size_t>(node)]; }
  int supernode(int column) const { return supernode_[static_cast<std::size_t>(column)]; }

  /// Blocks of the matrix in the rows below a column, the diagonal first.
  struct Entry {
    int row;         // column of its node, >= that of the column
    int block;       // of TetMatrices
    bool transpose;  // the block stands above the diagonal
  };
  const std::vector<Entry>& entries(int column) const {
    return entries_[static_cast<std::size_t>(column)];
  }

 private:
  void number_columns(const TetMatrices& m, const std::vector<int>& order);
  std::vector<int> elimination_tree() const;
  void find_supernodes();
  void merge_supernodes();

  std::vector<int> node_, column_, supernode_;
  std::vector<std::vector<Entry>> entries_;  // per column
  std::vector<Supernode> supernodes_;
};

/// The factor L of mass M + ratio K with M in blocks m 1, of a free body for ratio >= 0: positive
/// definite. Supernodal, multifrontal: products of dense matrices; no other library.
class BlockCholesky {
 public:
  /// Throws AssertionError where it is not positive definite.
  BlockCholesky(std::shared_ptr<const FactorPattern> pattern, const TetMatrices& matrices,
                double ratio);
  /// With other blocks K of the same pattern; null where M + ratio K is not positive definite.
  static std::shared_ptr<const BlockCholesky> if_definite(
      std::shared_ptr<const FactorPattern> pattern, const TetMatrices& matrices,
      const std::vector<Mat3>& K, double ratio);

  /// Columns of b (3 n, dof 3 node + axis) become those of the solution. A column's answer does not
  /// depend on the number of threads.
  void solve(MatX& b) const;
  /// E^T A^-1 E, k x k, of forces E (3 n x k) on a few nodes each: the first half of the solution
  /// alone, and of the factor what these nodes lead to.
  MatX compliance(const Eigen::SparseMatrix<double>& E) const;

 private:
  explicit BlockCholesky(std::shared_ptr<const FactorPattern> pattern)
      : pattern_(std::move(pattern)) {}
  bool factor(const TetMatrices& matrices, const std::vector<Mat3>& K, double ratio);
  void solve_some(Eigen::Ref<MatX> b) const;
  std::shared_ptr<const FactorPattern> pattern_;
  std::vector<MatX> panels_;  // per supernode, 3 rows() x 3 width: L of its columns
};

}  // namespace archetide
