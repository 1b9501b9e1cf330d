#pragma once

#include <optional>
#include <string>

#include "precompute/meshing/tetrahedralize.h"
#include "precompute/modal/modes.h"

namespace archetide {

/// Dry and wet modes of elastic bodies with known frequencies.

struct ElasticCase {
  std::string name;
  const TriMesh& surface;
  int order = 2, target = 1000, count = 10;
  double poisson = 0.3;
  std::optional<MassKind> mass = {};
  StaticLoads loads = {};
};
inline Material material_of(const ElasticCase& c) { return {1000.0, 1e6, c.poisson}; }

struct ElasticResult {
  TetrahedralizeResult body;  // moved to its centre of mass
  ModesResult modes;
  Profile profile;                         // of the modes, wall seconds
  double mesh_cpu = 0.0, modes_cpu = 0.0;  // s
  VecX omega() const { return modes.omega2.cwiseSqrt(); }
};
ElasticResult elastic_modes(const ElasticCase& c);

/// Free elastic sphere of radius 1 (Lamb), Poisson 0.3 or 0.45: omega of T2 (5), S2 (5), S1 (3), T3
/// (7), rad/s.
VecX lamb_sphere(const Material& m);

/// Largest relative deviation of the first `count` from `exact`.
double worst_deviation(const VecX& omega, const VecX& exact, int count);

/// Free bar 20 x 1 x 1 (Poisson 0.3): Timoshenko's first four bending frequencies, each twice;
/// omega / exact - 1 of them.
inline constexpr int kBarModes = 9;  // the torsional mode is the seventh
Eigen::Vector4d bar_bending_errors(const VecX& omega, const Material& m);

/// Tip stretch over half length of a free rod 20 x 1 x 1 with its first axial mode alone, spun
/// about its middle at W = kl / (l sqrt(rho / E)) and at rest in its frame. `kl` gets the final
/// value.
double spinning_rod_stretch(const ElasticResult& bar, const Material& m, double& kl);

}  // namespace archetide
