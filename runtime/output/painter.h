#pragma once

#include <map>

#include <Eigen/Geometry>

#include "common/files/image.h"
#include "runtime/output/camera.h"
#include "runtime/output/ray_scene.h"

namespace archetide {

class Dice;

/// Everything that a picture shows, in metres.
struct PaintedScene {
  SurfaceMesh water, bodies, obstacles;
  std::vector<Vec3> markers, spray;  // drawn as dots
  bool has_tank = false;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // the tank, or a box around the bodies
};

/// Ray traces one stage: sun and sky with soft shadows, opaque bodies, and water that reflects,
/// refracts and absorbs. The tank's sides do not bend light, so that a look through them is a cut
/// through the water. Deterministic.
class Painter {
 public:
  explicit Painter(const PaintedScene& stage);
  Image paint(const Camera& camera, int width, int height, int samples) const;

 private:
  struct Surface {  // what an opaque hit looks like
    Vec3f position, normal, colour;
    float gloss = 0.0f;
  };

  Vec3f air_light(const Ray& ray, int depth, Dice& dice) const;
  Vec3f water_surface_light(const Ray& ray, const RayHit& hit, int depth, Dice& dice) const;
  Vec3f light_through_water(Ray ray, int depth, Dice& dice) const;
  Vec3f shade(const Surface& surface, const Vec3f& to_eye, Dice& dice) const;
  Vec3f sun_visibility(const Vec3f& position, Dice& dice) const;
  float sky_visibility(const Surface& surface, Dice& dice) const;

  bool opaque_surface(const Ray& ray, Surface& surface, float& t) const;
  bool is_tank_side(const Vec3f& position, const Vec3f& normal) const;
  Vec3f body_colour(const RayHit& hit) const;
  Vec3f ground_colour(const Vec3f& position) const;
  Vec3f transmittance(float length) const;

  const PaintedScene& scene_;
  std::map<int, Eigen::AlignedBox3d> rest_;  // around each undeformed body, m
  SurfaceMesh edges_;                        // the tank's edges as thin bars
  SurfaceMesh dots_, drops_;                 // one on each marker, drop of spray
  RayScene opaque_, edge_scene_, water_;     // edges cast no shadow
  Vec3f low_, high_, absorption_;            // absorption in 1/m
  float size_ = 1.0f, near_ = 0.0f, ground_ = 0.0f, tile_ = 1.0f;  // m
};

}  // namespace archetide
