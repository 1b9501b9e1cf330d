#include "runtime/water_step.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <utility>

#include "common/base/check.h"
#include "runtime/fluid/advection.h"
#include "runtime/fluid/air_extension.h"
#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/extrapolation.h"
#include "runtime/fluid/level_set.h"
#include "runtime/fluid/markers.h"
#include "runtime/fluid/particle_level_set.h"
#include "runtime/fluid/spray.h"
#include "runtime/fluid/time_splitting.h"
#include "runtime/grid/state_fields.h"
#include "runtime/numerics/largest.h"
#include "runtime/statistics.h"

namespace archetide {
namespace {

// How much faster the velocity that carries the surface may become in the air where it is made free
// of divergence, by the fastest of a cell: gaps that close squeeze their air out fast [D24].
constexpr double kMostSpeedup = 3.0;

// Cells whose larger part is solid: phi is continued into them, particles die there.
void mark_solid_cells(const SolidFractions& solids, Array3<unsigned char>& mask) {
  const Array3<double>& cell = solids.cell;
  if (mask.size() != cell.size()) mask.resize(cell.nx(), cell.ny(), cell.nz());
  const double* solid = cell.data();
  unsigned char* marks = mask.data();
#pragma omp parallel for simd schedule(static)
  for (std::size_t n = 0; n < cell.size(); ++n) marks[n] = solid[n] > 0.5;
}

// Marks a face by its two cells, each of which is marked where phi < level; a side of the tank has
// one.
template <class Join>
void mark_faces(const Grid& g, const Array3<double>& phi, double level, const Join& join,
                FaceField<unsigned char>& marked) {
  if (marked[0].size() == 0) marked.resize(g, 0);
  Array3<unsigned char> cells(g.nx, g.ny, g.nz, Unfilled{});
  const double* values = phi.data();
  unsigned char* marks = cells.data();
#pragma omp parallel for simd schedule(static)
  for (std::size_t n = 0; n < phi.size(); ++n) marks[n] = values[n] < level;
  for (int a = 0; a < 3; ++a) {
    Array3<unsigned char>& faces = marked[a];
    const int last[3] = {g.nx - 1, g.ny - 1, g.nz - 1};
#pragma omp parallel for schedule(static)
    for (int k = 0; k < faces.nz(); ++k)
      for (int j = 0; j < faces.ny(); ++j) {
        const bool x = a == 0, y = a == 1, z = a == 2;
        const unsigned char* low = &cells(0, std::max(j - y, 0), std::max(k - z, 0));
        const unsigned char* high = &cells(0, std::min(j, last[1]), std::min(k, last[2]));
        unsigned char* out = &faces(0, j, k);
        const int nx = g.nx;
#pragma omp simd
        for (int i = x; i < nx; ++i) out[i] = join(low[i - x], high[i]);
        if (x) out[0] = high[0], out[nx] = high[nx - 1];
      }
  }
}

// Faces next to cells that may be wet (beside solids a cell is sampled up to half a cell from its
// centre): where the advected velocity is wanted.
void mark_water_faces(const Grid& g, const Array3<double>& phi, FaceField<unsigned char>& target) {
  mark_faces(g, phi, g.dx, std::bit_or<unsigned char>(), target);
}

// Faces of water so far from the surface that it cannot flicker between water and air.
void mark_deep_faces(const Grid& g, const Array3<double>& phi, FaceField<unsigned char>& deep) {
  constexpr double kDeep = 2.0;  // dx
  mark_faces(g, phi, -kDeep * g.dx, std::bit_and<unsigned char>(), deep);
}

// Layers from the floor on that hold all water.
int wet_layers(const Array3<double>& phi) {
  const std::size_t layer = static_cast<std::size_t>(phi.nx()) * phi.ny();
  int wet = phi.nz();
  for (bool air = true; air && wet > 0; wet -= air)
    for (std::size_t n = layer * (wet - 1); n < layer * wet && air; ++n) air = phi[n] >= 0.0;
  return wet;
}

// The same that hold all of a residual.
int layers_of(const Array3<double>& residual) {
  const std::size_t layer = static_cast<std::size_t>(residual.nx()) * residual.ny();
  int layers = residual.nz();
  const auto empty = [&](int k) {
    const double* values = residual.data() + layer * k;
    return std::all_of(values, values + layer, [](double r) { return r == 0.0; });
  };
  while (layers > 0 && empty(layers - 1)) --layers;
  return layers;
}

// The same that sources fill, at time t (s) or (NaN) at any.
int layers_of_sources(const Grid& g, const SimulationOptions& options, double t) {
  double top = g.low()[2];
  for (const WaterSource& source : options.sources)
    if (std::isnan(t) || source.pours(t)) top = std::max(top, source.high[2]);
  return std::min(static_cast<int>(std::ceil((top - g.low()[2]) / g.dx)), options.grid.nz);
}

// Layers, in eights and at most `full`, that end above what a step reads and writes of the air: the
// highest water or particle, the way of a step, the layers that velocities are continued by, and
// the stencils around.
int ceiling(const Grid& g, int full, double cfl, const FluidState& fluid, int layers_held = 0) {
  double top = g.low()[2] + g.dx * std::max(wet_layers(fluid.phi), layers_held);
  const std::vector<Vec3>& particles = fluid.particles.position;
#pragma omp parallel for reduction(max : top)
  for (std::size_t t = 0; t < particles.size(); ++t) top = std::max(top, particles[t][2]);
  constexpr int kAround = 8, kEights = 8;
  const int layers = static_cast<int>(std::ceil((top - g.low()[2]) / g.dx)) +
                     2 * static_cast<int>(std::ceil(cfl)) + kAround;
  return std::min((layers + kEights - 1) / kEights * kEights, full);
}

// Root mean square of |v| over the faces with valid == 1, of the three components together, m/s;
// plane by plane, so that threads do not change the sum.
double mean_size(const MacField& v, const FaceField<unsigned char>& valid) {
  double square = 0.0, count = 0.0;
  for (int a = 0; a < 3; ++a) {
    const Array3<double>& field = v[a];
    std::vector<double> squares(field.nz(), 0.0), counts(field.nz(), 0.0);
#pragma omp parallel for schedule(static, 1)
    for (int k = 0; k < field.nz(); ++k) {
      const double* row = &field(0, 0, k);
      const unsigned char* solved = &valid[a](0, 0, k);
      const int size = field.nx() * field.ny();
      double sum = 0.0;
      int faces = 0;
#pragma omp simd reduction(+ : sum, faces)
      for (int n = 0; n < size; ++n) {
        const double here = solved[n] == 1 ? row[n] : 0.0;
        sum += here * here;
        faces += solved[n] == 1;
      }
      squares[k] = sum, counts[k] = faces;
    }
    for (int k = 0; k < field.nz(); ++k) square += squares[k], count += counts[k];
  }
  return count > 0.0 ? std::sqrt(3.0 * square / count) : 0.0;
}

// Flow that the last solve has given faces and that u does not show: through narrow ones, and
// with bodies.
std::vector<FaceFlow> hidden_flow(const Coupling& coupling, const MacField& u) {
  const std::vector<NarrowFace>& narrow = coupling.narrow_faces();
  const std::vector<Coupling::SlipFace>& slip = coupling.slip_faces();
  const auto key = [](const auto& f) { return std::pair(f.axis, f.face); };
  std::vector<NarrowFace> by_face = narrow;
  std::ranges::sort(by_face, {}, key);
  std::vector<FaceFlow> flow;
  for (const NarrowFace& f : narrow)
    flow.push_back({f.axis, f.face, f.open * (f.after - u[f.axis][f.face])});
  flow.resize(narrow.size() + slip.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < slip.size(); ++n) {
    const Coupling::SlipFace& f = slip[n];
    const auto at = std::ranges::lower_bound(by_face, key(f), {}, key);
    const bool is_narrow = at != by_face.end() && key(*at) == key(f);
    const double here = is_narrow ? at->after : u[f.axis][f.face];
    flow[narrow.size() + n] = {f.axis, f.face, f.s * (f.v - here)};
  }
  return flow;
}

// Of the water that moves with solids, by the last solve, m/s.
double fastest_wall(const Coupling& coupling) {
  const std::vector<Coupling::SlipFace>& slip = coupling.slip_faces();
  return largest_of(slip.size(), [&](std::size_t n) { return std::abs(slip[n].v); });
}

// Lists of one thing's properties have one length.
void demand_one_length(const StateArchive& a, const std::string& what,
                       std::initializer_list<std::size_t> sizes) {
  for (const std::size_t size : sizes)
    if (size != *sizes.begin()) a.fail("the lists of " + what + " are not of one length");
}

// Marks faces that solids close, of those that velocities were continued to; the sides of the tank
// are no solids.
void mark_closed_faces(const Grid& g, const FaceField<double>& open,
                       FaceField<unsigned char>& valid) {
  for (int a = 0; a < 3; ++a) {
    const Array3<double>& w = open[a];
    const bool x = a == 0, y = a == 1, z = a == 2;
#pragma omp parallel for schedule(static)
    for (int k = z; k < g.nz; ++k)
      for (int j = y; j < g.ny; ++j) {
        const double* share = &w(0, j, k);
        unsigned char* marks = &valid[a](0, j, k);
#pragma omp simd
        for (int i = x; i < g.nx; ++i)
          marks[i] = (marks[i] != 0) & (share[i] == 0.0) ? kClosedFace : marks[i];
      }
  }
}

void demand_faces(const StateArchive& a, const std::string& name, const MacField& u,
                  const std::vector<signed char>& axis, const std::vector<std::int64_t>& face) {
  for (std::size_t n = 0; n < axis.size(); ++n) {
    const bool there = axis[n] >= 0 && axis[n] < 3 && face[n] >= 0 &&
                       static_cast<std::size_t>(face[n]) < u[axis[n]].size();
    if (!there) a.fail("field " + name + " names a face that the tank has not");
  }
}

void visit_flow(StateArchive& a, const MacField& u, std::vector<FaceFlow>& flow) {
  std::vector<signed char> axis;
  std::vector<std::int64_t> face;
  std::vector<double> beyond;
  for (const FaceFlow& f : flow) {
    axis.push_back(static_cast<signed char>(f.axis));
    face.push_back(static_cast<std::int64_t>(f.face));
    beyond.push_back(f.beyond);
  }
  a.field("water/hidden_axis", axis);
  a.field("water/hidden_face", face);
  a.field("water/hidden_beyond", beyond);
  if (!a.reading()) return;
  demand_one_length(a, "hidden flow", {axis.size(), face.size(), beyond.size()});
  demand_faces(a, "water/hidden_face", u, axis, face);
  flow.clear();
  for (std::size_t n = 0; n < axis.size(); ++n)
    flow.push_back({axis[n], static_cast<std::size_t>(face[n]), beyond[n]});
}

}  // namespace

Grid field_grid(const SimulationOptions& options, const FluidState& initial) {
  Grid g = options.grid;
  if (options.has_water && g.cells() > 0)
    g.nz = ceiling(g, g.nz, options.cfl, initial, layers_of_sources(g, options, NAN));
  return g;
}

WaterStep::WaterStep(const SimulationOptions& options, FluidState initial)
    : options_(options),
      fluid_(std::move(initial)),
      grid_(options.grid),
      open_side_(options.open_side) {
  beyond_.fill(Vec3::Zero());
  fit_ceiling();
}

bool WaterStep::fit_ceiling() {
  if (!present()) return false;
  constexpr int kSpare = 16;  // layers more than needed that stay
  const int full = options_.grid.nz;
  const int wanted =
      ceiling(grid_, full, options_.cfl, fluid_,
              std::max(layers_of(residual_), layers_of_sources(grid_, options_, fluid_.time)));
  if (wanted == grid_.nz || (wanted < grid_.nz && wanted + kSpare > grid_.nz && grid_.nz < full))
    return false;
  set_ceiling(wanted);
  return true;
}

void WaterStep::set_ceiling(int layers) {
  grid_.nz = layers;
  open_side_[kZMax] = options_.open_side[kZMax] || layers < options_.grid.nz;
  fluid_.phi.set_layers(layers, surface_options().band_cells * grid_.dx);
  for (MacField* u : {&fluid_.u, &u_half_, &u_star_, &push_, &carrier_, &u_last_})
    u->set_layers(layers);
  held_.set_layers(layers, 0.0);
  residual_.set_layers(layers, 0.0);
  valid_.set_layers(layers);
  target_.set_layers(layers);
  deep_.set_layers(layers);
}

double WaterStep::top() const { return grid_.low()[2] + grid_.dx * wet_layers(fluid_.phi); }

SurfaceOptions WaterStep::surface_options() const {
  SurfaceOptions s;
  s.particles_per_cell = options_.particles_per_cell;
  s.open_side = air_sides();
  s.air_beyond = air_beyond_;
  return s;
}

// Beyond an open side that the water covers whole there is as much of it as it takes; otherwise air.
void WaterStep::find_air_beyond() {
  const Array3<double>& phi = fluid_.phi;
  const auto is_air = [&](std::size_t n) { return phi[n] >= 0.0 && !solid_cells_[n]; };
  for (int side = 0; side < 6; ++side)
    if (options_.open_side[side])
      for_cells_at_side(grid_, side, [&](Ijk c) {  // a ceiling that was lowered lies in the air
        if (is_air(phi.index(c.i, c.j, c.k))) air_beyond_[side] = true;
      });
  full_ = grid_.nz == options_.grid.nz;
  for (std::size_t n = 0; n < phi.size() && full_; ++n) full_ = !is_air(n);
}

Sides WaterStep::water_beyond() const {
  Sides sides{};
  for (int side = 0; side < 6; ++side) sides[side] = options_.open_side[side] && !air_beyond_[side];
  return sides;
}

// With the ceiling, if that was lowered.
Sides WaterStep::air_sides() const {
  const Sides water = water_beyond();
  Sides sides{};
  for (int side = 0; side < 6; ++side) sides[side] = open_side_[side] && !water[side];
  return sides;
}

void WaterStep::prepare(const Coupling& coupling) {
  const Grid& g = grid_;
  if (fluid_.u[0].size() == 0) fluid_.u.resize(g, 0.0);
  for (MacField* u : {&u_half_, &u_star_, &push_, &carrier_}) u->resize(g, 0.0);
  if (single()) u_last_.resize(g, 0.0);
  valid_.resize(g, 1);
  mark_solid_cells(coupling.solids(), solid_cells_);
  find_air_beyond();
  beyond_ = mean_at_sides(g, fluid_.u);
  prepare_surface(g, fluid_, surface_options(), solid_cells_);
  held_.resize(g.nx, g.ny, g.nz, 0.0);
  residual_.resize(g.nx, g.ny, g.nz, 0.0);
  measure_held(g, fluid_.phi, coupling.solids().cell, held_, residual_);
  residual_.fill(0.0);
  mark_deep_faces(g, fluid_.phi, deep_);
}

bool WaterStep::pours() const {
  return present() && std::ranges::any_of(options_.sources, [&](const WaterSource& source) {
           return source.pours(fluid_.time);
         });
}

// Continues the velocities that sources have set to the faces around. Elsewhere faces that had one
// (marked in `keeps`) keep it: narrow ones, settled after the last continuation, would change it.
// A resumed run does not know how fast walls were: as if they were at rest.
void WaterStep::continue_around_sources(const Coupling& coupling, FaceField<unsigned char> keeps) {
  constexpr int kAround = 3;  // cells
  const MacField kept = fluid_.u;
  for (int a = 0; a < 3; ++a) {
#pragma omp parallel for schedule(static)
    for (std::size_t n = 0; n < valid_[a].size(); ++n) valid_[a][n] = valid_[a][n] == 1;
  }
  extrapolate(coupling, 0.0, {&fluid_.u});
  mark_for_advection(coupling);
  for (const WaterSource& source : options_.sources)
    if (source.pours(fluid_.time)) forget_around(grid_, source, kAround, keeps);
  for (int a = 0; a < 3; ++a) {
#pragma omp parallel for schedule(static)
    for (std::size_t n = 0; n < keeps[a].size(); ++n)
      if (keeps[a][n] != 0) fluid_.u[a][n] = kept[a][n];
  }
}

WaterStep::Poured WaterStep::pour(const Coupling& coupling) {
  Poured poured;
  const Grid& g = grid_;
  std::vector<MacField*> fields = {&fluid_.u, &u_half_};
  if (single()) fields.push_back(&u_last_);
  const double density = options_.water_density;
  const HeldMotion before = held_motion(g, held_, fluid_.u);
  FaceField<unsigned char> had = valid_;  // a velocity
  for (const WaterSource& source : options_.sources) {
    if (!source.pours(fluid_.time)) continue;
    const FilledSource came =
        fill_source(g, source, coupling.solids().cell, fluid_.phi, held_, fields, valid_);
    poured_ += came.volume;
    poured.energy -= density * options_.gravity.dot(came.moment);
  }
  mark_deep_faces(g, fluid_.phi, deep_);
  continue_around_sources(coupling, std::move(had));
  const HeldMotion now = held_motion(g, held_, fluid_.u);
  poured.motion = {density * (now.P - before.P), density * (now.L - before.L),
                   density * (now.kinetic - before.kinetic)};
  poured.energy += poured.motion.kinetic;
  return poured;
}

void WaterStep::place_markers(const std::vector<TriMesh>& obstacles,
                              const std::vector<ReducedBody>& bodies) {
  if (fluid_.markers.empty()) return;
  push_out_ = std::make_unique<PushOut>(obstacles, 0.5 * grid_.dx);
  keep_markers_in_water(bodies);
}

// Continues a velocity, and the push of its solve, from the faces that were solved for.
void WaterStep::extrapolate(const Coupling& coupling, double wall_speed,
                            const std::vector<MacField*>& fields) {
  const int layers = static_cast<int>(std::ceil(options_.cfl)) + 4;
  constexpr double kDeep = 4.0;  // dx
  const InSolidsUnderWater in_solids{fluid_.phi, kDeep * grid_.dx, coupling.open(), wall_speed};
  extrapolate_velocity(fields, valid_, layers, &in_solids);
  for (MacField* u : fields) {
    keep_behind_walls(coupling.obstacle_walls(), *u);
    close_sides(grid_, open_side_, *u);
  }
}

// Of the faces that the last solve is continued to: narrow ones are as good as solved, and those
// that solids close are told apart.
void WaterStep::mark_for_advection(const Coupling& coupling) {
  for (const NarrowFace& f : coupling.narrow_faces()) valid_[f.axis][f.face] = 1;
  mark_closed_faces(grid_, coupling.open(), valid_);
}

// Beside the advection, on the same faces. Returns what it takes, J.
double WaterStep::damp_water(double dt, MacField& u) const {
  if (!options_.damping.any()) return 0.0;
  return options_.water_density * damp(grid_, options_.damping, dt, target_, held_, u);
}

// The largest speed that a step can carry, m/s [D20].
double WaterStep::most_speed(double dt) const {
  const double cells = std::max(options_.cfl, std::min(3.0 * options_.cfl, 10.0));
  return cells * grid_.dx / dt;
}

// Water that outruns the step.
void WaterStep::slow_down(double dt, MacField& u) const {
  if (options_.outrun == 0.0) return;
  const double most = most_speed(dt);
  for (Array3<double>& axis : u.axis) {
#pragma omp parallel for simd schedule(static)
    for (std::size_t n = 0; n < axis.size(); ++n)
      axis.data()[n] = std::min(std::max(axis.data()[n], -most), most);
  }
}

void WaterStep::follow(At expected, At next) {
  ARCHETIDE_CHECK(at_ == expected);
  at_ = next;
}

void WaterStep::start_single() {
  if (!present()) return;
  at_ = At::kHalfSolved;
  u_half_ = fluid_.u;
}

void WaterStep::start_with_given_velocity() {
  at_ = At::kAdvected;
  copy_values(fluid_.u, u_star_);
}

void WaterStep::end_step(double dt) {
  last_dt_ = dt;
  fluid_.time += dt;
}

void WaterStep::visit_clock(StateArchive& a) {
  a.field("time", fluid_.time);
  a.field("last_dt", last_dt_);
}

// Eq. 22 without forces: u_half_ = A(u^n) over dt/2, carried by the velocity a quarter of the step
// ahead; a copy in push_.
void WaterStep::advect_to_half(double dt) {
  if (!present()) return;
  at_ = At::kHalfAdvected;
  const Grid& g = grid_;
  constexpr double kFarthest = 1.0;  // after a much shorter step the difference says little
  const double intervals =
      last_dt_ > 0.0 ? std::min(dt / (2.0 * last_dt_), kFarthest) : 0.0;  // (dt/4) / (last_dt/2)
  continue_in_time(fluid_.u, u_half_, intervals, valid_, carrier_);
  mark_water_faces(g, fluid_.phi, target_);
  advect_velocity(g, carrier_, fluid_.u, 0.5 * dt, valid_, target_, u_half_);
  bring_in_water(g, water_beyond(), beyond_, carrier_, 0.5 * dt, u_half_);
  damp_water(0.5 * dt, u_half_);
  copy_values(u_half_, push_);
}

// Eq. 22: u_star_ for the full-step solve: the second half of the way after the reflection (two
// solves), or all of it (one).
void WaterStep::advect_to_end(double dt) {
  follow(At::kSurfaceMoved, At::kAdvected);
  const Grid& g = grid_;
  mark_water_faces(g, fluid_.phi, target_);
  mark_deep_faces(g, fluid_.phi, deep_);
  if (single()) {
    // The push of the last solve is used as that of a half step.
    const double share = last_dt_ > 0.0 ? dt / (2.0 * last_dt_) : 0.0;
    continue_in_time(fluid_.u, u_last_, share, valid_, carrier_);
    copy_values(fluid_.u, u_last_);
    add_push(push_, -share, valid_, u_half_);
    advect_velocity(g, carrier_, u_half_, dt, valid_, target_, u_star_);
    bring_in_water(g, water_beyond(), beyond_, carrier_, dt, u_star_);
    add_push(push_, share, target_, u_star_);
    drag_energy_ = -damp_water(dt, u_star_);
    take_up_momentum(g, landings_, held_, u_star_);
    copy_values(fluid_.u, u_half_);
    copy_values(u_star_, push_);
    return;
  }
  // Without gravity there is no measure for what an impact is beside a vortex in still water.
  const double usual = options_.gravity.norm() > 0.0 ? usual_acceleration(dt) * 0.5 * dt : 0.0;
  const Reflection reflection = {push_, usual, deep_};
  start_reflection(fluid_.u, 0.5, reflection, valid_, u_half_, carrier_);  // (dt/4) / (dt/2)
  advect_velocity(g, carrier_, u_half_, 0.5 * dt, valid_, target_, u_star_);
  bring_in_water(g, water_beyond(), beyond_, carrier_, 0.5 * dt, u_star_);
  end_reflection(reflection, valid_, target_, u_half_, u_star_);
  drag_energy_ = -2.0 * damp_water(0.5 * dt, u_star_);  // the first half's is like it
  take_up_momentum(g, landings_, held_, u_star_);
}

// Γ = u* − u^{n+1/2}, the push of Eq. 24.
void WaterStep::after_position_solve(double dt, const Coupling& coupling) {
  if (!present()) return;
  follow(At::kHalfAdvected, At::kHalfSolved);
  copy_values(coupling.valid(), valid_);
  slow_down(dt, u_half_);
  add_narrow_flow(narrow_, coupling.open(), push_);
  subtract_solved(u_half_, valid_, push_);
  extrapolate(coupling, fastest_wall(coupling), {&push_, &u_half_});
  mean_push_ = mean_size(push_, valid_);
  narrow_ = settle_before(coupling.narrow_faces(), u_half_, push_);
  mark_for_advection(coupling);
  hidden_ = hidden_flow(coupling, u_half_);
}

void WaterStep::let_flow(double dt, const Coupling& coupling) {
  follow(At::kHalfSolved, At::kFlowBooked);
  const Grid& g = grid_;
  copy_values(u_half_, carrier_);
  make_air_divergence_free(g, fluid_.phi, coupling.open(), coupling.valid(), swept_reach(),
                           kMostSpeedup, carrier_);
  carry_residual(g, carrier_, dt, fluid_.phi, coupling.solids().cell, residual_);
  outflow_ +=
      take_outflow(g, carrier_, dt, fluid_.phi, coupling.open(), hidden_, air_sides(), residual_);
}

void WaterStep::move_surface(double dt, const Coupling& coupling, std::int64_t step) {
  follow(At::kFlowBooked, At::kSurfaceMoved);
  const Grid& g = grid_;
  const Array3<double>& solid = coupling.solids().cell;
  mark_solid_cells(coupling.solids(), solid_cells_);
  std::swap(fluid_.u, carrier_);
  advance_surface(g, fluid_, dt, surface_options(), solid_cells_, step);
  std::swap(fluid_.u, carrier_);
  move_spray(dt, solid);
  measure_held(g, fluid_.phi, solid, held_, residual_);
  const bool particles = fluid_.particles.size() > 0;
  const Array3<double> before = particles ? fluid_.phi : Array3<double>();
  refitted_ += refit_.refit(g, solid, coupling.open(), fluid_.phi, held_, residual_);
  bring_to_surface(g, fluid_.phi, options_.gravity, solid, residual_);
  if (particles) adjust_radii(g, fluid_.phi, before, fluid_.particles);
}

double WaterStep::residual_volume() const {
  return sum_by_plane(residual_) * grid_.dx * grid_.dx * grid_.dx;
}

// Drops come from the residual and return to it.
void WaterStep::move_spray(double dt, const Array3<double>& solid) {
  const SprayEnds ends = fly_spray(options_.grid, options_.open_side, options_.gravity, dt,
                                   fluid_.phi, solid, residual_, fluid_.spray);
  outflow_ += ends.left;
  landings_ = ends.landings;
  if (options_.spray)
    release_spray(grid_, fluid_.phi, u_half_, solid_cells_, options_.particles_per_cell,
                  fluid_.particles, residual_, fluid_.spray);
  release_fragments(grid_, fluid_.phi, u_half_, solid, residual_, fluid_.spray);
}

// With the surface moved by u^n (one solve a step) its waves are neutral where it stands.
FreeSurface WaterStep::surface_now(double dt) const {
  FreeSurface surface = surface_as_it_stands();
  if (!present() || single()) return surface;
  surface.carrier = &u_half_, surface.shift = kReadBack * dt;
  surface.push = &push_, surface.push_seconds = 0.5 * dt;
  surface.usual_acceleration = usual_acceleration(dt);
  return surface;
}

FreeSurface WaterStep::surface_as_it_stands() const {
  FreeSurface surface;
  surface.phi = &fluid_.phi;
  if (full_) surface.water_beyond = water_beyond();
  const Vec3 low = options_.grid.low(), high = options_.grid.high();
  surface.level = (options_.gravity.array() < 0.0).select(high, low);  // the highest corner
  return surface;
}

// What an acceleration is measured by that may be an impact's: gravity, or the mean that the
// half-step solve gave the water; without gravity twice that, which the ends of an oscillating drop
// have.
double WaterStep::usual_acceleration(double dt) const {
  const double mean = mean_push_ / (0.5 * dt), g = options_.gravity.norm();
  return g > 0.0 ? std::max(g, mean) : 2.0 * mean;
}

void WaterStep::after_velocity_solve(double dt, const Coupling& coupling) {
  if (!present()) return;
  follow(At::kAdvected, At::kEnd);
  std::swap(fluid_.u, u_star_);
  copy_values(coupling.valid(), valid_);
  if (options_.outrun > 0.0)
    slowed_energy_ =
        -energy_above(grid_, coupling.system(), held_, valid_, most_speed(dt), fluid_.u);
  slow_down(dt, fluid_.u);
  if (single()) {
    add_narrow_flow(narrow_, coupling.open(), push_);
    subtract_solved(fluid_.u, valid_, push_);
    extrapolate(coupling, fastest_wall(coupling), {&push_, &fluid_.u});
  } else {
    extrapolate(coupling, fastest_wall(coupling), {&fluid_.u});
  }
  narrow_ = settle_after(coupling.narrow_faces(), fluid_.u);
  mark_for_advection(coupling);
  if (single()) hidden_ = hidden_flow(coupling, fluid_.u);
}

void WaterStep::carry_markers(double dt, const std::vector<ReducedBody>& bodies) {
  if (!push_out_) return;
  advect_points(grid_, u_half_, dt, fluid_.markers);
  keep_markers_in_water(bodies);
}

// Trilinear velocities near a body know its sides to a fraction of a cell only.
void WaterStep::keep_markers_in_water(const std::vector<ReducedBody>& bodies) {
  constexpr double kClearance = 0.01;  // from bodies and obstacles, dx
  return_to_water(grid_, fluid_.phi, fluid_.markers);
  push_out_->move_out(bodies, kClearance * grid_.dx, fluid_.markers);
}

void WaterStep::visit_state(StateArchive& a) {
  std::int64_t ceiling = grid_.nz;
  a.field("water/ceiling", ceiling);
  if (ceiling < 1 || ceiling > options_.grid.nz) a.fail("the water stands in another tank");
  if (a.reading()) set_ceiling(static_cast<int>(ceiling));
  std::int64_t air = 0;
  for (int side = 0; side < 6; ++side) air |= std::int64_t{air_beyond_[side]} << side;
  a.field("water/air_beyond", air);
  for (int side = 0; side < 6; ++side) air_beyond_[side] = (air >> side & 1) != 0;
  std::int64_t full = full_ ? 1 : 0;
  a.field("water/full", full);
  full_ = full != 0;
  std::vector<Vec3> beyond(beyond_.begin(), beyond_.end());
  a.field("water/velocity_beyond", beyond);
  if (beyond.size() != beyond_.size()) a.fail("a tank has six sides");
  std::ranges::copy(beyond, beyond_.begin());
  a.field("water/refitted", refitted_);
  a.field("water/outflow", outflow_);
  a.field("water/poured", poured_);
  a.field("water/markers", fluid_.markers);
  a.field("spray/position", fluid_.spray.position);
  a.field("spray/velocity", fluid_.spray.velocity);
  a.field("spray/volume", fluid_.spray.volume);
  a.field("particles/position", fluid_.particles.position);
  a.field("particles/radius", fluid_.particles.radius);
  a.field("particles/sign", fluid_.particles.sign);
  a.field("water/narrow_axis", narrow_.axis);
  a.field("water/narrow_face", narrow_.face);
  a.field("water/narrow_open", narrow_.open);
  a.field("water/narrow_excess", narrow_.excess);
  demand_one_length(
      a, "drops",
      {fluid_.spray.position.size(), fluid_.spray.velocity.size(), fluid_.spray.volume.size()});
  demand_one_length(a, "particles",
                    {fluid_.particles.position.size(), fluid_.particles.radius.size(),
                     fluid_.particles.sign.size()});
  demand_one_length(
      a, "narrow faces",
      {narrow_.axis.size(), narrow_.face.size(), narrow_.open.size(), narrow_.excess.size()});
  demand_faces(a, "water/narrow_face", fluid_.u, narrow_.axis, narrow_.face);
  grid_field(a, "water/phi", fluid_.phi);
  if (a.reading()) mark_deep_faces(grid_, fluid_.phi, deep_);
  grid_field(a, "water/held", held_);
  grid_field(a, "water/residual", residual_);
  grid_field(a, "water/valid", valid_);
  grid_field(a, "water/u", fluid_.u);
  grid_field(a, "water/u_half", u_half_);
  grid_field(a, "water/u_star", u_star_);  // advection leaves it as it is far from the water
  grid_field(a, "water/push", push_);
  if (!single()) return;
  grid_field(a, "water/u_last", u_last_);
  visit_flow(a, fluid_.u, hidden_);
}

void WaterStep::remember(Memory& now) const {
  copy_values(fluid_.phi, now.phi);
  copy_values(fluid_.particles.position, now.particles.position);
  copy_values(fluid_.particles.radius, now.particles.radius);
  copy_values(fluid_.particles.sign, now.particles.sign);
  copy_values(valid_, now.valid);
  now.refitted = refitted_;
  copy_values(held_, now.held);
  copy_values(residual_, now.residual);
  now.outflow = outflow_;
  now.spray = fluid_.spray;
  now.narrow = narrow_;
}

void WaterStep::restore(const Memory& before) {
  fluid_.phi = before.phi;
  fluid_.particles = before.particles;
  fluid_.spray = before.spray;
  narrow_ = before.narrow;
  refitted_ = before.refitted;
  held_ = before.held;
  residual_ = before.residual;
  outflow_ = before.outflow;
  valid_ = before.valid;
  last_dt_ = 0.0;
  mark_deep_faces(grid_, fluid_.phi, deep_);
}

}  // namespace archetide
