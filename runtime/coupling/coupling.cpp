#include "runtime/coupling/coupling.h"

#include <algorithm>
#include <utility>

#include "common/check.h"
#include "runtime/coupling/displaced_push.h"
#include "runtime/coupling/hydrostatic_force.h"
#include "runtime/grid/state_fields.h"

namespace archetide {
namespace {

double stage_seconds(Stage stage, double dt) {
  return stage == Stage::kPositionHalf ? 0.5 * dt : dt;
}

}  // namespace

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

void Coupling::set_tank(const Grid& g, const Sides& open_side) {
  options_.grid = g;
  options_.open_side = open_side;
  if (g.cells() == 0) return;  // no tank: nothing to couple
  obstacle_faces_.clear();
  obstacles_.face.resize(g, 0.0);
  obstacles_.cell.resize(g.nx, g.ny, g.nz, 0.0);
  for (const TriMesh& m : obstacle_surfaces_) {
    if (options_.geometry == Geometry::kCutCell) {
      obstacle_faces_.push_back(add_solid_fractions(g, m.vertices, m.triangles, obstacles_));
    } else
      add_voxel_fractions(cells_inside(g, m.vertices, m.triangles), obstacles_);
  }
  obstacle_walls_ = wall_faces(obstacles_);
  open_.resize(g, 1.0);
  solids_ = obstacles_;
  cut_.clear();
  open_box(whole_box(g));
  valid_.set_layers(g.nz, 0);
  for (auto& p : pressure_) p.set_layers(g.nz, 0.0);
}

// What solids leave open of the faces in a box.
void Coupling::open_box(const CellBox& box) {
  for (int a = 0; a < 3; ++a) {
    const double* solid = solids_.face[a].data();
    double* open = open_[a].data();
    for_each_row(open_[a], box, [&](std::size_t first, std::size_t last) {
#pragma omp simd
      for (std::size_t n = first; n < last; ++n) {
        const double w = 1.0 - solid[n];
        open[n] = w < kSliver ? 0.0 : w > 1.0 ? 1.0 : w;
      }
    });
  }
  changed_.push_back(box);
}

// Bodies cut few of the cells: the others stay as the obstacles leave them.
void Coupling::forget_bodies() {
  for (const CellBox& box : cut_) {
    copy_box(obstacles_.face, box, solids_.face);
    copy_box(obstacles_.cell, box, solids_.cell);
  }
}

void Coupling::update_geometry(const std::vector<StageBody>& bodies) {
  const Grid& g = options_.grid;
  forget_bodies();
  const std::vector<CellBox> before = std::exchange(cut_, {});
  surfaces_.clear();
  voxels_.clear();
  faces_.resize(bodies.size());
  fluxes_.assign(bodies.size(), {});
  skinned_ = skinned_bodies(bodies.size(), skins_);
  for (const StageBody& b : bodies)
    surfaces_.push_back(body_surface(b.met ? *b.met : *b.body, options_.modal.mass));
  std::vector<std::size_t> bare;  // bodies that the water meets themselves
  std::vector<const BodySurface*> bare_surfaces;
  std::vector<DualFaces*> bare_faces;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    if (skinned_[n]) continue;
    cut_.push_back(cell_box(g, surfaces_[n].points));
    bare.push_back(n), bare_surfaces.push_back(&surfaces_[n]), bare_faces.push_back(&faces_[n]);
    if (options_.geometry == Geometry::kVoxel)
      voxels_.push_back(voxel_body(g, surfaces_[n], solids_));
  }
  if (options_.geometry == Geometry::kCutCell) {
    std::vector<BodyFlux> fluxes = cut_bodies(g, bare_surfaces, bare_faces, solids_);
    for (std::size_t m = 0; m < bare.size(); ++m) fluxes_[bare[m]] = std::move(fluxes[m]);
  }
  skin_points_.resize(skins_.size());
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    const auto body_of = [&](int b) -> const ReducedBody& { return *surfaces_[b].body; };
    skin_points(skins_[s], body_of, skin_points_[s]);
    cut_.push_back(cell_box(g, skin_points_[s]));
    std::vector<BodyFlux> of_members =
        cut_skin(g, wet_surface(skins_[s], surfaces_, skin_points_[s]), solids_);
    for (std::size_t m = 0; m < of_members.size(); ++m)
      fluxes_[skins_[s].bodies[m]] = std::move(of_members[m]);
  }
  for (const CellBox& box : before) open_box(box);
  for (const CellBox& box : cut_) open_box(box);
  close_sides(g, options_.open_side, open_);
}

