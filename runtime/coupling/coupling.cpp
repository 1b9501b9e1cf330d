#include "runtime/coupling/coupling.h"

#include <algorithm>

#include "runtime/coupling/constraint.h"
#include "runtime/coupling/hydrostatic_force.h"

namespace archetide {
namespace {

double stage_seconds(Stage stage, double dt) { return stage == Stage::kPositionHalf ? 0.5 * dt : dt; }

MatX inverse(const GeneralisedMass& H) {
  MatX inverse = MatX::Zero(H.size(), H.size());
  inverse.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / H.mass);
  inverse.block<3, 3>(3, 3) = H.inertia_inverse;
  const auto r = H.M_hat.rows();
  if (r > 0) inverse.bottomRightCorner(r, r) = H.M_hat_factor.solve(MatX::Identity(r, r));
  return inverse;
}

MatX dense(const GeneralisedMass& H) {
  MatX m = MatX::Zero(H.size(), H.size());
  m.topLeftCorner<3, 3>().diagonal().setConstant(H.mass);
  m.block<3, 3>(3, 3) = H.inertia;
  m.bottomRightCorner(H.M_hat.rows(), H.M_hat.rows()) = H.M_hat;
  return m;
}

}  // namespace

Coupling::Coupling(const CouplingOptions& options, const std::vector<TriMesh>& obstacles)
    : options_(options) {
  const Grid& g = options_.grid;
  obstacles_.face.resize(g, 0.0);
  obstacles_.cell.resize(g.nx, g.ny, g.nz, 0.0);
  for (const TriMesh& m : obstacles) {
    if (options_.geometry == Geometry::kCutCell)
      add_solid_fractions(g, m.vertices, m.triangles, obstacles_);
    else
      add_voxel_fractions(cells_inside(g, m.vertices, m.triangles), obstacles_);
  }
  open_.resize(g, 1.0);
  valid_.resize(g, 0);
  for (auto& p : pressure_) p.resize(g.nx, g.ny, g.nz, 0.0);
}

void Coupling::fill_open_fractions() {
  for (int a = 0; a < 3; ++a) {
    const Array3<double>& solid = solids_.face[a];
    Array3<double>& open = open_[a];
    constexpr double kSliver = 1e-9;  // an opening below this is round-off of overlapping fractions
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t n = 0; n < static_cast<std::ptrdiff_t>(open.size()); ++n) {
      const double w = 1.0 - solid[n];
      open[n] = w < kSliver ? 0.0 : w > 1.0 ? 1.0 : w;
    }
  }
  close_sides(options_.grid, options_.open_side, open_);
}

void Coupling::update_geometry(const std::vector<StageBody>& bodies) {
  const Grid& g = options_.grid;
  solids_ = obstacles_;
  surfaces_.clear();
  fluxes_.clear();
  voxels_.clear();
  for (const StageBody& b : bodies) {
    surfaces_.push_back(body_surface(*b.body, options_.modal.mass));
    if (options_.geometry == Geometry::kCutCell)
      fluxes_.push_back(cut_body(g, surfaces_.back(), solids_));
    else
      voxels_.push_back(voxel_body(g, surfaces_.back(), solids_));
  }
  fill_open_fractions();
}

