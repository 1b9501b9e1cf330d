#pragma once

#include <memory>
#include <string>
#include <vector>

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Where the forces of an actuator point before they are balanced.
struct ActuationDirection {
  enum class Kind { kNormal, kRadial, kInward, kVector };
  Kind kind = Kind::kNormal;   // surface normals; away from, or to, the middle of the points
  Vec3 vector = Vec3::Zero();  // kVector: rest frame, any length but 0
};

/// Forces on points of a body, fixed in its rest frame, that drive its modes but never its motion
/// as a whole (Section 7). Per newton of amplitude, which the points share evenly.
struct ActuationPattern {
  std::vector<int> vertices;   // of the surface
  std::vector<Vec3> force;     // one per vertex, 1
  VecX modal;                  // r, sum phi_i . f, m; of a body of nodes 3 n, f, 1
  Vec3 torque = Vec3::Zero();  // sum x x f of the rest shape, m; 0 when the points are balanced
  MatX torque_of_modes;        // 3 x r, sum phi_i x f, m per unit q
  double kept = 1.0;           // share of the forces (2-norm) that balancing has left; 0: nothing
};

/// `balanced`: the forces lose the part that is a rigid motion of the points (least change in the
/// 2-norm), so that they have no resultant and no torque at rest. Otherwise the whole body resists,
/// each particle by its mass, which is what the projection B^T f means. `nodes`: of bodies of nodes;
/// null: of modes.
ActuationPattern actuation_pattern(const Archetype& archetype, const std::vector<int>& vertices,
                                   const ActuationDirection& direction, bool balanced,
                                   const NodalSpace* nodes = nullptr);

/// A pattern on one body, sine in time.
struct Actuator {
  int body = -1;
  std::shared_ptr<const ActuationPattern> pattern;
  double amplitude = 0.0;              // N, of all points together
  double period = 1.0;                 // s
  double phase = 0.0;                  // rad
  double start = 0.0, end = INFINITY;  // s

  /// amplitude sin(2 pi (t - start) / period + phase) from start to end, else 0, N.
  double force_at(double t) const;
};

/// B^T f, r, N m: what the actuator does to the modes of a body at configuration `at`. Its share in
/// P and L is zero by construction: the torque that deformation gives the forces is resisted by
/// the body's inertia.
VecX modal_force(const Actuator& actuator, double t, const ReducedBody& body,
                 const Configuration& at, const ConfigurationTerms& terms);

/// The same of all actuators at time t (s), per body; empty: none. Bodies that have not appeared
/// yet are left out. Both stages of a step evaluate it at the middle of the step: with the
/// trapezoidal rule the first then gives the modes (q̇ⁿ + q̇ⁿ⁺¹)/2, and work done is energy gained.
std::vector<VecX> modal_forces(const std::vector<Actuator>& actuators, double t,
                               const std::vector<ReducedBody>& bodies,
                               const std::vector<Configuration>& at, ModalMass mass);

}  // namespace archetide
