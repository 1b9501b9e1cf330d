#include "runtime/scene/parse_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "common/params/params.h"
#include "runtime/scene/scene_schema.h"
#include "scene_test_support.h"

namespace archetide {
namespace {

const char* const kParsedHead = "schema = 1\ntime = { end = 2.5, fps = 24 }\n";

SceneSpec parse(const std::string& body, const std::vector<std::string>& overrides = {}) {
  return parse_scene_text(kParsedHead + body, "dir/tub.scene.toml", overrides);
}

std::string complaint(const std::string& body, const std::vector<std::string>& overrides = {}) {
  return message_of<InputError>([&] { parse(body, overrides); });
}

// Every key of the schema that this version accepts, none at its default.
const char* const kEverything = R"(
name = "all"
gravity = [0, 1, -5]
step = { cfl = 0.5, outrun = 0.001, max = 0.01, scheme = "single" }
[fluid]
grid = [4, 8, 16]
cell = "1/8"
origin = [-1, 0, 1]
density = 900.0
velocity = [0.5, 0, -1]
walls = { xmin = "open", xmax = "open", ymin = "open", ymax = "open", zmin = "open", zmax = "open" }
particles = { per_cell = 16, spray = true }
beach = { xmin = 0.0625, xmax = 0.125, ymin = 0.03125, ymax = 0.25, rate = 2.5 }
drag = 0.125
[fluid.water]
level = 0.4
boxes = [{ low = [0, 0, 0], high = [1, 1, 1], velocity = [1, 2, 3] }]
spheres = [{ centre = [1, 2, 3], radius = 0.5, velocity = [4, 5, 6] }]
mesh = "../meshes/drop.obj"
[[markers]]
count = 100
box = [[0, 0, 0], [0.5, 1, 2]]
seed = 4
[[markers]]
count = 7
centre = [1, 2, 3]
radius = 0.5
[[gauge]]
name = "wall-1"
point = [-1, 0.2, 1.5]
[[source]]
box = [[-1, 0, 2], [-0.5, 1, 3]]
velocity = [1, 0, -2]
start = 0.25
end = 0.75
[[source]]
centre = [-0.5, 0.5, 2]
radius = 0.25
velocity = [0, 1, 0]
[coupling]
geometry = "voxel"
surface = "full"
tolerance = 1e-6
max_iterations = 77
modal_step = "backward-euler"
modal_mass = "paper"
on_fail = "stop"
[[body]]
name = "first"
archetype = "torus"
position = [0.5, 0.5, 0.8]
rotation = { axis = [0, 0, 2], degrees = 90 }
velocity = [0, 0, -1]
angular_velocity = [1, 2, 3]
density = 300
modes = 7
deformable = "modes"
clamp = "foot"
contact = { restitution = 0.9, friction = 0.05 }
[[scatter]]
archetype = "../special/star.h5"
count = 3
box = [[0, 0, 0], [1, 1, 1]]
rotation = "none"
seed = 7
gap = 0.01
waves = { count = 2, every = 0.4 }
velocity = [1, 0, 0]
angular_velocity = [0, 1, 0]
density = 200
modes = "all"
deformable = "full"
contact = { restitution = 0.8, friction = 0.2 }
[[scatter]]
archetypes = ["torus", "../special/star.h5"]
count = 5
mesh = "../meshes/cloud.obj"
[[static]]
mesh = "../meshes/rocks.obj"
contact = { restitution = 0.1, friction = 0.7 }
scale = 2.0
position = [1, 1, 1]
rotation = { axis = [1, 0, 0], degrees = 180 }
[[static]]
mesh = "paddle.obj"
motion = [{ t = 0.5 }, { t = 1, position = [0, 0, 2], rotation = { axis = [0, 0, 1], degrees = 90 } }]
[[static]]
mesh = "paddle.obj"
motion = "way.csv"
[[joint]]
bodies = ["first", "world"]
points = [[0.1, 0, 0], [0, 0.2, 0]]
frame = "hip"
type = "weld"
point_set = "rim"
[[force]]
body = "first"
points = "rim"
direction = [0, 0, 2]
amplitude = 2.0
period = 1.2
phase = 90
phases = "random"
seed = 5
balance = "body"
start = 0.5
end = 2.0
[[external]]
body = "first"
force = [1, 0, -2]
torque = [0, 3, 0]
start = 0.25
end = 0.75
[[external]]
body = "first"
csv = "push.csv"
[[spring]]
bodies = ["first", "world"]
points = [[0, 0, 0.1], [1, 2, 3]]
stiffness = 50
damping = 2
length = 0.5
slack = true
[[motor]]
bodies = ["first", "world"]
axis = [0, 0, 2]
torque = 3
speed = 12
period = 0.5
phase = 90
start = 0.25
end = 4
[[wavemaker]]
side = "ymax"
type = "flap"
height = 0.1
period = 1.5
ramp = 2
front = 0.3
[[wavemaker]]
side = "xmin"
stroke = 0.05
period = 2
[[skin]]
name = "jelly"
archetype = "jelly_skin"
parts = ["bell", "../special/arm.h5"]
position = [1, 2, 3]
rotation = { axis = [0, 1, 0], degrees = 180 }
velocity = [0, 0, 2]
angular_velocity = [0, 4, 0]
density = 900
modes = 4
[[skin]]
archetype = "../special/own.h5"
bodies = ["first"]
[contact]
restitution = 0.1
friction = 0.4
bodies = false
[output]
frames = ["particles.vtp"]
checkpoint = { every_frames = 6, keep = 3 }
[limits]
volume_drift = 0.05
speed = 20
deformation = 0.6
energy = 0.1
step = 1e-5
iterations = 60
[expect]
volume_drift = 0.02
iterations = 30
deformation_min = 0.01
deformation_max = 0.2
[[expect.body]]
body = 3
window = 0.5
z_min = 0.1
z_max = 0.4
speed_min = 0.0
speed_max = 0.3
z = 0.25
draft = 0.5
margin = 0.01
)";

TEST(ParseScene, TakesEveryKeyToItsPlace) {
  const SceneSpec s = parse(kEverything);
  EXPECT_EQ(s.name, "all");
  EXPECT_EQ(s.end_time, 2.5);
  EXPECT_EQ(s.gravity, Vec3(0, 1, -5));
  EXPECT_EQ(s.cfl, 0.5);
  EXPECT_EQ(s.outrun, 0.001);
  EXPECT_EQ(s.max_dt, 0.01);
  EXPECT_EQ(s.scheme, Scheme::kSingle);
  EXPECT_EQ(s.geometry, Geometry::kVoxel);
  EXPECT_TRUE(s.full_surface);
  EXPECT_EQ(s.tolerance, 1e-6);
  EXPECT_EQ(s.max_iterations, 77);
  EXPECT_EQ(s.modal.step, ModalStep::kBackwardEuler);
  EXPECT_EQ(s.modal.mass, ModalMass::kPaper);
  EXPECT_EQ(s.on_fail, OnFail::kStop);
  EXPECT_EQ(s.restitution, 0.1);
  EXPECT_EQ(s.friction, 0.4);
  EXPECT_EQ(s.frames, std::vector<std::string>{"particles.vtp"});
  EXPECT_TRUE(s.checkpoints);
  EXPECT_EQ(s.checkpoint_every, 6);
  EXPECT_EQ(s.checkpoint_keep, 3);
  EXPECT_EQ(s.limits.volume_drift, 0.05);
  EXPECT_EQ(s.limits.speed, 20.0);
  EXPECT_EQ(s.limits.deformation, 0.6);
  EXPECT_EQ(s.limits.energy, 0.1);
  EXPECT_EQ(s.limits.step, 1e-5);
  EXPECT_EQ(s.limits.iterations, 60);

  ASSERT_TRUE(s.fluid);
  EXPECT_EQ(s.fluid->cells, Vec3i(4, 8, 16));
  EXPECT_EQ(s.fluid->cell, 0.125);
  EXPECT_EQ(s.fluid->origin, Vec3(-1, 0, 1));
  EXPECT_EQ(s.fluid->density, 900.0);
  EXPECT_EQ(s.fluid->velocity, Vec3(0.5, 0, -1));
  EXPECT_EQ(s.fluid->water.boxes.at(0).velocity, Vec3(1, 2, 3));
  EXPECT_EQ(s.fluid->water.spheres.at(0).velocity, Vec3(4, 5, 6));
  for (const bool open : s.fluid->open) EXPECT_TRUE(open);
  EXPECT_EQ(s.fluid->particles_per_cell, 16);
  EXPECT_TRUE(s.fluid->spray);
  EXPECT_EQ(s.fluid->damping.width, (std::array<double, 4>{0.0625, 0.125, 0.03125, 0.25}));
  EXPECT_EQ(s.fluid->damping.rate, 2.5);
  EXPECT_EQ(s.fluid->damping.drag, 0.125);
  EXPECT_FALSE(s.fluid->water.full);
  EXPECT_EQ(s.fluid->water.level, 0.4);
  EXPECT_EQ(s.fluid->water.boxes.at(0).high, Vec3(1, 1, 1));
  EXPECT_EQ(s.fluid->water.spheres.at(0).radius, 0.5);
  EXPECT_EQ(s.fluid->water.mesh, "meshes/drop.obj");

  const BodySpec& body = s.bodies.at(0);
  EXPECT_EQ(body.name, "first");
  EXPECT_EQ(body.archetype, "torus");
  EXPECT_EQ(body.position, Vec3(0.5, 0.5, 0.8));
  // A quarter turn about z takes x to y; 1e-15: rounding of sine and cosine.
  EXPECT_NEAR((body.rotation * Vec3::UnitX() - Vec3::UnitY()).norm(), 0.0, 1e-15);
  EXPECT_EQ(body.velocity, Vec3(0, 0, -1));
  EXPECT_EQ(body.angular_velocity, Vec3(1, 2, 3));
  EXPECT_EQ(body.density, 300.0);
  EXPECT_EQ(body.modes, 7);
  EXPECT_FALSE(body.every_node);

  const ScatterSpec& scatter = s.scatters.at(0);
  EXPECT_EQ(scatter.kinds.at(0).archetype,
            "special/star.h5");  // a path, relative to the scene file
  EXPECT_EQ(scatter.count, 3);
  EXPECT_FALSE(scatter.random_rotation);
  EXPECT_EQ(scatter.seed, 7u);
  EXPECT_EQ(scatter.gap, 0.01);
  EXPECT_EQ(scatter.kinds[0].modes, std::nullopt);
  EXPECT_TRUE(scatter.kinds[0].every_node);
  EXPECT_EQ(scatter.waves, 2);
  EXPECT_EQ(scatter.kinds[0].contact.friction, 0.2);
  EXPECT_EQ(s.statics.at(0).contact.friction, 0.7);
  const ScatterSpec& mixed = s.scatters.at(1);
  EXPECT_EQ(mixed.kinds.at(0).archetype, "torus");
  EXPECT_EQ(mixed.kinds.at(1).archetype, "special/star.h5");
  EXPECT_EQ(mixed.mesh, "meshes/cloud.obj");
  EXPECT_EQ(scatter.wave_interval, 0.4);
  EXPECT_FALSE(s.body_contact);  // contact.bodies = false

  EXPECT_EQ(s.joints.at(0).name, "body[0].clamp");
  EXPECT_EQ(s.joints.at(0).point_set, "foot");
  const JointSpec& joint = s.joints.at(1);
  EXPECT_EQ(joint.name, "[[joint]] 1");
  EXPECT_EQ(joint.a, 0);
  EXPECT_EQ(joint.b, -1);
  EXPECT_EQ(joint.points.at(1), Vec3(0, 0.2, 0));
  EXPECT_EQ(joint.frame, "hip");
  EXPECT_EQ(joint.frame_points, 3);
  EXPECT_EQ(joint.point_set, "rim");

  const SkinSpec& skin = s.skins.at(0);
  EXPECT_EQ(skin.archetype, "jelly_skin");
  EXPECT_EQ(skin.bodies, (std::vector<int>{1, 2}));  // behind the [[body]]s
  EXPECT_EQ(skin.position, Vec3(1, 2, 3));
  EXPECT_NEAR((skin.rotation * Vec3(0, 0, 1) - Vec3(0, 0, -1)).norm(), 0.0, 1e-15);
  EXPECT_EQ(skin.velocity, Vec3(0, 0, 2));
  EXPECT_EQ(skin.angular_velocity, Vec3(0, 4, 0));
  EXPECT_EQ(s.bodies.at(1).name, "jelly.bell");
  EXPECT_EQ(s.bodies.at(1).density, 900.0);
  EXPECT_EQ(s.bodies.at(2).name, "jelly.arm");
  EXPECT_EQ(s.bodies.at(2).archetype, "special/arm.h5");
  EXPECT_EQ(s.bodies.at(2).modes, 4);
  EXPECT_EQ(s.skins.at(1).archetype, "special/own.h5");
  EXPECT_EQ(s.skins.at(1).bodies, std::vector<int>{0});

  EXPECT_EQ(s.statics.at(0).mesh, "meshes/rocks.obj");
  EXPECT_EQ(s.statics.at(0).scale, 2.0);
  EXPECT_EQ(s.expect.iterations, 30);
  EXPECT_EQ(s.expect.bodies.at(0).z_max, 0.4);
  EXPECT_EQ(s.expect.bodies.at(0).window, 0.5);
  EXPECT_EQ(s.expect.bodies.at(0).z, 0.25);
  EXPECT_EQ(s.expect.bodies.at(0).draft, 0.5);
  EXPECT_EQ(s.expect.bodies.at(0).margin, 0.01);
}

// Whether a table, or any entry of a list of tables on the way, has the key of this path.
bool has_key(const ParamNode& table, const std::string& path) {
  const std::size_t dot = path.find('.');
  std::string name = path.substr(0, dot);
  const bool list = name.ends_with("[]");
  if (list) name.resize(name.size() - 2);
  const ParamNode* at = table.find(name);
  if (!at || dot == std::string::npos) return at != nullptr;
  const std::string rest = path.substr(dot + 1);
  if (!list) return has_key(*at, rest);
  return std::any_of(at->items.begin(), at->items.end(),
                     [&](const ParamNode& entry) { return has_key(entry, rest); });
}

TEST(ParseScene, EveryAcceptedKeyOfTheSchemaIsInTheTestAbove) {
  // to_scene() already throws when a key of the file is never read; this closes the other half: no
  // row of the schema is left out of kEverything.
  const ParamNode root = parse_param_text(std::string(kParsedHead) + kEverything, "everything");
  for (const Key& key : scene_schema().keys()) {
    if (!key.later.empty() && key.later_values.empty()) continue;
    EXPECT_TRUE(has_key(root, key.path)) << key.path;
  }
}

TEST(ParseScene, SkinsNameTheirBodiesOnce) {
  const std::string bodies =
      "[[body]]\nname = \"bell\"\narchetype = \"b\"\nposition = [0, 0, 0]\n"
      "[[body]]\nname = \"arm\"\narchetype = \"a\"\nposition = [0, 0, 0]\n";
  const auto skin = [&](const std::string& keys) {
    return complaint(bodies + "[[skin]]\narchetype = \"s\"\n" + keys);
  };
  expect_contains(skin("bodies = [\"bel\", \"arm\"]\n"), "did you mean \"bell\"?");
  expect_contains(skin("bodies = [\"arm\", \"arm\"]\n"), "\"arm\" stands twice");
  expect_contains(skin("bodies = [\"arm\"]\n[[skin]]\narchetype = \"s\"\nbodies = [\"arm\"]\n"),
                  "\"arm\" has a skin already");
  expect_contains(skin("bodies = [\"bell\"]\nposition = [0, 0, 0]\n"), "position belongs to parts");
  expect_contains(skin("parts = [\"a\"]\n"), "position is missing");
  expect_contains(skin("parts = [\"a\"]\nbodies = [\"arm\"]\nposition = [0, 0, 0]\n"),
                  "expected either parts or bodies");
}

TEST(ParseScene, AbsentSectionsSwitchOff) {
  const SceneSpec s = parse("");
  EXPECT_EQ(s.name, "tub");
  EXPECT_FALSE(s.fluid);
  EXPECT_TRUE(s.bodies.empty());
  EXPECT_EQ(s.gravity, Vec3(0, 0, -9.81));
  EXPECT_EQ(s.restitution, 0.0);
  EXPECT_EQ(s.limits.volume_drift, std::nullopt);
  EXPECT_FALSE(s.checkpoints);
  const SceneSpec full = parse("[fluid]\ngrid = [2, 2, 2]\ncell = 1\n");
  EXPECT_TRUE(full.fluid->water.full);
  EXPECT_EQ(full.fluid->particles_per_cell, 0);
  EXPECT_FALSE(full.fluid->damping.any());
  EXPECT_EQ(
      parse("[fluid]\ngrid = [2, 2, 2]\ncell = 1\nparticles = {}\n").fluid->particles_per_cell, 64);
}

TEST(ParseScene, DefaultsOfTheSchemaAreThoseOfTheOptions) {
  const SceneSpec s = parse("");
  const SimulationOptions o;
  EXPECT_EQ(s.cfl, o.cfl);
  EXPECT_EQ(s.outrun, o.outrun);
  EXPECT_EQ(s.max_dt, o.max_dt);
  EXPECT_EQ(s.scheme, o.scheme);
  EXPECT_EQ(s.geometry, o.geometry);
  EXPECT_EQ(s.tolerance, 1e-5);  // programs that say nothing solve exactly [D88]
  EXPECT_EQ(s.max_iterations, o.max_iterations);
  EXPECT_EQ(s.modal.step, o.modal.step);
  EXPECT_EQ(s.modal.mass, o.modal.mass);
  EXPECT_EQ(s.on_fail, o.on_fail);
  EXPECT_EQ(s.gravity, o.gravity);
}

TEST(ParseScene, ContactBetweenBodiesComesWithTheSection) {
  EXPECT_FALSE(parse("").body_contact);
  EXPECT_TRUE(parse("[contact]\nfriction = 0.4\n").body_contact);
  EXPECT_FALSE(parse("[contact]\nbodies = false\n").body_contact);
  expect_contains(complaint("[[scatter]]\narchetype = \"a\"\ncount = 2\n"
                            "box = [[0,0,0],[1,1,1]]\nwaves = { count = 5, every = 0.4 }\n"),
                  "more waves than bodies");
}

TEST(ParseScene, JointsNameBodiesAndHavePoints) {
  const std::string two =
      "[[body]]\narchetype = \"a\"\nposition = [0, 0, 0]\n"
      "[[body]]\nname = \"arm\"\narchetype = \"a\"\nposition = [1, 0, 0]\n";
  const SceneSpec s = parse(two + "[[joint]]\nbodies = [\"arm\", \"a\"]\npoints = [[0, 0, 0]]\n");
  EXPECT_EQ(s.joints.at(0).a, 1);
  EXPECT_EQ(s.joints.at(0).b, 0);
  const auto wrong = [&](const std::string& joint) {
    return complaint(two + "[[joint]]\n" + joint);
  };
  expect_contains(wrong("bodies = [\"arn\", \"a\"]\npoints = [[0, 0, 0]]\n"),
                  "joint[0].bodies: there is no [[body]] called \"arn\"");
  expect_contains(wrong("bodies = [\"arn\", \"a\"]\npoints = [[0, 0, 0]]\n"),
                  "did you mean \"arm\"?");
  expect_contains(wrong("bodies = [\"arm\", \"arm\"]\npoints = [[0, 0, 0]]\n"), "to itself");
  expect_contains(wrong("bodies = [\"world\", \"a\"]\npoints = [[0, 0, 0]]\n"),
                  "expected two names, the first of a body");
  expect_contains(wrong("bodies = [\"arm\", \"a\"]\n"), "the joint has no points");
  expect_contains(wrong("bodies = [\"arm\", \"a\"]\npoints = [[0, 0, 0]]\ntype = \"weld\"\n"),
                  "type is that of a frame");
  const std::string twin = "[[body]]\narchetype = \"a\"\nposition = [2, 0, 0]\n";
  expect_contains(
      complaint(two + twin + "[[joint]]\nbodies = [\"arm\", \"a\"]\npoints = [[0, 0, 0]]\n"),
      "two bodies are called \"a\"");
}

TEST(ParseScene, ClampsHoldABodyByAPlane) {
  const std::string body = "[[body]]\narchetype = \"a\"\nposition = [0, 0, 0]\n";
  const SceneSpec s =
      parse(body + body + "name = \"b\"\nclamp = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]]\n");
  ASSERT_EQ(s.joints.size(), 1u);
  EXPECT_EQ(s.joints[0].name, "body[1].clamp");
  EXPECT_EQ(s.joints[0].a, 1);
  EXPECT_EQ(s.joints[0].b, -1);
  EXPECT_EQ(s.joints[0].points.size(), 4u);
  for (const char* line : {"[[0, 0, 0], [1, 2, 3]]", "[[0, 0, 1], [0, 0, 1], [0, 0, 2]]", "[]"})
    expect_contains(complaint(body + "clamp = " + line + "\n"),
                    "body[0].clamp: expected three points or more that are not on one line");
  expect_contains(complaint(body + "clamp = [1, 2, 3]\n"), "list of [x, y, z] or string");
}

TEST(ParseScene, ForcesHaveADirectionAndTimes) {
  const ForceSpec all = parse(kEverything).forces.at(0);
  EXPECT_EQ(all.body, "first");
  EXPECT_EQ(all.points, "rim");
  EXPECT_EQ(all.direction.kind, ActuationDirection::Kind::kVector);
  EXPECT_EQ(all.direction.vector, Vec3(0, 0, 2));
  EXPECT_EQ(all.amplitude, 2.0);
  EXPECT_EQ(all.period, 1.2);
  EXPECT_DOUBLE_EQ(all.phase, std::numbers::pi / 2.0);
  EXPECT_TRUE(all.random_phases);
  EXPECT_EQ(all.seed, 5u);
  EXPECT_FALSE(all.balanced);
  EXPECT_EQ(all.start, 0.5);
  EXPECT_EQ(all.end, 2.0);

  const std::string head = "[[force]]\nbody = \"a\"\npoints = \"p\"\namplitude = 1\nperiod = 2\n";
  const ForceSpec least = parse(head).forces.at(0);
  EXPECT_EQ(least.direction.kind, ActuationDirection::Kind::kNormal);
  EXPECT_TRUE(least.balanced);
  EXPECT_FALSE(least.end);
  EXPECT_EQ(parse(head + "direction = \"inward\"\n").forces.at(0).direction.kind,
            ActuationDirection::Kind::kInward);
  expect_contains(complaint(head + "direction = [0, 0, 0]\n"), "the vector has no length");
  expect_contains(complaint(head + "direction = \"radiol\"\n"), "did you mean \"radial\"?");
  expect_contains(complaint(head + "direction = 3\n"), "[x, y, z] or string");
  expect_contains(complaint(head + "start = 2\nend = 1\n"), "ends before it starts");
}

TEST(ParseScene, ExternalLoadsAreConstantOrATable) {
  const std::vector<ExternalSpec> both = parse(kEverything).externals;
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].body, "first");
  EXPECT_EQ(both[0].force, Vec3(1, 0, -2));
  EXPECT_EQ(both[0].torque, Vec3(0, 3, 0));
  EXPECT_EQ(both[0].start, 0.25);
  EXPECT_EQ(both[0].end, 0.75);
  EXPECT_TRUE(both[1].csv.ends_with("push.csv"));
  const std::string head = "[[external]]\nbody = \"a\"\n";
  expect_contains(complaint(head), "nothing acts on the body");
  expect_contains(complaint(head + "force = [1, 0, 0]\ncsv = \"a.csv\"\n"), "in the table already");
  expect_contains(complaint(head + "force = [1, 0, 0]\nstart = 2\nend = 1\n"),
                  "ends before it starts");
}