void Coupling::prepare_geometry(const std::vector<StageBody>& bodies) {
  if (!wet()) return;
  update_geometry(bodies);
  geometry_is_prepared_ = true;
}

// Hydrostatic part of the water's pressure on every body.
std::vector<VecX> Coupling::hydrostatic_loads(const std::vector<StageBody>& bodies) const {
  std::vector<VecX> loads(bodies.size());
  const auto read_at = [&](std::size_t b) {
    return bodies[b].read_points.empty() ? &surfaces_[b].points : &bodies[b].read_points;
  };
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (!wet())
      loads[b] = VecX::Zero(bodies[b].body->dofs());
    else if (!skinned_[b])
      loads[b] = hydrostatic_force(options_.grid, surfaces_[b], *read_at(b), system_);
  if (!wet()) return loads;
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    std::vector<const std::vector<Vec3>*> own;
    for (const int b : skins_[s].bodies) own.push_back(read_at(b));
    std::vector<Vec3> read = skin_points_[s];
    move_with_members(skins_[s], surfaces_, own, read);
    const std::vector<VecX> of_members = hydrostatic_forces(
        options_.grid, wet_surface(skins_[s], surfaces_, skin_points_[s]), read, own, system_);
    for (std::size_t m = 0; m < of_members.size(); ++m) loads[skins_[s].bodies[m]] = of_members[m];
  }
  return loads;
}

// Where the water meets bodies and skins in the position stage.
void Coupling::remember_places() {
  half_way_.clear();
  for (const BodySurface& s : surfaces_) half_way_.push_back(s.points);
  skins_half_way_ = skin_points_;
}

// What the bodies owe to the water that they displaced since the position stage.
std::vector<VecX> Coupling::displaced_pushes(const FreeSurface& surface, double dt) const {
  const Grid& g = options_.grid;
  const double density = options_.hydrostatics.density;
  std::vector<VecX> impulses(surfaces_.size());
  for (std::size_t b = 0; b < surfaces_.size(); ++b)
    impulses[b] = skinned_[b] ? VecX::Zero(surfaces_[b].body->dofs())
                              : displaced_push(g, wet_surface(surfaces_[b]), half_way_[b], surface,
                                               density, dt)[0];
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    const std::vector<VecX> of_members =
        displaced_push(g, wet_surface(skins_[s], surfaces_, skin_points_[s]), skins_half_way_[s],
                       surface, density, dt);
    for (std::size_t m = 0; m < of_members.size(); ++m)
      impulses[skins_[s].bodies[m]] = of_members[m];
  }
  return impulses;
}

// Made once for each archetype.
const InnerFlow& Coupling::inner_flow_of(const Archetype& archetype) {
  const auto [at, fresh] = inner_flows_.try_emplace(&archetype);
  if (fresh) at->second = inner_flow(archetype);
  return at->second;
}

