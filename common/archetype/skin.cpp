#include "common/archetype/skin.h"

#include <fmt/core.h>

#include <cmath>

#include "common/archetype/field_io.h"
#include "common/archetype/ladder_io.h"
#include "common/base/check.h"
#include "common/base/input_error.h"
#include "common/base/sha256.h"
#include "common/files/hdf5_file.h"

namespace archetide {
namespace {

constexpr char kSkinAdvice[] =
    "rebuild it with: archetide-precompute build SKIN.body.toml -o OUT.h5";

/// Joints as flat lists.
struct FlatJoints {
  std::vector<int> parts;  // 2 a joint
  std::vector<int> ends;   // of its points
  std::vector<Vec3> points;
};

FlatJoints flat(const std::vector<SkinJoint>& joints) {
  FlatJoints f;
  for (const SkinJoint& joint : joints) {
    f.parts.insert(f.parts.end(), {joint.a, joint.b});
    f.points.insert(f.points.end(), joint.points.begin(), joint.points.end());
    f.ends.push_back(static_cast<int>(f.points.size()));
  }
  return f;
}

bool unflatten(const FlatJoints& f, std::vector<SkinJoint>& joints) {
  if (f.parts.size() != 2 * f.ends.size()) return false;
  int begin = 0;
  for (std::size_t j = 0; j < f.ends.size(); ++j) {
    const int end = f.ends[j];
    if (end < begin || static_cast<std::size_t>(end) > f.points.size()) return false;
    joints.push_back(
        {f.parts[2 * j], f.parts[2 * j + 1], {f.points.begin() + begin, f.points.begin() + end}});
    begin = end;
  }
  return true;
}

template <class Io, class S, class Text>
void skin_fields(Io& io, S& skin, Text& parts, FlatJoints& joints) {
  io("name", skin.name, "1", "text");
  io("generator", skin.generator, "1", "text");
  io("recipe", skin.recipe, "1", "text");
  io("mesh_file", skin.mesh_file, "1", "text");
  io("mesh_hash", skin.mesh_hash, "1", "text: SHA-256, hexadecimal");
  io("blend", skin.blend, "m", "scalar");
  io("surface_vertices", skin.surface.vertices, "m", "n x 3");
  io("surface_triangles", skin.surface.triangles, "1", "nf x 3");
  io("parts", parts, "1", "text: a line each");
  io("part_of", skin.part_of, "1", "n x 4");
  io("weights", skin.weights, "1", "4 n");
  io("joint_parts", joints.parts, "1", "2 joints");
  io("joint_ends", joints.ends, "1", "joints");
  io("joint_points", joints.points, "m", "points of all joints x 3");
}

constexpr auto kSkinRungFields = [](auto& io, auto& rung) {
  io("surface_vertices", rung.surface.vertices, "m", "n x 3");
  io("surface_triangles", rung.surface.triangles, "1", "nf x 3");
  io("part_of", rung.part_of, "1", "n x 4");
  io("weights", rung.weights, "1", "4 n");
  io("deviation", rung.deviation, "m", "scalar");
};

/// Of the skin alone, or of the skin and its ladder.
std::string joined(const std::string& skin, const std::string& ladder) {
  return ladder.empty() ? skin : sha256_hex(skin + ladder);
}

void demand(bool holds, const char* field, const char* rule) {
  if (!holds) throw AssertionError(std::string("skin field ") + field + ": " + rule);
}

bool is_skin(const Hdf5Reader& file) {
  return file.has_attribute("format") && file.text_attribute("format") == kSkinFormat;
}

}  // namespace

double Skin::weight(std::size_t vertex, int part) const {
  double sum = 0.0;
  for (int k = 0; k < kMostParts; ++k)
    if (part_of[vertex][k] == part) sum += weights[kMostParts * vertex + k];
  return sum;
}

namespace {

/// A surface and what moves it, of the skin or of a rung.
template <class S>
void validate_surface(const S& skin, int parts) {
  const std::size_t n = skin.surface.vertices.size();
  demand(n > 0 && parts > 0, "surface_vertices", "empty");
  for (const Vec3& x : skin.surface.vertices)
    demand(x.allFinite(), "surface_vertices", "not finite");
  for (const Vec3i& t : skin.surface.triangles)
    for (const int v : t)
      demand(v >= 0 && static_cast<std::size_t>(v) < n, "surface_triangles", "index out of range");
  demand(skin.part_of.size() == n, "part_of", "not one for each vertex");
  demand(skin.weights.size() == Skin::kMostParts * n, "weights", "not four for each vertex");
  for (std::size_t v = 0; v < n; ++v) {
    double sum = 0.0;
    for (int k = 0; k < Skin::kMostParts; ++k) {
      const double w = skin.weights[Skin::kMostParts * v + k];
      demand(skin.part_of[v][k] >= 0 && skin.part_of[v][k] < parts, "part_of",
             "index out of range");
      demand(w >= 0.0 && w <= 1.0 + 1e-12, "weights", "not in [0, 1]");
      sum += w;
    }
    demand(std::abs(sum - 1.0) <= 1e-12, "weights", "their sum is not 1");
  }
}

}  // namespace

Skin on_rung(const Skin& skin, const SkinRung& rung) {
  Skin coarse = skin;
  coarse.surface = rung.surface;
  coarse.part_of = rung.part_of;
  coarse.weights = rung.weights;
  coarse.ladder.clear();
  return coarse;
}

void validate(const Skin& skin) {
  const auto parts = static_cast<int>(skin.parts.size());
  validate_surface(skin, parts);
  for (const SkinRung& rung : skin.ladder) {
    validate_surface(rung, parts);
    demand(rung.deviation >= 0.0 && std::isfinite(rung.deviation), "deviation", "negative");
  }
  for (const SkinJoint& joint : skin.joints) {
    demand(joint.a >= 0 && joint.a < parts && joint.b >= 0 && joint.b < parts, "joint_parts",
           "index out of range");
    for (const Vec3& x : joint.points) demand(x.allFinite(), "joint_points", "not finite");
  }
}

std::string write_skin(const std::string& path, const Skin& skin) {
  validate(skin);
  std::string parts;
  for (const std::string& part : skin.parts) parts += part + "\n";
  FlatJoints joints = flat(skin.joints);
  Hdf5Writer file(path);
  file.attribute("format", kSkinFormat);
  file.attribute("format_version", Skin::kFormatVersion);
  fields::FieldWriter out{file, "skin"};
  skin_fields(out, skin, parts, joints);
  const std::string hash =
      joined(out.hash.hex(), fields::write_ladder(file, skin.ladder, kSkinRungFields));
  file.attribute("content_hash", hash);
  file.commit();
  return hash;
}

Skin read_skin(const std::string& path) {
  const Hdf5Reader file(path, kSkinAdvice);
  if (!is_skin(file))  // nothing has to be built again
    throw FileError(path + ": not a skin; a body belongs in a [[body]] of a scene");
  const int version = file.int_attribute("format_version");
  if (version != Skin::kFormatVersion)
    file.fail(fmt::format("format version {}, this program reads version {}", version,
                          Skin::kFormatVersion));
  Skin skin;
  std::string parts;
  FlatJoints joints;
  fields::FieldReader in{file, "skin"};
  skin_fields(in, skin, parts, joints);
  skin.content_hash =
      joined(in.hash.hex(), fields::read_ladder(file, skin.ladder, kSkinRungFields));
  if (file.text_attribute("content_hash") != skin.content_hash)
    file.fail("the contents do not match their content_hash (damaged or changed by hand)");
  skin.parts = fields::lines_of(parts);
  if (!unflatten(joints, skin.joints)) file.fail("field joint_ends is not of shape joints");
  try {
    validate(skin);
  } catch (const AssertionError& wrong) {
    file.fail(wrong.what());
  }
  return skin;
}

bool is_skin_file(const std::string& path) { return is_skin(Hdf5Reader(path, kSkinAdvice)); }

}  // namespace archetide
