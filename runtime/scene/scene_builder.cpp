#include "runtime/scene/scene_builder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "common/archetype/complete_basis.h"
#include "common/archetype/mode_cluster.h"
#include "runtime/cut_cells/resolution.h"
#include "runtime/scene/add_forces.h"
#include "runtime/scene/add_moving_obstacle.h"
#include "runtime/scene/add_skins.h"
#include "runtime/scene/add_wavemaker.h"
#include "runtime/scene/check_placement.h"
#include "runtime/scene/closed_mesh.h"
#include "runtime/scene/initial_water.h"
#include "runtime/scene/place_markers.h"
#include "runtime/scene/scatter.h"
#include "runtime/solid/extent.h"
#include "runtime/solid/rotation.h"

namespace archetide {
namespace {

constexpr double kFarthest = 1e9;  // m, that anything may be away
constexpr double kDensest = 1e9;   // kg/m^3

TriMesh build_obstacle(const StaticSpec& spec, const SimulationOptions& o) {
  TriMesh mesh = read_closed_mesh(spec.mesh);
  for (Vec3& x : mesh.vertices) {
    x = spec.position + spec.rotation * (spec.scale * x);
    if (!(x.norm() < kFarthest))
      throw InputError({{spec.where, "the obstacle reaches farther than a million kilometres",
                         "check its scale and position"}});
  }
  const double thin = o.has_water ? thin_part(o.grid, mesh.vertices, mesh.triangles) : 0.0;
  if (thin > kTooThin)
    throw InputError(
        {{spec.where,
          fmt::format("the obstacle is thinner than a cell over {} % of its surface: water would "
                      "leak through it",
                      static_cast<int>(100.0 * thin)),
          fmt::format("make it at least {:f} m thick, or the cells smaller", o.grid.dx)}});
  return mesh;
}

// A body of nodes at rest in its shape, from one of modes.
void set_nodes_free(const BodySpec& spec, ArchetypeLibrary& library, ReducedBody& body) {
  const Archetype& a = *body.archetype;
  const std::string full = "deformable = \"full\" ";
  if (spec.modes || spec.every_motion)
    throw InputError({{spec.modes_where, full + "frees every node: it has no number of modes",
                       "remove modes, or remove deformable"}});
  if (a.nonlinear() && !a.matrices.empty() && a.matrices.lambda.size() == 0)
    throw InputError({{spec.deformable_where,
                       full + "needs the material of every tet, which archetype " + spec.archetype +
                           " is too old to have",
                       "build it again"}});
  if (a.matrices.empty())
    throw InputError({{spec.deformable_where,
                       full + "needs the mass and the stiffness of the tets, which archetype " +
                           spec.archetype + " does not keep",
                       "set keep = \"tets\" in its body file and build it again"}});
  free_nodes(library.nodes_of(body.archetype), body);
}

// A skin is bound to the modes of its members.
void demand_modes_under_skins(const BodySpec& spec, const SceneSpec& scene) {
  if (!spec.every_node || scene.skins.empty()) return;
  throw InputError(
      {{spec.deformable_where, "bodies with deformable = \"full\" are not possible with [[skin]]",
        "remove [[skin]], or give the body modes instead"}});
}

// Nonlinear bodies have the trapezoidal rule only.
void demand_trapezoid(const BodySpec& spec, const BuiltScene& built) {
  const ReducedBody& body = built.bodies.back();
  if (built.options.modal.step == ModalStep::kTrapezoid || !body.is_nonlinear()) return;
  throw InputError(
      {{spec.where,
        "archetype " + spec.archetype + " is nonlinear, which backward Euler does not advance",
        "remove coupling.modal_step, or set modes.kind = \"linear\" in its body "
        "file"}});
}

// A rigid body needs no tets.
Part part_needed(const BodySpec& spec) { return spec.modes == 0 ? Part::kRuntime : Part::kAll; }

// Once for each archetype.
void note_cluster(const BodySpec& spec, BuiltScene& built) {
  const ReducedBody& body = built.bodies.back();
  if (spec.every_node || !spec.modes || *spec.modes == body.r) return;
  const std::string note = fmt::format(
      "modes: {} takes {}, not {}: the last of them have equal frequencies, and fewer would make "
      "it stiffer in one direction than in another",
      body.archetype->name, body.r, *spec.modes);
  if (std::find(built.notes.begin(), built.notes.end(), note) == built.notes.end())
    built.notes.push_back(note);
}

// Of a body or an obstacle with values of its own.
std::optional<ContactMaterial> contact_of(const ContactSpec& own, const SimulationOptions& o) {
  if (!own.restitution && !own.friction) return std::nullopt;
  return ContactMaterial{own.restitution.value_or(o.restitution),
                         own.friction.value_or(o.friction)};
}

void add_body(const BodySpec& spec, ArchetypeLibrary& library, BuiltScene& built,
              double release = 0.0) {
  const Part part = part_needed(spec);
  built.bodies.push_back(instantiate(spec, library.load(spec.archetype, part)));
  if (spec.every_node) set_nodes_free(spec, library, built.bodies.back());
  demand_trapezoid(spec, built);
  built.bodies.back().contact = contact_of(spec.contact, built.options);
  const Archetype& archetype = *built.bodies.back().archetype;
  built.body_names.push_back(spec.name.empty() ? archetype.name : spec.name);
  built.release.push_back(release);
  note_cluster(spec, built);
}

// The places of a joint in the rest frame of its first body.
std::vector<Vec3> joint_points(const JointSpec& spec, const Archetype& a) {
  constexpr double kLever = 0.1;  // of the bounding radius
  std::vector<Vec3> points = spec.points;
  if (!spec.frame.empty()) {
    const auto frame = std::find_if(a.joint_frames.begin(), a.joint_frames.end(),
                                    [&](const JointFrame& f) { return f.name == spec.frame; });
    if (frame == a.joint_frames.end())
      throw InputError(
          {{spec.frame_where, "archetype " + a.name + " has no joint frame \"" + spec.frame + "\"",
            "name one in its body file ([[joint_frame]]) and build it again"}});
    const double lever = kLever * bounding_radius(a);
    points.push_back(frame->point);
    if (spec.frame_points >= 2) points.emplace_back(frame->point + lever * frame->axes.col(2));
    if (spec.frame_points >= 3) points.emplace_back(frame->point + lever * frame->axes.col(0));
  }
  if (!spec.point_set.empty()) {
    for (const int v : point_set_of(a, spec.point_set, spec.point_set_where))
      points.push_back(a.surface.vertices[v]);
  }
  return points;
}

// A soft body must have material where it is held: its modes are continued from the surface. `tie`: a
// joint or a spring.
void demand_close(const SourceLocation& where, const char* tie, int b,
                  const std::vector<AttachedPoint>& points, const BuiltScene& built) {
  const ReducedBody& body = built.bodies[b];
  if (body.r == 0) return;
  const double reach = bounding_radius(*body.archetype);
  for (const AttachedPoint& p : points)
    if (p.rest.norm() > 1.5 * reach)
      throw InputError(
          {{where,
            fmt::format("a point of the {} is {:f} m from the centre of {}, a soft body that "
                        "reaches {:f} m",
                        tie, p.rest.norm(), built.body_names[b], reach),
            "move the body or the point, or make the body rigid (modes = 0)"}});
}

void add_joint(const JointSpec& spec, BuiltScene& built) {
  if (built.options.scheme == Scheme::kSingle)
    throw InputError({{spec.where, "joints are not possible with step.scheme = \"single\"",
                       "use \"newmark\", two solves a step"}});
  built.joints.push_back(make_joint(built.bodies, spec.a, spec.b,
                                    joint_points(spec, *built.bodies[spec.a].archetype)));
  const Joint& joint = built.joints.back();
  demand_close(spec.where, "joint", joint.a, joint.at_a, built);
  if (joint.b >= 0) demand_close(spec.where, "joint", joint.b, joint.at_b, built);
  built.joint_names.push_back(spec.name);
}

void add_spring(const SpringSpec& spec, BuiltScene& built) {
  for (const int b : {spec.a, spec.b})
    if (b >= 0 && built.bodies[b].nodes)
      throw InputError(
          {{spec.where, built.body_names[b] + " is a body of nodes, which springs cannot hold yet",
            "give it modes instead of deformable = \"full\""}});
  Spring spring = make_spring(built.bodies, spec.a, spec.b, spec.points[0], spec.points[1]);
  spring.stiffness = spec.stiffness, spring.damping = spec.damping;
  spring.length = spec.length.value_or(spring.length);
  spring.slack = spec.slack;
  demand_close(spec.where, "spring", spring.a, {spring.at_a}, built);
  if (spring.b >= 0) demand_close(spec.where, "spring", spring.b, {spring.at_b}, built);
  built.springs.push_back(spring);
}

// Springs whose force asks for many steps a frame, as the bodies begin.
void note_stiff_springs(const SceneSpec& scene, BuiltScene& built) {
  constexpr double kMany = 20.0;  // steps a frame
  const double frame = 1.0 / scene.fps;
  for (const Spring& spring : built.springs) {
    const double step = stable_spring_step(
        spring, [&](int b) { return built.bodies[b]; }, built.options.modal, frame);
    if (step * kMany < frame)
      built.notes.push_back(fmt::format(
          "spring: that between {} and {} asks for steps of {:.1e} s, {:.0f} a frame; a [[joint]], "
          "or less stiffness and damping, is quicker",
          built.body_names[spring.a], spring.b < 0 ? "the world" : built.body_names[spring.b], step,
          frame / step));
  }
}

BoxSpec box_around(const TriMesh& mesh) {
  BoxSpec box{Vec3::Constant(INFINITY), Vec3::Constant(-INFINITY)};
  for (const Vec3& x : mesh.vertices)
    box.low = box.low.cwiseMin(x), box.high = box.high.cwiseMax(x);
  return box;
}

// Waves share the box one after the other: each keeps clear only of itself and of what is placed
// by hand.
void add_scatter(const ScatterSpec& scatter, ArchetypeLibrary& library, BuiltScene& built) {
  std::vector<OccupiedBall> placed;
  for (std::size_t b = 0; b < built.bodies.size(); ++b)
    if (built.release[b] == 0.0)
      placed.push_back({built.bodies[b].position, bounding_radius(*built.bodies[b].archetype)});
  std::vector<double> radii;
  for (const BodySpec& kind : scatter.kinds)
    radii.push_back(bounding_radius(*library.load(kind.archetype, part_needed(kind))));
  ScatterSpec part = scatter;
  std::optional<TriMesh> within;
  if (!scatter.mesh.empty()) {
    within = read_closed_mesh(scatter.mesh);
    part.box = box_around(*within);
  }
  std::size_t instance = 0;
  for (int wave = 0; wave < scatter.waves; ++wave) {
    part.count = scatter.count * (wave + 1) / scatter.waves - scatter.count * wave / scatter.waves;
    part.seed = scatter.seed + static_cast<unsigned>(wave);
    std::vector<OccupiedBall> occupied = placed;
    for (const Placement& place :
         scatter_places(part, radii, instance, within ? &*within : nullptr, occupied)) {
      BodySpec body = scatter.kinds[instance++ % scatter.kinds.size()];
      body.position = place.position;
      body.rotation = place.rotation;
      add_body(body, library, built, wave * scatter.wave_interval);
    }
  }
}

// In the order in which they appear; those that appear together as in the file.
void sort_by_release(BuiltScene& built) {
  std::vector<std::size_t> order(built.bodies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t p, std::size_t q) {
    return built.release[p] < built.release[q];
  });
  const BuiltScene before = built;
  for (std::size_t n = 0; n < order.size(); ++n) {
    built.bodies[n] = before.bodies[order[n]];
    built.body_names[n] = before.body_names[order[n]];
    built.release[n] = before.release[order[n]];
  }
  for (PrescribedBody& told : built.prescribed)
    told.body = static_cast<int>(std::find(order.begin(), order.end(), told.body) - order.begin());
}

}  // namespace

