#include "runtime/coupling/coupling.h"

#include <algorithm>
#include <utility>

#include <Eigen/LU>

#include "common/base/check.h"
#include "runtime/grid/state_fields.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

Coupling::Coupling(const CouplingOptions& options, const std::vector<TriMesh>& obstacles,
                   std::vector<Joint> joints, std::vector<SkinnedBodies> skins)
    : options_(options),
      obstacle_surfaces_(obstacles),
      joints_(std::move(joints)),
      skins_(std::move(skins)) {
  ARCHETIDE_CHECK(skins_.empty() || options_.geometry == Geometry::kCutCell);
  options_.solve.warm_start = true;
  const Grid& g = options_.grid;
  valid_.resize(Grid{g.nx, g.ny, 0, g.dx, g.origin}, 0);
  for (auto& p : pressure_) p.resize(g.nx, g.ny, 0, 0.0);
  set_tank(g, options.open_side);
}

// Made once for each archetype.
const InnerFlow& Coupling::inner_flow_of(const Archetype& archetype) {
  const auto [at, fresh] = inner_flows_.try_emplace(&archetype);
  if (fresh) at->second = inner_flow(archetype);
  return at->second;
}

// Geometry of this configuration, the pressure system in it (Eq. 23), and what the water gives the
// bodies beside p'.
void Coupling::meet_water(Stage stage, double dt, const FreeSurface& surface,
                          const std::vector<StageBody>& bodies) {
  const Known known = std::exchange(known_, Known::kNothing);
  if (known == Known::kLoads) return;
  if (wet()) {
    if (known != Known::kGeometry) update_geometry(bodies);
    assemble(surface);
  }
  loads_ = stage_loads(stage, dt, surface, bodies);
}

namespace {

// What a load of stiffness K has where free_motion() takes it to be read beyond what it has at
// `met`, r: in the first stage both normals and pressure belong to the guess of the middle, in the
// second the normals to the end of the way.
VecX load_at_start(Stage stage, const StageBody& in, const ReducedBody& met,
                   const HydrostaticStiffness& K) {
  if (stage == Stage::kPositionHalf) return K.whole * (met.q - in.body->q);
  return K.of_normals * (met.q - in.at.q);
}

}  // namespace

// Uncoupled motion of one body under its weight and the hydrostatic part of the water's pressure
// (S7).
void Coupling::move_freely(Stage stage, double dt, std::size_t b, const StageBody& in,
                           const Loads& loads, StageResult& out) const {
  const ReducedBody& body = *in.body;
  const double h = stage_seconds(stage, dt);
  VecX weight = VecX::Zero(body.dofs());
  weight.head<3>() = body_mass(body) * options_.hydrostatics.gravity;
  VecX hydro = loads.hydrostatic[b];
  const HydrostaticStiffness& K = loads.stiffness[b];
  if (!K.whole.empty()) hydro.tail(body.r) += load_at_start(stage, in, *surfaces_[b].body, K);
  VecX force = weight + hydro;
  if (in.drive.size() > 0) force += in.drive;
  out.motion = free_motion(body, in.at, force, dt, stage, options_.modal, K.whole);
  out.delta_P = h * force.head<3>();
  out.delta_L = h * force.segment<3>(3);
  out.water_impulse = h * hydro;
  out.contacts = in.held;
  if (stage == Stage::kPositionHalf && in.near_wall) {
    WallContactOptions walls = options_.walls;
    walls.dt = dt;
    out.contacts = reachable_wall_contacts(body, out.motion, dt, walls);
  }
}

// Cut cells: F of the body, with the flux that the water carried beside it pushes, and the mass of
// that water; H: of the reduced velocity of the body.
MatX Coupling::water_beside(std::size_t b, const MatX& H, CoupledBody& c) {
  const InnerFlow& inner = inner_flow_of(*surfaces_[b].body->archetype);
  c.flux = fluxes_[b];  // another couple() may need them
  MatX carried = carried_water(options_.grid, faces_[b], options_.hydrostatics.density,
                               PlacedInnerFlow(inner, surfaces_[b]), c.flux);
  if (!surfaces_[b].body->prescribed) bound_carried_water(H, carried);
  return carried;
}

