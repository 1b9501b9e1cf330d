#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Flow through a face beyond open * u, m/s: what the pressure solve moves there and u does not
/// show.
struct FaceFlow {
  int axis;
  std::size_t face;  // index in the component's array
  double beyond;
};

/// Water that `u` carries through the open part of every face within dt, out of the cell on one
/// side and into that on the other: residual (per cell, dx^3) loses the net outflow. What each face
/// lets through is wet as far as the water that comes through in dt was at the start, when phi held
/// (means over points of time; the face is taken back as a square). The sum over cells changes by
/// round-off only. Returns what has left through open sides of the tank, m^3.
double take_outflow(const Grid& g, const MacField& u, double dt, const Array3<double>& phi,
                    const FaceField<double>& open, const std::vector<FaceFlow>& beyond,
                    const Sides& open_side, Array3<double>& residual);

}  // namespace archetide