SimulationOptions simulation_options(const SceneSpec& scene) {
  SimulationOptions options;
  options.gravity = scene.gravity;
  if (scene.fluid) {
    options.grid = tank_grid(*scene.fluid);
    options.has_water = has_water(scene.fluid->water) || !scene.sources.empty();
    options.sources = scene.sources;
    options.water_density = scene.fluid->density;
    options.reference_point = scene.fluid->origin;
    options.reference_point[2] = highest_water(*scene.fluid);
    options.open_side = scene.fluid->open;
    options.damping = scene.fluid->damping;
    options.particles_per_cell = scene.fluid->particles_per_cell;
    options.spray = scene.fluid->spray;
  }
  options.wall_contact = scene.fluid.has_value();
  options.body_contact = scene.body_contact;
  options.restitution = scene.restitution;
  options.friction = scene.friction;
  options.geometry = scene.geometry;
  options.tolerance = scene.tolerance;
  options.max_iterations = scene.max_iterations;
  options.modal = scene.modal;
  options.scheme = scene.scheme;
  options.cfl = scene.cfl;
  options.outrun = scene.outrun;
  options.max_dt = scene.max_dt;
  options.on_fail = scene.on_fail;
  return options;
}

namespace {

// The step knows one momentum only, that of the body as a whole.
void demand_no_rigid_motion(const BodySpec& spec, const Archetype& a) {
  constexpr double kRigid = 1e-9;  // of the momentum that a mode of this mass could carry
  const MomentumIntegrals& m = a.integrals;
  for (std::size_t i = 0; i < m.I3.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double linear = m.I3[i].norm() / std::sqrt(m.mass * a.M_r(k, k));
    const double angular = axial(m.A[i]).norm() / std::sqrt(m.Sxx.trace() * a.M_r(k, k));
    if (linear <= kRigid && angular <= kRigid) continue;
    throw InputError(
        {{spec.where,
          fmt::format("mode {} of archetype {} moves or turns the body as a whole ({:f} % of it)",
                      i + 1, spec.archetype, 100.0 * std::max(linear, angular)),
          "take the rigid motions out of its modes, or build it with archetide-precompute"}});
  }
}

void demand_every_motion(const BodySpec& spec, const Archetype& a) {
  if (!spec.every_motion || has_complete_basis(a)) return;
  const int nodes = static_cast<int>(a.tets.nodes.size());
  throw InputError(
      {{spec.modes_where,
        fmt::format("the body asks for every degree of freedom, archetype {} stores {} modes of "
                    "the {} that {} nodes have",
                    spec.archetype, a.r(), elastic_dofs(nodes), nodes),
        "set modes.count = \"full\" in the body file, with few tets (tet.target), and build it "
        "again"}});
}

}  // namespace

