#include "runtime/numerics/box_cycle.h"

#include <gtest/gtest.h>
#include <omp.h>

#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

// A tank with water around a solid sphere, its multigrid, and a box around the sphere that the
// surface crosses.
struct BoxInATank {
  BoxInATank() {
    op.setup(matrix);
    multigrid.setup(op);
    const std::vector<int> number = number_unknowns(matrix);
    for (int k = low[2]; k < low[2] + size[2]; ++k)
      for (int j = low[1]; j < low[1] + size[1]; ++j)
        for (int i = low[0]; i < low[0] + size[0]; ++i) {
          const int n = number[matrix.kind.index(i, j, k)];
          if (n >= 0) cells.push_back(Vec3i(i, j, k)), rows.push_back(n);
        }
  }
  // A on the cells of the box, with zero beyond it.
  MatX dense() const {
    const MatX all = dense_matrix(matrix);
    return all(rows, rows);
  }

  PoissonMatrix matrix = make_matrix({26, 22, 20, 0.7, 1.0, {{{13.0, 11.0, 9.0}, 4.0}}});
  PoissonOperator op;
  Multigrid multigrid;
  int low[3] = {5, 4, 3}, size[3] = {15, 13, 15};
  std::vector<Vec3i> cells;  // unknowns of the box
  std::vector<int> rows;     // of the dense matrix
};

// V times columns (unknowns of the box x at most kLanes), in lanes from `first` on.
MatX cycle_of(BoxCycle& cycle, const BoxInATank& box, const MatX& columns, int first = 0) {
  cycle.setup(box.multigrid, box.low, box.size);
  const auto place = [&](const Vec3i& c) { return cycle.place(c[0], c[1], c[2]); };
  MatX result(columns.rows(), columns.cols());
  for (Eigen::Index m = 0; m < columns.rows(); ++m)
    for (Eigen::Index n = 0; n < columns.cols(); ++n)
      cycle.rhs()[place(box.cells[m]) + first + n] = static_cast<float>(columns(m, n));
  cycle.cycle();
  for (Eigen::Index m = 0; m < columns.rows(); ++m)
    for (Eigen::Index n = 0; n < columns.cols(); ++n)
      result(m, n) = cycle.iterate()[place(box.cells[m]) + first + n];
  return result;
}

// As a step of an iteration a V(2,2) cycle leaves a tenth to a third of an error in the energy norm
// (a good cycle of cell-centred aggregates with cut cells; a smoother alone leaves 0.9 and more of
// the smooth part of it).
TEST(BoxCycle, IsNearlyTheInverseInTheBoxForEveryLane) {
  const BoxInATank box;
  const MatX A = box.dense();
  std::srand(7);
  const MatX solution = MatX::Random(A.rows(), kLanes) + MatX::Ones(A.rows(), kLanes);
  BoxCycle cycle;
  MatX x = MatX::Zero(A.rows(), kLanes);
  const auto energies = [&](const MatX& v) -> VecX {
    return v.cwiseProduct(A * v).colwise().sum();
  };
  VecX before = energies(solution);
  for (int n = 0; n < 6; ++n) {
    x += cycle_of(cycle, box, A * (solution - x));
    const VecX after = energies(solution - x);
    for (int lane = 0; lane < kLanes; ++lane)
      EXPECT_LE(std::sqrt(after[lane] / before[lane]), 0.35) << "cycle " << n << " lane " << lane;
    before = after;
  }
}

// A lane does not hear of the others, and a box not of the one before it.
TEST(BoxCycle, LanesAndBoxesAreIndependent) {
  const BoxInATank box;
  BoxInATank larger;
  larger.low[0] = 2, larger.size[0] = 22, larger.size[1] = 17;
  std::srand(8);
  const MatX columns = MatX::Random(static_cast<Eigen::Index>(box.rows.size()), 4);
  BoxCycle fresh, used;
  const MatX expected = cycle_of(fresh, box, columns);
  cycle_of(used, larger, MatX::Random(static_cast<Eigen::Index>(box.rows.size()), kLanes));
  EXPECT_EQ(cycle_of(used, box, columns, 9), expected);
  for (int n = 0; n < 4; ++n) EXPECT_EQ(cycle_of(used, box, columns.col(n)), expected.col(n)) << n;
}

TEST(BoxCycle, IsBitIdenticalForAnyNumberOfThreads) {
  PoissonMatrix matrix = make_matrix({64, 60, 56, 0.9, 2.0, random_spheres(3, 64, 60, 40, 2)});
  PoissonOperator op;
  op.setup(matrix);
  Multigrid multigrid;
  multigrid.setup(op);
  const int low[3] = {3, 1, 1}, size[3] = {58, 57, 53};
  const auto run = [&](int threads) {
    omp_set_num_threads(threads);
    BoxCycle cycle;
    cycle.setup(multigrid, low, size);
    std::vector<float> values;
    const auto each = [&](const auto& f) {
      for (int k = low[2]; k < low[2] + size[2]; ++k)
        for (int j = low[1]; j < low[1] + size[1]; ++j)
          for (int i = low[0]; i < low[0] + size[0]; ++i)
            if (matrix.kind(i, j, k) == CellKind::kUnknown) f(cycle.place(i, j, k));
    };
    int n = 0;
    each([&](std::size_t at) {
      for (int l = 0; l < kLanes; ++l) cycle.rhs()[at + l] = static_cast<float>(++n * 37 % 101);
    });
    cycle.cycle();
    each([&](std::size_t at) {
      values.insert(values.end(), cycle.iterate() + at, cycle.iterate() + at + kLanes);
    });
    return values;
  };
  const int threads = omp_get_max_threads();
  const std::vector<float> one = run(1), three = run(3);
  omp_set_num_threads(threads);
  EXPECT_EQ(one, three);
}

}  // namespace
}  // namespace archetide::testing