TEST(ParseScene, ObstaclesMayMove) {
  const std::vector<StaticSpec> all = parse(kEverything).statics;
  ASSERT_EQ(all.size(), 3u);
  EXPECT_FALSE(all[0].moves());
  ASSERT_EQ(all[1].motion.keys.size(), 2u);
  EXPECT_EQ(all[1].motion.keys[0].t, 0.5);
  EXPECT_EQ(all[1].motion.keys[0].shift, Vec3::Zero());
  EXPECT_EQ(all[1].motion.keys[1].shift, Vec3(0, 0, 2));
  EXPECT_NEAR((all[1].motion.keys[1].turn * Vec3(1, 0, 0) - Vec3(0, 1, 0)).norm(), 0.0, 1e-15);
  EXPECT_EQ(all[2].motion_csv, "dir/way.csv");
  const std::string head = "[[static]]\nmesh = \"a.obj\"\nmotion = ";
  expect_contains(complaint(head + "[{ t = 1 }, { t = 1 }]\n"), "times must ascend");
  expect_contains(complaint(head + "[]\n"), "it has no keys");
  expect_contains(complaint(head + "[{ position = [0, 0, 1] }]\n"),
                  "missing key 'static[0].motion[0].t'");
  expect_contains(complaint(head + "3\n"), "expected list of tables or string");
  expect_contains(complaint(head + "[{ t = 0 }, { t = 1, rotation = { axis = [0, 0, 1], degrees = "
                                   "360 } }]\n"),
                  "more than 120 degrees");
}

