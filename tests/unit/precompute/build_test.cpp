#include "precompute/build.h"
#include "common/params/cli.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "common/base/input_error.h"
#include "precompute/inspect/inspect.h"
#include "precompute/intake/tet_io.h"
#include "precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::as_off;
using testing_meshes::ScratchFolder;

std::string body_text(const std::string& mesh,
                      const std::string& more = "modes = { count = 5 }\n") {
  return "schema = 1\nmesh = \"" + mesh + "\"\nscale = 0.5\ntet = { target = 1500 }\n" +
         "material = { density = 800.0, young = 1e5, poisson = 0.3 }\n" + more;
}

Archetype built(const std::string& path) {
  const ScopedLogLevel quiet(LogLevel::kQuiet);
  Profile profile;
  return build_archetype(read_recipe(path), profile);
}

/// A ball of radius 0.5 m around (1, 2, 3): unit sphere at (2, 4, 6), scale 0.5.
Archetype ball(const ScratchFolder& folder) {
  TriMesh mesh = shapes::sphere(1.0, 3);
  for (Vec3& x : mesh.vertices) x += Vec3(2, 4, 6);
  folder.write("ball.off", as_off(mesh));
  return built(folder.write("ball.body.toml", body_text("ball.off")));
}

TEST(Build, GivesABallItsMassCentreInertiaAndQuadrupoleFrequency) {
  const ScratchFolder folder;
  const Archetype a = ball(folder);
  const double volume = 4.0 / 3.0 * std::numbers::pi * 0.125, mass = 800 * volume;
  // A polyhedron of 1280 faces is 0.9 % smaller than the ball; the tets fill it.
  EXPECT_NEAR(a.volume, volume, 0.012 * volume);
  EXPECT_NEAR(a.integrals.mass, 800 * a.volume, 1e-9 * mass);
  EXPECT_LT((a.centre - Vec3(1, 2, 3)).norm(), 2e-3);
  const double expected = 0.4 * mass * 0.25;  // 2/5 m R^2
  const Mat3 inertia = a.integrals.Sxx.trace() * Mat3::Identity() - a.integrals.Sxx;
  EXPECT_LT((inertia - expected * Mat3::Identity()).norm(), 0.03 * expected);
  // Free elastic sphere, nu 0.3: the lowest mode is torsional, n = 2, omega R / c_s = 2.501 (Lamb).
  // The polyhedron's radius is 0.3 % smaller; the mesh's own error is below 0.1 %.
  const double c_s = std::sqrt(1e5 / (2 * 1.3) / 800);
  const double x = std::sqrt(a.omega2[0]) * 0.5 / c_s;
  EXPECT_GT(x, 2.501);
  EXPECT_LT(x, 2.52);
  EXPECT_LT(a.residuals.maxCoeff(), 1e-8);
}

TEST(Build, SurfaceOfANeutralBodyHasItsVolumeAndCentre) {
  // What water sees is the flat-sided surface: with the density of water it must weigh what it
  // displaces and be centred where it floats, whatever the order.
  const ScratchFolder folder;
  folder.write("ball.off", as_off(shapes::sphere(1.0, 3)));
  folder.write("torus.off", as_off(shapes::torus(1.0, 0.4, 48, 24)));
  folder.write("box.off", as_off(shapes::box(Vec3(2, 1, 1), 4)));
  for (const char* shape : {"ball", "torus", "box"})
    for (const int order : {1, 2}) {
      const Archetype a = built(folder.write(
          "a.body.toml",
          fmt::format("schema = 1\nmesh = \"{}.off\"\ntet = {{ target = 600, order = {} }}\n"
                      "modes = {{ count = 0 }}\n"
                      "material = {{ density = 1000.0, young = 1e5, poisson = 0.3 }}\n",
                      shape, order)));
      EXPECT_EQ(a.tets.order(), order);
      EXPECT_NEAR(enclosed_volume(a.surface) * 1000.0 / a.integrals.mass, 1.0, 1e-14) << shape;
      EXPECT_LT(enclosed_centroid(a.surface).norm(), 1e-14) << shape;
    }
}

