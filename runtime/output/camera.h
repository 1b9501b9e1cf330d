#pragma once

#include "runtime/output/ray_scene.h"

namespace archetide {

/// A perspective camera that looks at a box from azimuth / elevation and holds all of it in view.
class Camera {
 public:
  /// Degrees: azimuth 0 looks from the front (-y), positive moves to the right; elevation above the
  /// horizon.
  Camera(const Vec3& low, const Vec3& high, double azimuth, double elevation, int width,
         int height);

  /// Through the point (x, y) of the picture, in pixels from its top left corner.
  Ray ray(double x, double y) const;
  const Vec3& eye() const { return eye_; }

 private:
  Vec3 eye_, forward_, right_, up_;
  double pixel_ = 0.0;                           // size of a pixel at distance 1
  double half_width_ = 0.0, half_height_ = 0.0;  // pixels
};

}  // namespace archetide