TEST(ParseScene, SpringsTieTwoPoints) {
  const std::vector<SpringSpec> one = parse(kEverything).springs;
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].b, -1);
  EXPECT_EQ(one[0].points, (std::vector<Vec3>{{0, 0, 0.1}, {1, 2, 3}}));
  EXPECT_EQ(one[0].stiffness, 50.0);
  EXPECT_EQ(one[0].damping, 2.0);
  EXPECT_EQ(one[0].length, 0.5);
  EXPECT_TRUE(one[0].slack);
  const std::string body =
      "[[body]]\narchetype = \"a\"\nposition = [0, 0, 0]\n[[spring]]\nstiffness = 1\n";
  expect_contains(complaint(body + "bodies = [\"a\", \"world\"]\npoints = [[0, 0, 0]]\n"),
                  "expected two points");
  expect_contains(complaint(body + "bodies = [\"a\", \"a\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n"),
                  "tied to itself");
  expect_contains(complaint(body + "bodies = [\"a\", \"wold\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n"),
                  "no [[body]] called");
}

TEST(ParseScene, MotorsTurnOneBodyAgainstAnother) {
  const std::vector<Motor> one = parse(kEverything).motors;
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].a, 0);
  EXPECT_EQ(one[0].b, -1);
  EXPECT_EQ(one[0].axis, Vec3(0, 0, 1));
  EXPECT_EQ(one[0].torque, 3.0);
  EXPECT_EQ(one[0].speed, 12.0);
  EXPECT_EQ(one[0].period, 0.5);
  EXPECT_DOUBLE_EQ(one[0].phase, 0.5 * M_PI);
  EXPECT_EQ(one[0].start, 0.25);
  EXPECT_EQ(one[0].end, 4.0);
  const std::string head =
      "[[body]]\narchetype = \"a\"\nposition = [0, 0, 0]\n[[motor]]\n"
      "bodies = [\"a\", \"world\"]\ntorque = 1\n";
  const std::vector<Motor> plain = parse(head + "axis = [1, 0, 0]\n").motors;
  EXPECT_EQ(plain.at(0).speed, INFINITY);
  EXPECT_EQ(plain.at(0).period, INFINITY);
  EXPECT_EQ(plain.at(0).end, INFINITY);
  expect_contains(complaint(head + "axis = [0, 0, 0]\n"), "the vector has no length");
  expect_contains(complaint(head), "missing key 'motor[0].axis'");
  expect_contains(complaint(head + "axis = [1, 0, 0]\nstart = 2\nend = 1\n"),
                  "the motor ends before it starts");
}