int whole_cluster(const Archetype& a, int modes) {
  const auto vibration = static_cast<int>(std::count(a.is_static.begin(), a.is_static.end(), 0));
  if (modes <= 0 || modes >= vibration) return modes;
  int end = modes;
  while (end < vibration && std::sqrt(a.omega2[end] / a.omega2[end - 1]) < 1.0 + kClusterGap) ++end;
  return end;
}

ReducedBody instantiate(const BodySpec& spec, std::shared_ptr<const Archetype> archetype) {
  if (!archetype->clamped.empty())
    throw InputError(
        {{spec.where,
          "archetype " + spec.archetype + " was computed clamped at \"" + archetype->clamped +
              "\": its modes are those of a held body, and bodies " + "in a scene move freely",
          "remove clamped from its body file and build it again"}});
  if (!(spec.density.value_or(0.0) <= kDensest))
    throw InputError({{spec.where, "a density beyond that of any matter",
                       "density is in kg/m^3: 1000 is that of water"}});
  demand_no_rigid_motion(spec, *archetype);
  demand_every_motion(spec, *archetype);
  const int stored = archetype->r();
  if (spec.modes.value_or(0) > stored) {
    throw InputError(
        {{spec.modes_where,
          fmt::format("the body asks for {} modes, archetype {} stores {}", *spec.modes,
                      spec.archetype, stored),
          fmt::format(
              "ask for at most {}, or raise modes.count in the body file and build it again",
              stored)}});
  }
  if (archetype->nonlinear() && spec.modes.value_or(stored) % stored != 0)
    throw InputError({{spec.modes_where, "a nonlinear body uses all of its vectors or none",
                       "leave modes out, or set modes = 0 for a rigid body"}});
  ReducedBody body;
  body.mass_scale = spec.density.value_or(archetype->density) / archetype->density;
  body.archetype = std::move(archetype);
  body.r = whole_cluster(*body.archetype, spec.modes.value_or(stored));
  body.q = VecX::Zero(body.r);
  body.q_dot = VecX::Zero(body.r);
  body.position = spec.position;
  body.rotation = spec.rotation;
  set_velocity(spec.velocity, spec.angular_velocity, body);
  return body;
}