// Uncoupled motion of one body under its weight and the hydrostatic part `hydro` of the water's
// pressure, its F and H^-1.
void Coupling::start_body(Stage stage, double dt, std::size_t b, const StageBody& in,
                          const VecX& hydro, const MacField& u, CoupledBody& c, StageResult& out) {
  const ReducedBody& body = *in.body;
  const double h = stage_seconds(stage, dt);
  VecX weight = VecX::Zero(body.dofs());
  weight.head<3>() = body_mass(body) * options_.hydrostatics.gravity;
  VecX force = weight + hydro;
  if (in.actuation.size() > 0) force.tail(body.r) += in.actuation;
  out.motion = free_motion(body, in.at, force, dt, stage, options_.modal);
  out.delta_P = h * force.head<3>();
  out.delta_L = h * force.segment<3>(3);
  out.water_impulse = h * hydro;
  out.contacts = in.held;
  if (stage == Stage::kPositionHalf && in.near_wall) {
    WallContactOptions walls = options_.walls;
    walls.dt = dt;
    out.contacts = reachable_wall_contacts(body, out.motion, dt, walls);
  }

  c.y_star = out.motion.y_star;
  c.inverse_mass = out.motion.H.inverse();
  if (!wet()) return;
  // Eqs. 42 and 44: (H + M) y = H y* + momentum of the water M that moves with the body: the dual
  // cells W β⁻¹ Wᵀ of the paper, or what the open fractions leave beside the wall.
  const MatX H = out.motion.H.dense();
  MatX& carried = carried_[b];
  if (skinned_[b]) {
    c.flux = std::move(fluxes_[b]);
    carried = MatX::Zero(body.dofs(), body.dofs());
    return;
  }
  VecX momentum;
  if (options_.geometry == Geometry::kCutCell) {
    c.flux = std::move(fluxes_[b]);
    carried = carried_water(options_.grid, faces_[b], options_.hydrostatics.density,
                            PlacedInnerFlow(inner_flow_of(*body.archetype), surfaces_[b]), c.flux);
    bound_carried_water(H, carried);
    momentum = carried * carried_velocity_[b];
  } else {
    VoxelCoupling v = voxel_coupling(options_.grid, voxels_[b], body.dofs(),
                                     options_.hydrostatics.density, u, system_.matrix.kind);
    c.flux = std::move(v.flux);
    carried = std::move(v.fluid_mass);
    momentum = std::move(v.fluid_momentum);
  }
  const Eigen::LDLT<MatX> factor(H + carried);
  c.y_star = factor.solve(H * c.y_star + momentum);
  c.inverse_mass = factor.solve(MatX::Identity(body.dofs(), body.dofs()));
}

// The coupled solve with bodies held at walls. A wall may push but not pull: the points that press
// are found again from the solution's pressure, and the solve repeated until they do not change.
SolveReport Coupling::solve_held(Stage stage, double dt, const std::vector<StageBody>& bodies,
                                 MacField& u, std::vector<CoupledBody>& coupled,
                                 std::vector<StageResult>& results) {
  struct Unheld {
    VecX y_star;
    MatX inverse_mass;
  };
  std::vector<Unheld> unheld;
  for (const CoupledBody& c : coupled) unheld.push_back({c.y_star, c.inverse_mass});
  const std::size_t n = bodies.size();
  std::vector<MatX> rows(n), tangents(n);
  std::vector<std::vector<int>> pressing(n);
  bool any = false;
  for (std::size_t b = 0; b < n; ++b) {
    const StageContacts& contacts = results[b].contacts;
    if (contacts.points.empty()) continue;
    const ReducedBody& body = *bodies[b].body;
    const ConfigurationTerms here =
        configuration_terms(body, current_configuration(body), options_.modal.mass);
    rows[b] = contact_rows(body, here, contacts.points);
    tangents[b] = tangent_rows(body, here, contacts.points);
    pressing[b] = pressing_rows(results[b].motion.H, rows[b], unheld[b].y_star, contacts.target);
    any = true;
  }
  const bool again = any && wet();
  CoupledSolveOptions trial = options_.solve;
  if (again) trial.tolerance = std::max(trial.tolerance, kTrialTolerance);
  Array3<double>& pressure = pressure_[stage == Stage::kVelocityFull];
  SolveReport total;
  constexpr int kMaxRounds = 5;
  for (int round = 0; round < kMaxRounds; ++round) {
    for (std::size_t b = 0; b < n; ++b) {
      if (rows[b].rows() == 0) continue;
      const ConstrainedMass held(unheld[b].inverse_mass, rows[b](pressing[b], Eigen::all),
                                 results[b].contacts.target(pressing[b]));
      coupled[b].inverse_mass = held.inverse();
      coupled[b].y_star = held.project(unheld[b].y_star);
    }
    total.add(solver_.find_pressure(options_.grid, system_, stage_seconds(stage, dt), coupled,
                                    round == 0 ? trial : options_.solve, u, pressure, nullptr,
                                    round > 0));
    bool changed = false;
    for (std::size_t b = 0; b < n; ++b) {
      if (rows[b].rows() == 0) continue;
      const VecX y_free = unheld[b].y_star + unheld[b].inverse_mass * coupled[b].impulse;
      auto now = pressing_rows(results[b].motion.H, rows[b], y_free, results[b].contacts.target);
      changed = changed || now != pressing[b];
      pressing[b] = std::move(now);
    }
    if (!again || (round > 0 && !changed)) break;
  }
  solver_.move_water(options_.grid, system_, stage_seconds(stage, dt), pressure, u, valid_);

  // Friction, and what the last round did not settle, on the body alone.
  for (std::size_t b = 0; b < n; ++b) {
    if (rows[b].rows() == 0) continue;
    coupled[b].y = unheld[b].y_star + unheld[b].inverse_mass * coupled[b].impulse;
    push_apart(results[b].motion.H, rows[b], tangents[b], results[b].contacts.target,
               options_.walls.friction, coupled[b].y);
  }
  return total;
}

