#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/output/ray_scene.h"

namespace archetide {

constexpr float kWaterIndex = 1.33f;        // of refraction
constexpr float kWaterReflectance = 0.02f;  // at normal incidence, ((n - 1) / (n + 1))^2

inline Vec3f mix(const Vec3f& a, const Vec3f& b, float s) { return a + s * (b - a); }

inline Vec3f reflected(const Vec3f& d, const Vec3f& n) {
  return (d - 2.0f * d.dot(n) * n).normalized();
}

/// Schlick's approximation for light that meets the surface at `cosine` on the thin side.
inline float fresnel(float cosine) {
  return kWaterReflectance + (1.0f - kWaterReflectance) * std::pow(1.0f - cosine, 5.0f);
}

/// Snell's law for ratio = n_from / n_to and n against d; false on total reflection.
inline bool refract(const Vec3f& d, const Vec3f& n, float ratio, Vec3f& out) {
  const float c = -d.dot(n), k = 1.0f - ratio * ratio * (1.0f - c * c);
  if (k < 0.0f) return false;
  out = (ratio * d + (ratio * c - std::sqrt(k)) * n).normalized();
  return true;
}

inline void tangents(const Vec3f& n, Vec3f& a, Vec3f& b) {
  a = n.cross(std::abs(n[2]) < 0.9f ? Vec3f(0, 0, 1) : Vec3f(1, 0, 0)).normalized();
  b = n.cross(a);
}

inline std::uint8_t encoded(float linear) {
  // A shoulder that keeps highlights below white, then the sRGB curve.
  const float x = linear / (1.0f + std::max(0.0f, linear - 0.75f) * 0.55f);
  const float s = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::clamp(255.0f * s + 0.5f, 0.0f, 255.0f));
}

/// Points in the unit square for one sample of one pixel. Over the samples they follow the R2
/// sequence [Rob18]; each request and pixel shifts it by interleaved gradient noise [Jim14], so that neighbours err differently.
class Dice {
 public:
  Dice(int x, int y, int sample) : x_(x), y_(y), sample_(sample) {}
  // Point `n` of `count` that one request draws per sample.
  void next(float& u, float& v, int n = 0, int count = 1) {
    if (n == 0) ++request_;
    const float index = static_cast<float>(sample_ * count + n);
    u = fraction(noise(17.0f * request_, 5.0f * request_) + 0.7548776662f * index);
    v = fraction(noise(5.0f * request_ + 47.0f, 29.0f * request_ + 113.0f) + 0.5698402910f * index);
  }

 private:
  static float fraction(float x) { return x - std::floor(x); }
  float noise(float dx, float dy) const {
    return fraction(52.9829189f * fraction(0.06711056f * (x_ + dx) + 0.00583715f * (y_ + dy)));
  }
  int x_, y_, sample_, request_ = 0;
};

}  // namespace archetide
