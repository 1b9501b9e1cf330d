#pragma once

#include <cstdint>
#include <vector>

#include "runtime/cut_cells/body_flux.h"

namespace archetide {

/// A face inside an obstacle, next to its surface: velocities that are continued into the obstacle
/// must not carry water through its wall.
struct WallFace {
  int axis = 0;
  Vec3i face;   // index of the MAC face
  Vec3 normal;  // of the wall, unit
};

/// The faces that obstacles cover and beside which their surface is. The normal is that of
/// the solid fractions of the cells around.
std::vector<WallFace> wall_faces(const SolidFractions& obstacles);

/// Takes from u on these faces what goes along the wall's normal: u_a - n_a (n . u).
void keep_behind_walls(const std::vector<WallFace>& walls, MacField& u);

}  // namespace archetide