// Eq. 41: on constraint faces the water moves with the body.
void Coupling::set_constraint_faces(const std::vector<CoupledBody>& coupled, MacField& u) {
  for (std::size_t b = 0; b < voxels_.size(); ++b)
    for (const ConstraintFace& f : voxels_[b].faces)
      if (system_.matrix.kind(f.outer[0], f.outer[1], f.outer[2]) == CellKind::kUnknown) {
        u[f.axis](f.face[0], f.face[1], f.face[2]) = f.Q.dot(coupled[b].y);
        valid_[f.axis](f.face[0], f.face[1], f.face[2]) = 1;
      }
}

// Of the water that moves with a body at y.
WaterMotion Coupling::carried_motion(std::size_t b, const VecX& y) const {
  const VecX momentum = carried_[b] * y;
  const Vec3 P = momentum.head<3>();
  const Motion motion = {P, momentum.segment<3>(3) + surfaces_[b].centre.cross(P),
                         0.5 * momentum.dot(y)};
  return {motion, motion};
}

// Impulses of the velocity stage, for the budget; `hydrostatic`: on each body, 6 + r, N s.
void Coupling::measure_impulses(double dt, const std::vector<CoupledBody>& coupled,
                                const std::vector<VecX>& hydrostatic) {
  const PressureImpulses pushes =
      pressure_impulses(options_.grid, system_, dt, last_pressure(Stage::kVelocityFull), coupled);
  solid_impulse_ = pushes.solids;
  hydrostatic_impulse_ = pushes.surface;
  const WaterMotion gained = after_ - before_;
  const Motion beyond = gained.held - gained.solved;
  unmatched_impulse_ = {beyond.P, beyond.L};
  unmatched_impulse_ += pushes.bodies;
  for (std::size_t b = 0; b < coupled.size(); ++b) {
    const auto on_body = [&](const VecX& given) {
      return impulse_at(surfaces_[b].centre, given.head<3>(), given.segment<3>(3));
    };
    hydrostatic_impulse_ += on_body(hydrostatic[b]);
    unmatched_impulse_ += on_body(coupled[b].impulse);
  }
}

