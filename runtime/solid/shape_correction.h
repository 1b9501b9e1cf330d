#pragma once

#include <memory>
#include <mutex>

#include "common/archetype/archetype.h"

namespace archetide {

struct ReducedBody;

/// The shape that water, contact and camera see is y = s(q) (x + S q) + d(q) about the centre of mass
/// (S2) [D18].
///
/// Linear modes change the volume of a body in ways that no strain energy resists: a turn by an angle t
/// drawn as straight displacements swells it by t^2. Water pressure would drive that: a soft body deep
/// under water would whip, or stand as if stiff. With s and d the surface encloses the volume V(0) f(a
/// . q) about the centroid c(0) + b . q, exactly [D82], a and b of LinearShape and f convex, f(0) =
/// f'(0) = f''(0) = 1: so the work of a uniform pressure is convex in q.
///
/// Nonlinear modes have an energy that resists at its own points, and a surface that swells otherwise
/// would be driven as well: there s makes the volume that of these points (elastic_volume), from the
/// second order on. On a rung d makes the centroid that of the body's own surface, to second order
/// [D81].
struct ShapeCorrection {
  double s = 1.0;
  VecX slope;                 // r, d ln s / dq
  Vec3 shift = Vec3::Zero();  // d, body frame, m
  MatX shift_rate;            // 3 x r, dd/dq - d (d ln s/dq), m: what the arm y does not tell
};

/// Of the shape q (r) of the body. The last two of a body are kept.
std::shared_ptr<const ShapeCorrection> shape_correction(const ReducedBody& body, const VecX& q);

/// d2V/dq2 of the volume V that the surface of a body with nonlinear modes encloses, r x r, m^3.
MatX volume_curvature(const ReducedBody& body);

/// The last shapes of a body and their corrections; a copy of the body has them, too. Threads may
/// share it.
class KeptShapes {
 public:
  struct Entry {
    std::shared_ptr<const Archetype> archetype;
    const SurfaceRung* rung;
    VecX q;
    ShapeCorrection shape;
  };

  KeptShapes() = default;
  KeptShapes(const KeptShapes& other) noexcept;
  KeptShapes& operator=(const KeptShapes& other) noexcept;

  std::shared_ptr<const Entry> find(const ReducedBody& body, const VecX& q) const;  // null: none
  void keep(std::shared_ptr<const Entry> entry) const;

 private:
  mutable std::mutex lock_;
  mutable std::shared_ptr<const Entry> last_, before_;
};

}  // namespace archetide
