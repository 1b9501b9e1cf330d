#include "assets/generate/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace archetide {
namespace {

constexpr double kPi = std::numbers::pi;

/// Polynomial smooth minimum: a union whose seam is rounded over a width k (m).
double smooth_union(double a, double b, double k) {
  const double overlap = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * k * overlap * overlap;
}

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// A ball of radius ra at a that glides to b while its radius changes to rb.
double tapered_capsule(const Vec3& x, const Vec3& a, double ra, const Vec3& b, double rb) {
  const Vec3 axis = b - a;
  const double t = std::clamp((x - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (x - a - t * axis).norm() - (ra + t * (rb - ra));
}

double sphere(const Vec3& x) { return x.norm() - 0.2; }

double torus(const Vec3& x) {
  const double to_ring = std::hypot(x.x(), x.y()) - 0.2;
  return std::hypot(to_ring, x.z()) - 0.07;
}

/// Five tapered arms joined by rounded webs; the top is domed, the underside nearly flat, the tips
/// rise.
double starfish(const Vec3& x) {
  const double distance = std::hypot(x.x(), x.y());
  const double lift = 0.35 * distance * distance;  // m, 1 cm at the tips
  const double z = x.z() - lift;
  const Vec3 stretched(x.x(), x.y(), z * (z > 0.0 ? 1.7 : 2.6));
  double solid = tapered_capsule(stretched, Vec3::Zero(), 0.052, Vec3(0, 0, 0.001), 0.052);
  for (int arm = 0; arm < 5; ++arm) {
    const double angle = kPi / 2.0 + 2.0 * kPi * arm / 5.0;
    const Vec3 direction(std::cos(angle), std::sin(angle), 0.0);
    solid = smooth_union(
        solid, tapered_capsule(stretched, 0.02 * direction, 0.042, 0.16 * direction, 0.015), 0.03);
  }
  return 0.6 * solid;
}

/// The bell: a thick domed shell, thinner towards a rim with eight shallow lobes.
double bell(const Vec3& x) {
  constexpr double kFlatness = 0.8, kRadius = 0.138, kRimAngle = 1.8;  // 1, m, rad from the top
  const double rho = std::hypot(x.x(), x.y()), z = x.z() / kFlatness;
  const double angle = std::clamp(std::atan2(rho, z), 0.0, kRimAngle);
  const double lobes =
      std::cos(8.0 * std::atan2(x.y(), x.x())) * smooth_step(0.7, kRimAngle, angle);
  const double radius = kRadius * (1.0 + 0.025 * lobes);
  const double half_thickness = 0.018 - 0.009 * smooth_step(0.0, kRimAngle, angle);
  return std::hypot(rho - radius * std::sin(angle), z - radius * std::cos(angle)) - half_thickness;
}

constexpr int kArmPoints = 25;

/// Middle line of one arm of the jellyfish, from under the top of the bell down to the tip, m.
Vec3 arm_point(double s, double azimuth) {
  const double out = 0.012 + 0.085 * s - 0.014 * std::sin(3.0 * kPi * s);
  const double aside = 0.016 * s * std::sin(2.5 * kPi * s);
  const Vec3 outward(std::cos(azimuth), std::sin(azimuth), 0.0);
  const Vec3 sideways(-std::sin(azimuth), std::cos(azimuth), 0.0);
  return out * outward + aside * sideways + Vec3(0, 0, 0.095 - 0.32 * s);
}

double arm_radius(double s) { return 0.0165 - 0.0085 * s; }

double jellyfish_arm(const Vec3& x, int arm) {
  static const auto points = [] {
    std::array<std::array<Vec3, kArmPoints>, 4> all;
    for (int a = 0; a < 4; ++a)
      for (int i = 0; i < kArmPoints; ++i)
        all[a][i] = arm_point(double(i) / (kArmPoints - 1), kPi / 4.0 + a * kPi / 2.0);
    return all;
  }();
  double nearest = 1.0;
  for (int i = 0; i + 1 < kArmPoints; ++i) {
    const double s = double(i) / (kArmPoints - 1), ds = 1.0 / (kArmPoints - 1);
    nearest = std::min(nearest, tapered_capsule(x, points[arm][i], arm_radius(s),
                                                points[arm][i + 1], arm_radius(s + ds)));
  }
  return nearest;
}

double jellyfish(const Vec3& x) {
  double solid = bell(x);
  for (int arm = 0; arm < 4; ++arm) solid = smooth_union(solid, jellyfish_arm(x, arm), 0.025);
  return solid;
}

/// A lumpy ellipsoid; `kind` turns its bumps.
double rock(const Vec3& x, double kind, const Vec3& axes) {
  const Vec3 p = x / 0.2;  // m
  const double bumps =
      0.10 * std::sin(3.1 * p.x() + 1.3 * kind) * std::sin(2.7 * p.y() + 0.7 * kind) +
      0.07 * std::sin(4.3 * p.x() + 2.1 * kind) * std::cos(3.9 * p.z() + kind) +
      0.05 * std::cos(5.1 * p.y() + 0.4 * kind) * std::sin(4.7 * p.z() + 1.9 * kind);
  return 0.2 * axes.minCoeff() * (p.cwiseQuotient(axes).norm() - 1.0 + bumps);
}
double round_rock(const Vec3& x) { return rock(x, 1.0, Vec3(1.0, 0.85, 0.7)); }
double flat_rock(const Vec3& x) { return rock(x, 4.0, Vec3(1.1, 0.8, 0.5)); }

}  // namespace

const std::vector<Shape>& all_shapes() {
  static const std::vector<Shape> shapes = {
      {"sphere", "sphere of radius 0.2 m", sphere, Vec3(-0.23, -0.23, -0.23),
       Vec3(0.23, 0.23, 0.23), 0.0125},
      {"torus", "torus, ring radius 0.2 m, tube radius 0.07 m", torus, Vec3(-0.30, -0.30, -0.10),
       Vec3(0.30, 0.30, 0.10), 0.008},
      {"starfish", "starfish with five arms, span 0.35 m", starfish, Vec3(-0.20, -0.20, -0.04),
       Vec3(0.20, 0.20, 0.06), 0.004},
      {"jellyfish", "jellyfish, bell of 0.3 m with four arms", jellyfish, Vec3(-0.17, -0.17, -0.26),
       Vec3(0.17, 0.17, 0.15), 0.0058},
      {"round_rock", "rock of about 0.4 m x 0.34 m x 0.28 m", round_rock, Vec3(-0.28, -0.26, -0.24),
       Vec3(0.28, 0.26, 0.24), 0.018},
      {"flat_rock", "rock of about 0.44 m x 0.32 m x 0.2 m", flat_rock, Vec3(-0.3, -0.26, -0.2),
       Vec3(0.3, 0.26, 0.2), 0.018},
  };
  return shapes;
}

Vec3 gradient(const Shape& shape, const Vec3& x) {
  constexpr double kStep = 1e-5;  // m; error h^2 f''' is far below the 1e-7 m of the written file
  Vec3 g;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 h = kStep * Vec3::Unit(axis);
    g[axis] = (shape.value(x + h) - shape.value(x - h)) / (2.0 * kStep);
  }
  return g;
}

Vec3 project(const Shape& shape, Vec3 x) {
  for (int step = 0; step < 8; ++step) {
    const double value = shape.value(x);
    if (std::abs(value) < 1e-9) break;  // m
    const Vec3 g = gradient(shape, x);
    x -= value / g.squaredNorm() * g;
  }
  return x;
}

}  // namespace archetide
