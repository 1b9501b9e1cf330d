#include "runtime/articulation/motion_path.h"

#include <algorithm>

namespace archetide {
namespace {

using Vec7 = Eigen::Matrix<double, 7, 1>;  // shift, quaternion

Vec7 values(const MotionPath::Key& key) {
  Vec7 x;
  x << key.shift, key.turn.coeffs();
  return x;
}

// Of a key beside another: the quaternion of two that mean the same turn that is closer to it.
Vec7 values_beside(const MotionPath::Key& key, const Vec7& other) {
  Vec7 x = values(key);
  if (x.tail<4>().dot(other.tail<4>()) < 0.0) x.tail<4>() *= -1.0;
  return x;
}

// d/dt at key n, whose values are x.
Vec7 slope(const std::vector<MotionPath::Key>& keys, std::size_t n, const Vec7& x) {
  if (n == 0 || n + 1 == keys.size()) return Vec7::Zero();
  const double before = keys[n].t - keys[n - 1].t, after = keys[n + 1].t - keys[n].t;
  const Vec7 back = (x - values_beside(keys[n - 1], x)) / before,
             ahead = (values_beside(keys[n + 1], x) - x) / after;
  return (after * back + before * ahead) / (before + after);
}

MotionPath::State state_of(const Vec7& x, const Vec7& rate) {
  MotionPath::State s;
  s.shift = x.head<3>(), s.velocity = rate.head<3>();
  const Quat q(Eigen::Vector4d(x.tail<4>())), q_dot(Eigen::Vector4d(rate.tail<4>()));
  s.turn = q.normalized();
  s.spin = 2.0 / q.squaredNorm() * (q_dot * q.conjugate()).vec();
  return s;
}

}  // namespace

// Eq. S8e.
MotionPath::State MotionPath::at(double t) const {
  const auto after = std::upper_bound(keys.begin(), keys.end(), t,
                                      [](double x, const Key& key) { return x < key.t; });
  if (after == keys.begin()) return state_of(values(keys.front()), Vec7::Zero());
  if (after == keys.end()) return state_of(values(keys.back()), Vec7::Zero());
  const auto n = static_cast<std::size_t>(after - keys.begin());
  const double h = after->t - keys[n - 1].t, s = (t - keys[n - 1].t) / h;
  const Vec7 a = values(keys[n - 1]), b = values_beside(*after, a),
             a_dot = h * slope(keys, n - 1, a), b_dot = h * slope(keys, n, b), way = b - a;
  // Hermite: a + s a' + s^2 (3 way - 2 a' - b') + s^3 (a' + b' - 2 way)
  const Vec7 second = 3.0 * way - 2.0 * a_dot - b_dot, third = a_dot + b_dot - 2.0 * way;
  return state_of(a + s * (a_dot + s * (second + s * third)),
                  (a_dot + s * (2.0 * second + 3.0 * s * third)) / h);
}

PrescribedBody::Pose PrescribedBody::at(double t) const {
  const MotionPath::State s = path.at(t);
  const Vec3 turned = s.turn * arm;
  return {origin + s.shift + turned, s.turn, s.velocity + s.spin.cross(turned), s.spin};
}

}  // namespace archetide