TEST(Build, CentresTheRestShapeAndSamplesItsSurface) {
  const ScratchFolder folder;
  const Archetype a = ball(folder);
  EXPECT_LT(a.sdf.value(Vec3::Zero()), -0.45);
  for (std::size_t v = 0; v < a.surface.vertices.size(); ++v) {
    // The surface is moved out to the tets' volume: about a third of the sag of a flat triangle.
    EXPECT_LT((a.surface.vertices[v] - a.tets.nodes[a.surface_to_node[v]]).norm(), 0.005);
    EXPECT_LT(std::abs(a.sdf.value(a.surface.vertices[v])), a.sdf.spacing);
    EXPECT_GT(a.surface_normals[v].dot(a.surface.vertices[v]), 0.0);
    for (int k = 0; k < a.r(); ++k) {
      EXPECT_EQ(a.surface_modes(3 * v + 1, k), a.node_modes(3 * a.surface_to_node[v] + 1, k));
    }
  }
}

/// Run by the next test in a process of its own.
TEST(FreshProcess, DISABLED_WritesTheBall) {
  const char* target = std::getenv("ARCHETIDE_TEST_TARGET");
  ASSERT_NE(target, nullptr);
  const ScratchFolder folder;
  write_archetype(target, ball(folder));
}

TEST(Build, IsReproducibleByteForByte) {
  // Fresh processes: the order in which the mesher visits its cells hangs on their addresses.
  const ScratchFolder folder;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  for (const char* name : {"a.h5", "b.h5"}) {
    const std::string command = "ARCHETIDE_TEST_TARGET='" + folder.file(name) + "' '" + self +
                                "' --gtest_also_run_disabled_tests --gtest_brief=1 "
                                "--gtest_filter='FreshProcess.*'";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  EXPECT_GT(read_whole_file(folder.file("a.h5")).size(), 10000u);
  EXPECT_TRUE(read_whole_file(folder.file("a.h5")) == read_whole_file(folder.file("b.h5")));
}

TEST(Build, KnowsRegionsPointSetsFramesAndStaticLoads) {
  const ScratchFolder folder;
  folder.write("box.off", as_off(shapes::box(Vec3(2, 1, 1), 4)));
  const std::string more =
      "modes = { count = 4, static = [\"pressure\", \"end\"] }\n"
      "[[material_region]]\nbox = [[0.5, -1, -1], [2, 2, 2]]\ndensity = 1600.0\nyoung = 2e5\n"
      "poisson = 0.2\n[[points]]\nname = \"end\"\nbox = [[-1, -1, -1], [1e-9, 2, 2]]\n"
      "[[points]]\nname = \"corner\"\nlist = [[1, 0.5, 0.5]]\n"
      "[[points]]\nname = \"ball\"\ncenter = [0, 0.25, 0.25]\nradius = 0.3\n"
      "[[joint_frame]]\nname = \"hinge\"\npoint = [0.0, 0.25, 0.25]\nx = [0, 0, 2]\nz = [1, 0, "
      "0]\n";
  const Archetype a = built(folder.write("box.body.toml", body_text("box.off", more)));
  // 1 x 0.5 x 0.5 m, 800 and 1600 kg/m^3 on either side of the middle, but for the tets across it.
  EXPECT_NEAR(a.density, 1200.0, 40.0);
  EXPECT_NEAR(a.density * a.volume, a.integrals.mass, 1e-9);
  EXPECT_NEAR(a.centre[0], (0.25 * 800 + 0.75 * 1600) / 2400, 0.02);
  EXPECT_NEAR(enclosed_centroid(a.surface)[0] + a.centre[0], 0.5, 1e-9);  // the shape's middle

  ASSERT_EQ(a.point_sets.size(), 3u);
  EXPECT_EQ(a.point_sets[0].name, "end");
  EXPECT_GE(a.point_sets[0].vertices.size(), 9u);
  for (const int v : a.point_sets[0].vertices)
    EXPECT_NEAR(a.surface.vertices[v][0] + a.centre[0], 0.0, 1e-9);
  ASSERT_EQ(a.point_sets[1].vertices.size(), 1u);
  EXPECT_LT((a.surface.vertices[a.point_sets[1].vertices[0]] + a.centre - Vec3(1, 0.5, 0.5)).norm(),
            1e-9);
  EXPECT_GT(a.point_sets[2].vertices.size(), 4u);
  ASSERT_EQ(a.joint_frames.size(), 1u);
  EXPECT_LT((a.joint_frames[0].point + a.centre - Vec3(0, 0.25, 0.25)).norm(), 1e-12);
  Mat3 axes;
  axes << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  EXPECT_LT((a.joint_frames[0].axes - axes).norm(), 1e-15);

  EXPECT_EQ(std::count(a.is_static.begin(), a.is_static.end(), 0), 4);
  EXPECT_GE(a.r(), 4 + 3);
  EXPECT_TRUE(std::is_sorted(a.is_static.begin(), a.is_static.end()));
}

TEST(Build, EstimatesTheErrorOfTheFrequencies) {
  const ScratchFolder folder;
  folder.write("ball.off", as_off(shapes::sphere(2.0, 5)));  // radius 1 m after scale
  const Archetype a = built(folder.write("ball.body.toml", body_text("ball.off")));
  ASSERT_EQ(a.frequency_error.size(), 5);
  const double c_s = std::sqrt(1e5 / (2 * 1.3) / 800);
  const double exact = 2.50113262 * c_s;  // T2, five times
  // An estimate: the right order of magnitude. 1500 quadratic tets are off by 5e-4.
  for (int k = 0; k < 5; ++k) {
    const double error = std::sqrt(a.omega2[k]) / exact - 1.0;
    EXPECT_GT(a.frequency_error[k], 0.25 * error) << k;
    EXPECT_LT(a.frequency_error[k], 4.0 * error) << k;
  }
}

TEST(Build, TakesTetsOfAMshFile) {
  const ScratchFolder folder;
  // A cube of 2 x 2 x 2 boxes of six tets each, the second node of one tet swapped to make it
  // negative.
  std::ostringstream msh;
  msh << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n27\n";
  for (int i = 0; i < 27; ++i)
    msh << i + 1 << ' ' << i % 3 << ' ' << i / 3 % 3 << ' ' << i / 9 << '\n';
  msh << "$EndNodes\n$Elements\n48\n";
  const int way[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                         {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  int element = 0;
  for (int box = 0; box < 8; ++box) {
    for (const auto& tet : way) {
      msh << ++element << " 4 2 1 1";
      for (int c = 0; c < 4; ++c) {
        const int corner = tet[element == 5 && c > 0 && c < 3 ? 3 - c : c];
        const int x = (box & 1) + (corner & 1), y = (box >> 1 & 1) + (corner >> 1 & 1),
                  z = (box >> 2) + (corner >> 2);
        msh << ' ' << 1 + x + 3 * y + 9 * z;
      }
      msh << '\n';
    }
  }
  msh << "$EndElements\n";
  folder.write("cube.msh", msh.str());
  const Archetype a = built(folder.write("cube.body.toml", body_text("cube.msh")));
  EXPECT_EQ(a.mesher, "input");
  EXPECT_EQ(a.tets.tets.size(), 48u);
  EXPECT_NEAR(a.volume, 1.0, 1e-14);  // 2^3 scaled by 0.5^3
  EXPECT_LT((a.centre - Vec3(0.5, 0.5, 0.5)).norm(), 1e-14);
  EXPECT_EQ(a.surface.triangles.size(), 4 * 48u);  // quadratic tets by default
  EXPECT_EQ(a.frequency_error.size(), 0);          // no coarser mesh of it
}

TEST(Build, RefusesBadMeshFilesWithTheirNames) {
  const ScratchFolder folder;
  const auto refusal = [&](const std::string& mesh) {
    try {
      built(folder.write("bad.body.toml", body_text(mesh)));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  TriMesh open = shapes::sphere(1.0, 2);
  open.triangles.pop_back();
  folder.write("open.off", as_off(open));
  EXPECT_NE(refusal("open.off").find("open.off: error: the surface is open: 3 boundary edges"),
            std::string::npos);
  folder.write("empty.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n");
  EXPECT_NE(refusal("empty.msh").find("no tetrahedra"), std::string::npos) << refusal("empty.msh");
  EXPECT_NE(refusal("duck.glb").find("bad.body.toml:2:8: error: unknown kind of mesh file"),
            std::string::npos);
  EXPECT_THROW(built(folder.write("bad.body.toml", body_text("missing.obj"))), FileError);
  EXPECT_THROW(built(folder.write("bad.body.toml", body_text("missing.msh"))), FileError);
}

TEST(Build, DepfileNamesBodyAndMesh) {
  Recipe recipe;
  recipe.path = "bodies/my duck.body.toml";
  recipe.mesh_path = "meshes/duck.obj";
  EXPECT_EQ(depfile_text("out/duck.h5", recipe),
            "out/duck.h5: \\\n  bodies/my\\ duck.body.toml \\\n  meshes/duck.obj\n"
            "\nbodies/my\\ duck.body.toml:\n\nmeshes/duck.obj:\n");
  recipe.mesh_path = "x=1\nall:\ttouch here;true\n";
  EXPECT_THROW(depfile_text("out/duck.h5", recipe), InputError);
}

TEST(Inspect, JsonHasThePromisedKeys) {
  const ScratchFolder folder;
  Archetype a = ball(folder);
  a.content_hash = "abc";
  const nlohmann::json info = nlohmann::json::parse(info_json(a, 1234));
  EXPECT_EQ(info.at("volume"), a.volume);
  EXPECT_EQ(info.at("mass"), a.integrals.mass);
  EXPECT_EQ(info.at("center").at(2), a.centre[2]);
  EXPECT_NEAR(info.at("inertia").at(1).at(1).get<double>(),
              a.integrals.Sxx(0, 0) + a.integrals.Sxx(2, 2), 1e-12);
  EXPECT_NEAR(info.at("frequencies_hz").at(0).get<double>(),
              std::sqrt(a.omega2[0]) / (2 * std::numbers::pi), 1e-12);
  EXPECT_EQ(info.at("residuals").size(), 5u);
  EXPECT_EQ(info.at("quality").at("min_dihedral_deg"), a.min_dihedral);
  EXPECT_EQ(info.at("hash"), "abc");
  EXPECT_EQ(info.at("bytes"), 1234);
}

TEST(Inspect, VtuHoldsTheDisplacedNodes) {
  const ScratchFolder folder;
  const Archetype a = ball(folder);
  write_vtu(folder.file("m.vtu"), a, 2, 0.05);
  const std::string bytes = read_whole_file(folder.file("m.vtu"));
  const std::size_t n = a.tets.nodes.size(),
                    start = bytes.find('_', bytes.find("<AppendedData")) + 1;
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data() + start, 8);
  ASSERT_EQ(length, 24 * n);
  // The first array is the displacement, the second the points.
  std::vector<Vec3> u(n), x(n);
  std::memcpy(static_cast<void*>(u.data()), bytes.data() + start + 8, length);
  std::memcpy(static_cast<void*>(x.data()), bytes.data() + start + 16 + length, length);
  double farthest = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_EQ(x[i], a.tets.nodes[i] + u[i]);
    farthest = std::max(farthest, u[i].norm());
  }
  EXPECT_NEAR(farthest, 0.05, 1e-15);
  EXPECT_THROW(write_vtu(folder.file("m.vtu"), a, 6, 0.05), InputError);
}

}  // namespace
}  // namespace archetide