TEST(ParseScene, SourcesAreBoxesOrBalls) {
  const std::vector<WaterSource> both = parse(kEverything).sources;
  ASSERT_EQ(both.size(), 2u);
  EXPECT_FALSE(both[0].ball);
  EXPECT_EQ(both[0].high, Vec3(-0.5, 1, 3));
  EXPECT_EQ(both[0].velocity, Vec3(1, 0, -2));
  EXPECT_TRUE(both[0].pours(0.25));
  EXPECT_FALSE(both[0].pours(0.75));
  EXPECT_TRUE(both[1].ball);
  EXPECT_EQ(both[1].low, Vec3(-0.75, 0.25, 1.75));
  EXPECT_DOUBLE_EQ(both[1].distance(Vec3(-0.5, 0.5, 2.5)), 0.25);
  EXPECT_EQ(both[1].end, INFINITY);
  const std::string tank = "[fluid]\ngrid = [8, 8, 8]\ncell = 0.1\n";
  const std::string head = "[[source]]\nvelocity = [1, 0, 0]\n";
  const std::string box = "box = [[0, 0, 0], [0.4, 0.4, 0.4]]\n";
  expect_contains(complaint(head + box), "a source needs a tank");
  expect_contains(complaint(tank + head), "expected a box, or centre and radius");
  expect_contains(complaint(tank + head + box + "radius = 1\n"), "expected a box, or");
  expect_contains(complaint(tank + head + "box = [[0, 0, 0], [0.4, 0.4, 0.15]]\n"),
                  "thinner than two cells");
  expect_contains(complaint(tank + head + "centre = [2, 0, 0]\nradius = 0.3\n"), "not in the tank");
  expect_contains(complaint(tank + head + box + "start = 2\nend = 1\n"),
                  "the source ends before it starts");
}

