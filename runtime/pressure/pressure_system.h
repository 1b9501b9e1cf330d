#pragma once

#include "runtime/cut_cells/cell_box.h"
#include "runtime/cut_cells/dual_faces.h"
#include "runtime/grid/grid.h"
#include "runtime/numerics/poisson_matrix.h"

namespace archetide {

/// Gravity and the point where dynamic and total pressure agree: p' = p - rho g . (x - x_ref). g is
/// a vector, so the free surface carries p' = -rho g . (x_I - x_ref) (docs/method.md, C1).
struct Hydrostatics {
  double density = 1000.0;           // kg/m^3
  Vec3 gravity = Vec3(0, 0, -9.81);  // m/s^2
  Vec3 reference = Vec3::Zero();     // x_ref, m

  /// p' of the free surface at x, divided by rho, m^2/s^2.
  double surface_value(const Vec3& x) const { return -gravity.dot(x - reference); }
};

/// How far back in the step, in steps, surface and bodies are read for their hydrostatic pressure.
/// 1/2 leaves oscillations undamped, 1/2 - c takes c/2 (w dt)^2 of one of frequency w in a step
/// [D38].
constexpr double kReadBack = 0.495;

/// The free surface as the pressure sees it. The interface may be read earlier in the step: its
/// points are moved back by shift * carrier (half a step makes the restoring force second order in
/// time and neutral; 0: where it stands).
struct FreeSurface {
  const Array3<double>* phi = nullptr;  // cells, m; continued into solids
  const MacField* carrier = nullptr;    // velocity that moved the interface, m/s; may be null
  double shift = 0.0;                   // s
  const MacField* push = nullptr;       // push_seconds grad p' / rho, m/s; may be null
  double push_seconds = 0.0;            // s
  // Accelerations above this, m/s^2, are an impact's: there nothing is moved back (see
  // carried_pressure).
  double usual_acceleration = 0.0;
  Sides water_beyond{};       // open sides beyond which is water of pressure ..
  Vec3 level = Vec3::Zero();  // .. 0 at the height of this place, m
};

/// What the interface at x carries in p' / rho because it stood elsewhere earlier in the step,
/// m^2/s^2: (g + grad p' / rho) . (the way that it is moved back), the total pressure at x at the
/// time when it was there. In impacts, where grad p' / rho is 1 to 2 times the usual acceleration,
/// it fades out: it feeds on itself there.
double carried_pressure(const Grid& g, const FreeSurface& surface, const Vec3& gravity,
                        const Vec3& x);

/// What is known of a row of cells along x without testing each: no solid cuts any of them or their
/// neighbours' faces, and all are air, or water; of an inner one those around are water as well.
enum class RowKind : unsigned char { kMixed, kAir, kWater, kInner };

/// The water part of the coupled system at one configuration, in units that make the matrix
/// dimensionless: the unknown is phi = dt p' / (rho dx), m/s, and u = u* - difference(phi) / theta
/// on every open face.
struct PressureSystem {
  FreeSurface surface;
  Hydrostatics hydrostatics;
  const FaceField<double>* open = nullptr;  // w; matrix.w is e, which differs beside solids
  PoissonMatrix matrix;
  Array3<double> surface_rhs;           // per cell, sum over Dirichlet faces of w/theta (p'_I/rho -
                                        // surface_mean), m^2/s^2
  Array3<double> surface_weight;        // per cell, sum over Dirichlet faces of w/theta
  std::vector<std::size_t> at_surface;  // cells that may have such terms; 0 elsewhere
  double surface_mean = 0.0;            // mean over Dirichlet faces of p'_I / rho, m^2/s^2
  bool meets_air = false;               // whether there are Dirichlet faces
  std::size_t unknowns = 0;
  std::vector<RowKind> rows;  // of the last assembly, (j, k), j fastest; the next one builds on it

  RowKind row(int j, int k) const {
    return rows[static_cast<std::size_t>(j) + static_cast<std::size_t>(matrix.ny) * k];
  }
};

/// The point at which phi decides whether a cell is wet: its centre, moved towards its openings by
/// half a cell times its solid fraction. Beside a body the centre may lie inside the solid [D36].
struct WetPoint {
  Vec3 x;      // m
  double phi;  // m
};
WetPoint wet_point(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                   const Vec3i& cell);

/// A face between water and a prescribed value: the interface crosses the segment of wet points at
/// theta.
struct SurfaceFace {
  double theta;  // clamped to [kThetaMin, 1], cells
  double value;  // p'_I / rho, m^2/s^2 (at the unclamped crossing)
};
constexpr double kThetaMin = 1e-3;
/// Pressure at the surface: [GFCK02].
SurfaceFace surface_face(const Grid& g, const FreeSurface& surface, const FaceField<double>& open,
                         const Hydrostatics& hydrostatics, const Vec3i& water_cell, int axis,
                         int sign);

/// Its theta alone, which costs less.
double surface_theta(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                     const Vec3i& water_cell, int axis, int sign);

/// Classifies cells (water where phi < 0 at the wet point and some face is open) and fills the
/// system. `open` are the open area fractions of all faces, 0 on closed sides of the tank (kept by
/// address). `solids`: faces beside each solid, which this function assigns to cells. `changed`:
/// where `open` is not what it was in the last call for this system; null: anywhere. Eq. 23. The
/// variational form beside solids: [BBB07].
void assemble_pressure_system(const Grid& g, const FreeSurface& surface,
                              const FaceField<double>& open, const Sides& open_side,
                              const Hydrostatics& hydrostatics,
                              const std::vector<DualFaces*>& solids, PressureSystem& system,
                              const std::vector<CellBox>* changed = nullptr);

}  // namespace archetide
