#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Where slopes are believed more easily: faces that solids cut or close (open < 1) between cells whose
/// phi is at most -depth, well under the surface [D91, D97].
struct InSolidsUnderWater {
  const Array3<double>& phi;      // m
  double depth;                   // m
  const FaceField<double>& open;  // of each face, 1
  double wall_speed;              // of the fastest solid, m/s

  bool operator()(int axis, int face) const;
};

/// Continues fields of face velocities from valid faces (valid == 1, of all fields) into invalid
/// ones, layer by layer: every new face takes the mean over its valid face neighbours of the layers
/// before, each continued by its slope in the first two layers (the smaller of the last two slopes,
/// 0 where the last three are not alike) [D23]. In solids under water (null: none are told) beside at
/// least five valid faces in a row, no gap, it is the last slope, at most twice the one before it, 0
/// where they differ in sign; where water that leaves a wall would be the faster the deeper in it,
/// as far as no wall is slower [D95]. On return valid is 1 on
/// the faces that were valid, 1 + l on layer l <= layers, and 0 beyond, where u is set to zero.
void extrapolate_velocity(const std::vector<MacField*>& fields, FaceField<unsigned char>& valid,
                          int layers, const InSolidsUnderWater* solids = nullptr);

/// Continues the free surface into the cells with solid != 0 beside which it stands, up to `layers`
/// cells deep: a sheet of phi along the surface, linear from the open cells next to it. Nothing
/// that was inside the solid has a say, so the sheet cannot move on its own [D30]; its values are
/// within 1.5 dx of those of the open cells beside it [D68]. Returns the mask of the sheet's cells.
/// Cells that would change by less than rounding (1e-9 dx) keep their values.
Array3<unsigned char> continue_surface(const Grid& g, Array3<double>& phi,
                                       const Array3<unsigned char>& solid, int layers);

/// Continues the level set (slope at most 1, |phi| at most band, m) through `layers` layers of the
/// other cells with solid != 0, from the open ones and from the sheet: linearly within a cell of
/// the interface and along it, by a constant away from it, so that deep water stays deep inside, and
/// within 1.5 dx of the open cells beside [D68]. Deeper cells keep their values. An empty mask means
/// no solids.
void extend_level_set(const Grid& g, Array3<double>& phi, const Array3<unsigned char>& solid,
                      int layers, double band, const Array3<unsigned char>& sheet = {});

}  // namespace archetide