TEST(ParseScene, WaveMakersAreToldAHeightOrAStroke) {
  const std::vector<WavemakerSpec> both = parse(kEverything).wavemakers;
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].side, kYMax);
  EXPECT_TRUE(both[0].flap);
  EXPECT_EQ(both[0].height, 0.1);
  EXPECT_FALSE(both[0].stroke);
  EXPECT_EQ(both[0].period, 1.5);
  EXPECT_EQ(both[0].ramp, 2.0);
  EXPECT_EQ(both[0].front, 0.3);
  EXPECT_EQ(both[1].side, kXMin);
  EXPECT_FALSE(both[1].flap);
  EXPECT_EQ(both[1].stroke, 0.05);
  EXPECT_FALSE(both[1].ramp);
  const std::string head = "[[wavemaker]]\nside = \"xmax\"\nperiod = 1\n";
  expect_contains(complaint(head), "expected either height or stroke");
  expect_contains(complaint(head + "height = 1\nstroke = 1\n"), "expected either");
  expect_contains(complaint("[[wavemaker]]\nside = \"zmin\"\nperiod = 1\nheight = 1\n"),
                  "\"xmin\"");
}

TEST(ParseScene, MarkersLieInABoxOrABall) {
  const std::vector<MarkersSpec> both = parse(kEverything).markers;
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].count, 100);
  EXPECT_EQ(both[0].seed, 4u);
  EXPECT_EQ(both[0].box->high, Vec3(0.5, 1, 2));
  EXPECT_EQ(both[1].ball->centre, Vec3(1, 2, 3));
  EXPECT_EQ(both[1].ball->radius, 0.5);
  const std::string tank = "[fluid]\ngrid = [8, 8, 8]\ncell = 0.1\n";
  const std::string head = "[[markers]]\ncount = 3\n";
  expect_contains(complaint(head + "centre = [0, 0, 0]\nradius = 1\n"), "markers need water");
  expect_contains(complaint(tank + head), "expected a box, or centre and radius");
  expect_contains(complaint(tank + head + "radius = 1\n"), "expected a box, or centre");
  expect_contains(complaint(tank + head + "box = [[0, 0, 0]]\n"), "expected two corners");
}

