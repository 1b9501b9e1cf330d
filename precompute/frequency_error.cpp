#include "precompute/frequency_error.h"

#include <algorithm>
#include <cmath>

#include "common/base/input_error.h"

namespace archetide {
namespace {

constexpr double kCoarser[] = {4.0, 2.5};  // times fewer tets; a thin part may not have so few
constexpr double kLeastRatio = 1.5;  // of the tets of both meshes, or the difference says little
constexpr double kLooseResidual = 1e-4;  // of modes whose frequencies only are wanted

/// From a mesh with `coarser` times fewer tets; empty when none passes the quality gate.
VecX errors_from(const Recipe& recipe, const TriMesh& surface, const VecX& omega2, int tets,
                 double coarser) {
  try {
    TetrahedralizeOptions mesher = recipe.tet;
    mesher.target = std::max(100, int(tets / coarser));
    TetMesh mesh = tetrahedralize(surface, mesher).mesh;
    const double ratio = double(tets) / double(mesh.tets.size());
    if (ratio < kLeastRatio) return {};
    const MaterialField in_place =
        find_materials(recipe.material, recipe.material_regions, mesh, Vec3::Zero());
    move_to_centre_of_mass(mesh, in_place);
    ModesOptions options = recipe.modes;
    options.count = int(omega2.size());
    options.whole_clusters = options.sturm_check = false;
    options.loads = {};
    options.nonlinear = false;
    options.residual = kLooseResidual;
    Profile unused;
    const VecX coarse = compute_modes(mesh, in_place, options, unused).omega2;
    const double growth = std::pow(ratio, 2.0 * recipe.tet.order / 3.0) - 1.0;
    return ((coarse.array() / omega2.array()).sqrt() - 1.0) / growth;
  } catch (const Error&) {  // too coarse for this shape
    return {};
  }
}

}  // namespace

VecX estimate_frequency_errors(const Recipe& recipe, const TriMesh& surface, const VecX& omega2,
                               int tets, Profile& profile) {
  const ScopedTimer timer(profile, "estimate");
  for (const double coarser : kCoarser) {
    VecX errors = errors_from(recipe, surface, omega2, tets, coarser);
    if (errors.size() > 0) return errors;
  }
  return {};
}

}  // namespace archetide