namespace {

/// What the water meets of each body, in cells of this size. Members of a skin keep their own
/// surface: the skin is bound to it, and the water meets the skin.
void choose_rungs(const SceneSpec& scene, BuiltScene& built) {
  const double dx = cell_of_rungs(scene, built.options);
  const std::vector<char> skinned = skinned_bodies(built.bodies.size(), built.skins);
  std::map<const Archetype*, const SurfaceRung*> chosen;
  for (std::size_t b = 0; b < built.bodies.size(); ++b) {
    ReducedBody& body = built.bodies[b];
    if (skinned[b] || body.nodes) continue;
    const auto [at, fresh] = chosen.try_emplace(body.archetype.get(), nullptr);
    if (fresh) at->second = coarsest_rung(body.archetype->ladder, dx);
    body.rung = at->second;
  }
}

/// What weight and impacts will do to the bodies, and a note where linear modes cannot tell.
void forecast(const SceneSpec& scene, BuiltScene& built) {
  built.forecasts = forecast_deformation(scene, built.options, built.bodies);
  for (const DeformationForecast& kind : built.forecasts)
    if (const std::string note = beyond_modes(kind); !note.empty()) built.notes.push_back(note);
  std::set<const Archetype*> told;
  for (const ReducedBody& body : built.bodies)
    if (told.insert(body.archetype.get()).second)
      if (const std::string note = beyond_pressure(body, built.options); !note.empty())
        built.notes.push_back(note);
}

}  // namespace

