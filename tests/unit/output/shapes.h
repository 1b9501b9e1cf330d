#pragma once

#include <cmath>
#include <memory>
#include <numbers>

#include "common/archetype/archetype.h"
#include "runtime/output/surface_mesh.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// A sphere of latitude bands, outward, marked with a body number.
inline SurfaceMesh ball(const Vec3& centre, double radius, int body, int bands = 24) {
  SurfaceMesh mesh;
  const int around = 2 * bands;
  for (int i = 0; i <= bands; ++i)
    for (int j = 0; j < around; ++j) {
      const double polar = std::numbers::pi * i / bands, turn = 2 * std::numbers::pi * j / around;
      const Vec3 n(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                   std::cos(polar));
      mesh.vertices.push_back(centre + radius * n);
      mesh.normals.push_back(n);
      mesh.body.push_back(body);
    }
  for (int i = 0; i < bands; ++i)
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j, b = i * around + (j + 1) % around;
      if (i > 0) mesh.triangles.emplace_back(a, a + around, b);
      if (i < bands - 1) mesh.triangles.emplace_back(b, a + around, b + around);
    }
  return mesh;
}

/// A rigid archetype with the surface of a tetrahedron and the inertia of a unit ball, 2 kg.
inline std::shared_ptr<Archetype> tetrahedron_archetype() {
  auto a = std::make_shared<Archetype>();
  a->name = "tetrahedron";
  a->content_hash = "0123";
  a->density = 400.0;
  a->surface.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  a->surface.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  a->integrals.mass = 2.0;
  a->integrals.Sxx = 0.4 * Mat3::Identity();  // so that I = 0.8 * identity, kg m^2
  return a;
}

inline ReducedBody rigid_body(std::shared_ptr<const Archetype> archetype) {
  ReducedBody body;
  body.archetype = std::move(archetype);
  body.q.resize(0);
  body.q_dot.resize(0);
  return body;
}

}  // namespace archetide