TEST(ParseScene, GaugesHaveNamesOfTheirOwnAndLieInTheTank) {
  const std::vector<Gauge> one = parse(kEverything).gauges;
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].name, "wall-1");
  EXPECT_EQ(one[0].point, Vec3(-1, 0.2, 1.5));
  const std::string tank = "[fluid]\ngrid = [8, 8, 8]\ncell = 0.1\n";
  const std::string gauge = "[[gauge]]\npoint = [0.1, 0.2, 0.8]\n";
  const std::vector<Gauge> two = parse(tank + gauge + gauge).gauges;
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].name, "g1");
  EXPECT_EQ(two[1].name, "g2");
  expect_contains(complaint(gauge), "a gauge needs water");
  expect_contains(complaint(tank + "[[gauge]]\npoint = [0.1, 0.2, 0.81]\n"), "not in the tank");
  expect_contains(complaint(tank + gauge + "name = \"a,b\"\n"), "letters, digits");
  expect_contains(complaint(tank + gauge + "name = \"\"\n"), "letters, digits");
  expect_contains(complaint(tank + gauge + "name = \"g2\"\n" + gauge),
                  "there is a gauge \"g2\" already");
}

TEST(ParseScene, ModesAreANumberOrAllOrEveryDegreeOfFreedom) {
  const std::string body = "[[body]]\narchetype = \"a\"\nposition = [0, 0, 0]\nmodes = ";
  const auto first = [&](const char* value) { return parse(body + value + "\n").bodies.at(0); };
  EXPECT_EQ(first("3").modes, 3);
  EXPECT_FALSE(first("\"all\"").modes || first("\"all\"").every_motion);
  EXPECT_TRUE(!first("\"full\"").modes && first("\"full\"").every_motion);
  expect_contains(complaint(body + "\"every\"\n"), "\"every\" is not allowed here");
}

