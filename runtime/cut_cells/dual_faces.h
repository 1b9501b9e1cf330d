#pragma once

#include <vector>

#include "runtime/cut_cells/body_flux.h"
#include "runtime/cut_cells/inner_flow.h"
#include "runtime/numerics/poisson_matrix.h"

namespace archetide {

/// An opening below this is round-off of overlapping fractions: the face is closed.
constexpr double kSliver = 1e-9;

/// Kinetic energy of the water in the dual cell of a face beside a solid (volumes in dx^3; a: axis
/// of the face, u: its velocity, w: its open fraction, y: the body's generalised velocity, v = V +
/// S x + T x x: the potential flow inside the body that y goes with, InnerFlow):
///     2 T / (rho dx^3) = e u^2 + s v_a^2 + s (S x)_a^2 + 2 s (T x x)_a^2 + (V - w) (Q y)^2,
///     flux = e u + s v_a,   s = kappa dx A / 20,   e = w - s .
/// V is the volume of water in the dual cell. w alone measures it by the midpoint rule, which errs
/// by up to dx^2/6 of the slope's jump where a wall crosses the grid lines at right angles; there
/// the water moves with the wall, at Q y. Where walls are oblique the errors cancel along the wall.
/// s: the sum of u^2 over faces exceeds the integral, averaged over positions of the grid, by
/// dx^2/12 of the integral of (d_i d_j phi)^2, i != j, which is 3/5 of the one over all i, j for
/// any orientation. Around a body that is dx^2/20 of the surface integral of kappa |slip|^2 (slip:
/// jump from v to the water's velocity) and, where v is not uniform, of 2 (S n) . slip less the
/// integral of S : S inside (harmonic phi, Green's identity), together as much as kappa |S x|^2 for
/// a sphere of whatever S, kappa (n - 1) |v_n|^2 for the part of degree n of v. By this the added
/// mass is too small; water of mass s that moves at v makes up for it. (A sphere of 4 cells radius
/// that changes its shape at degree 2: 6 % of the added mass, 2.6 % of it when water moved with
/// translations alone.)
struct DualFace {
  int axis;
  Vec3i face;        // index of the MAC face
  int low, high;     // columns of BodyFlux of the cells on its low and high side; -1 without body
  bool closed;       // the body covers the whole face
  double volume;     // V - w by this body alone, dx^3
  double curvature;  // kappa dx A / 20, dx^3
  double n_over_A;   // n_a / A of the vector area, 1/dx^2; 0 where a face has no one normal
  // Set by share_dual_faces: the water reaches this face, and s.
  bool wet = false;
  double slip = 0.0;  // dx^3
};

/// Lessens s to at most a tenth of the body's volume (dx^3) along each axis: the expansion that it
/// stems from ends where a body's radius of curvature is about a cell; a sphere of 1.3 cells radius
/// and larger ones keep all of it.
void bound_slip(double volume, std::vector<DualFace>& faces);

/// Takes w in `weight` to e on faces between cells with an unknown; s is at most w / 4. The faces
/// are those of one surface, each once.
void share_dual_faces(const Array3<CellKind>& kind, const FaceField<double>& open,
                      std::vector<DualFace>& faces, FaceField<double>& weight);

/// Adds the flux s v_a to F and returns the mass of the water that moves with the body, sum rho
/// dx^3 (s v_a^2 + s (S x + sqrt(2) T x x)_a^2 + (V - w) (Q y)^2), (6 + r) x (6 + r), kg.
/// Symmetric; V - w has either sign.
MatX carried_water(const Grid& g, const std::vector<DualFace>& faces, double density,
                   const PlacedInnerFlow& inner, BodyFlux& flux);

/// Takes what is negative off the carried water so far that four fifths of H are left everywhere:
/// H + carried is positive definite and A hardly worse conditioned for bodies however
/// light. A sphere of 4 cells per radius keeps all of it: a rigid one heavier than 0.03 of the
/// water, a soft one heavier than 0.42 (quadratic modes; at 0.5 the least eigenvalue is -0.17).
void bound_carried_water(const MatX& H, MatX& carried);

}  // namespace archetide
