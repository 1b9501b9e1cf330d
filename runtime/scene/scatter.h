#pragma once

#include <vector>

#include "runtime/scene/scene_spec.h"

namespace archetide {

struct Placement {
  Vec3 position = Vec3::Zero();  // of the centre of mass, m
  Quat rotation = Quat::Identity();
};

/// A ball that other bodies keep out of.
struct OccupiedBall {
  Vec3 centre = Vec3::Zero();  // m
  double radius = 0.0;         // m
};

/// Places for all instances of a scatter, chosen at random (same seed, same places) so that their
/// bounding balls overlap neither each other nor `occupied`, which grows by them. Throws InputError
/// when they do not fit.
std::vector<Placement> scatter_places(const ScatterSpec& scatter, double bounding_radius,
                                      std::vector<OccupiedBall>& occupied);

}  // namespace archetide
