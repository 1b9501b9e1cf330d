#include "runtime/output/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace archetide {
namespace {

constexpr double kFieldOfView = 30.0;  // degrees, along the picture's height
constexpr double kMargin = 1.06;       // air around the box

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

}  // namespace

Camera::Camera(const Vec3& low, const Vec3& high, double azimuth, double elevation, int width,
               int height)
    : half_width_(0.5 * width), half_height_(0.5 * height) {
  const double a = radians(azimuth), e = radians(elevation);
  forward_ = -Vec3(std::sin(a) * std::cos(e), -std::cos(a) * std::cos(e), std::sin(e));
  right_ = forward_.cross(Vec3::UnitZ()).normalized();
  up_ = right_.cross(forward_);
  pixel_ = 2.0 * std::tan(radians(0.5 * kFieldOfView)) / height;

  // Each corner c of the box, relative to the middle, demands |x| <= s (d + z) in both directions;
  // the target moves until the demands of opposite sides agree.
  const Vec3 middle = 0.5 * (low + high);
  const double slope[2] = {pixel_ * half_width_ / kMargin, pixel_ * half_height_ / kMargin};
  Vec3 shift = Vec3::Zero();
  double distance = 0.0;
  for (int pass = 0; pass < 20; ++pass) {
    double demand[2][2] = {};
    for (int c = 0; c < 8; ++c) {
      const Vec3 corner((c & 1 ? high : low)[0], (c & 2 ? high : low)[1], (c & 4 ? high : low)[2]);
      const Vec3 x = corner - middle - shift;
      const double along[2] = {x.dot(right_), x.dot(up_)};
      for (int axis = 0; axis < 2; ++axis)
        for (int side = 0; side < 2; ++side)
          demand[axis][side] = std::max(
              demand[axis][side], (side ? 1 : -1) * along[axis] / slope[axis] - x.dot(forward_));
    }
    distance = std::max({demand[0][0], demand[0][1], demand[1][0], demand[1][1]});
    for (int axis = 0; axis < 2; ++axis)
      shift += 0.5 * slope[axis] * (demand[axis][1] - demand[axis][0]) * (axis ? up_ : right_);
  }
  eye_ = middle + shift - distance * forward_;
}

Ray Camera::ray(double x, double y) const {
  const Vec3 d = forward_ + pixel_ * ((x - half_width_) * right_ + (half_height_ - y) * up_);
  Ray ray;
  ray.origin = eye_.cast<float>();
  ray.direction = d.normalized().cast<float>();
  return ray;
}

}  // namespace archetide