TEST(ParseScene, FeaturesOfLaterVersionsAreRefusedByName) {
  for (const char* kind : {"surface.vdb", "phi.vti"}) {
    expect_contains(complaint("[output]\nframes = [\"" + std::string(kind) + "\"]\n"),
                    "not in this version");
  }
}

TEST(ParseScene, ComplaintsThatNeedMoreThanOneKeyComeTogether) {
  const std::string text = complaint(R"(
    [fluid]
    grid = [8, 8, 8]
    cell = 0.1
    water = { level = 0.9, boxes = [{ low = [1, 0, 0], high = [0, 1, 1] }] }
    beach = { ymax = 1.0, rate = 1.0 }
    [[body]]
    archetype = "a"
    position = [0, 0, 0]
    rotation = { axis = [0, 0, 0], degrees = 1 }
    [[scatter]]
    archetype = "a"
    count = 1
    box = [[0, 0, 0]]
    [[expect.body]]
    body = 2
  )");
  expect_contains(text, "fluid.water.level: the water stands above the tank");
  expect_contains(text, "fluid.water.boxes[0].low: the first corner is not the low one");
  expect_contains(text, "fluid.beach.ymax: the beach is wider than the tank");
  expect_contains(text, "body[0].rotation.axis: the axis has no length");
  expect_contains(text, "scatter[0].box: expected two corners");
  expect_contains(text, "expect.body[0].body: there is no body 2");
}

