#include "tests/support/coupled_scene.h"

#include <cmath>
#include <random>

#include "runtime/coupling/hydrostatic_force.h"
#include "runtime/cut_cells/voxel_faces.h"
#include "tests/support/constants.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

std::shared_ptr<const Archetype> body_archetype(const CoupledSceneOptions& o, double radius) {
  const double density = kWaterDensity * o.density_ratio;
  if (o.modes == 0) return rigid_surface_archetype(volume_true_sphere(3, radius), density);
  SyntheticOptions synthetic;
  synthetic.r = o.modes;
  synthetic.density = density;
  synthetic.first_omega = o.first_omega;
  const TetMesh blob = blob_tets(1, radius * Vec3(2.0, 1.6, 1.4), Vec3i(5, 4, 4));
  return deformable_archetype(blob, synthetic).archetype;
}

// Open fractions of the tank with these solids in it, top open.
FaceField<double> open_fractions(const Grid& g, const SolidFractions& solids, const Sides& open) {
  FaceField<double> w(g, 1.0);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < w[a].size(); ++n) {
      const double fraction = 1.0 - solids.face[a][n];
      w[a][n] = fraction < 1e-9 ? 0.0 : fraction;
    }
  close_sides(g, open, w);
  return w;
}

}  // namespace

CoupledScene::CoupledScene(const CoupledSceneOptions& o) : dt(o.dt) {
  grid.nx = o.cells[0], grid.ny = o.cells[1], grid.nz = o.cells[2];
  grid.dx = 1.0 / grid.nz;
  const Vec3 size = grid.high();
  phi.resize(grid.nx, grid.ny, grid.nz);
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const Vec3 x = grid.cell_centre(i, j, k);
        const double wave = std::sin(7.0 * x[0] + 0.3) * std::cos(5.0 * x[1] + 1.0);
        phi(i, j, k) = x[2] - o.fill - 0.03 * wave;
      }
  // Some smooth motion that is not free of divergence.
  u_star.resize(grid, 0.0);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < u_star[a].nz(); ++k)
      for (int j = 0; j < u_star[a].ny(); ++j)
        for (int i = 0; i < u_star[a].nx(); ++i) {
          const Vec3 x = grid.face_centre(a, i, j, k).cwiseQuotient(size);
          u_star[a](i, j, k) = 0.3 * std::sin(9.0 * x[a] + 5.0 * x[(a + 1) % 3] + a);
        }
  valid.resize(grid, 0);
  place_bodies(o);
}

// On a lattice in plan, turned at random, alternately deep and afloat.
void CoupledScene::place_bodies(const CoupledSceneOptions& o) {
  const Vec3 size = grid.high();
  SolidFractions solids;
  solids.face.resize(grid, 0.0);
  solids.cell.resize(grid.nx, grid.ny, grid.nz, 0.0);
  const Sides open_side{false, false, false, false, false, true};
  Hydrostatics hydrostatics;
  hydrostatics.density = kWaterDensity;
  hydrostatics.reference = Vec3(0, 0, o.fill);
  const int columns =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(o.bodies * size[0] / size[1]))));
  const int lines = (o.bodies + columns - 1) / columns;
  if (o.bodies > 0) {
    radius = std::min({0.28 * size[0] / columns, 0.28 * size[1] / lines, 0.22 * o.fill});
    const auto archetype = body_archetype(o, radius);
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (int b = 0; b < o.bodies; ++b) {
      reduced.push_back(make_body(archetype, o.modes));
      const double depth = b % 2 ? 0.45 * o.fill : 0.95 * o.fill;
      reduced.back().position = Vec3(size[0] * (b % columns + 0.5 + 0.05 * std::sin(b)) / columns,
                                     size[1] * (b / columns + 0.5) / lines, depth);
      Quat turn;
      turn.coeffs() << normal(random), normal(random), normal(random), normal(random);
      reduced.back().rotation = turn.normalized();
    }
  }
  std::vector<BodySurface> surfaces;
  std::vector<VoxelBody> voxels;
  std::vector<DualFaces> faces(reduced.size());
  std::vector<DualFaces*> solid_faces;
  bodies.resize(reduced.size());
  for (std::size_t b = 0; b < reduced.size(); ++b) {
    surfaces.push_back(body_surface(reduced[b], ModalMass::kExact));
    solid_faces.push_back(&faces[b]);
    if (o.geometry == Geometry::kCutCell)
      bodies[b].flux = cut_body(grid, surfaces[b], solids, faces[b]);
    else
      voxels.push_back(voxel_body(grid, surfaces[b], solids));
  }
  open = open_fractions(grid, solids, open_side);
  assemble_pressure_system(grid, {&phi, nullptr, 0.0}, open, open_side, hydrostatics, solid_faces,
                           system);

  for (std::size_t b = 0; b < reduced.size(); ++b) {
    CoupledBody& body = bodies[b];
    VecX force = hydrostatic_force(grid, surfaces[b], surfaces[b].points, system);
    force.head<3>() += reduced[b].archetype->integrals.mass * hydrostatics.gravity;
    const FreeMotion motion = free_motion(reduced[b], current_configuration(reduced[b]), force, dt,
                                          Stage::kVelocityFull, {});
    // At rest, so that water moving with the body has no momentum.
    const MatX H = motion.H.dense();
    MatX carried;
    VecX momentum = VecX::Zero(reduced[b].dofs());
    if (o.geometry == Geometry::kCutCell) {
      const PlacedInnerFlow inner(inner_flow(*reduced[b].archetype), surfaces[b]);
      carried = carried_water(grid, faces[b], kWaterDensity, inner, body.flux);
      bound_carried_water(H, carried);
    } else {
      VoxelCoupling v = voxel_coupling(grid, voxels[b], reduced[b].dofs(), kWaterDensity, u_star,
                                       system.matrix.kind);
      body.flux = std::move(v.flux);
      carried = std::move(v.fluid_mass);
      momentum = std::move(v.fluid_momentum);
    }
    const Eigen::LDLT<MatX> factor(H + carried);
    body.y_star = factor.solve(H * motion.y_star + momentum);
    body.inverse_mass = factor.solve(MatX::Identity(H.rows(), H.cols()));
  }
}

CoupledScene::Result CoupledScene::solve(CoupledSolver& solver, const CoupledSolveOptions& options,
                                         const ConstrainedInverse* rows) const {
  Result result{{}, bodies, u_star, Array3<double>(grid.nx, grid.ny, grid.nz, 0.0)};
  FaceField<unsigned char> flags = valid;
  result.report = solver.solve(grid, system, dt, result.bodies, options, result.u, flags,
                               result.pressure, rows);
  return result;
}

}  // namespace archetide