// Eqs. 42 and 44: (H + M) y = H y* + momentum of the water M that moves with the body: the dual
// cells W β⁻¹ Wᵀ of the paper, or what the open fractions leave beside the wall. F of the body.
// Eq. C9.
void Coupling::add_carried_water(std::size_t b, const MatX& H, const MacField& u, CoupledBody& c) {
  const Eigen::Index dofs = H.rows();
  const double density = options_.hydrostatics.density;
  MatX& carried = carried_[b];
  if (skinned_[b]) {
    c.flux = fluxes_[b];
    carried = MatX::Zero(dofs, dofs);
    return;
  }
  VecX momentum;
  if (options_.geometry == Geometry::kCutCell) {
    carried = water_beside(b, H, c);
    momentum = carried * carried_velocity_[b];
  } else {
    VoxelCoupling v = voxel_coupling(options_.grid, voxels_[b], static_cast<int>(dofs), density, u,
                                     system_.matrix.kind);
    c.flux = std::move(v.flux);
    carried = std::move(v.fluid_mass);
    momentum = std::move(v.fluid_momentum);
  }
  if (surfaces_[b].body->prescribed) return;
  const Eigen::LDLT<MatX> factor(H + carried);
  c.y_star = factor.solve(H * c.y_star + momentum);
  c.inverse_mass = factor.solve(MatX::Identity(dofs, dofs));
}

// The same of a body of nodes. Cut cells: the water follows its reduced velocity, and so adds few
// columns to its mass [D56]. Voxels: a column for each face.
void Coupling::add_water_of_nodes(std::size_t b, const MacField& u, NodalInverse& inverse,
                                  CoupledBody& c) {
  const NodalSpace& space = inverse.space();
  if (options_.geometry == Geometry::kCutCell) {
    carried_[b] = water_beside(b, inverse.block().inverse(), c);
    inverse.add_reduced(carried_[b]);
    const VecX gained = carried_[b] * (carried_velocity_[b] - space.reduced_velocity(c.y_star));
    c.y_star += inverse.solve_reduced(gained);
    return;
  }
  NodalVoxelCoupling v =
      nodal_voxel_coupling(options_.grid, voxels_[b], surfaces_[b], options_.hydrostatics.density,
                           u, system_.matrix.kind);
  c.flux = std::move(v.flux);
  inverse.add(v.Q, v.b * MatX::Identity(v.Q.cols(), v.Q.cols()));
  const VecX gained = v.momentum - v.b * (v.Q.transpose() * c.y_star);
  c.y_star += inverse.solve(v.Q * gained);
}

void Coupling::start_nodes(std::size_t b, const GeneralisedMass& H, const MacField& u,
                           CoupledBody& c) {
  NodalInverse inverse(H);
  if (wet()) add_water_of_nodes(b, u, inverse, c);
  c.inverse_mass = inverse.block();
  c.nodes =
      std::make_shared<const NodalBody>(wet() ? surfaces_[b].nodes : nullptr, std::move(inverse));
}

// What the solve knows of a body: y*, H^-1 and F.
void Coupling::start_body(Stage stage, double dt, std::size_t b, const StageBody& in,
                          const Loads& loads, const MacField& u, CoupledBody& c, StageResult& out) {
  move_freely(stage, dt, b, in, loads, out);
  c.y_star = out.motion.y_star;
  if (in.returns_flux && wet() && options_.geometry == Geometry::kCutCell)
    c.y_before = generalised_velocity(*in.body, out.motion.terms);
  if (in.body->nodes) {
    start_nodes(b, out.motion.H, u, c);
  } else {
    c.inverse_mass = out.motion.H.inverse();
    if (wet()) add_carried_water(b, out.motion.H.dense(), u, c);
  }
}