void Coupling::collect_slip(const std::vector<CoupledBody>& coupled) {
  slip_faces_.clear();
  if (options_.geometry != Geometry::kCutCell) return;
  const Grid& g = options_.grid;
  const auto add = [&](const DualFaces& faces, const auto& speed) {
    for (const DualFace& f : faces)
      if (f.slip != 0.0)
        slip_faces_.push_back(
            {f.axis, open_[f.axis].index(f.face[0], f.face[1], f.face[2]), f.slip, speed(f)});
  };
  for (const DualFaces& faces : obstacle_faces_) add(faces, [](const DualFace&) { return 0.0; });
  VecX whole, strain;
  for (std::size_t b = 0; b < coupled.size(); ++b) {
    if (skinned_[b]) continue;
    const PlacedInnerFlow inner(inner_flow_of(*surfaces_[b].body->archetype), surfaces_[b]);
    add(faces_[b], [&](const DualFace& f) {
      inner.at(g.face_centre(f.axis, f.face[0], f.face[1], f.face[2]), f.axis, whole, strain);
      return whole.dot(coupled[b].y);
    });
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
}

SolveReport Coupling::couple(Stage stage, double dt, const FreeSurface& surface,
                             const std::vector<StageBody>& bodies, MacField& u,
                             std::vector<StageResult>& results, GroupContacts* together,
                             const NarrowFlow& narrow, const Array3<double>* held) {
  const Grid& g = options_.grid;
  if (wet()) {
    if (!std::exchange(geometry_is_prepared_, false)) update_geometry(bodies);
    assemble(surface);
    add_narrow_flow(narrow, open_, u);
  }
  results.assign(bodies.size(), {});
  carried_.assign(bodies.size(), {});
  carried_velocity_.resize(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (carried_velocity_[b].size() == 0) carried_velocity_[b] = VecX::Zero(bodies[b].body->dofs());
  std::vector<CoupledBody> coupled(bodies.size());
  std::vector<VecX> free_velocity(bodies.size());
  const std::vector<VecX> hydro = hydrostatic_loads(bodies);
  const bool displaces = wet() && options_.geometry == Geometry::kCutCell;
  if (displaces && stage == Stage::kPositionHalf) remember_places();
  std::vector<VecX> displaced;
  if (displaces && stage == Stage::kVelocityFull && surface.push)
    displaced = displaced_pushes(surface, dt);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    start_body(stage, dt, b, bodies[b], hydro[b], u, coupled[b], results[b]);
    free_velocity[b] = results[b].motion.y_star;
    if (!displaced.empty()) {
      coupled[b].y_star += coupled[b].inverse_mass * displaced[b];
      results[b].water_impulse += displaced[b];
    }
    if (bodies[b].reaction.size() > 0)
      coupled[b].y_star += coupled[b].inverse_mass * bodies[b].reaction;
  }

  const bool last = wet() && stage == Stage::kVelocityFull;
  if (last) {
    before_ = water_motion(g, system_, held, u);
    if (options_.geometry == Geometry::kCutCell)
      for (std::size_t b = 0; b < bodies.size(); ++b)
        before_ += carried_motion(b, carried_velocity_[b]);
  }

  GroupContacts none;
  const bool tied = together || !joints_.empty();
  const SolveReport report =
      tied ? solve_together(stage, dt, bodies, together ? *together : none, u, coupled, results)
           : solve_held(stage, dt, bodies, u, coupled, results);
  if (wet()) {
    set_constraint_faces(coupled, u);
    collect_slip(coupled);
  }
  if (last) {
    after_ = water_motion(g, system_, held, u);
    if (options_.geometry == Geometry::kCutCell)
      for (std::size_t b = 0; b < bodies.size(); ++b) after_ += carried_motion(b, coupled[b].y);
    std::vector<VecX> still;  // without p'
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      still.push_back(dt * hydro[b]);
      if (!displaced.empty()) still[b] += displaced[b];
    }
    measure_impulses(dt, coupled, still);
  }

  // Eq. 40: what the body received beyond its forces is H (y - y*): dynamic pressure, the water
  // carried with it, walls, contacts and joints. Without water these last are known as impulses,
  // equal and opposite to the last digit.
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    StageResult& out = results[b];
    out.y = coupled[b].y;
    if (wet() && options_.geometry == Geometry::kCutCell) {
      const VecX momentum = carried_[b] * out.y;
      out.water_impulse -= momentum - carried_[b] * carried_velocity_[b];
    }
    if (stage == Stage::kVelocityFull && report.converged) carried_velocity_[b] = out.y;
    VecX f;
    if (out.reaction.size() > 0 && !wet()) {
      f = out.reaction;
      if (bodies[b].reaction.size() > 0) f += bodies[b].reaction;
    } else {
      f = out.motion.H.apply(out.y - free_velocity[b]);
    }
    out.delta_P += f.head<3>();
    out.delta_L += f.segment<3>(3);
    out.water_impulse += coupled[b].impulse;
  }
  if (stage == Stage::kVelocityFull || !report.converged)
    divergence_ = wet() ? max_divergence(g, system_, u, coupled, &divergent_cell_) : 0.0;
  return report;
}

void Coupling::visit_state(StateArchive& a) {
  a.field("coupling/carried_velocity", carried_velocity_);
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