SolveReport Coupling::couple(Stage stage, double dt, const FreeSurface& surface,
                             const std::vector<StageBody>& bodies, MacField& u,
                             std::vector<StageResult>& results) {
  const Grid& g = options_.grid;
  const double h = stage_seconds(stage, dt), rho = options_.hydrostatics.density;
  const bool wet = options_.has_water && g.cells() > 0;
  if (wet) {
    update_geometry(bodies);
    assemble_pressure_system(g, surface, open_, options_.open_side, options_.hydrostatics, system_);
  }

  // Uncoupled motion under weight and the hydrostatic part of the water's pressure.
  results.resize(bodies.size());
  std::vector<CoupledBody> coupled(bodies.size());
  std::vector<MatX> rows(bodies.size());   // contact rows, m x (6 + r)
  std::vector<MatX> free_mass(bodies.size());
  std::vector<VecX> free_velocity(bodies.size());
  Array3<unsigned char> is_water;
  if (wet && options_.geometry == Geometry::kVoxel) {
    is_water.resize(g.nx, g.ny, g.nz);
    for (std::size_t n = 0; n < is_water.size(); ++n) is_water[n] = system_.matrix.kind[n] == CellKind::kUnknown;
  }
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = *bodies[b].body;
    StageResult& out = results[b];
    VecX weight = VecX::Zero(body.dofs());
    weight.head<3>() = body.mass_scale * body.archetype->integrals.mass * options_.hydrostatics.gravity;
    VecX hydro = VecX::Zero(body.dofs());
    if (wet) {
      const auto& mid = bodies[b].mid_points.empty() ? surfaces_[b].points : bodies[b].mid_points;
      hydro = hydrostatic_force(g, surfaces_[b], mid, system_);
    }
    const VecX force = weight + hydro;
    out.motion = free_motion(body, bodies[b].at, force, dt, stage, options_.modal);
    out.delta_P = h * force.head<3>();
    out.delta_L = h * force.segment<3>(3);
    out.water_impulse = h * hydro;

    CoupledBody& c = coupled[b];
    free_mass[b] = dense(out.motion.H);
    free_velocity[b] = out.motion.y_star;
    c.y_star = out.motion.y_star;
    c.inverse_mass = inverse(out.motion.H);
    if (wet && options_.geometry == Geometry::kVoxel) {
      // (H + Q^T b Q) y = H y* + Q^T b u*: the paper's faces carry their dual cell's water with the body.
      VoxelCoupling v = voxel_coupling(g, voxels_[b], body.dofs(), rho, u, is_water);
      const Eigen::LDLT<MatX> factor(free_mass[b] + v.fluid_mass);
      c.flux = std::move(v.flux);
      c.y_star = factor.solve(free_mass[b] * c.y_star + v.fluid_momentum);
      c.inverse_mass = factor.solve(MatX::Identity(body.dofs(), body.dofs()));
    } else if (wet) {
      c.flux = std::move(fluxes_[b]);
    }
    if (!bodies[b].resting.empty()) {
      // Of the resting points those that the load so far presses on the wall.
      const ConfigurationTerms here =
          configuration_terms(body, current_configuration(body), options_.modal.mass);
      const MatX all = contact_rows(body, here, bodies[b].resting);
      rows[b] = all(pressing_rows(out.motion.H, all, out.motion.y_star), Eigen::all);
    }
  }

  // A wall may push but not pull: rows whose impulse comes out negative are released and the solve repeated.
  const std::vector<CoupledBody> unconstrained = coupled;
  const MacField u_star = std::any_of(rows.begin(), rows.end(), [](const MatX& m) { return m.rows() > 0; }) ? u : MacField();
  SolveReport report;
  report.converged = true;
  constexpr int kMaxRounds = 4;
  for (int round = 0; round < kMaxRounds; ++round) {
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (rows[b].rows() > 0) {
        const ConstrainedInverse held = constrain(unconstrained[b].inverse_mass, rows[b]);
        coupled[b].inverse_mass = held.inverse_mass;
        coupled[b].y_star = held.project(unconstrained[b].y_star);
      }
    if (wet && system_.unknowns > 0) {
      if (round > 0) u = u_star;
      const SolveReport r = solver_.solve(g, system_, h, coupled, options_.solve, u, valid_,
                                          pressure_[stage == Stage::kVelocityFull]);
      report.iterations += r.iterations;
      report.residual = r.residual;
      report.converged = report.converged && r.converged;
      report.setup_seconds += r.setup_seconds;
      report.solve_seconds += r.solve_seconds;
    } else {
      for (CoupledBody& c : coupled) {
        c.y = c.y_star;
        c.impulse = VecX::Zero(c.y.size());
      }
      for (int a = 0; a < 3; ++a) valid_[a].fill(0);
    }
    bool released = false;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      if (rows[b].rows() == 0) continue;
      const VecX without = unconstrained[b].y_star + unconstrained[b].inverse_mass * coupled[b].impulse;
      released |= release_pulling_rows(unconstrained[b].inverse_mass, without, rows[b]);
    }
    if (!released) break;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      if (rows[b].rows() > 0) continue;
      coupled[b].inverse_mass = unconstrained[b].inverse_mass;
      coupled[b].y_star = unconstrained[b].y_star;
    }
  }

  // On the paper's constraint faces the water moves with the body.
  for (std::size_t b = 0; b < voxels_.size() && wet; ++b)
    for (const ConstraintFace& f : voxels_[b].faces)
      if (is_water(f.outer[0], f.outer[1], f.outer[2])) {
        u[f.axis](f.face[0], f.face[1], f.face[2]) = f.Q.dot(coupled[b].y);
        valid_[f.axis](f.face[0], f.face[1], f.face[2]) = 1;
      }

  // What the body received beyond its forces is H (y - y*): dynamic pressure, dual-cell water and wall.
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    StageResult& out = results[b];
    out.y = coupled[b].y;
    const VecX f = free_mass[b] * (out.y - free_velocity[b]);
    out.delta_P += f.head<3>();
    out.delta_L += f.segment<3>(3);
    out.water_impulse += coupled[b].impulse;
  }
  divergence_ = wet && system_.unknowns > 0 ? max_divergence(g, system_, u, coupled) : 0.0;
  return report;
}

std::size_t Coupling::bytes() const {
  const auto faces = [](const auto& f, std::size_t item) {
    return item * (f[0].size() + f[1].size() + f[2].size());
  };
  const std::size_t cells = options_.grid.cells();
  return solver_.bytes() + faces(obstacles_.face, 8) * 4 + faces(valid_, 1) + cells * (8 * 7 + 1);
}

}  // namespace archetide
