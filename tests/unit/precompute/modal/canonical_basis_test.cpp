#include "precompute/modal/canonical_basis.h"

#include <gtest/gtest.h>

#include <dlfcn.h>
#include <omp.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <numeric>
#include <random>

#include "common/archetype/mode_cluster.h"
#include "precompute/modal/modes.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

/// A square bar whose mesh is its own mirror image under x <-> y: bending modes come in exact
/// pairs.
TetMesh symmetric_bar() {
  TetMesh mesh = shapes::tet_box(2, 2, 8, 0.25);
  move_to_centre_of_mass(mesh);
  return mesh;
}

ModesResult modes_of(const TetMesh& mesh, int count) {
  Profile profile;
  ModesOptions options;
  options.count = count;
  return compute_modes(mesh, kRubber, options, profile);
}

TEST(CanonicalBasis, UndoesAnyRotationInsideAPairOfEqualModes) {
  const TetMesh mesh = symmetric_bar();
  const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
  const ModesResult modes = modes_of(mesh, 6);
  VecX omega2 = modes.omega2;
  omega2[1] = omega2[0];  // a pair by decree
  for (const double angle : {0.3, 1.5, 2.9, -2.0}) {
    MatX turned = modes.node_modes;
    turned.col(0) =
        std::cos(angle) * modes.node_modes.col(0) + std::sin(angle) * modes.node_modes.col(1);
    turned.col(1) =
        std::sin(angle) * modes.node_modes.col(0) - std::cos(angle) * modes.node_modes.col(1);
    turned.col(3) *= -1.0;
    MatX first = modes.node_modes;
    canonicalise(mesh.nodes, mass, omega2, first);
    canonicalise(mesh.nodes, mass, omega2, turned);
    EXPECT_LT((turned - first).cwiseAbs().maxCoeff(), 1e-10 * first.cwiseAbs().maxCoeff());
  }
}

TEST(CanonicalBasis, KeepsTheSpaceAndItsOrthonormality) {
  const TetMesh mesh = symmetric_bar();
  const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
  const MatX before = modes_of(mesh, 6).node_modes;
  MatX after = before;
  canonicalise(mesh.nodes, mass, VecX::Ones(before.cols()), after);  // all equal: all are mixed
  const MatX Q = before.transpose() * apply_mass(mass, after);
  const MatX one = MatX::Identity(Q.rows(), Q.cols());
  EXPECT_LT((Q * Q.transpose() - one).norm(), 1e-12);
  EXPECT_GT((Q - one).norm(), 0.1);
}

TEST(CanonicalBasis, FirstModeOfAPairTakesAllOfTheFirstReferenceFieldThatThePairKnows) {
  const TetMesh mesh = symmetric_bar();
  const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
  MatX pair = modes_of(mesh, 6).node_modes.leftCols(2);
  canonicalise(mesh.nodes, mass, VecX::Ones(2), pair);
  // Bending: cross sections tilt. The first field of this kind is x z e_z.
  VecX field = VecX::Zero(pair.rows());
  for (std::size_t v = 0; v < mesh.nodes.size(); ++v)
    field[3 * Eigen::Index(v) + 2] = mesh.nodes[v][0] * mesh.nodes[v][2];
  const VecX part = pair.transpose() * apply_mass(mass, field);
  EXPECT_GT(std::abs(part[0]), 0.1 * std::sqrt(field.dot(apply_mass(mass, field).col(0))));
  EXPECT_LT(std::abs(part[1]), 1e-12 * std::abs(part[0]));
}

// ---- H20: the same spaces whatever the solver's way to them ------------------------------------

/// A cube of 6^3 cells, or a ball: the cube drawn in. Both are their own images under every exchange
/// of the axes and under inversion, so that pairs of modes have equal frequencies; those of the
/// ball come in near-multiplets of 5, 5, 3, 7 as well.
TetMesh cube_or_ball(bool drawn_in) {
  TetMesh mesh = shapes::tet_box(6, 6, 6, 1.0 / 3);
  for (Vec3& x : mesh.nodes) {
    x -= Vec3::Ones();
    if (drawn_in && x.norm() > 0.0) x *= x.cwiseAbs().maxCoeff() / x.norm();
  }
  move_to_centre_of_mass(mesh);
  return mesh;
}

/// Nodes and tets in another order: ARPACK's start vector is another field, and every sum is
/// another one. `order`: which old node is the n-th.
TetMesh reordered(const TetMesh& mesh, const std::vector<int>& order) {
  std::vector<int> place(order.size());
  TetMesh other;
  for (std::size_t n = 0; n < order.size(); ++n) {
    place[order[n]] = static_cast<int>(n);
    other.nodes.push_back(mesh.nodes[order[n]]);
  }
  for (auto tet = mesh.tets.rbegin(); tet != mesh.tets.rend(); ++tet) {
    other.tets.push_back(*tet);
    for (int& node : other.tets.back()) node = place[node];
  }
  return other;
}