BuiltScene build_scene(const SceneSpec& scene, ArchetypeLibrary& library) {
  library.require_all(scene);
  BuiltScene built;
  built.options = simulation_options(scene);
  std::vector<Diagnostic> bad;
  const auto collect = [&bad](const auto& build) {
    try {
      build();
    } catch (const InputError& error) {
      bad.insert(bad.end(), error.diagnostics.begin(), error.diagnostics.end());
    }
  };
  for (const BodySpec& spec : scene.bodies)
    collect([&] {
      demand_modes_under_skins(spec, scene);
      add_body(spec, library, built);
    });
  if (bad.empty()) collect([&] { add_skins(scene, library, built); });
  for (const ScatterSpec& spec : scene.scatters)
    collect([&] {
      for (const BodySpec& kind : spec.kinds) demand_modes_under_skins(kind, scene);
      add_scatter(spec, library, built);
    });
  for (const StaticSpec& spec : scene.statics) {
    collect([&] {
      TriMesh mesh = build_obstacle(spec, built.options);
      const std::optional<ContactMaterial> contact = contact_of(spec.contact, built.options);
      if (spec.moves()) return add_moving_obstacle(spec, mesh, contact, built);
      built.obstacles.push_back(std::move(mesh));
      built.options.obstacles.push_back(contact);
    });
  }
  for (const WavemakerSpec& spec : scene.wavemakers)
    collect([&] { add_wavemaker(spec, scene, built); });
  if (bad.empty())
    for (const JointSpec& spec : scene.joints) collect([&] { add_joint(spec, built); });
  if (bad.empty())
    for (const SpringSpec& spec : scene.springs) collect([&] { add_spring(spec, built); });
  built.motors = scene.motors;
  if (bad.empty()) bad = misplaced_bodies(scene, built);
  if (!bad.empty()) throw InputError(bad);
  choose_rungs(scene, built);
  note_stiff_springs(scene, built);
  sort_by_release(built);
  for (const ForceSpec& spec : scene.forces) collect([&] { add_force(spec, built); });
  for (const ExternalSpec& spec : scene.externals) collect([&] { add_external(spec, built); });
  if (!bad.empty()) throw InputError(bad);
  forecast(scene, built);
  return built;
}

Simulation make_simulation(BuiltScene built, const SceneSpec& scene) {
  FluidState fluid = initial_fluid(scene.fluid);
  if (!scene.markers.empty())
    fluid.markers = place_markers(scene.markers, built.options.grid, fluid.phi);
  Simulation simulation(built.options, std::move(fluid), std::move(built.bodies),
                        std::move(built.obstacles), std::move(built.release),
                        std::move(built.joints), std::move(built.skins));
  simulation.set_actuators(std::move(built.actuators));
  simulation.set_external_loads(std::move(built.loads));
  simulation.set_springs(std::move(built.springs));
  simulation.set_motors(std::move(built.motors));
  simulation.set_prescribed(std::move(built.prescribed));
  return simulation;
}

}  // namespace archetide
