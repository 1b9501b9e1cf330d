#pragma once

#include <limits>
#include <memory>

#include "runtime/output/surface_mesh.h"

namespace archetide {

using Vec3f = Eigen::Vector3f;

struct Ray {
  Vec3f origin, direction;  // m, unit
  float near = 0.0f;        // m
  float far = std::numeric_limits<float>::infinity();

  Vec3f at(float t) const { return origin + t * direction; }
};

/// Where a ray meets a surface first; mesh < 0: nowhere.
struct RayHit {
  float t = std::numeric_limits<float>::infinity();  // m
  int mesh = -1, triangle = -1;
  float u = 0.0f, v = 0.0f;           // barycentric weights of corners 1 and 2
  Vec3f flat_normal = Vec3f::Zero();  // of the triangle, unit, outward

  explicit operator bool() const { return mesh >= 0; }
};

/// Triangle meshes behind a bounding volume hierarchy (embree). Safe to query from many threads.
class RayScene {
 public:
  /// The meshes are numbered as given; they are copied. Throws MachineError when this build has no
  /// embree.
  explicit RayScene(const std::vector<const SurfaceMesh*>& meshes);
  ~RayScene();
  RayScene(RayScene&&) noexcept;

  static bool available();
  RayHit closest(const Ray& ray) const;
  bool blocked(const Ray& ray) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
