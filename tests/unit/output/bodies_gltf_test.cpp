#include "runtime/output/bodies_gltf.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/unit/output/scratch_folder.h"

namespace archetide {
namespace {

using Json = nlohmann::json;

// A .glb file as a program that shows it reads it.
struct Film {
  explicit Film(const std::string& glb) {
    std::size_t at = 0;
    EXPECT_EQ(take_number<std::uint32_t>(glb, at), 0x46546C67u);  // glTF
    EXPECT_EQ(take_number<std::uint32_t>(glb, at), 2u);
    EXPECT_EQ(take_number<std::uint32_t>(glb, at), glb.size());
    const auto json_size = take_number<std::uint32_t>(glb, at);
    EXPECT_EQ(take_number<std::uint32_t>(glb, at), 0x4E4F534Au);  // JSON
    json = Json::parse(glb.substr(at, json_size));
    at += json_size;
    const auto binary_size = take_number<std::uint32_t>(glb, at);
    EXPECT_EQ(take_number<std::uint32_t>(glb, at), 0x004E4942u);  // BIN
    EXPECT_EQ(at + binary_size, glb.size());
    EXPECT_EQ(at % 4, 0u);
    binary = glb.substr(at);
  }

  std::vector<float> floats(const Json& accessor) const {
    const Json& a = json["accessors"][accessor.get<std::size_t>()];
    EXPECT_EQ(a["componentType"], 5126);
    const std::string type = a["type"];
    const std::size_t each = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : 4;
    std::size_t at = json["bufferViews"][a["bufferView"].get<std::size_t>()]["byteOffset"];
    std::vector<float> values;
    for (std::size_t i = 0; i < each * a["count"].get<std::size_t>(); ++i)
      values.push_back(take_number<float>(binary, at));
    return values;
  }

  std::vector<float> channel(int node, const std::string& path) const {
    const Json& animation = json["animations"][0];
    for (const Json& c : animation["channels"])
      if (c["target"]["node"] == node && c["target"]["path"] == path)
        return floats(animation["samplers"][c["sampler"].get<std::size_t>()]["output"]);
    return {};
  }

  // Vertices of a node in a frame, before the root turns them.
  std::vector<Vec3> vertices(int node, std::size_t frame) const {
    const auto mesh = json["nodes"][static_cast<std::size_t>(node)]["mesh"].get<std::size_t>();
    const Json& primitive = json["meshes"][mesh]["primitives"][0];
    std::vector<float> places = floats(primitive["attributes"]["POSITION"]);
    const std::vector<float> weights = channel(node, "weights");
    const std::size_t targets = primitive.contains("targets") ? primitive["targets"].size() : 0;
    for (std::size_t k = 0; k < targets && !weights.empty(); ++k) {
      const std::vector<float> moved = floats(primitive["targets"][k]["POSITION"]);
      for (std::size_t i = 0; i < places.size(); ++i)
        places[i] += weights[frame * targets + k] * moved[i];
    }
    const auto t = channel(node, "translation"), R = channel(node, "rotation"),
               s = channel(node, "scale");
    const Quat turn(R[4 * frame + 3], R[4 * frame], R[4 * frame + 1], R[4 * frame + 2]);
    std::vector<Vec3> out;
    for (std::size_t v = 0; v < places.size(); v += 3) {
      Vec3 x;
      for (std::size_t a = 0; a < 3; ++a)
        x[static_cast<long>(a)] = double{s[3 * frame + a]} * double{places[v + a]};
      out.push_back(turn * x + Vec3(t[3 * frame], t[3 * frame + 1], t[3 * frame + 2]));
    }
    return out;
  }

  Json json;
  std::string binary;
};

// A body with 4 modes in frames 0 and 1, and a rigid one of the same archetype from frame 1 on.
struct TwoBlobs {
  TwoBlobs() {
    archetype = random_archetype(1, 4).archetype;
    for (const int r : {4, 0}) {
      ReducedBody body;
      body.archetype = archetype;
      body.r = r;
      body.q = body.q_dot = VecX::Zero(r);
      bodies.push_back(body);
    }
    Manifest m;
    m.scene = "blobs";
    m.archetypes = {{"blob", "", 0, 4, 0.0}};
    m.bodies = {{"soft", "blob", 1.0, 1.0, 4, 0.0}, {"hard", "blob", 1.0, 1.0, 0, 0.0}};
    write_manifest(folder / "manifest.json", m);
    std::ofstream rows(folder / "bodies.csv");
    rows << "t,body,x,y,z,qw,qx,qy,qz,q1,q2,q3,q4\n"
         << "0,0,1,2,3,1,0,0,0,0.1,0,-0.2,0.05\n"
         << "0.5,0,1.5,2,2.5,-0.8,0,-0.6,0,-0.3,0,0.1,0.15\n"
         << "0.5,1,4,5,6,1,0,0,0,,,,\n";
  }
  Film film(int first = 0, int last = -1) const {
    return Film(bodies_gltf(open_run_folder(folder.path()), bodies, first, last).bytes);
  }

