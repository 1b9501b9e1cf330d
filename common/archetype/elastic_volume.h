#pragma once

#include "common/archetype/elastic_cubature.h"

namespace archetide {

/// Volume J(q) = sum_p w_p det F_p that the points of an elastic energy have in a pose, m^3, with its
/// derivatives: what that energy resists.
struct ElasticVolume {
  double value = 0.0;
  VecX rate;  // r, dJ/dq
};
ElasticVolume elastic_volume(const ElasticCubature& elastic, const VecX& q);
MatX elastic_volume_curvature(const ElasticCubature& elastic, const VecX& q);  // r x r, d2J/dq2

}  // namespace archetide
