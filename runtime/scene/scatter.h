#pragma once

#include <vector>

#include "common/mesh/tri_mesh.h"
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
/// bounding balls overlap neither each other nor `occupied`, which grows by them; centres inside of
/// `within`, if there is one. `radii` (m): bounding radii that the instances have in turn, from the
/// `first` on. Throws InputError when they do not fit.
std::vector<Placement> scatter_places(const ScatterSpec& scatter, const std::vector<double>& radii,
                                      std::size_t first, const TriMesh* within,
                                      std::vector<OccupiedBall>& occupied);

}  // namespace archetide