  ScratchFolder folder;
  std::shared_ptr<Archetype> archetype;
  std::vector<ReducedBody> bodies;
};

// The largest distance of vertices from those of the body there.
double distance(const std::vector<Vec3>& shown, const ReducedBody& body) {
  std::vector<Vec3> points;
  surface_points(body, points);
  EXPECT_EQ(shown.size(), points.size());
  double off = 0.0;
  for (std::size_t v = 0; v < points.size(); ++v)
    off = std::max(off, (shown[v] - points[v]).norm());
  return off;
}

TEST(BodiesGltf, ShowsTheShapesOfTheRun) {
  TwoBlobs run;
  const Film film = run.film();
  EXPECT_EQ(film.json["nodes"][0]["name"], "soft");
  EXPECT_EQ(film.floats(film.json["animations"][0]["samplers"][0]["input"]),
            (std::vector<float>{0.0f, 0.5f}));
  ReducedBody& soft = run.bodies[0];
  soft.q = Eigen::Vector4d(0.1, 0, -0.2, 0.05), soft.position = Vec3(1, 2, 3);
  EXPECT_LT(distance(film.vertices(0, 0), soft), 1e-6);  // 3e-7: single precision
  soft.q = Eigen::Vector4d(-0.3, 0, 0.1, 0.15), soft.position = Vec3(1.5, 2, 2.5);
  soft.rotation = Quat(0.8, 0, 0.6, 0);
  EXPECT_LT(distance(film.vertices(0, 1), soft), 1e-6);
  run.bodies[1].position = Vec3(4, 5, 6);
  EXPECT_LT(distance(film.vertices(1, 1), run.bodies[1]), 1e-6);
}

TEST(BodiesGltf, InstancesShareAMeshWhoseModesAreTargets) {
  const Film film = TwoBlobs().film();
  EXPECT_EQ(film.json["meshes"].size(), 1u);
  // mode 2 never moves
  EXPECT_EQ(film.json["meshes"][0]["extras"]["targetNames"],
            (std::vector<std::string>{"mode 1 +", "mode 1 -", "mode 3 +", "mode 3 -", "mode 4 +"}));
  EXPECT_EQ(film.channel(0, "weights"),
            (std::vector<float>{1, 0, 0, 1, static_cast<float>(0.05 / 0.15), 0, 1, 1, 0, 1}));
  EXPECT_EQ(film.channel(1, "weights"), std::vector<float>(10, 0.0f));
}

TEST(BodiesGltf, RotationsGoTheShortWayAndBodiesWaitWithoutSize) {
  const Film film = TwoBlobs().film();
  const auto R = film.channel(0, "rotation");
  double product = 0.0;
  for (int c = 0; c < 4; ++c) product += double{R[c]} * double{R[4 + c]};
  EXPECT_GT(product, 0.0);
  EXPECT_EQ(film.channel(1, "scale"), (std::vector<float>{0, 0, 0, 1, 1, 1}));
}

TEST(BodiesGltf, TakesARangeOfFrames) {
  const Film film = TwoBlobs().film(1, 1);
  EXPECT_EQ(film.floats(film.json["animations"][0]["samplers"][0]["input"]),
            std::vector<float>{0.0f});
  EXPECT_THROW(TwoBlobs().film(2), FileError);
}

TEST(BodiesGltf, RefusesDamagedRows) {
  TwoBlobs run;
  for (const char* row : {"0,7,1,2,3,1,0,0,0,0,0,0,0", "0,0,1,2,3,1,0,0,0,0,,0,0"}) {
    std::ofstream(run.folder / "bodies.csv") << "t,body,x,y,z,qw,qx,qy,qz,q1,q2,q3,q4\n"
                                             << row << '\n';
    EXPECT_THROW(run.film(), FileError) << row;
  }
}

}  // namespace
}  // namespace archetide