/// What OpenMP and OpenBLAS may use from here on, as OMP_NUM_THREADS would have it.
void allow_threads(int threads) {
  omp_set_num_threads(threads);
  using SetThreads = void (*)(int);
  const auto set = reinterpret_cast<SetThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set) set(threads);
}

/// Largest sine of the principal angles, in the mass, of the spaces that two bases span.
double largest_angle(const SparseMatrix& mass, const MatX& a, const MatX& b) {
  const MatX rest = b - a * (a.transpose() * apply_mass(mass, b));
  return std::sqrt(Eigen::SelfAdjointEigenSolver<MatX>(rest.transpose() * apply_mass(mass, rest))
                       .eigenvalues()
                       .maxCoeff());
}

/// Of all clusters of the first modes (those that no relative gap of kClusterGap in omega parts).
double worst_cluster(const SparseMatrix& mass, const VecX& omega2, const MatX& a, const MatX& b) {
  double worst = 0.0;
  for (Eigen::Index first = 0, next; first < omega2.size(); first = next) {
    for (next = first + 1; next < omega2.size(); ++next)
      if (std::sqrt(omega2[next] / omega2[next - 1]) > 1.0 + kClusterGap) break;
    worst = std::max(worst, largest_angle(mass, a.middleCols(first, next - first),
                                          b.middleCols(first, next - first)));
  }
  return worst;
}

TEST(CanonicalBasis, SpacesDependOnNeitherThreadsNorStartNorTheNumberOfModes) {
  for (const bool drawn_in : {false, true}) {
    const TetMesh mesh = cube_or_ball(drawn_in);
    const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
    const auto solve = [&](const TetMesh& of, int count, double shift_scale, int threads) {
      const int before = omp_get_max_threads();
      allow_threads(threads);
      Profile profile;
      ModesOptions options;
      options.count = count;
      options.shift_scale = shift_scale;
      const ModesResult modes = compute_modes(of, kRubber, options, profile);
      allow_threads(before);
      return modes;
    };
    const ModesResult one = solve(mesh, 12, 0.1, 1);
    const Eigen::Index r = one.omega2.size();
    EXPECT_GE(r, 10);
    EXPECT_GE(one.cluster_gap, kClusterGap);
    const auto compare = [&](const char* what, const VecX& omega2, const MatX& modes) {
      const double angle = worst_cluster(mass, one.omega2, one.node_modes, modes.leftCols(r));
      const double apart = (modes.leftCols(r) - one.node_modes).cwiseAbs().maxCoeff() /
                           one.node_modes.cwiseAbs().maxCoeff();
      std::printf("%s, %s: frequencies %.1e, principal angle %.1e, vectors %.1e apart\n",
                  drawn_in ? "ball" : "cube", what,
                  (omega2.head(r).array() / one.omega2.array() - 1.0).abs().maxCoeff(), angle,
                  apart);
      EXPECT_LT(angle, 1e-6) << what;  // asked; measured 1e-13 (cube), 1.3e-10 (ball)
      EXPECT_LT(apart, 1e-9) << what;  // measured 3e-13, 1.1e-10
    };
    for (const int threads : {2, 4}) {
      const ModesResult many = solve(mesh, 12, 0.1, threads);
      EXPECT_EQ(many.omega2, one.omega2) << threads;
      EXPECT_EQ(many.node_modes, one.node_modes) << threads;
      compare("threads", many.omega2, many.node_modes);
    }
    // More modes: more Lanczos vectors, other restarts.
    for (const int count : {16, 30}) {
      const ModesResult more = solve(mesh, count, 0.1, 1);
      compare("more modes", more.omega2, more.node_modes);
    }
    for (const double shift_scale : {1e-3, 10.0}) {
      const ModesResult shifted = solve(mesh, 12, shift_scale, 1);
      compare("another shift", shifted.omega2, shifted.node_modes);
    }
    std::vector<int> order(mesh.nodes.size());
    std::iota(order.begin(), order.end(), 0);
    for (const unsigned seed : {1u, 2u}) {
      std::shuffle(order.begin(), order.end(), std::mt19937(seed));
      const ModesResult other = solve(reordered(mesh, order), 12, 0.1, 1);
      ASSERT_EQ(other.omega2.size(), r);
      MatX back(other.node_modes.rows(), r);
      for (std::size_t n = 0; n < order.size(); ++n)
        back.middleRows<3>(3 * order[n]) = other.node_modes.middleRows<3>(3 * Eigen::Index(n));
      canonicalise_signs(back);  // they are chosen by the order of the nodes
      compare("another start", other.omega2, back);
    }
  }
}

}  // namespace
}  // namespace archetide
