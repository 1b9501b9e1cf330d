#include "runtime/articulation/motion_path.h"

#include <gtest/gtest.h>

#include <cmath>

namespace archetide {
namespace {

Quat turn_about(const Vec3& axis, double angle) {
  return Quat(Eigen::AngleAxisd(angle, axis.normalized()));
}

TEST(MotionPath, StandsStillBeforeAndAfterItsKeys) {
  const MotionPath path{{{1.0, Vec3(1, 0, 0), turn_about(Vec3(0, 0, 1), 0.3)},
                         {2.0, Vec3(3, 0, 0), turn_about(Vec3(0, 0, 1), 0.5)}}};
  for (const double t : {0.0, 0.5, 1.0}) {
    EXPECT_EQ(path.at(t).shift, Vec3(1, 0, 0));
    EXPECT_EQ(path.at(t).velocity, Vec3::Zero());
    EXPECT_LT(path.at(t).turn.angularDistance(turn_about(Vec3(0, 0, 1), 0.3)), 1e-15);
  }
  EXPECT_EQ(path.at(2.0).shift, Vec3(3, 0, 0));
  EXPECT_EQ(path.at(9.0).spin, Vec3::Zero());
  EXPECT_DOUBLE_EQ(path.at(1.5).shift[0], 2.0);  // eased in and out
  EXPECT_DOUBLE_EQ(path.at(1.5).velocity[0], 3.0);
}

// Three keys of a parabola with a slope of 0 at the first are that parabola up to the second.
TEST(MotionPath, FollowsAParabola) {
  MotionPath path;
  for (const double t : {0.0, 0.3, 1.0})
    path.keys.push_back({t, Vec3(0, 2.0 * t * t, 0), Quat::Identity()});
  for (const double t : {0.1, 0.2, 0.3}) {
    EXPECT_NEAR(path.at(t).shift[1], 2.0 * t * t, 1e-15);
    EXPECT_NEAR(path.at(t).velocity[1], 4.0 * t, 1e-14);
  }
}

// Velocity and spin are the rates of shift and turn. Keys of 30 degrees of a steady turn tell its rate
// to 1 - sin(a) / a, a = 15 degrees, 1.14 %; the sign of a quaternion does not matter.
TEST(MotionPath, TellsItsVelocity) {
  MotionPath path;
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  for (int n = 0; n <= 12; ++n) {
    Quat turn = turn_about(axis, n * M_PI / 6.0);
    if (n % 2) turn.coeffs() *= -1.0;
    path.keys.push_back({0.1 * n, Vec3(std::sin(0.5 * n), 0.01 * n * n, 0), turn});
  }
  const double h = 1e-6, rate = M_PI / 0.6;
  for (double t = 0.05; t < 1.2; t += 0.0313) {
    const MotionPath::State a = path.at(t - h), b = path.at(t + h), now = path.at(t);
    EXPECT_LT(((b.shift - a.shift) / (2 * h) - now.velocity).norm(), 1e-7);
    const Eigen::AngleAxisd turned(b.turn * a.turn.conjugate());
    EXPECT_LT((turned.angle() / (2 * h) * turned.axis() - now.spin).norm(), 1e-7 * rate);
    if (t > 0.2 && t < 1.0) {
      EXPECT_LT((now.spin - rate * axis).norm(), 1.2e-2 * rate);
    }
  }
}

TEST(PrescribedBody, TurnsAboutItsOrigin) {
  PrescribedBody told;
  told.origin = Vec3(1, 0, 0), told.arm = Vec3(2, 0, 0);
  told.path.keys = {{0.0, Vec3::Zero(), Quat::Identity()},
                    {1.0, Vec3(0, 0, 5), turn_about(Vec3(0, 0, 1), M_PI / 2)},
                    {2.0, Vec3(0, 0, 10), turn_about(Vec3(0, 0, 1), M_PI)}};
  const PrescribedBody::Pose end = told.at(1.0);
  EXPECT_LT((end.position - Vec3(1, 2, 5)).norm(), 1e-14);
  EXPECT_LT((end.velocity - Vec3(-2.0 * end.spin[2], 0, 5)).norm(), 1e-13);
}

}  // namespace
}  // namespace archetide
