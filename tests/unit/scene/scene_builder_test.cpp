#include "runtime/scene/scene_builder.h"

#include <gtest/gtest.h>

#include "common/files/make_word.h"
#include "common/mesh/mesh_sdf.h"
#include "runtime/scene/add_wavemaker.h"
#include "runtime/scene/initial_water.h"
#include "runtime/scene/parse_scene.h"
#include "runtime/scene/scatter.h"
#include "runtime/solid/extent.h"
#include "scene_test_support.h"

namespace archetide {
namespace {

const char* const kHead = "schema = 1\ntime = { end = 1.0 }\n";

// A scene folder with one archetype, "tetra".
class BuildScene : public testing::Test {
 protected:
  BuildScene() { write_archetype(folder_ / "tetra.h5", tetrahedron_archetype("tetra")); }

  BuiltScene build(const std::string& text) {
    folder_.write("s.scene.toml", kHead + text);
    ArchetypeLibrary library(folder_.path(), folder_.path());
    return build_scene(parse_scene(folder_ / "s.scene.toml"), library);
  }

  ScratchFolder folder_;
};

TEST_F(BuildScene, MomentaFollowFromVelocitiesAndDensity) {
  const BuiltScene built = build(R"([[body]]
    archetype = "tetra"
    position = [1, 2, 3]
    rotation = { axis = [0, 0, 1], degrees = 90 }
    velocity = [0, 0, -2]
    angular_velocity = [0, 0, 3]
    density = 800)");
  const ReducedBody& body = built.bodies.at(0);
  const double mass = 800.0 / 6.0;  // density times the volume of the unit corner tetrahedron
  EXPECT_DOUBLE_EQ(body.mass_scale, 2.0);
  EXPECT_NEAR((body.P - Vec3(0, 0, -2 * mass)).norm(), 0.0, 1e-12 * mass);
  // Corner tetrahedron about its centroid: int x^2 = 1/160 each, int x y = -1/480; turning about z
  // by 90 degrees flips the sign of I_yz only. L = I w with w = 3 z: I_zz = 2/160, I_xz = 1/480 rho
  // w, I_yz likewise.
  const Vec3 L = 800.0 * 3.0 * Vec3(-1.0 / 480, 1.0 / 480, 2.0 / 160);
  EXPECT_NEAR((body.L - L).norm(), 0.0, 1e-12 * L.norm());
  EXPECT_EQ(body.r, 2);  // all that are stored
  EXPECT_EQ(body.q, VecX::Zero(2));
  EXPECT_EQ(built.body_names.at(0), "tetra");
}

TEST_F(BuildScene, BodiesOfNodesNeedAnArchetypeThatKeepsItsTets) {
  const std::string body =
      "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\ndeformable = \"full\"\n";
  const std::string message = message_of<InputError>([&] { build(body); });
  expect_contains(message, "s.scene.toml:6");
  expect_contains(message, "archetype tetra does not keep");
  expect_contains(message, "set keep = \"tets\" in its body file and build it again");
}

TEST_F(BuildScene, BodiesOfNodesHaveNoNumberOfModes) {
  const std::string message = message_of<InputError>([&] {
    build(
        "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\ndeformable = \"full\"\nmodes = "
        "2\n");
  });
  expect_contains(message, "s.scene.toml:7");
  expect_contains(message, "remove modes, or remove deformable");
}

TEST_F(BuildScene, BodiesOfNodesAreRefusedBesideSkins) {
  const std::string message = message_of<InputError>([&] {
    build(
        "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\ndeformable = \"full\"\n"
        "[contact]\nfriction = 0.1\n"
        "[[skin]]\narchetype = \"tetra\"\nbodies = [\"tetra\"]\n");
  });
  expect_contains(message, "bodies with deformable = \"full\" are not possible with [[skin]]");
}

TEST_F(BuildScene, BodiesWhoseModesAreClampedAreRefused) {
  Archetype a = tetrahedron_archetype("held");
  a.point_sets = {{"base", {0}}};
  a.clamped = "base";
  write_archetype(folder_ / "held.h5", a);
  const std::string message = message_of<InputError>(
      [&] { build("[[body]]\narchetype = \"held\"\nposition = [0, 0, 0]\n"); });
  expect_contains(message, "s.scene.toml:4");
  expect_contains(message, "computed clamped at \"base\"");
  expect_contains(message, "remove clamped from its body file");
}

TEST_F(BuildScene, JointsTakePointsFramesAndPointSets) {
  Archetype a = tetrahedron_archetype("jointed");
  a.joint_frames = {{"hip", Vec3(0.1, 0, 0), Mat3::Identity()}};
  a.point_sets = {{"tips", {1, 2}}};
  write_archetype(folder_ / "jointed.h5", a);
  const std::string bodies =
      "[[body]]\narchetype = \"jointed\"\nposition = [0, 0, 0]\nmodes = 0\n"
      "[[body]]\narchetype = \"tetra\"\nposition = [1, 2, 3]\n"
      "rotation = { axis = [0, 0, 1], degrees = 90 }\nmodes = 0\n";
  const std::string head = "[[joint]]\nbodies = [\"jointed\", \"tetra\"]\n";
  const BuiltScene built =
      build(bodies + head +
            "points = [[0, 0, 0.3]]\nframe = \"hip\"\ntype = \"hinge\"\npoint_set = \"tips\"\n");
  const Joint& joint = built.joints.at(0);
  ASSERT_EQ(joint.at_a.size(), 5u);
  EXPECT_EQ(joint.at_a[0].rest, Vec3(0, 0, 0.3));
  EXPECT_EQ(joint.at_a[1].rest, Vec3(0.1, 0, 0));
  EXPECT_NEAR((joint.at_a[2].rest - Vec3(0.1, 0, 0.1 * bounding_radius(a))).norm(), 0.0, 1e-15);
  EXPECT_EQ(joint.at_a[3].rest, a.surface.vertices[1]);
  EXPECT_LE(joint_drift(built.joints, built.bodies), 1e-15);
  expect_contains(message_of<InputError>([&] { build(bodies + head + "frame = \"hep\"\n"); }),
                  "archetype jointed has no joint frame \"hep\"");
  expect_contains(message_of<InputError>([&] { build(bodies + head + "point_set = \"t\"\n"); }),
                  "archetype jointed has no point set \"t\"");
  expect_contains(
      message_of<InputError>([&] {
        build("[step]\nscheme = \"single\"\n" + bodies + head + "points = [[0, 0, 0]]\n");
      }),
      "joints are not possible with step.scheme = \"single\"");
  const BuiltScene held = build(
      "[[body]]\narchetype = \"jointed\"\nposition = [1, 0, 0]\nmodes = 0\n"
      "clamp = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n" +
      bodies.substr(bodies.find("[[body]]", 1)) + "[[joint]]\nbodies = [\"tetra\", \"world\"]\n" +
      "points = [[0, 0, 0]]\n");
  EXPECT_EQ(held.joint_names, (std::vector<std::string>{"body[0].clamp", "[[joint]] 1"}));
  EXPECT_EQ(held.joints.at(0).b, -1);
  EXPECT_EQ(held.joints.at(0).at_world.at(1), Vec3(2, 0, 0));
  expect_contains(message_of<InputError>([&] {
                    build(
                        "[[body]]\narchetype = \"jointed\"\nposition = [0, 0, 0]\nmodes = 0\n"
                        "clamp = \"foot\"\n");
                  }),
                  "s.scene.toml:7:9: error: archetype jointed has no point set \"foot\"");
  const std::string soft = "[[body]]\narchetype = \"tetra\"\nposition = [9, 0, 0]\n";
  expect_contains(message_of<InputError>([&] {
                    build("[[body]]\narchetype = \"jointed\"\nposition = [0, 0, 0]\nmodes = 0\n" +
                          soft + head + "points = [[0, 0, 0]]\n");
                  }),
                  "m from the centre of tetra, a soft body");
}

TEST_F(BuildScene, SpringsAreWithoutForceAsTheBodiesBegin) {
  write_archetype(folder_ / "stone.h5", tetrahedron_archetype("stone"));
  const std::string text =
      "[[body]]\narchetype = \"stone\"\nname = \"a\"\nposition = [0, 0, 0]\n"
      "[[body]]\narchetype = \"stone\"\nname = \"b\"\nposition = [5, 0, 0]\n"
      "[[spring]]\nbodies = [\"a\", \"b\"]\npoints = [[0, 0, 0], [1, 0, 0]]\nstiffness = 3\n";
  const BuiltScene built = build(text);
  ASSERT_EQ(built.springs.size(), 1u);
  EXPECT_EQ(built.springs[0].b, 1);
  EXPECT_DOUBLE_EQ(built.springs[0].length, 6.0);
  EXPECT_EQ(build(text + "length = 2\n").springs.at(0).length, 2.0);
  EXPECT_TRUE(built.notes.empty());
  const BuiltScene stiff = build(text + "damping = 1e9\n");
  ASSERT_EQ(stiff.notes.size(), 1u);
  expect_contains(stiff.notes[0], "spring: that between a and b asks for steps of");
  const std::string soft = "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\n";
  expect_contains(message_of<InputError>([&] {
                    build(soft +
                          "[[spring]]\nbodies = [\"tetra\", \"world\"]\n"
                          "points = [[9, 0, 0], [9, 0, 1]]\nstiffness = 3\n");
                  }),
                  "a point of the spring is 9");
}

TEST_F(BuildScene, ExternalLoadsComeFromTheFileOrATable) {
  write_archetype(folder_ / "stone.h5", tetrahedron_archetype("stone"));
  const std::string body = "[[body]]\narchetype = \"stone\"\nposition = [0, 0, 0]\n[[external]]\n";
  const std::string named = body + "body = \"stone\"\n";
  const BuiltScene constant = build(named + "force = [1, 2, 3]\nend = 4\n");
  ASSERT_EQ(constant.loads.size(), 1u);
  EXPECT_EQ(constant.loads[0].at(4.0).force, Vec3(1, 2, 3));
  EXPECT_EQ(constant.loads[0].at(4.1).force, Vec3::Zero());
  folder_.write("push.csv", "t,fz,tx\n0,1,0\n2,5,-4\n");
  const BuiltScene table = build(named + "csv = \"push.csv\"\n");
  EXPECT_EQ(table.loads.at(0).at(0.5).force, Vec3(0, 0, 2));
  EXPECT_EQ(table.loads[0].at(0.5).torque, Vec3(-1, 0, 0));
  EXPECT_EQ(table.loads[0].at(9.0).force, Vec3(0, 0, 5));

  const auto wrong = [&](const std::string& rows) {
    folder_.write("push.csv", rows);
    return message_of<InputError>([&] { build(named + "csv = \"push.csv\"\n"); });
  };
  expect_contains(wrong("t,fz\n0,1\n0,2\n"), "line 3: times must ascend");
  expect_contains(wrong("t,fz\n0,one\n"), "line 2 holds something that is no number");
  expect_contains(wrong("t,fq\n0,1\n"), "no column may be called \"fq\"");
  expect_contains(wrong("t\n0\n"), "no values");
  expect_contains(
      message_of<InputError>([&] { build(body + "body = \"stune\"\nforce = [1, 0, 0]\n"); }),
      "did you mean \"stone\"?");
  EXPECT_THROW(build(named + "csv = \"none.csv\"\n"), FileError);
}

TEST_F(BuildScene, ForcesActOnEveryBodyOfTheirNameWithPhasesBySeed) {
  Archetype a = tetrahedron_archetype("driven");
  a.surface_modes = MatX::Zero(12, 2);  // a mode that spreads the corners
  for (int v = 0; v < 4; ++v) a.surface_modes.block<3, 1>(3 * v, 0) = a.surface.vertices[v];
  a.point_sets = {{"all", {0, 1, 2, 3}}, {"one", {2}}};
  write_archetype(folder_ / "driven.h5", a);
  const std::string scatter =
      "[[scatter]]\narchetype = \"driven\"\ncount = 3\nbox = [[0, 0, 0], [9, 9, 9]]\n"
      "[[body]]\nname = \"stiff\"\narchetype = \"driven\"\nposition = [20, 0, 0]\nmodes = 0\n";
  const auto force = [&](const std::string& rest) {
    return scatter + "[[force]]\namplitude = 2\nperiod = 0.5\n" + rest;
  };
  const BuiltScene built =
      build(force("body = \"driven\"\npoints = \"all\"\nphases = \"random\"\nphase = 90\n"));
  ASSERT_EQ(built.actuators.size(), 3u);
  for (int n = 0; n < 3; ++n) {
    EXPECT_EQ(built.actuators[n].body, n + 1);  // the [[body]] stands first
    EXPECT_EQ(built.actuators[n].amplitude, 2.0);
    EXPECT_EQ(built.actuators[n].pattern, built.actuators[0].pattern);  // shared
    EXPECT_GE(built.actuators[n].phase, EIGEN_PI / 2.0);
  }
  EXPECT_NE(built.actuators[0].phase, built.actuators[1].phase);
  const BuiltScene same = build(force("body = \"driven\"\npoints = \"all\"\n"));
  EXPECT_EQ(same.actuators[0].phase, same.actuators[2].phase);

  const auto wrong = [&](const std::string& rest) {
    return message_of<InputError>([&] { build(force(rest)); });
  };
  expect_contains(wrong("body = \"drivem\"\npoints = \"all\"\n"), "s.scene.toml:15");
  expect_contains(wrong("body = \"drivem\"\npoints = \"all\"\n"), "did you mean \"driven\"?");
  expect_contains(wrong("body = \"driven\"\npoints = \"al\"\n"), "has no point set \"al\"");
  expect_contains(wrong("body = \"stiff\"\npoints = \"all\"\n"), "is rigid");
  expect_contains(wrong("body = \"driven\"\npoints = \"one\"\n"), "takes the whole force away");
  expect_contains(wrong("body = \"driven\"\npoints = \"all\"\ndirection = [0, 0, 1]\n"),
                  "balance = \"body\"");
  // the modes have no momentum of their own, so a push of all points alike does not reach them
  expect_contains(wrong("body = \"driven\"\npoints = \"all\"\ndirection = [0, 0, 1]\n"
                        "balance = \"body\"\n"),
                  "none of the 2 modes of archetype driven gives way");
}

TEST_F(BuildScene, MarkersLieInTheWaterOfTheirPlaces) {
  const std::string tank = "[fluid]\ngrid = [8, 8, 8]\ncell = 0.125\nwater = { level = 0.5 }\n";
  const auto markers = [&](const std::string& place) {
    folder_.write("s.scene.toml", kHead + tank + "[[markers]]\ncount = 500\n" + place);
    ArchetypeLibrary library(folder_.path(), folder_.path());
    const SceneSpec scene = parse_scene(folder_ / "s.scene.toml");
    return make_simulation(build_scene(scene, library), scene).fluid().markers;
  };
  const auto in_box = markers("box = [[0.2, 0.1, 0.1], [0.4, 2.0, 2.0]]\n");
  ASSERT_EQ(in_box.size(), 500u);
  for (const Vec3& x : in_box) {
    EXPECT_TRUE(x[0] >= 0.2 && x[0] <= 0.4 && x[1] <= 1.0);
    EXPECT_LE(x[2], 0.5);
  }
  const auto in_ball = markers("centre = [0.5, 0.5, 0.3]\nradius = 0.1\n");
  Vec3 mean = Vec3::Zero();
  for (const Vec3& x : in_ball) {
    EXPECT_LE((x - Vec3(0.5, 0.5, 0.3)).norm(), 0.1);
    mean += x / 500.0;
  }
  EXPECT_LE((mean - Vec3(0.5, 0.5, 0.3)).norm(), 0.01);  // 0.1 sqrt(3/5) / sqrt(500) = 0.0035
  EXPECT_EQ(in_ball, markers("centre = [0.5, 0.5, 0.3]\nradius = 0.1\n"));
  EXPECT_NE(in_ball, markers("centre = [0.5, 0.5, 0.3]\nradius = 0.1\nseed = 2\n"));
  const std::string dry =
      message_of<InputError>([&] { markers("box = [[0, 0, 0.6], [1, 1, 1]]\n"); });
  expect_contains(dry, "almost no water where these markers should be");
  expect_contains(dry, "s.scene.toml:7");
}

TEST_F(BuildScene, SkinsPlaceTheirPartsAndHoldThemTogether) {
  for (const char* name : {"one", "two"}) {
    Archetype a = tetrahedron_archetype(name);
    a.centre = Vec3(name[0] == 'o' ? 1.0 : 2.0, 0, 0);
    write_archetype(folder_ / (std::string(name) + ".h5"), a);
  }
  Skin skin;
  skin.name = "both";
  skin.parts = {"one", "two"};
  skin.surface = tetrahedron_archetype("s").surface;
  for (Vec3& x : skin.surface.vertices) x += Vec3(1.5, 0, 0);
  for (std::size_t v = 0; v < 4; ++v) {
    skin.part_of.push_back({0, 1, 0, 0});
    skin.weights.insert(skin.weights.end(), {0.25, 0.75, 0.0, 0.0});
  }
  skin.joints = {{0, 1, {Vec3(1.5, 0, 0), Vec3(1.5, 0.1, 0)}}};
  write_skin(folder_ / "both.h5", skin);

  const std::string place =
      "position = [5, 0, 0]\nvelocity = [0, 1, 0]\n"
      "angular_velocity = [0, 0, 2]\n"
      "rotation = { axis = [0, 0, 1], degrees = 90 }\n";
  const std::string head = "[[skin]]\narchetype = \"both\"\n";
  const BuiltScene built = build(head + "parts = [\"one\", \"two\"]\n" + place + head +
                                 "parts = [\"one\", \"two\"]\nposition = [0, 0, 0]\n");
  ASSERT_EQ(built.bodies.size(), 4u);
  EXPECT_EQ(built.body_names[1], "both.two");
  EXPECT_NEAR((built.bodies[1].position - Vec3(5, 2, 0)).norm(), 0.0, 1e-15);
  // v + w x (R centre) = (0, 1, 0) + (0, 0, 2) x (0, 2, 0)
  EXPECT_NEAR(
      (built.bodies[1].P / built.bodies[1].archetype->integrals.mass - Vec3(-4, 1, 0)).norm(), 0.0,
      1e-12);
  ASSERT_EQ(built.skins.size(), 2u);
  EXPECT_EQ(built.skins[0].shape, built.skins[1].shape);  // bound once
  EXPECT_EQ(built.skins[1].bodies, (std::vector<int>{2, 3}));
  ASSERT_EQ(built.joints.size(), 2u);
  EXPECT_EQ(built.joints[1].b, 3);
  EXPECT_LE(joint_drift(built.joints, built.bodies), 1e-15);
  // the skin stands where the whole does
  std::vector<Vec3> points;
  skin_points(
      built.skins[0], [&](int b) -> const ReducedBody& { return built.bodies[b]; }, points);
  for (std::size_t v = 0; v < 4; ++v) {
    const Vec3& x = skin.surface.vertices[v];
    EXPECT_NEAR((points[v] - Vec3(5 - x[1], x[0], x[2])).norm(), 0.0, 1e-14);
  }

  const auto refusal = [&](const std::string& text) {
    return message_of<InputError>([&] { build(text); });
  };
  expect_contains(refusal(head + "parts = [\"two\", \"one\"]\nposition = [0, 0, 0]\n"),
                  "part 1 of skin both is \"one\", not \"two\"");
  expect_contains(refusal(head + "parts = [\"one\"]\nposition = [0, 0, 0]\n"),
                  "skin both has 2 parts, not 1");
  expect_contains(refusal("[coupling]\ngeometry = \"voxel\"\n" + head +
                          "parts = [\"one\", \"two\"]\nposition = [0, 0, 0]\n"),
                  "skins are not possible with coupling.geometry = \"voxel\"");
  expect_contains(refusal("[step]\nscheme = \"single\"\n" + head +
                          "parts = [\"one\", \"two\"]\nposition = [0, 0, 0]\n"),
                  "joints are not possible");
  const auto wrong_file = [&](const std::string& text) {
    return message_of<FileError>([&] { build(text); });
  };
  expect_contains(wrong_file("[[body]]\narchetype = \"both\"\nposition = [0, 0, 0]\n"),
                  "a skin, not a body");
  expect_contains(wrong_file("[[skin]]\narchetype = \"one\"\nparts = [\"one\", \"two\"]\n"
                             "position = [0, 0, 0]\n"),
                  "not a skin; a body belongs in a [[body]]");
}

TEST_F(BuildScene, ModesCanBeFewerButNotMore) {
  const std::string body = "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\nmodes = ";
  EXPECT_EQ(build(body + "0").bodies.at(0).r, 0);
  EXPECT_EQ(build(body + "1").bodies.at(0).q.size(), 1);
  const std::string text = message_of<InputError>([&] { build(body + "3\n" + body + "4\n"); });
  expect_contains(text,
                  "s.scene.toml:6:9: error: the body asks for 3 modes, archetype tetra stores 2");
  expect_contains(text, "asks for 4 modes");
}

TEST_F(BuildScene, EveryDegreeOfFreedomNeedsACompleteBasis) {
  const std::string body = "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\nmodes = ";
  const std::string text = message_of<InputError>([&] { build(body + "\"full\"\n"); });
  expect_contains(text, "s.scene.toml:6:9: error: the body asks for every degree of freedom");
  expect_contains(text, "archetype tetra stores 2 modes of the 6 that 4 nodes have");
  expect_contains(text, "modes.count = \"full\" in the body file");

  Archetype six = tetrahedron_archetype("tetra");
  six.omega2 = VecX::LinSpaced(6, 100, 200);
  six.is_static.assign(6, 0);
  six.residuals = VecX::Zero(6);
  six.surface_modes = six.node_modes = MatX::Constant(12, 6, 0.01);
  six.M_r = MatX::Identity(6, 6);
  six.K_r = six.omega2.asDiagonal();
  six.integrals.I3.assign(6, Vec3::Zero());
  six.integrals.A.assign(6, Mat3::Zero());
  six.integrals.B.assign(36, Mat3::Zero());
  write_archetype(folder_ / "tetra.h5", six);
  EXPECT_EQ(build(body + "\"full\"\n").bodies.at(0).r, 6);
}

TEST_F(BuildScene, RigidMotionsLeftAmongTheModesAreRefused) {
  const std::string body = "[[body]]\narchetype = \"loose\"\nposition = [0, 0, 0]\nmodes = 0\n";
  for (const bool turns : {false, true}) {
    Archetype a = tetrahedron_archetype("loose");
    if (turns)
      a.integrals.A[1](0, 1) = 1e-3, a.integrals.A[1](1, 0) = -1e-3;
    else
      a.integrals.I3[1] = Vec3(0, 0, 1e-3);
    write_archetype(folder_ / "loose.h5", a);
    const std::string text = message_of<InputError>([&] { build(body); });
    expect_contains(text, "mode 2 of archetype loose moves or turns the body as a whole");
    a.integrals.I3[1] *= 1e-10, a.integrals.A[1] *= 1e-10;  // round-off
    write_archetype(folder_ / "loose.h5", a);
    EXPECT_NO_THROW(build(body));
  }
}

TEST_F(BuildScene, MissingArchetypesAreNamedTogetherAsFileError) {
  const std::string text = message_of<FileError>([&] {
    build(
        "[[body]]\narchetype = \"toros\"\nposition = [0, 0, 0]\n"
        "[[body]]\narchetype = \"gone.h5\"\nposition = [0, 0, 0]\n");
  });
  expect_contains(text,
                  "s.scene.toml:4:13: error: there is no archetype file " + (folder_ / "toros.h5"));
  expect_contains(text, "make -f pipeline.mk bodies");
  expect_contains(text, folder_ / "gone.h5");
}

TEST_F(BuildScene, DamagedArchetypeIsAFileError) {
  folder_.write("bad.h5", "not HDF5");
  EXPECT_THROW(build("[[body]]\narchetype = \"bad\"\nposition = [0, 0, 0]\n"), FileError);
}

TEST_F(BuildScene, InstancesShareOneArchetype) {
  const BuiltScene built = build(
      "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\n"
      "[[body]]\narchetype = \"tetra\"\nposition = [5, 0, 0]\n");
  EXPECT_EQ(built.bodies[0].archetype.get(), built.bodies[1].archetype.get());
}

TEST_F(BuildScene, TankAndWaterBecomeOptions) {
  const BuiltScene built = build(R"([fluid]
    grid = [4, 6, 8]
    cell = 0.25
    origin = [0, 0, 10]
    water = { level = 0.5 }
    walls = { zmax = "open" })");
  EXPECT_EQ(built.options.grid.nz, 8);
  EXPECT_TRUE(built.options.has_water);
  EXPECT_TRUE(built.options.wall_contact);
  EXPECT_EQ(built.options.open_side, (Sides{false, false, false, false, false, true}));
  EXPECT_EQ(built.options.reference_point[2], 10.5);
  EXPECT_FALSE(
      build("[fluid]\ngrid = [4, 4, 4]\ncell = 1\nwater = { level = 0 }").options.has_water);
  EXPECT_EQ(build("").options.grid.cells(), 0u);
}

TEST_F(BuildScene, StaticsArePlacedAndMustBeClosed) {
  folder_.write(
      "m/t.obj",
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1 4/2 2/3\nf 2 4 3\nf -1 -4 -2\n");
  const std::string place =
      "scale = 2\nposition = [1, 0, 0]\nrotation = { axis = [0, 0, 1], degrees = 90 }\n";
  const BuiltScene built = build("[[static]]\nmesh = \"m/t.obj\"\n" + place);
  const TriMesh& mesh = built.obstacles.at(0);
  EXPECT_NEAR((mesh.vertices[1] - Vec3(1, 2, 0)).norm(), 0.0, 1e-15);
  // The file's faces point inward; they come out outward, 2^3 times the volume 1/6.
  EXPECT_NEAR(enclosed_volume(mesh), 8.0 / 6.0, 1e-15);

  folder_.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_contains(message_of<InputError>([&] { build("[[static]]\nmesh = \"open.obj\"\n"); }),
                  "not closed");
  folder_.write("odd.obj", "v 0 0 0\nv 1 0\n");
  expect_contains(message_of<InputError>([&] { build("[[static]]\nmesh = \"odd.obj\"\n"); }),
                  "odd.obj:2:");
  EXPECT_THROW(build("[[static]]\nmesh = \"gone.obj\"\n"), FileError);
}

TEST_F(BuildScene, ObstaclesThatMoveAreBodies) {
  folder_.write("t.obj",
                "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const std::string later =
      "[[scatter]]\narchetype = \"tetra\"\ncount = 2\nbox = [[5, 5, 5], [9, 9, 9]]\n"
      "waves = { count = 2, every = 1 }\n[[static]]\nmesh = \"t.obj\"\nscale = 2\n"
      "position = [0, 0, 3]\n";
  const BuiltScene still = build(later);
  EXPECT_EQ(still.obstacles.size(), 1u);
  EXPECT_TRUE(still.prescribed.empty());
  const BuiltScene built = build(later + "motion = [{ t = 0 }, { t = 1, position = [1, 0, 0] }]\n");
  EXPECT_TRUE(built.obstacles.empty());
  ASSERT_EQ(built.prescribed.size(), 1u);
  const PrescribedBody& told = built.prescribed[0];
  ASSERT_EQ(told.body, 1);  // between the first wave and the second
  EXPECT_EQ(built.body_names[1], "t");
  EXPECT_EQ(built.bodies[1].r, 0);
  EXPECT_NEAR((told.at(0.0).position - Vec3(0.5, 0.5, 3.5)).norm(), 0.0, 1e-14);
  EXPECT_NEAR((told.at(1.0).position - Vec3(1.5, 0.5, 3.5)).norm(), 0.0, 1e-14);

  folder_.write("way.csv", "t,z,qw,qz\n0,0,1,0\n2,4,1,1\n");
  const BuiltScene table = build(later + "motion = \"way.csv\"\n");
  const PrescribedBody::Pose end = table.prescribed.at(0).at(2.0);
  EXPECT_NEAR((end.position - Vec3(-0.5, 0.5, 7.5)).norm(), 0.0, 1e-14);  // a quarter turn
  EXPECT_NE(table.bodies[1].archetype->content_hash, built.bodies[1].archetype->content_hash);
  const std::pair<const char*, const char*> bad_tables[] = {
      {"t,z,vx\n0,0,1\n", "no column may be called \"vx\""},
      {"t,qw,qz\n0,1,0\n1,0,0\n", "at t = 1: a quaternion of length 0"},
      {"t,qw,qz\n0,1,0\n2,1,1\n3,-1,2\n", "at t = 3: a turn of more than 120 degrees"}};
  for (const auto& [rows, message] : bad_tables) {
    folder_.write("way.csv", rows);
    expect_contains(message_of<InputError>([&] { build(later + "motion = \"way.csv\"\n"); }),
                    message);
  }
  expect_contains(message_of<InputError>([&] {
                    build(later +
                          "motion = [{ t = 0 }]\n[[external]]\nbody = \"t\"\n"
                          "force = [1, 0, 0]\n");
                  }),
                  "goes as its motion tells");
  expect_contains(message_of<InputError>([&] {
                    build("[step]\nscheme = \"single\"\n" + later + "motion = [{ t = 0 }]\n");
                  }),
                  "obstacles do not move with step.scheme = \"single\"");
}

// omega^2 = g k tanh(k h), and H / S as the hyperbolic functions of the books; in the limits of shallow
// and deep water k h and k h / 2, 2 and 2.
TEST(WaveTheory, IsThatOfLinearWaves) {
  for (const double omega : {0.1, 1.0, 4.0, 20.0}) {
    const double k = wave_number(omega, 0.5, 9.81);
    EXPECT_NEAR(9.81 * k * std::tanh(0.5 * k), omega * omega, 1e-13 * omega * omega);
  }
  for (const double kh : {0.1, 1.0, 3.0}) {
    const double both = std::sinh(2.0 * kh) + 2.0 * kh;
    EXPECT_NEAR(height_over_stroke(false, kh), 2.0 * (std::cosh(2.0 * kh) - 1.0) / both, 1e-14);
    EXPECT_NEAR(height_over_stroke(true, kh),
                4.0 * std::sinh(kh) / kh * (kh * std::sinh(kh) - std::cosh(kh) + 1.0) / both,
                1e-14);
  }
  EXPECT_NEAR(height_over_stroke(false, 1e-3), 1e-3, 1e-9);
  EXPECT_NEAR(height_over_stroke(true, 1e-3), 0.5e-3, 1e-9);
  EXPECT_NEAR(height_over_stroke(false, 1e3), 2.0, 1e-12);
  EXPECT_NEAR(height_over_stroke(true, 1e3), 2.0, 3e-3);
}

TEST_F(BuildScene, WaveMakersAreObstaclesThatMove) {
  const std::string
      tank =
          "[fluid]\ngrid = [40, 8, 8]\ncell = 0.1\norigin = [1, 0, 0]\nwater = { level = 0.5 }\n",
      head = "[[wavemaker]]\nside = \"xmax\"\nperiod = 1\n";
  const BuiltScene piston = build(tank + head + "stroke = 0.1\nfront = 0.25\nramp = 0\n");
  ASSERT_EQ(piston.prescribed.size(), 1u);
  EXPECT_EQ(piston.body_names.at(0), "wavemaker");
  ASSERT_EQ(piston.wavemakers.size(), 1u);
  expect_contains(piston.wavemakers[0], "piston of stroke 0.1 m");
  const PrescribedBody& told = piston.prescribed[0];
  const TriMesh& surface = piston.bodies[0].archetype->surface;
  const auto front = [&](double t) {  // m
    const PrescribedBody::Pose pose = told.at(t);
    double x = INFINITY;
    for (const Vec3& v : surface.vertices) x = std::min(x, (pose.position + pose.rotation * v)[0]);
    return x;
  };
  EXPECT_NEAR(front(0.0), 4.75, 1e-12);  // 0.25 m from x = 5
  EXPECT_NEAR(front(0.25), 4.70, 1e-5);
  EXPECT_NEAR(front(0.75), 4.80, 1e-5);
  EXPECT_GT(enclosed_volume(surface), 0.0);

  const BuiltScene flap =
      build(tank +
            "[[wavemaker]]\nside = \"ymin\"\ntype = \"flap\"\nperiod = 1\nramp = 0\n"
            "stroke = 0.1\nfront = 0.2\n");
  const PrescribedBody& turned = flap.prescribed.at(0);
  const PrescribedBody::Pose pose = turned.at(0.25);
  // the point of the front at the level goes by half the stroke inwards, that on the floor stays
  const Vec3 level = turned.origin + Vec3(0, 0, 0.5), arm = level - flap.bodies[0].position;
  EXPECT_NEAR((turned.origin - Vec3(3.0, 0.2, 0.0)).norm(), 0.0, 1e-12);
  const Vec3 moved = pose.position + pose.rotation * arm - turned.origin;
  EXPECT_NEAR(moved[1] / moved[2], 0.05 / 0.5, 1e-5);
  EXPECT_GT(moved[1], 0.0);
  EXPECT_NEAR(
      (pose.position + pose.rotation * (turned.origin - flap.bodies[0].position) - turned.origin)
          .norm(),
      0.0, 1e-12);

  EXPECT_TRUE(piston.notes.empty());
  const BuiltScene steep = build(tank + head + "height = 0.3\nfront = 0.5\n");
  ASSERT_EQ(steep.notes.size(), 1u);
  expect_contains(steep.notes[0], "higher than waves of");
  const auto refused = [&](const std::string& text) {
    return message_of<InputError>([&] { build(text); });
  };
  expect_contains(refused(tank + head + "stroke = 0.2\nfront = 0.05\n"), "cannot go to and fro");
  expect_contains(refused(tank + head + "stroke = 2.5\n"), "cannot go to and fro");
  expect_contains(refused("[fluid]\ngrid = [40, 8, 8]\ncell = 0.1\n" + head + "stroke = 0.2\n"),
                  "needs water of a known depth");
  expect_contains(refused(head + "stroke = 0.2\n"), "needs water of a known depth");
  expect_contains(refused("gravity = [1, 0, -9]\n" + tank + head + "stroke = 0.2\n"),
                  "gravity along -z");
}

TEST_F(BuildScene, DensitiesOfNoMatterAreRefused) {
  const std::string body = "[[body]]\narchetype = \"tetra\"\nposition = [0, 0, 0]\ndensity = ";
  expect_contains(message_of<InputError>([&] { build(body + "1e150\n"); }),
                  "density: 1e+150 is out of range");
  EXPECT_EQ(build(body + "2e4\n").bodies.size(), 1u);
}

TEST_F(BuildScene, ObstaclesNowhereAreRefused) {
  const std::string rest = "v 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  for (const std::string corner : {"nan 0 0", "0 inf 0", "0 0 1e308"}) {
    folder_.write("t.obj", "v " + corner + "\n" + rest);
    EXPECT_NE(message_of<InputError>([&] { build("[[static]]\nmesh = \"t.obj\"\n"); }), "")
        << corner;
  }
  folder_.write("t.obj", "v 0 0 0\n" + rest);
  expect_contains(message_of<InputError>(
                      [&] { build("[[static]]\nmesh = \"t.obj\"\nposition = [0, 1e300, 0]\n"); }),
                  "s.scene.toml:");
}

TEST_F(BuildScene, BodiesBeyondTheTankOrInOneAnotherAreRefusedByName) {
  Archetype solid = tetrahedron_archetype("solid");
  solid.sdf = sample_distance(solid.surface, SdfOptions());
  write_archetype(folder_ / "solid.h5", solid);
  const std::string tank =
      "[fluid]\ngrid = [40, 40, 40]\ncell = 0.1\nwater = { level = 1 }\nwalls = { zmax = \"open\" "
      "}\n";
  const auto body = [](const std::string& name, const std::string& place) {
    return "[[body]]\nname = \"" + name + "\"\narchetype = \"solid\"\nposition = [" + place + "]\n";
  };
  const auto refusal = [&](const std::string& text) {
    return message_of<InputError>([&] { build(text); });
  };
  EXPECT_EQ(refusal(tank + body("a", "2, 2, 2") + body("b", "2, 2, 20")), "");  // above an open top
  EXPECT_EQ(refusal(tank + body("a", "2, 2, 0.2")), "");  // half a cell is contact's
  expect_contains(refusal(tank + body("a", "2, 2, 2") + body("b", "9, 2, 2")),
                  "body 2 (b) reaches 5.75");
  expect_contains(refusal(tank + body("a", "2, 2, 0.1")),
                  "beyond the closed side zmin of the tank");
  expect_contains(refusal(tank + body("a", "2, 1e12, 2")), "closed side ymax");
  const std::string twice = body("a", "2, 2, 2") + body("b", "2.1, 2, 2");
  expect_contains(refusal(tank + twice), "m deep inside body 1 (a)");
  expect_contains(refusal(twice), "m deep inside body 1 (a)");  // without a tank too
  EXPECT_EQ(refusal(twice + "[[joint]]\nbodies = [\"a\", \"b\"]\npoints = [[0, 0, 0]]\n"), "");
}

// A wall whose two sides lie in one cell is no wall for the water.
TEST_F(BuildScene, ThinObstaclesInWaterAreRefusedAsLeaks) {
  const auto wall = [&](double thickness, const std::string& water) {
    const std::string x = std::to_string(0.53), y = std::to_string(0.53 + thickness);
    std::string obj;
    for (const std::string& at : {x, y})
      for (const char* corner : {" 0 0", " 1 0", " 1 1", " 0 1"}) obj += "v " + at + corner + "\n";
    obj += "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    folder_.write("wall.obj", obj);
    return build("[fluid]\ngrid = [10, 10, 10]\ncell = 0.1\n" + water +
                 "[[static]]\nmesh = \"wall.obj\"\n");
  };
  const std::string message = message_of<InputError>([&] { wall(0.01, ""); });
  expect_contains(message, "thinner than a cell over");
  expect_contains(message, "leak");
  EXPECT_EQ(wall(0.25, "").obstacles.size(), 1u);
}

TEST_F(BuildScene, WavesAppearOneAfterTheOther) {
  const BuiltScene built = build(R"([[scatter]]
    archetype = "tetra"
    count = 5
    box = [[0, 0, 5], [3, 3, 6]]
    waves = { count = 2, every = 0.25 }
    [[body]]
    archetype = "tetra"
    position = [9, 9, 9])");
  EXPECT_EQ(built.release, (std::vector<double>{0, 0, 0, 0.25, 0.25, 0.25}));
  EXPECT_EQ(built.bodies[0].position, Vec3(9, 9, 9));
  Simulation s(built.options, FluidState(), built.bodies, {}, built.release);
  EXPECT_EQ(s.bodies().size(), 3u);
  EXPECT_EQ(s.all_bodies().size(), 6u);
  for (int n = 0; n < 6; ++n) s.step(0.05);
  ASSERT_EQ(s.bodies().size(), 6u);
  // free fall since 0.25 s: one step of 0.05 s
  EXPECT_NEAR(s.bodies()[5].position[2], built.bodies[5].position[2] - 0.5 * 9.81 * 0.0025, 1e-12);
}

TEST_F(BuildScene, ScatteredBodiesKeepApartAndRepeat) {
  const std::string text = R"([[body]]
    archetype = "tetra"
    position = [2, 2, 2]
    [[scatter]]
    archetype = "tetra"
    count = 12
    box = [[0, 0, 0], [6, 6, 6]]
    gap = 0.1
    seed = )";
  const BuiltScene first = build(text + "7"), again = build(text + "7"), other = build(text + "8");
  ASSERT_EQ(first.bodies.size(), 13u);
  const double radius = bounding_radius(*first.bodies[0].archetype);
  EXPECT_DOUBLE_EQ(radius, std::sqrt(0.75 * 0.75 + 2 * 0.25 * 0.25));
  for (std::size_t a = 0; a < first.bodies.size(); ++a) {
    EXPECT_EQ(first.bodies[a].position, again.bodies[a].position);
    EXPECT_EQ(first.bodies[a].rotation.coeffs(), again.bodies[a].rotation.coeffs());
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_GE((first.bodies[a].position - first.bodies[b].position).norm(), 2 * radius + 0.1);
    }
  }
  EXPECT_NE(first.bodies[1].position, other.bodies[1].position);
  EXPECT_NE(first.bodies[1].rotation.coeffs(), first.bodies[2].rotation.coeffs());
}

TEST_F(BuildScene, ScatterThatDoesNotFitSaysHowManyDid) {
  const std::string text = message_of<InputError>([&] {
    build("[[scatter]]\narchetype = \"tetra\"\ncount = 50\nbox = [[0, 0, 0], [1, 1, 1]]\n");
  });
  expect_contains(text, "of 50 instances of tetra fit");
}

TEST_F(BuildScene, ScatterTakesItsKindsInTurnThroughAllWaves) {
  write_archetype(folder_ / "other.h5", tetrahedron_archetype("other"));
  const BuiltScene built = build(
      "[[scatter]]\narchetypes = [\"tetra\", \"other\"]\ncount = 5\nbox = [[0, 0, 0], [9, 9, 9]]\n"
      "waves = { count = 2, every = 0.5 }\n");
  ASSERT_EQ(built.bodies.size(), 5u);
  for (std::size_t b = 0; b < 5; ++b)
    EXPECT_EQ(built.body_names[b], b % 2 == 0 ? "tetra" : "other") << b;
  EXPECT_EQ(built.release[1], 0.0);
  EXPECT_EQ(built.release[2], 0.5);
}

TEST_F(BuildScene, ScatterFillsAMesh) {
  // A tetrahedron: a sixth of its box.
  folder_.write("corner.obj",
                "v 0 0 0\nv 12 0 0\nv 0 12 0\nv 0 0 12\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const BuiltScene built =
      build("[[scatter]]\narchetype = \"tetra\"\ncount = 6\nmesh = \"corner.obj\"\n");
  ASSERT_EQ(built.bodies.size(), 6u);
  for (const ReducedBody& body : built.bodies) {
    EXPECT_GT(body.position.minCoeff(), 0.0);
    EXPECT_LT(body.position.sum(), 12.0);
  }
}

TEST(WholeCluster, TakesModesOfEqualFrequency) {
  Archetype a;
  a.omega2 = VecX{{1.0, 4.0, 4.01, 4.02, 9.0, 9.0, 1.0}};
  a.is_static = {0, 0, 0, 0, 0, 0, 1};
  EXPECT_EQ(whole_cluster(a, 0), 0);
  EXPECT_EQ(whole_cluster(a, 1), 1);
  EXPECT_EQ(whole_cluster(a, 2), 4);
  EXPECT_EQ(whole_cluster(a, 4), 4);
  EXPECT_EQ(whole_cluster(a, 5), 6);
  EXPECT_EQ(whole_cluster(a, 6), 6);
  EXPECT_EQ(whole_cluster(a, 7), 7);
}

TEST(RandomRotation, IsUniform) {
  // Mean of R x over uniform rotations is 0 with variance 1/3 per component: 4000 samples give a
  // standard deviation of 0.009; 5 sigma. Measured 0.009.
  ScatterSpec scatter;
  scatter.count = 4000;
  scatter.box = {Vec3::Zero(), Vec3::Ones()};
  std::vector<OccupiedBall> occupied;
  Vec3 mean = Vec3::Zero();
  for (const Placement& p : scatter_places(scatter, {0.0}, 0, nullptr, occupied)) {
    EXPECT_NEAR(p.rotation.norm(), 1.0, 1e-14);
    mean += p.rotation * Vec3::UnitX() / scatter.count;
  }
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 5 * std::sqrt(1.0 / 3.0 / scatter.count));
}

TEST(ArchetypeLibrary, LooksBesideTheSceneThenInTheCurrentFolder) {
  ScratchFolder folder;
  folder.write("out/archetypes/near.h5", "");
  const ArchetypeLibrary library(folder / "assets/scenes");
  EXPECT_EQ(library.path("near"), folder / "out/archetypes/near.h5");
  EXPECT_EQ(library.path("gone"), folder / "out/archetypes/gone.h5");  // where make would put it
  EXPECT_EQ(library.path("x/y.h5"), "x/y.h5");
}

TEST(MakeFragment, ListsEveryFileOnceAndEscapes) {
  const SceneSpec scene = parse_scene_text(std::string(kHead) + R"([[body]]
    archetype = "a"
    position = [0, 0, 0]
    [[body]]
    archetype = "a"
    position = [0, 0, 0]
    [[static]]
    mesh = "my rocks.obj")",
                                           "s/x.scene.toml");
  const ArchetypeLibrary library("s", "arch");
  EXPECT_EQ(make_fragment("run/x", scene_dependencies(scene, library)),
            "run/x: \\\n  s/x.scene.toml \\\n  arch/a.h5 \\\n  s/my\\ rocks.obj\n"
            "\ns/x.scene.toml:\n\narch/a.h5:\n\ns/my\\ rocks.obj:\n");
}

}  // namespace
}  // namespace archetide