TEST(ParseScene, AnEmptyWaterTableIsRefused) {
  expect_contains(complaint("[fluid]\ngrid = [8, 8, 8]\ncell = 0.1\nwater = {}\n"),
                  "the table is empty");
}

TEST(ParseScene, OverridesReachEverySection) {
  const SceneSpec s = parse(kEverything, {"fluid.grid=[2, 2, 4]", "body.modes=0", "time.end=1.0",
                                          "scatter[0].count=9", "source=absent"});
  EXPECT_EQ(s.fluid->cells, Vec3i(2, 2, 4));
  EXPECT_EQ(s.bodies.at(0).modes, 0);
  EXPECT_EQ(s.end_time, 1.0);
  EXPECT_EQ(s.scatters.at(0).count, 9);
  const SceneSpec again = parse_scene_text(s.text, "dir/tub.scene.toml");
  EXPECT_EQ(again.fluid->cells, Vec3i(2, 2, 4));
  EXPECT_EQ(again.bodies.at(0).modes, 0);
}

TEST(ParseScene, MissingFileIsAFileError) {
  EXPECT_THROW(parse_scene("/no/such.scene.toml"), FileError);
}

TEST(SceneSchema, EveryDefaultParsesAndValidates) {
  for (const Key& key : scene_schema().keys()) {
    EXPECT_FALSE(key.meaning.empty()) << key.path;
    EXPECT_FALSE(key.fallback.empty()) << key.path;
    if (key.fallback == "required" || key.fallback == "absent") continue;
    const ParamNode node = parse_param_text("x = " + key.fallback + "\n", key.path);
    EXPECT_TRUE(check_value(key, *node.find("x"), key.path).empty()) << key.path;
  }
}

}  // namespace
}  // namespace archetide