// The impulses that the stage begins with.
void Coupling::add_first_impulses(const std::vector<StageBody>& bodies, const Loads& loads,
                                  std::vector<CoupledBody>& coupled,
                                  std::vector<StageResult>& results) {
  if (!loads.displaced.empty()) {
    const std::vector<VecX> moved = answers(coupled, loads.displaced);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      coupled[b].y_star += moved[b];
      results[b].water_impulse += loads.displaced[b];
    }
  }
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (bodies[b].reaction.size() > 0) coupled[b].y_star += coupled[b].answer(bodies[b].reaction);
}

std::vector<CoupledBody> Coupling::start_bodies(Stage stage, double dt,
                                                const std::vector<StageBody>& bodies,
                                                const Loads& loads, const MacField& u,
                                                std::vector<StageResult>& results) {
  results.assign(bodies.size(), {});
  carried_.assign(bodies.size(), {});
  carried_velocity_.resize(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (carried_velocity_[b].size() == 0)
      carried_velocity_[b] = VecX::Zero(reduced_dofs(*bodies[b].body));
  std::vector<CoupledBody> coupled(bodies.size());
  if (wet() && options_.geometry == Geometry::kCutCell)
    for (std::size_t b = 0; b < bodies.size(); ++b)  // made before the threads
      if (!skinned_[b]) inner_flow_of(*bodies[b].body->archetype);
  for_each_large(bodies.size(), [&](std::size_t b) {
    start_body(stage, dt, b, bodies[b], loads, u, coupled[b], results[b]);
  });
  add_first_impulses(bodies, loads, coupled, results);
  return coupled;
}

// Eq. 41: on constraint faces the water moves with the body.
void Coupling::set_constraint_faces(const std::vector<CoupledBody>& coupled, MacField& u) {
  for (std::size_t b = 0; b < voxels_.size(); ++b) {
    const NodalSurface* nodes = surfaces_[b].nodes.get();
    const VecX at_vertices = nodes ? VecX(nodes->velocity(coupled[b].y)) : VecX();
    for (const ConstraintFace& f : voxels_[b].faces)
      if (system_.matrix.kind(f.outer[0], f.outer[1], f.outer[2]) == CellKind::kUnknown) {
        u[f.axis](f.face[0], f.face[1], f.face[2]) =
            nodes ? face_speed(f, surfaces_[b], at_vertices) : f.Q.dot(coupled[b].y);
        valid_[f.axis](f.face[0], f.face[1], f.face[2]) = 1;
      }
  }
}

void Coupling::assemble(const FreeSurface& surface) {
  const Grid& g = options_.grid;
  std::vector<DualFaces*> solids;
  if (options_.geometry == Geometry::kCutCell) {
    for (DualFaces& faces : obstacle_faces_) solids.push_back(&faces);
    for (DualFaces& faces : faces_) solids.push_back(&faces);
  }
  assemble_pressure_system(g, surface, open_, options_.open_side, options_.hydrostatics, solids,
                           system_, &changed_);
  changed_.clear();
  if (!system_.meets_air) refer_to_bodies();
}

// In water that meets no air the constant of the hydrostatic pressure is free. It is 0 in the mean of
// the soft bodies: as a load it would follow their shape in another way than the solve's own pressure
// does, which takes it back [D87].
void Coupling::refer_to_bodies() {
  Vec3 sum = Vec3::Zero();
  double volume = 0.0;
  for (const BodySurface& s : surfaces_) {
    if (s.body->r == 0) continue;
    sum += s.body->archetype->volume * s.centre;
    volume += s.body->archetype->volume;
  }
  if (volume > 0.0) system_.hydrostatics.reference = sum / volume;
}

// Eq. 40: what the body received beyond its forces is H (y - y*): dynamic pressure, the water
// carried with it, walls, contacts and joints. Without water these last are known as impulses,
// equal and opposite to the last digit.
void Coupling::end_body(std::size_t b, const StageBody& in, const CoupledBody& c,
                        StageResult& out) {
  out.y = c.y;
  if (wet() && options_.geometry == Geometry::kCutCell) {
    const VecX momentum = carried_[b] * reduced_velocity(*in.body, out.y);
    out.water_impulse -=
        from_reduced_force(*in.body, momentum - carried_[b] * carried_velocity_[b]);
  }
  VecX f;
  if (out.reaction.size() > 0 && !wet()) {
    f = out.reaction;
    if (in.reaction.size() > 0) f += in.reaction;
  } else {
    f = out.motion.H.apply(out.y - out.motion.y_star);
  }
  out.delta_P += f.head<3>();
  out.delta_L += f.segment<3>(3);
  out.water_impulse += c.impulse;
}

// Eq. 45, with joints Eq. 49, and what walls and contacts hold: velocities of water and bodies.
SolveReport Coupling::solve(Stage stage, double dt, const std::vector<StageBody>& bodies,
                            GroupContacts* together, MacField& u, std::vector<CoupledBody>& coupled,
                            std::vector<StageResult>& results) {
  GroupContacts none;
  const bool at_walls = std::any_of(results.begin(), results.end(), [](const StageResult& body) {
    return !body.contacts.points.empty();
  });
  const SolveReport report =
      together || at_walls || !joints_.empty()
          ? solve_together(stage, dt, bodies, together ? *together : none, u, coupled, results)
          : solver_.solve(options_.grid, system_, stage_seconds(stage, dt), coupled, options_.solve,
                          u, valid_, pressure_[stage == Stage::kVelocityFull]);
  if (wet()) {
    set_constraint_faces(coupled, u);
    collect_slip(coupled);
  }
  return report;
}

SolveReport Coupling::couple(Stage stage, double dt, const FreeSurface& surface,
                             const std::vector<StageBody>& bodies, MacField& u,
                             std::vector<StageResult>& results, GroupContacts* together,
                             const NarrowFlow& narrow, const Array3<double>* held) {
  meet_water(stage, dt, surface, bodies);
  if (wet()) add_narrow_flow(narrow, open_, u);
  std::vector<CoupledBody> coupled = start_bodies(stage, dt, bodies, loads_, u, results);
  measure_before(stage, u, held);

  const SolveReport report = solve(stage, dt, bodies, together, u, coupled, results);
  measure_after(stage, dt, loads_, coupled, u, held);

  const bool ends_step = stage == Stage::kVelocityFull;
  if (!report.converged) forget_guess(stage);
  if (ends_step) solved_velocity_.resize(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    end_body(b, bodies[b], coupled[b], results[b]);
    if (ends_step) solved_velocity_[b] = reduced_velocity(*bodies[b].body, results[b].y);
  }
  if (ends_step || !report.converged)
    divergence_ =
        wet() ? max_divergence(options_.grid, system_, u, coupled, &divergent_cell_) : 0.0;
  return report;
}

void Coupling::accept_velocities() { carried_velocity_ = solved_velocity_; }

void Coupling::visit_state(StateArchive& a, const std::vector<ReducedBody>& bodies) {
  a.field("coupling/carried_velocity", carried_velocity_);
  if (carried_velocity_.size() > bodies.size())
    a.fail("field coupling/carried_velocity is of another number of bodies");
  for (std::size_t b = 0; b < carried_velocity_.size(); ++b)
    if (carried_velocity_[b].size() != 0 && carried_velocity_[b].size() != reduced_dofs(bodies[b]))
      a.fail("field coupling/carried_velocity is of another number of modes");
  if (!wet()) return;
  grid_field(a, "coupling/valid", valid_);
  grid_field(a, "coupling/pressure_position", pressure_[0]);
  grid_field(a, "coupling/pressure_velocity", pressure_[1]);
}

std::size_t Coupling::bytes() const {
  const auto faces = [](const auto& f, std::size_t item) {
    return item * (f[0].size() + f[1].size() + f[2].size());
  };
  const std::size_t cells = options_.grid.cells();
  return solver_.bytes() + faces(obstacles_.face, 8) * 4 + faces(valid_, 1) + cells * (8 * 7 + 1);
}

}  // namespace archetide
