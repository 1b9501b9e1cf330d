#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Water that a cell should hold is what the level set shows there, `held` (dx^3), and `residual`,
/// what the level set has lost (or gained: negative). Their sum changes by what flows (see
/// take_outflow) and by nothing else: moving, measuring and continuing phi only shifts water
/// between the two. The residual is carried by the flow until the surface nearby takes it up.

/// Open fraction of cell n = (i, j, k) times its wet fraction, dx^3.
double held_by_surface(const Grid& g, const Array3<double>& phi, const Array3<double>& solid, int i,
                       int j, int k, std::size_t n);

/// held = held_by_surface of every cell; residual gives what held takes.
void measure_held(const Grid& g, const Array3<double>& phi, const Array3<double>& solid,
                  Array3<double>& held, Array3<double>& residual);

/// The flow u takes the residual along for dt: forward traces, distributed to the open cells around
/// the end. Deep in the water what is small stays where it is. Cells that a solid fills give theirs
/// to open ones beside them.
void carry_residual(const Grid& g, const MacField& u, double dt, const Array3<double>& phi,
                    const Array3<double>& solid, Array3<double>& residual);

/// Residual out of the surface's reach comes nearer by a cell, along the axis that gravity is
/// nearest to, unless a solid is in the way: what is left in the air falls; what is too much or too
/// little in the water (the solve's tolerance, and what bodies sweep) and has not been taken up
/// rises.
void bring_to_surface(const Grid& g, const Array3<double>& phi, const Vec3& gravity,
                      const Array3<double>& solid, Array3<double>& residual);

/// Moves the surface where residual lies nearby, so that it takes it up (docs/method.md, V5):
/// phi -= s, s the residual of the cells within 2 cells (within 12, for what finds no surface
/// there) over the area of the surface that shares it, both smoothed by the same symmetric kernel,
/// so that nothing is lost. Goes through open faces only.
class SurfaceRefit {
 public:
  /// Returns the volume that the surface took up and gave, both counted, m^3.
  double refit(const Grid& g, const Array3<double>& solid, const FaceField<double>& open,
               Array3<double>& phi, Array3<double>& held, Array3<double>& residual);

 private:
  void collect(const Grid& g, const FaceField<double>& open, const Array3<double>& phi,
               const Array3<double>& solid);
  void smooth(std::vector<double>& f, int passes, bool reversed);
  void smooth_both(std::vector<double>& f, int passes);
  double pass(const Grid& g, const Array3<double>& solid, int passes, Array3<double>& phi,
              Array3<double>& held, Array3<double>& residual);

  Array3<int> number_;                        // of each cell in the list; -1
  std::vector<int> cells_;                    // around the surface, ascending
  std::vector<int> beside_[6];                // of each, the cell behind an open face, or itself
  std::vector<double> area_, share_, spare_;  // work space
};

}  // namespace archetide
