#include "runtime/scene/parse_scene.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <tuple>

#include "common/params/params.h"
#include "runtime/scene/scene_schema.h"

namespace archetide {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;  // rad

using Complaints = std::vector<Diagnostic>;

std::optional<double> optional_number(const Section& s, const std::string& path) {
  return s.has(path) ? std::optional(s.number(path)) : std::nullopt;
}

std::optional<Vec3> optional_vector(const Section& s, const std::string& path) {
  return s.has(path) ? std::optional(s.vec3(path)) : std::nullopt;
}

// A path in a scene file is relative to the scene file.
std::string resolved(const SceneSpec& scene, const std::string& path) {
  return (std::filesystem::path(scene.directory) / path).lexically_normal().string();
}

BoxSpec parse_corners(const Section& s, const std::string& path, const Vec3& low, const Vec3& high,
                      Complaints& bad) {
  if ((low.array() > high.array()).any()) {
    bad.push_back(s.error(path, "the first corner is not the low one", "expected low <= high"));
  }
  return {low, high};
}

WaterSpec parse_water(const Section& fluid, const SceneSpec& scene, Complaints& bad) {
  WaterSpec water;
  water.full = !fluid.has("water");
  if (water.full) return water;
  const Section s = fluid.section("water");
  water.level = optional_number(s, "level");
  for (const Section& box : s.sections("boxes")) {
    water.boxes.push_back({parse_corners(box, "low", box.vec3("low"), box.vec3("high"), bad),
                           optional_vector(box, "velocity")});
  }
  for (const Section& ball : s.sections("spheres")) {
    water.spheres.push_back(
        {{ball.vec3("centre"), ball.number("radius")}, optional_vector(ball, "velocity")});
  }
  if (s.has("mesh")) water.mesh = resolved(scene, s.string("mesh"));
  if (!water.level && water.boxes.empty() && water.spheres.empty() && water.mesh.empty()) {
    bad.push_back(s.error("", "the table is empty",
                          "give level, boxes, spheres or mesh; leave it out for a full tank"));
  }
  return water;
}

void parse_beach(const Section& s, const char* const sides[], FluidSpec& fluid, Complaints& bad) {
  Damping& beach = fluid.damping;
  beach.rate = s.number("rate");
  for (int side = 0; side < 4; ++side) {
    beach.width[side] = s.number(sides[side]);
    const double length = fluid.cell * fluid.cells[side / 2];
    if (beach.width[side] > length * (1.0 + 1e-12))
      bad.push_back(s.error(sides[side], "the beach is wider than the tank",
                            fmt::format("the tank is {:f} m long there", length)));
  }
}

FluidSpec parse_fluid(const Section& s, const SceneSpec& scene, Complaints& bad) {
  FluidSpec fluid;
  fluid.where = s.location();
  fluid.cells = s.int_vec3("grid");
  fluid.cell = s.number("cell");
  fluid.origin = s.vec3("origin");
  fluid.density = s.number("density");
  fluid.water = parse_water(s, scene, bad);
  fluid.velocity = s.vec3("velocity");
  const char* const sides[] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
  const Section walls = s.section("walls");
  for (int side = 0; side < 6; ++side) fluid.open[side] = walls.string(sides[side]) == "open";
  fluid.damping.drag = s.number("drag");
  if (s.has("beach")) parse_beach(s.section("beach"), sides, fluid, bad);
  if (s.has("particles")) {
    fluid.particles_per_cell = s.integer("particles.per_cell");
    fluid.spray = s.boolean("particles.spray");
  }

  const double height = fluid.cell * fluid.cells[2];
  if (fluid.water.level.value_or(0.0) > height * (1.0 + 1e-12)) {
    bad.push_back(s.error("water.level", "the water stands above the tank",
                          fmt::format("the tank is {:f} m high", height)));
  }
  if (fluid.cells.cast<double>().prod() > 2e9) {
    bad.push_back(s.error("grid", "more than 2e9 cells", "use a coarser grid"));
  }
  return fluid;
}

// A box, or centre and radius of a ball.
std::pair<std::optional<BoxSpec>, std::optional<SphereSpec>> parse_place(const Section& s,
                                                                         Complaints& bad) {
  std::optional<BoxSpec> box;
  std::optional<SphereSpec> ball;
  if (s.has("box")) {
    const std::vector<Vec3> corners = s.points("box");
    if (corners.size() == 2)
      box = parse_corners(s, "box", corners[0], corners[1], bad);
    else
      bad.push_back(s.error("box", "expected two corners", "[[x0, y0, z0], [x1, y1, z1]]"));
  }
  const bool centre = s.has("centre"), radius = s.has("radius");
  if (centre && radius) ball = SphereSpec{s.vec3("centre"), s.number("radius")};
  if (centre != radius || s.has("box") == centre)
    bad.push_back(s.error("", "expected a box, or centre and radius of a ball"));
  return {box, ball};
}

MarkersSpec parse_markers(const Section& s, const SceneSpec& scene, Complaints& bad) {
  MarkersSpec markers;
  markers.where = s.location();
  markers.count = s.integer("count");
  markers.seed = static_cast<unsigned>(s.integer("seed"));
  if (!scene.fluid) bad.push_back(s.error("", "markers need water", "give [fluid]"));
  std::tie(markers.box, markers.ball) = parse_place(s, bad);
  return markers;
}

// When what starts at `start` (s) ends.
std::optional<double> parse_end(const Section& s, const char* what, double start, Complaints& bad) {
  const std::optional<double> end = optional_number(s, "end");
  if (end.value_or(INFINITY) <= start)
    bad.push_back(s.error("end", fmt::format("the {} ends before it starts", what),
                          fmt::format("it starts at {:f} s", start)));
  return end;
}

WaterSource parse_source(const Section& s, const SceneSpec& scene, Complaints& bad) {
  WaterSource source;
  const auto [box, ball] = parse_place(s, bad);
  if (box) source.low = box->low, source.high = box->high;
  if (ball) {
    const Vec3 arm = Vec3::Constant(ball->radius);
    source.ball = true, source.low = ball->centre - arm, source.high = ball->centre + arm;
  }
  source.velocity = s.vec3("velocity");
  source.start = s.number("start");
  source.end = parse_end(s, "source", source.start, bad).value_or(source.end);
  if (!scene.fluid) {
    bad.push_back(s.error("", "a source needs a tank", "give [fluid]"));
    return source;
  }
  if (!box && !ball) return source;
  const Vec3 low = scene.fluid->origin, high = scene.fluid->high();
  if ((source.high.array() <= low.array()).any() || (source.low.array() >= high.array()).any())
    bad.push_back(s.error(ball ? "centre" : "box", "the source is not in the tank",
                          fmt::format("that reaches from ({:f}, {:f}, {:f}) to ({:f}, {:f}, {:f})",
                                      low[0], low[1], low[2], high[0], high[1], high[2])));
  const double thin = (source.high - source.low).minCoeff(), cell = scene.fluid->cell;
  if (thin < 2.0 * cell)
    bad.push_back(
        s.error(ball ? "radius" : "box", "the source is thinner than two cells",
                fmt::format("make it at least {:f} m thick, or the cells smaller", 2.0 * cell)));
  return source;
}

// Behind those before it, whose names are taken.
Gauge parse_gauge(const Section& s, const SceneSpec& scene, Complaints& bad) {
  Gauge gauge;
  gauge.name = s.has("name") ? s.string("name") : fmt::format("g{}", scene.gauges.size() + 1);
  gauge.point = s.vec3("point");
  const bool plain = std::ranges::all_of(
      gauge.name, [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_'; });
  if (gauge.name.empty() || !plain)
    bad.push_back(s.error("name", "a gauge is named by letters, digits, '-' and '_'"));
  if (std::ranges::count(scene.gauges, gauge.name, &Gauge::name) > 0)
    bad.push_back(s.error(s.has("name") ? "name" : "",
                          "there is a gauge \"" + gauge.name + "\" already", "give another name"));
  if (!scene.fluid) {
    bad.push_back(s.error("", "a gauge needs water", "give [fluid]"));
    return gauge;
  }
  const Vec3 low = scene.fluid->origin, high = scene.fluid->high();
  if ((gauge.point.array() < low.array()).any() || (gauge.point.array() > high.array()).any())
    bad.push_back(s.error("point", "the gauge is not in the tank",
                          fmt::format("that reaches from ({:f}, {:f}, {:f}) to ({:f}, {:f}, {:f})",
                                      low[0], low[1], low[2], high[0], high[1], high[2])));
  return gauge;
}

Quat parse_rotation(const Section& s, Complaints& bad) {
  if (!s.has("rotation")) return Quat::Identity();
  const Section rotation = s.section("rotation");
  const Vec3 axis = rotation.vec3("axis");
  const double angle = rotation.number("degrees") * kDegree;
  if (axis.norm() > 0.0) return Quat(Eigen::AngleAxisd(angle, axis.normalized()));
  bad.push_back(rotation.error("axis", "the axis has no length", ""));
  return Quat::Identity();
}

ContactSpec parse_contact(const Section& s) {
  if (!s.has("contact")) return {};
  const Section contact = s.section("contact");
  return {optional_number(contact, "restitution"), optional_number(contact, "friction")};
}

// Keys that a body and the instances of a scatter share; `key` names the archetype.
BodySpec parse_instance(const Section& s, const SceneSpec& scene, const std::string& archetype,
                        const std::string& key = "archetype") {
  BodySpec body;
  body.where = s.location(key);
  body.archetype = archetype.ends_with(".h5") ? resolved(scene, archetype) : archetype;
  body.velocity = s.vec3("velocity");
  body.angular_velocity = s.vec3("angular_velocity");
  body.density = optional_number(s, "density");
  if (s.has("modes") && !s.is_string("modes")) body.modes = s.integer("modes");
  if (s.has("modes") && s.is_string("modes")) body.every_motion = s.string("modes") == "full";
  body.modes_where = s.location("modes");
  body.every_node = s.string("deformable") == "full";
  body.deformable_where = s.location("deformable");
  body.contact = parse_contact(s);
  return body;
}

BodySpec parse_body(const Section& s, const SceneSpec& scene, Complaints& bad) {
  BodySpec body = parse_instance(s, scene, s.string("archetype"));
  if (s.has("name")) body.name = s.string("name");
  body.position = s.vec3("position");
  body.rotation = parse_rotation(s, bad);
  return body;
}

void parse_kinds(const Section& s, const SceneSpec& scene, ScatterSpec& scatter, Complaints& bad) {
  if (s.has("archetype")) scatter.kinds = {parse_instance(s, scene, s.string("archetype"))};
  scatter.mixed = s.has("archetypes");
  if (scatter.mixed)
    for (const std::string& archetype : s.strings("archetypes"))
      scatter.kinds.push_back(parse_instance(s, scene, archetype, "archetypes"));
  if (s.has("archetype") == scatter.mixed || scatter.kinds.empty())
    bad.push_back(s.error("", "expected either archetype or archetypes",
                          "archetype = \"torus\", or archetypes = [\"torus\", \"sphere\"]"));
}

void parse_places(const Section& s, const SceneSpec& scene, ScatterSpec& scatter, Complaints& bad) {
  if (s.has("mesh")) scatter.mesh = resolved(scene, s.string("mesh"));
  if (s.has("box") == s.has("mesh")) {
    bad.push_back(s.error("", "expected either box or mesh", "where the centres of mass may be"));
    return;
  }
  if (!s.has("box")) return;
  const std::vector<Vec3> corners = s.points("box");
  if (corners.size() == 2)
    scatter.box = parse_corners(s, "box", corners[0], corners[1], bad);
  else
    bad.push_back(s.error("box", "expected two corners", "[[x0, y0, z0], [x1, y1, z1]]"));
}

ScatterSpec parse_scatter(const Section& s, const SceneSpec& scene, Complaints& bad) {
  ScatterSpec scatter;
  parse_kinds(s, scene, scatter, bad);
  scatter.count = s.integer("count");
  parse_places(s, scene, scatter, bad);
  scatter.random_rotation = s.string("rotation") == "random";
  scatter.seed = static_cast<unsigned>(s.integer("seed"));
  scatter.gap = s.number("gap");
  if (s.has("waves")) {
    scatter.waves = s.integer("waves.count");
    scatter.wave_interval = s.number("waves.every");
    scatter.waves_where = s.location("waves");
    if (scatter.waves > scatter.count)
      bad.push_back(s.error("waves.count", "more waves than bodies",
                            fmt::format("there are {}", scatter.count)));
  }
  return scatter;
}

// How an obstacle goes: keys, or the name of a table.
void parse_motion(const Section& s, const SceneSpec& scene, StaticSpec& obstacle, Complaints& bad) {
  if (!s.has("motion")) return;
  obstacle.motion_where = s.location("motion");
  if (s.is_string("motion")) {
    obstacle.motion_csv = resolved(scene, s.string("motion"));
    return;
  }
  double degrees = 0.0;
  for (const Section& key : s.sections("motion")) {
    std::vector<MotionPath::Key>& keys = obstacle.motion.keys;
    const double t = key.number("t");
    if (!keys.empty() && t <= keys.back().t) bad.push_back(key.error("t", "times must ascend", ""));
    const double before = degrees;
    degrees = key.has("rotation") ? key.section("rotation").number("degrees") : 0.0;
    if (!keys.empty() && std::abs(degrees - before) * kDegree > kMostTurn)
      bad.push_back(key.error("rotation", "a turn of more than 120 degrees since the last key",
                              "give keys in between"));
    keys.push_back({t, key.vec3("position"), parse_rotation(key, bad)});
  }
  if (obstacle.motion.keys.empty())
    bad.push_back(s.error("motion", "it has no keys", "remove it: the obstacle stays"));
}

StaticSpec parse_static(const Section& s, const SceneSpec& scene, Complaints& bad) {
  StaticSpec obstacle;
  obstacle.where = s.location("mesh");
  obstacle.mesh = resolved(scene, s.string("mesh"));
  obstacle.scale = s.number("scale");
  obstacle.position = s.vec3("position");
  obstacle.rotation = parse_rotation(s, bad);
  obstacle.contact = parse_contact(s);
  parse_motion(s, scene, obstacle, bad);
  return obstacle;
}

// The [[body]] of this name, or -1 and a complaint.
int body_named(const Section& s, const std::string& name, const SceneSpec& scene, Complaints& bad) {
  int found = -1;
  std::vector<std::string> names;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const BodySpec& body = scene.bodies[b];
    names.push_back(body.name.empty() ? body.archetype : body.name);
    if (names.back() != name) continue;
    if (found >= 0)
      bad.push_back(s.error("bodies", "two bodies are called \"" + name + "\"",
                            "give each of them a name of its own"));
    found = static_cast<int>(b);
  }
  if (found < 0) {
    const std::string near = closest_match(name, names);
    bad.push_back(s.error("bodies", "there is no [[body]] called \"" + name + "\"",
                          near.empty() ? "" : "did you mean \"" + near + "\"?"));
  }
  return found;
}

// The two bodies of a joint, a spring or a motor; the second may be the world (-1).
std::pair<int, int> parse_bodies(const Section& s, const SceneSpec& scene, Complaints& bad) {
  const std::vector<std::string> names = s.strings("bodies");
  if (names.size() != 2 || names[0] == "world") {
    bad.push_back(s.error("bodies", "expected two names, the first of a body",
                          "[\"bell\", \"arm\"] or [\"bell\", \"world\"]"));
    return {-1, -1};
  }
  const int a = body_named(s, names[0], scene, bad);
  const int b = names[1] == "world" ? -1 : body_named(s, names[1], scene, bad);
  if (a >= 0 && a == b) bad.push_back(s.error("bodies", "a body cannot be tied to itself", ""));
  return {a, b};
}

WavemakerSpec parse_wavemaker(const Section& s, Complaints& bad) {
  WavemakerSpec maker;
  maker.where = s.location("side");
  const std::string side = s.string("side");
  maker.side = side == "xmin" ? kXMin : side == "xmax" ? kXMax : side == "ymin" ? kYMin : kYMax;
  maker.flap = s.string("type") == "flap";
  maker.height = optional_number(s, "height");
  maker.stroke = optional_number(s, "stroke");
  maker.period = s.number("period");
  maker.ramp = optional_number(s, "ramp");
  maker.front = optional_number(s, "front");
  if (s.has("height") == s.has("stroke"))
    bad.push_back(s.error("", "expected either height or stroke",
                          "height = of the waves, m; stroke = of the front at the water level, m"));
  return maker;
}

// Whether no line goes through all of them.
bool span_a_plane(const std::vector<Vec3>& points) {
  constexpr double kThin = 1e-6;  // sine of the angle that is still a line
  for (const Vec3& p : points)
    for (const Vec3& q : points) {
      const Vec3 one = p - points[0], other = q - points[0];
      if (one.cross(other).norm() > kThin * one.norm() * other.norm()) return true;
    }
  return false;
}

// A weld of the body that was parsed last with the world.
JointSpec parse_clamp(const Section& s, const SceneSpec& scene, Complaints& bad) {
  JointSpec clamp;
  clamp.where = clamp.point_set_where = s.location("clamp");
  clamp.name = s.shown("clamp");
  clamp.a = static_cast<int>(scene.bodies.size()) - 1;
  if (s.is_string("clamp")) {
    clamp.point_set = s.string("clamp");
    return clamp;
  }
  clamp.points = s.points("clamp");
  if (!span_a_plane(clamp.points))
    bad.push_back(s.error("clamp", "expected three points or more that are not on one line",
                          "a [[joint]] with the world lets the body turn about fewer"));
  return clamp;
}

JointSpec parse_joint(const Section& s, const SceneSpec& scene, Complaints& bad) {
  JointSpec joint;
  joint.where = s.location("bodies");
  std::tie(joint.a, joint.b) = parse_bodies(s, scene, bad);
  if (s.has("points")) joint.points = s.points("points");
  if (s.has("frame")) joint.frame = s.string("frame");
  const std::string type = s.string("type");
  joint.frame_points = type == "ball" ? 1 : type == "hinge" ? 2 : 3;
  if (s.has("point_set")) joint.point_set = s.string("point_set");
  joint.frame_where = s.location("frame"), joint.point_set_where = s.location("point_set");
  if (s.has("type") && joint.frame.empty())
    bad.push_back(s.error("type", "type is that of a frame, and there is none",
                          "give frame, or leave type out: one point is a ball joint, two are a "
                          "hinge, three a weld"));
  if (joint.points.empty() && joint.frame.empty() && joint.point_set.empty())
    bad.push_back(s.error("", "the joint has no points", "give points, frame or point_set"));
  return joint;
}

SpringSpec parse_spring(const Section& s, const SceneSpec& scene, Complaints& bad) {
  SpringSpec spring;
  spring.where = s.location("bodies");
  std::tie(spring.a, spring.b) = parse_bodies(s, scene, bad);
  spring.points = s.points("points");
  if (spring.points.size() != 2)
    bad.push_back(
        s.error("points", "expected two points, one of each end",
                "[[0, 0, 0.1], [1, 2, 3]]: in the rest frame of each body; of the world in space"));
  spring.stiffness = s.number("stiffness");
  spring.damping = s.number("damping");
  spring.length = optional_number(s, "length");
  spring.slack = s.boolean("slack");
  return spring;
}

ActuationDirection parse_direction(const Section& s, Complaints& bad) {
  using Kind = ActuationDirection::Kind;
  if (!s.is_string("direction")) {
    const Vec3 vector = s.vec3("direction");
    if (vector.norm() == 0.0) bad.push_back(s.error("direction", "the vector has no length"));
    return {Kind::kVector, vector};
  }
  const std::string word = s.string("direction");
  return {word == "radial" ? Kind::kRadial : word == "inward" ? Kind::kInward : Kind::kNormal};
}

Motor parse_motor(const Section& s, const SceneSpec& scene, Complaints& bad) {
  Motor motor;
  std::tie(motor.a, motor.b) = parse_bodies(s, scene, bad);
  motor.axis = s.vec3("axis");
  if (motor.axis.norm() == 0.0) bad.push_back(s.error("axis", "the vector has no length"));
  motor.axis.normalize();
  motor.torque = s.number("torque");
  motor.speed = optional_number(s, "speed").value_or(motor.speed);
  motor.period = optional_number(s, "period").value_or(motor.period);
  motor.phase = s.number("phase") * kDegree;
  motor.start = s.number("start");
  motor.end = parse_end(s, "motor", motor.start, bad).value_or(motor.end);
  return motor;
}

ForceSpec parse_force(const Section& s, Complaints& bad) {
  ForceSpec force;
  force.body_where = s.location("body");
  force.points_where = s.location("points");
  force.direction_where = s.location("direction");
  force.body = s.string("body");
  force.points = s.string("points");
  force.direction = parse_direction(s, bad);
  force.amplitude = s.number("amplitude");
  force.period = s.number("period");
  force.phase = s.number("phase") * kDegree;
  force.random_phases = s.string("phases") == "random";
  force.seed = static_cast<unsigned>(s.integer("seed"));
  force.balanced = s.string("balance") == "points";
  force.start = s.number("start");
  force.end = parse_end(s, "force", force.start, bad);
  return force;
}

ExternalSpec parse_external(const Section& s, const SceneSpec& scene, Complaints& bad) {
  ExternalSpec load;
  load.body_where = s.location("body");
  load.csv_where = s.location("csv");
  load.body = s.string("body");
  load.force = s.vec3("force");
  load.torque = s.vec3("torque");
  if (s.has("csv")) load.csv = resolved(scene, s.string("csv"));
  load.start = s.number("start");
  load.end = parse_end(s, "load", load.start, bad);
  const bool constant = !load.force.isZero(0.0) || !load.torque.isZero(0.0);
  if (constant == s.has("csv"))
    bad.push_back(s.error(
        constant ? "csv" : "body",
        constant ? "force and torque stand in the table already" : "nothing acts on the body",
        "give force, torque or both, or csv"));
  return load;
}

// "../arm.h5" -> "arm"
std::string archetype_name(const std::string& archetype) {
  return archetype.ends_with(".h5") ? std::filesystem::path(archetype).stem().string() : archetype;
}

// The bodies that a skin places, behind those that are there.
void add_parts(const Section& s, const std::string& name, SkinSpec& skin, SceneSpec& scene) {
  for (const std::string& part : s.strings("parts")) {
    BodySpec body;
    body.where = body.modes_where = skin.bodies_where;
    body.name = name + "." + archetype_name(part);
    body.archetype = part.ends_with(".h5") ? resolved(scene, part) : part;
    body.density = optional_number(s, "density");
    if (s.has("modes")) {
      body.modes = s.integer("modes");
      body.modes_where = s.location("modes");
    }
    skin.parts.push_back(body.archetype);
    skin.bodies.push_back(static_cast<int>(scene.bodies.size()));
    scene.bodies.push_back(body);
  }
}

SkinSpec parse_skin(const Section& s, SceneSpec& scene, Complaints& bad) {
  SkinSpec skin;
  skin.where = s.location("archetype");
  skin.archetype = s.string("archetype");
  const std::string name = s.has("name") ? s.string("name") : archetype_name(skin.archetype);
  if (skin.archetype.ends_with(".h5")) skin.archetype = resolved(scene, skin.archetype);
  const bool places = s.has("parts");
  skin.bodies_where = s.location(places ? "parts" : "bodies");
  if (places == s.has("bodies")) {
    bad.push_back(s.error("", "expected either parts or bodies",
                          "parts = archetypes, to place them; bodies = names of [[body]]s"));
    return skin;
  }
  skin.rotation = parse_rotation(s, bad);
  skin.velocity = s.vec3("velocity");
  skin.angular_velocity = s.vec3("angular_velocity");
  if (s.has("position")) skin.position = s.vec3("position");
  if (places) {
    if (!s.has("position"))
      bad.push_back(s.error("", "position is missing", "of the mesh's origin"));
    add_parts(s, name, skin, scene);
    return skin;
  }
  for (const char* key :
       {"position", "rotation", "velocity", "angular_velocity", "density", "modes"})
    if (s.has(key))
      bad.push_back(
          s.error(key, std::string(key) + " belongs to parts", "give it in the [[body]]s"));
  for (const std::string& body : s.strings("bodies")) {
    const int b = body_named(s, body, scene, bad);
    if (b >= 0 && std::count(skin.bodies.begin(), skin.bodies.end(), b) > 0)
      bad.push_back(s.error("bodies", "\"" + body + "\" stands twice", ""));
    if (b >= 0) skin.bodies.push_back(b);
  }
  return skin;
}

// A body has one skin.
void demand_one_skin_each(const SceneSpec& scene, Complaints& bad) {
  std::vector<int> skins(scene.bodies.size(), 0);
  for (const SkinSpec& skin : scene.skins)
    for (const int b : skin.bodies)
      if (++skins[b] == 2)
        bad.push_back(
            {skin.bodies_where, "\"" + scene.bodies[b].name + "\" has a skin already", ""});
}

void parse_method(const Section& root, SceneSpec& scene) {
  const Section step = root.section("step"), coupling = root.section("coupling");
  scene.cfl = step.number("cfl");
  scene.outrun = step.number("outrun");
  scene.max_dt = step.number("max");
  scene.scheme = step.string("scheme") == "single" ? Scheme::kSingle : Scheme::kNewmark;
  scene.geometry = coupling.string("geometry") == "voxel" ? Geometry::kVoxel : Geometry::kCutCell;
  scene.full_surface = coupling.string("surface") == "full";
  scene.tolerance = coupling.number("tolerance");
  scene.max_iterations = coupling.integer("max_iterations");
  scene.modal.step = coupling.string("modal_step") == "backward-euler" ? ModalStep::kBackwardEuler
                                                                       : ModalStep::kTrapezoid;
  scene.modal.mass =
      coupling.string("modal_mass") == "paper" ? ModalMass::kPaper : ModalMass::kExact;
  scene.on_fail = coupling.string("on_fail") == "stop" ? OnFail::kStop : OnFail::kHalveStep;
  scene.restitution = root.number("contact.restitution");
  scene.friction = root.number("contact.friction");
  scene.body_contact = root.boolean("contact.bodies") && root.has("contact");
}

LimitSpec parse_limits(const Section& s) {
  LimitSpec limits;
  limits.volume_drift = optional_number(s, "volume_drift");
  limits.speed = optional_number(s, "speed");
  limits.deformation = optional_number(s, "deformation");
  limits.energy = optional_number(s, "energy");
  limits.step = optional_number(s, "step");
  if (s.has("iterations")) limits.iterations = s.integer("iterations");
  return limits;
}

ExpectSpec parse_expect(const Section& s, int bodies, Complaints& bad) {
  ExpectSpec expect;
  expect.volume_drift = optional_number(s, "volume_drift");
  if (s.has("iterations")) expect.iterations = s.integer("iterations");
  expect.deformation_min = optional_number(s, "deformation_min");
  expect.deformation_max = optional_number(s, "deformation_max");
  for (const Section& b : s.sections("body")) {
    const int index = b.integer("body");
    if (index >= bodies) {
      bad.push_back(b.error("body", fmt::format("there is no body {}", index),
                            fmt::format("the scene has {}, counted from 0", bodies)));
    }
    expect.bodies.push_back({b.location(), index, b.number("window"), optional_number(b, "z_min"),
                             optional_number(b, "z_max"), optional_number(b, "speed_min"),
                             optional_number(b, "speed_max"), optional_number(b, "z"),
                             optional_number(b, "draft"), optional_number(b, "margin")});
  }
  return expect;
}

SceneSpec to_scene(const Document& document, const std::string& path) {
  const Section root = document.root();
  const std::filesystem::path file(path);
  SceneSpec scene;
  Complaints bad;
  scene.file = path;
  scene.directory = file.has_parent_path() ? file.parent_path().string() : ".";
  scene.name = root.has("name") ? root.string("name") : file.stem().stem().string();
  scene.gravity = root.vec3("gravity");
  scene.end_time = root.number("time.end");
  scene.fps = root.number("time.fps");
  parse_method(root, scene);
  if (root.has("fluid")) scene.fluid = parse_fluid(root.section("fluid"), scene, bad);
  for (const Section& s : root.sections("markers"))
    scene.markers.push_back(parse_markers(s, scene, bad));
  for (const Section& s : root.sections("gauge"))
    scene.gauges.push_back(parse_gauge(s, scene, bad));
  for (const Section& s : root.sections("source"))
    scene.sources.push_back(parse_source(s, scene, bad));
  for (const Section& s : root.sections("body")) {
    scene.bodies.push_back(parse_body(s, scene, bad));
    if (s.has("clamp")) scene.joints.push_back(parse_clamp(s, scene, bad));
  }
  for (const Section& s : root.sections("skin")) scene.skins.push_back(parse_skin(s, scene, bad));
  demand_one_skin_each(scene, bad);
  int instances = static_cast<int>(scene.bodies.size());
  for (const Section& s : root.sections("scatter")) {
    scene.scatters.push_back(parse_scatter(s, scene, bad));
    instances += scene.scatters.back().count;
  }
  for (const Section& s : root.sections("static"))
    scene.statics.push_back(parse_static(s, scene, bad));
  for (const Section& s : root.sections("wavemaker"))
    scene.wavemakers.push_back(parse_wavemaker(s, bad));
  int number = 0;
  for (const Section& s : root.sections("joint")) {
    scene.joints.push_back(parse_joint(s, scene, bad));
    scene.joints.back().name = fmt::format("[[joint]] {}", ++number);
  }
  for (const Section& s : root.sections("force")) scene.forces.push_back(parse_force(s, bad));
  for (const Section& s : root.sections("spring"))
    scene.springs.push_back(parse_spring(s, scene, bad));
  for (const Section& s : root.sections("motor"))
    scene.motors.push_back(parse_motor(s, scene, bad));
  for (const Section& s : root.sections("external"))
    scene.externals.push_back(parse_external(s, scene, bad));
  scene.frames = root.strings("output.frames");
  scene.checkpoints = root.has("output.checkpoint");
  scene.checkpoint_every = root.integer("output.checkpoint.every_frames");
  scene.checkpoint_keep = root.integer("output.checkpoint.keep");
  scene.limits = parse_limits(root.section("limits"));
  scene.expect = parse_expect(root.section("expect"), instances, bad);
  scene.text = document.text();
  throw_if_any(bad);
  document.check_all_read();
  return scene;
}

}  // namespace

SceneSpec parse_scene(const std::string& path, const std::vector<std::string>& overrides) {
  return to_scene(Document::read(path, scene_schema(), overrides), path);
}

SceneSpec parse_scene_text(const std::string& text, const std::string& path,
                           const std::vector<std::string>& overrides) {
  return to_scene(Document::parse(text, path, scene_schema(), overrides), path);
}

}  // namespace archetide
