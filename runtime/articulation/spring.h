#pragma once

#include <functional>
#include <vector>

#include "runtime/articulation/joint.h"

namespace archetide {

/// A damped spring, or a rope, between a point of a body and one of another body or in space.
struct Spring {
  int a = -1, b = -1;            // indices of bodies of modes; b = -1: the world
  AttachedPoint at_a, at_b;      // at_b: not for the world
  Vec3 at_world = Vec3::Zero();  // m
  double stiffness = 0.0;        // N/m
  double damping = 0.0;          // N s/m
  double length = 0.0;           // without force, m
  bool slack = false;            // a rope: it only pulls
};

/// Without force as the bodies stand. `rest_a`: in the rest frame of a; `end`: in that of b, or in
/// space.
Spring make_spring(const std::vector<ReducedBody>& bodies, int a, int b, const Vec3& rest_a,
                   const Vec3& end);

/// Body number b where the springs are to be evaluated, with its velocities.
using PlacedBody = std::function<ReducedBody(int)>;

/// Adds J^T f of both ends (S8d) to the generalised forces, 6 + r, of the bodies.
void add_spring_force(const Spring& spring, const PlacedBody& placed, ModalMass mass,
                      std::vector<VecX>& force);

/// The longest step in which the explicit force of the spring is stable, with a margin, s; `dt`: the
/// step that is intended, for which modes are implicit.
double stable_spring_step(const Spring& spring, const PlacedBody& placed, const ModalOptions& modal,
                          double dt);

}  // namespace archetide
