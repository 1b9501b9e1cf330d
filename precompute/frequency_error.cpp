#include "precompute/frequency_error.h"

#include <algorithm>
#include <cmath>

#include "common/input_error.h"

namespace archetide {
namespace {

constexpr int kCoarser = 4;          // times fewer tets
constexpr double kLeastRatio = 2.0;  // of the tets of both meshes, or the difference says little
constexpr double kLooseResidual = 1e-4;  // of modes whose frequencies only are wanted

}  // namespace

VecX estimate_frequency_errors(const Recipe& recipe, const TriMesh& surface, const VecX& omega2,
                               int tets, Profile& profile) {
  const ScopedTimer timer(profile, "estimate");
  try {
    TetrahedralizeOptions mesher = recipe.tet;
    mesher.target = std::max(100, tets / kCoarser);
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
    options.residual = kLooseResidual;
    Profile unused;
    const VecX coarse = compute_modes(mesh, in_place, options, unused).omega2;
    const double growth = std::pow(ratio, 2.0 * recipe.tet.order / 3.0) - 1.0;
    return ((coarse.array() / omega2.array()).sqrt() - 1.0) / growth;
  } catch (const Error&) {  // too coarse for this shape
    return {};
  }
}

}  // namespace archetide
