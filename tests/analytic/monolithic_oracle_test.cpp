#include <gtest/gtest.h>

#include <random>

#include "tests/support/dense_eq45.h"
#include "tests/support/dry_body.h"
#include "tests/support/random_vectors.h"

namespace archetide {
namespace {

// Relative difference of the fast path from Eq. 45: 1e-10 is asked for, the PCG tolerance is 1e-13.
constexpr double kTolerance = 1e-10;

struct Case {
  int r;
  int bodies;
  ModalStep step;
  ModalMass mass;
};

class MonolithicOracle : public ::testing::TestWithParam<Case> {};

ReducedBody moving_body(const SyntheticBody& shape, int r, const Vec3& position,
                        std::mt19937& random) {
  std::normal_distribution<double> normal;
  ReducedBody body = make_body(shape.archetype, r);
  body.position = position;
  body.rotation = random_rotation(normal, random);
  body.P = 20.0 * random_vec3(normal, random);
  body.L = 2.0 * random_vec3(normal, random);
  for (int i = 0; i < r; ++i) body.q[i] = 0.05 * normal(random), body.q_dot[i] = normal(random);
  return body;
}

TEST_P(MonolithicOracle, FastPathEqualsDenseEquation45) {
  const Case& c = GetParam();
  std::mt19937 random(7 + c.r);
  CoupledTank tank(10, 0.8);
  tank.options.geometry = Geometry::kVoxel;
  tank.options.open_side[kZMax] = true;
  tank.options.solve.tolerance = 1e-13;
  tank.options.modal = {c.step, c.mass};
  std::vector<SyntheticBody> shapes;
  std::vector<const SyntheticBody*> pointers;
  const Vec3 positions[3] = {Vec3(-0.35, -0.35, -0.3), Vec3(0.4, 0.35, 0.3),
                             Vec3(0.35, -0.4, -0.35)};
  for (int b = 0; b < c.bodies; ++b)
    shapes.push_back(linear_alone(random_archetype(b + 1, std::max(c.r, 1))));
  for (int b = 0; b < c.bodies; ++b) {
    pointers.push_back(&shapes[b]);
    tank.bodies.push_back(moving_body(shapes[b], c.r, positions[b], random));
  }
  std::normal_distribution<double> normal;
  for (auto& component : tank.u.axis)
    for (std::size_t n = 0; n < component.size(); ++n) component[n] = normal(random);
  close_sides(tank.options.grid, tank.options.open_side, tank.u);

  const double dt = 0.02;
  const DenseSolution dense = solve_eq45(tank, pointers, dt);
  Coupling coupling(tank.options, {});
  std::vector<StageBody> stage;
  for (const ReducedBody& b : tank.bodies)
    stage.push_back({&b, current_configuration(b), {}, false, {}});
  MacField u = tank.u;
  const SolveReport report =
      coupling.couple(Stage::kVelocityFull, dt, {&tank.phi, nullptr, 0.0}, stage, u, tank.results);
  EXPECT_TRUE(report.converged) << report.residual;

  for (int b = 0; b < c.bodies; ++b)
    EXPECT_LT((tank.results[b].y - dense.body[b]).norm() / dense.body[b].norm(), kTolerance)
        << "body " << b;

  // Water velocities on the faces that both know, and the pressure.
  const auto& valid = coupling.valid();
  const auto& kind = coupling.system().matrix.kind;
  const Array3<double>& pressure = coupling.last_pressure(Stage::kVelocityFull);
  double p_difference = 0.0, p_norm = 0.0;
  Eigen::Index unknown = 0;
  for (std::size_t n = 0; n < kind.size(); ++n)
    if (kind[n] == CellKind::kUnknown) {
      p_difference = std::max(p_difference, std::abs(pressure[n] - dense.pressure[unknown]));
      p_norm = std::max(p_norm, std::abs(dense.pressure[unknown++]));
    }
  ASSERT_EQ(unknown, dense.pressure.size());
  EXPECT_LT(p_difference / p_norm, kTolerance);

  double u_difference = 0.0, u_norm = 0.0;
  for (const auto& [axis, at, value] : dense.faces)
    if (valid[axis](at[0], at[1], at[2])) {
      u_difference = std::max(u_difference, std::abs(u[axis](at[0], at[1], at[2]) - value));
      u_norm = std::max(u_norm, std::abs(value));
    }
  EXPECT_GT(u_norm, 0.1);
  EXPECT_LT(u_difference / u_norm, kTolerance);
}

/// Chains of bodies by joints at surface vertices, against the dense Eq. 49.
struct JointedCase {
  std::vector<int> r;  // modes of each body
  std::vector<DenseJoint> joints;
  bool water;
  bool twins = false;  // one shape and one rotation: three points between two of them have rank 6
};

class ArticulatedOracle : public ::testing::TestWithParam<JointedCase> {};

TEST_P(ArticulatedOracle, FastPathEqualsDenseEquation49) {
  const JointedCase& c = GetParam();
  std::mt19937 random(11);
  CoupledTank tank(8, 0.8);
  tank.options.has_water = c.water;
  tank.options.geometry = Geometry::kVoxel;
  tank.options.open_side[kZMax] = true;
  tank.options.solve.tolerance = 1e-13;
  std::vector<SyntheticBody> shapes;
  std::vector<const SyntheticBody*> pointers;
  const Vec3 positions[3] = {Vec3(-0.35, -0.35, -0.3), Vec3(0.4, 0.35, 0.3),
                             Vec3(0.35, -0.4, -0.35)};
  for (std::size_t b = 0; b < c.r.size(); ++b)
    shapes.push_back(linear_alone(
        random_archetype(c.twins ? 1 : static_cast<unsigned>(b) + 1, std::max(c.r[b], 1))));
  for (std::size_t b = 0; b < c.r.size(); ++b) {
    pointers.push_back(&shapes[b]);
    tank.bodies.push_back(moving_body(shapes[b], c.r[b], positions[b], random));
    if (c.twins) tank.bodies[b].rotation = tank.bodies[0].rotation;
  }
  std::normal_distribution<double> normal;
  for (auto& component : tank.u.axis)
    for (std::size_t n = 0; n < component.size(); ++n) component[n] = normal(random);
  close_sides(tank.options.grid, tank.options.open_side, tank.u);

  // the joints' points need not meet for one solve
  std::vector<Joint> joints;
  const auto at = [&](int body, int vertex) {
    return attach(tank.bodies[body], tank.bodies[body].archetype->surface.vertices[vertex]);
  };
  for (const DenseJoint& j : c.joints) {
    Joint joint;
    joint.a = j.a, joint.b = j.b;
    joint.at_a = {at(j.a, j.p)};
    if (j.b >= 0) joint.at_b = {at(j.b, j.c)};
    if (j.b < 0) joint.at_world = {Vec3::Zero()};
    joints.push_back(joint);
  }
  const double dt = 0.02;
  double speed = 0.0;  // before the solve: joints may leave nothing of it
  for (const ReducedBody& b : tank.bodies) {
    const ConfigurationTerms terms =
        configuration_terms(b, current_configuration(b), ModalMass::kExact);
    speed = std::max(speed, generalised_velocity(b, terms).norm());
  }
  const DenseSolution dense = solve_eq49(tank, pointers, dt, c.joints);
  Coupling coupling(tank.options, {}, joints);
  std::vector<StageBody> stage;
  for (const ReducedBody& b : tank.bodies)
    stage.push_back({&b, current_configuration(b), {}, false, {}, {}});
  MacField u = tank.u;
  const SolveReport report =
      coupling.couple(Stage::kVelocityFull, dt, {&tank.phi, nullptr, 0.0}, stage, u, tank.results);
  EXPECT_TRUE(report.converged) << report.residual;
  double worst = 0.0;
  for (std::size_t b = 0; b < c.r.size(); ++b)
    worst = std::max(worst, (tank.results[b].y - dense.body[b]).norm() / speed);
  std::printf("%zu bodies, %zu points, %s: off by %.1e, %d iterations\n", c.r.size(),
              c.joints.size(), c.water ? "wet" : "dry", worst, report.iterations);
  EXPECT_LT(worst, kTolerance);
  if (!c.water) return;
  const auto& kind = coupling.system().matrix.kind;
  const Array3<double>& pressure = coupling.last_pressure(Stage::kVelocityFull);
  double difference = 0.0, norm = 0.0;
  Eigen::Index unknown = 0;
  for (std::size_t n = 0; n < kind.size(); ++n)
    if (kind[n] == CellKind::kUnknown) {
      difference = std::max(difference, std::abs(pressure[n] - dense.pressure[unknown]));
      norm = std::max(norm, std::abs(dense.pressure[unknown++]));
    }
  EXPECT_LT(difference / norm, kTolerance);
}

const std::vector<DenseJoint> kBall = {{0, 3, 1, 5}};
const std::vector<DenseJoint> kWeld = {{0, 3, 1, 5}, {0, 9, 1, 12}, {1, 20, 0, 17}};
// three points between bodies 0 and 1, two between 1 and 2, one from 2 back to 0, one to the world
const std::vector<DenseJoint> kLoop = {{0, 3, 1, 5},  {0, 9, 1, 12},  {1, 20, 0, 17}, {1, 2, 2, 6},
                                       {1, 30, 2, 8}, {2, 14, 0, 22}, {2, 4, -1, -1}};
const std::vector<DenseJoint> kTwins = {{0, 3, 1, 3}, {0, 9, 1, 9}, {1, 20, 0, 20}};
// and three points around a ring of three
const std::vector<DenseJoint> kTwinRing = {{0, 3, 1, 3},   {0, 9, 1, 9},   {1, 20, 0, 20},
                                           {1, 3, 2, 3},   {1, 9, 2, 9},   {1, 20, 2, 20},
                                           {2, 14, 0, 14}, {2, 22, 0, 22}, {2, 8, 0, 8}};
INSTANTIATE_TEST_SUITE_P(
    Joints, ArticulatedOracle,
    ::testing::Values(JointedCase{{3, 0}, kBall, true}, JointedCase{{0, 0}, kWeld, true},
                      JointedCase{{4, 2}, kWeld, true}, JointedCase{{3, 0, 5}, kLoop, true},
                      JointedCase{{0, 0, 0}, kLoop, true}, JointedCase{{4, 2}, kWeld, false},
                      JointedCase{{3, 0, 5}, kLoop, false}, JointedCase{{0, 0, 0}, kLoop, false},
                      JointedCase{{0, 0}, kTwins, true, true},
                      JointedCase{{0, 0}, kTwins, false, true},
                      JointedCase{{0, 0, 0}, kTwinRing, true, true},
                      JointedCase{{0, 0, 0}, kTwinRing, false, true},
                      JointedCase{{0, 3}, kTwins, true, true}));

INSTANTIATE_TEST_SUITE_P(Bodies, MonolithicOracle,
                         ::testing::Values(Case{0, 1, ModalStep::kTrapezoid, ModalMass::kExact},
                                           Case{1, 2, ModalStep::kTrapezoid, ModalMass::kExact},
                                           Case{2, 3, ModalStep::kBackwardEuler, ModalMass::kPaper},
                                           Case{3, 2, ModalStep::kBackwardEuler, ModalMass::kExact},
                                           Case{4, 2, ModalStep::kTrapezoid, ModalMass::kPaper},
                                           Case{5, 3, ModalStep::kBackwardEuler,
                                                ModalMass::kPaper}));

}  // namespace
}  // namespace archetide
