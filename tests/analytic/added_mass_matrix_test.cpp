#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdio>

#include "common/base/input_error.h"
#include "runtime/added_mass.h"
#include "tests/support/constants.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

ReducedBody unit_ball() {
  return make_body(rigid_surface_archetype(volume_true_sphere(5, 1.0), 300.0), 0);
}

AddedMassTank cube(double half, int cells_per_metre) {
  AddedMassTank tank;
  tank.grid = added_mass_grid(1.0 / cells_per_metre, Vec3::Constant(2.0 * half));
  return tank;
}

// A ball in a closed cube of twice its size, converged spectral value over the displaced mass; its
// turns move no water.
TEST(AddedMassMatrix, OfABallInAClosedCubeIsTheSpectralOne) {
  constexpr double kClosedCube = 0.6228265974;
  const ReducedBody ball = unit_ball();
  AddedMassTank tank = cube(2.0, 8);
  tank.walls = true;
  const AddedMass found = added_mass(ball, tank);
  const double displaced = kWaterDensity * ball.archetype->volume;
  const VecX k = found.matrix.diagonal() / displaced;
  std::printf("translations %.6f %.6f %.6f, turns %.1e %.1e %.1e, asymmetry %.1e\n", k[0], k[1],
              k[2], k[3], k[4], k[5], found.asymmetry);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(k[i] / kClosedCube, 1.0, 4e-4);
  EXPECT_LT(k.tail<3>().maxCoeff(), 4e-8);
}

// What the sides of the tank change falls as the cube of radius over distance: without it 1/2 is
// left, within 0.04 % at 4 cells per radius.
TEST(AddedMassMatrix, OfABallFarFromTheSidesIsHalfTheDisplacedMass) {
  const ReducedBody ball = unit_ball();
  const double displaced = kWaterDensity * ball.archetype->volume;
  for (const bool walls : {false, true}) {
    double k[2];
    for (int n = 0; n < 2; ++n) {
      AddedMassTank tank = cube(n == 0 ? 3.0 : 6.0, 4);
      tank.walls = walls;
      k[n] = added_mass(ball, tank).matrix(2, 2) / displaced;
    }
    const double far = k[1] + (k[1] - k[0]) / 7.0;
    std::printf("%s: %.5f, %.5f, far %.5f\n", walls ? "walls" : "open", k[0], k[1], far);
    EXPECT_NEAR(far / 0.5, 1.0, 1.2e-3);
    EXPECT_GT(walls ? k[0] - k[1] : k[1] - k[0], 0.005);
  }
}

// The kinetic energy of the water that a bending body moves is positive, and what one motion pushes
// along another is what that pushes along it. Its own mass and stiffness do not count.
TEST(AddedMassMatrix, OfADeformableBodyIsSymmetricAndPositiveWhateverItsMass) {
  const SyntheticBody blob = random_archetype(5, 4);
  ReducedBody body = make_body(blob.archetype, 4);
  body.rotation = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  AddedMassTank tank;
  tank.grid = added_mass_grid(0.25, Vec3::Constant(6.0));
  const AddedMass found = added_mass(body, tank);
  const VecX values = Eigen::SelfAdjointEigenSolver<MatX>(found.matrix).eigenvalues();
  auto other = std::make_shared<Archetype>(*blob.archetype);
  other->density *= 3.0;  // its arrays stay: a third of the mass at the density of water
  other->K_r *= 100.0;
  body.archetype = other;
  const double change = (added_mass(body, tank).matrix - found.matrix).norm() / found.matrix.norm();
  std::printf("asymmetry %.1e, eigenvalues %.2g to %.2g, lighter and stiffer %.1e\n",
              found.asymmetry, values[0], values[9], change);
  EXPECT_LT(found.asymmetry, 1e-7);
  EXPECT_GT(values[0], 0.0);
  EXPECT_LT(change, 1e-8);
}

TEST(AddedMassMatrix, SaysWhatItCannotTell) {
  AddedMassTank tank = cube(0.9, 4);
  EXPECT_THROW(added_mass(unit_ball(), tank), InputError);  // it leaves the tank
  tank = cube(2.0, 4);
  tank.level = -1.5;
  EXPECT_THROW(added_mass(unit_ball(), tank), InputError);  // dry
  const SyntheticBody blob = random_archetype(5, 4);        // its modes change its volume
  tank = cube(2.0, 4);
  tank.walls = true;
  EXPECT_THROW(added_mass(make_body(blob.archetype, 4), tank), NumericsError);
  EXPECT_THROW(added_mass_grid(1e-6, Vec3::Ones()), InputError);
}

}  // namespace
}  // namespace archetide
