#include "runtime/output/bodies_gltf.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "common/base/input_error.h"
#include "runtime/output/csv.h"
#include "runtime/output/gltf_file.h"
#include "runtime/output/palette.h"
#include "runtime/output/ply.h"
#include "runtime/output/vtp.h"

namespace archetide {
namespace {

using Json = GltfFile::Json;

// The place of a body in the frames that are shown: x = t + R s (x0 + S q).
struct Track {
  std::vector<float> translation, rotation, scale;  // 3, 4 (x, y, z, w), 3 a frame
  std::vector<VecX> q;                              // a frame; empty before the body is there
};

struct FilmMotion {
  std::vector<float> times;  // s, from 0 on
  std::vector<int> frames;   // their numbers
  std::vector<Track> tracks;
};

void append(const Vec3& v, std::vector<float>& list) {
  for (int a = 0; a < 3; ++a) list.push_back(static_cast<float>(v[a]));
}

// Of two quaternions of one rotation the one nearer to the last: what lies between is interpolated.
void append_near(Quat R, std::vector<float>& list) {
  R.normalize();
  const std::size_t n = list.size();
  if (n > 0 &&
      R.x() * list[n - 4] + R.y() * list[n - 3] + R.z() * list[n - 2] + R.w() * list[n - 1] < 0.0)
    R.coeffs() *= -1.0;
  for (const double c : {R.x(), R.y(), R.z(), R.w()}) list.push_back(static_cast<float>(c));
}

// The columns of bodies.csv.
class BodyRows {
 public:
  explicit BodyRows(const std::string& path) : path_(path), table_(read_csv(path)) {
    for (const char* name : {"t", "body", "x", "y", "z", "qw", "qx", "qy", "qz"})
      if (!table_.has(name)) throw FileError(path + ": no column " + name);
  }
  std::size_t size() const { return table_.rows(); }
  double time(std::size_t row) const { return table_.column("t")[row]; }
  std::size_t body(std::size_t row, std::size_t bodies) const {
    const double b = table_.column("body")[row];
    if (!(b >= 0.0 && b < static_cast<double>(bodies)))
      throw FileError(fmt::format("{}: row {} names a body that is not there", path_, row + 2));
    return static_cast<std::size_t>(b);
  }
  void place(std::size_t row, ReducedBody& body) const {
    const auto cell = [&](const std::string& name) {
      const std::vector<double>& column = table_.column(name);
      if (column.empty() || !std::isfinite(column[row]))
        throw FileError(fmt::format("{}: row {} has no {}", path_, row + 2, name));
      return column[row];
    };
    body.position = {cell("x"), cell("y"), cell("z")};
    body.rotation = Quat(cell("qw"), cell("qx"), cell("qy"), cell("qz"));
    for (int m = 0; m < body.r; ++m) body.q[m] = cell(fmt::format("q{}", m + 1));
  }

 private:
  std::string path_;
  CsvTable table_;
};

void add_frame(const ReducedBody& body, Track& track) {
  const auto shape = shape_correction(body, body.q);
  append(body.position + body.rotation * shape->shift, track.translation);
  append_near(body.rotation, track.rotation);
  append(Vec3::Constant(shape->s), track.scale);
  track.q.push_back(body.q);
}

// A body that is not there yet: where it will appear, without size.
void add_hidden_frames(std::size_t count, const ReducedBody& body, Track& track) {
  for (std::size_t f = 0; f < count; ++f) {
    append(body.position, track.translation);
    append_near(body.rotation, track.rotation);
    append(Vec3::Zero(), track.scale);
    track.q.push_back(VecX::Zero(body.r));
  }
}

FilmMotion motion_of(const RunFolder& run, std::vector<ReducedBody>& bodies, int first, int last) {
  const BodyRows rows(run.path + "bodies.csv");
  FilmMotion motion;
  motion.tracks.resize(bodies.size());
  double t = -INFINITY;
  int frame = -1;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (rows.time(row) > t) t = rows.time(row), ++frame;
    if (frame < first || (last >= 0 && frame > last)) continue;
    if (motion.frames.empty() || motion.frames.back() != frame)
      motion.frames.push_back(frame), motion.times.push_back(static_cast<float>(t));
    const std::size_t b = rows.body(row, bodies.size());
    rows.place(row, bodies[b]);
    Track& track = motion.tracks[b];
    if (track.q.empty()) add_hidden_frames(motion.frames.size() - 1, bodies[b], track);
    add_frame(bodies[b], track);
  }
  if (motion.frames.empty())
    throw FileError(
        fmt::format("{}bodies.csv: no frame in the range; there are 0 to {}", run.path, frame));
  const float start = motion.times.front();
  for (float& time : motion.times) time -= start;
  return motion;
}

// A mode with the sign and size of its largest amplitude on that side: weights that go from 0 to 1 show
// in every program, negative ones do not.
struct Extreme {
  int mode = 0;
  double amplitude = 0.0;
};

// Of the modes that move, over all bodies of an archetype.
std::vector<Extreme> extremes(const Archetype& a, const std::vector<ReducedBody>& bodies,
                              const FilmMotion& motion) {
  VecX high = VecX::Zero(a.r()), low = high;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (bodies[b].archetype.get() != &a) continue;
    for (const VecX& q : motion.tracks[b].q) {
      high.head(q.size()) = high.head(q.size()).cwiseMax(q);
      low.head(q.size()) = low.head(q.size()).cwiseMin(q);
    }
  }
  std::vector<Extreme> found;
  for (int m = 0; m < a.r(); ++m) {
    if (high[m] > 0.0) found.push_back({m, high[m]});
    if (low[m] < 0.0) found.push_back({m, low[m]});
  }
  return found;
}

std::vector<Vec3> normals_of(const TriMesh& surface) {
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(surface, normals, areas);
  return normals;
}

std::vector<float> flat(const std::vector<Vec3>& vectors) {
  std::vector<float> numbers;
  numbers.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) append(v, numbers);
  return numbers;
}

int add_surface(const TriMesh& surface, const std::string& name, const std::array<float, 3>& colour,
                GltfFile& file) {
  std::vector<std::uint32_t> corners;
  for (const Vec3i& t : surface.triangles)
    for (int c = 0; c < 3; ++c) corners.push_back(static_cast<std::uint32_t>(t[c]));
  const int material =
      file.add("materials", {{"name", name},
                             {"pbrMetallicRoughness",
                              {{"baseColorFactor", {colour[0], colour[1], colour[2], 1.0f}},
                               {"metallicFactor", 0.0},
                               {"roughnessFactor", 0.6}}}});
  const Json primitive = {{"attributes",
                           {{"POSITION", file.floats(flat(surface.vertices), "VEC3", true)},
                            {"NORMAL", file.floats(flat(normals_of(surface)), "VEC3", true)}}},
                          {"indices", file.indices(corners)},
                          {"material", material}};
  return file.add("meshes", {{"name", name}, {"primitives", Json::array({primitive})}});
}

// What an amplitude changes: vertices, and normals to first order.
Json morph_target(const Archetype& a, const Extreme& extreme, GltfFile& file) {
  const std::vector<Vec3> rest = normals_of(a.surface);
  std::vector<Vec3> moved(rest.size());
  TriMesh near = a.surface;
  constexpr double kNear = 1e-3;  // of the amplitude
  for (std::size_t v = 0; v < moved.size(); ++v) {
    moved[v] =
        extreme.amplitude * a.surface_modes.block<3, 1>(3 * static_cast<long>(v), extreme.mode);
    near.vertices[v] += kNear * moved[v];
  }
  std::vector<Vec3> turned = normals_of(near);
  for (std::size_t v = 0; v < turned.size(); ++v) turned[v] = (turned[v] - rest[v]) / kNear;
  return {{"POSITION", file.floats(flat(moved), "VEC3", true)},
          {"NORMAL", file.floats(flat(turned), "VEC3", true)}};
}

// A mesh of an archetype, and what its targets are.
struct MorphedMesh {
  int index = 0;
  std::vector<Extreme> targets;
};

MorphedMesh add_archetype(const Archetype& a, const std::string& name,
                          std::vector<Extreme> extremes, const std::array<float, 3>& colour,
                          GltfFile& file) {
  MorphedMesh mesh{add_surface(a.surface, name, colour, file), std::move(extremes)};
  if (mesh.targets.empty()) return mesh;
  Json targets = Json::array(), names = Json::array(), weights = Json::array();
  for (const Extreme& extreme : mesh.targets) {
    targets.push_back(morph_target(a, extreme, file));
    names.push_back(
        fmt::format("mode {}{}", extreme.mode + 1, extreme.amplitude < 0.0 ? " -" : " +"));
    weights.push_back(0.0);
  }
  Json& item = file.at("meshes", mesh.index);
  item["primitives"][0]["targets"] = targets;
  item["weights"] = weights;
  item["extras"] = {{"targetNames", names}};
  return mesh;
}

std::vector<float> weights_of(const Track& track, const MorphedMesh& mesh) {
  std::vector<float> weights;
  for (const VecX& q : track.q)
    for (const Extreme& e : mesh.targets)
      weights.push_back(
          e.mode < q.size() ? static_cast<float>(std::max(0.0, q[e.mode] / e.amplitude)) : 0.0f);
  return weights;
}

void add_channel(int node, const std::string& path, int input, int output, Json& animation) {
  animation["channels"].push_back(
      {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
  animation["samplers"].push_back(
      {{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
}

// A body as a child of the root.
int add_body(const std::string& name, const Track& track, const MorphedMesh& mesh, int times,
             GltfFile& file, Json& animation) {
  const int node = file.add("nodes", {{"name", name}, {"mesh", mesh.index}});
  const auto channel = [&](const std::string& path, const std::vector<float>& values,
                           const std::string& type) {
    add_channel(node, path, times, file.floats(values, type, false), animation);
  };
  channel("translation", track.translation, "VEC3");
  channel("rotation", track.rotation, "VEC4");
  channel("scale", track.scale, "VEC3");
  if (!mesh.targets.empty()) channel("weights", weights_of(track, mesh), "SCALAR");
  return node;
}

void add_obstacles(const RunFolder& run, GltfFile& file, std::vector<int>& children) {
  const std::string path = run.path + "frames/obstacles.ply";
  if (!std::filesystem::exists(path)) return;
  const SurfaceMesh read = read_ply(path);
  constexpr std::array<float, 3> kStone = {0.45f, 0.43f, 0.40f};
  const int mesh = add_surface({read.vertices, read.triangles}, "obstacles", kStone, file);
  children.push_back(file.add("nodes", {{"name", "obstacles"}, {"mesh", mesh}}));
}

// Of the last frame, from its file.
std::optional<double> distance_to_frame(const RunFolder& run, std::vector<ReducedBody>& bodies,
                                        const FilmMotion& motion) {
  const auto files = std::find_if(run.frames.begin(), run.frames.end(), [&](const FrameFiles& f) {
    return f.number == motion.frames.back();
  });
  if (files == run.frames.end() || files->bodies.empty()) return std::nullopt;
  const SurfaceMesh written = read_vtp(files->bodies);
  double off = 0.0;
  std::vector<Vec3> points;
  std::size_t v = 0;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Track& track = motion.tracks[b];
    if (track.q.empty()) continue;
    surface_points(bodies[b], points);
    if (v + points.size() > written.vertices.size()) return std::nullopt;
    for (const Vec3& x : points) off = std::max(off, (x - written.vertices[v++]).norm());
  }
  return v == written.vertices.size() ? std::optional(off) : std::nullopt;
}

}  // namespace

BodiesGltf bodies_gltf(const RunFolder& run, std::vector<ReducedBody> bodies, int first, int last) {
  const FilmMotion motion = motion_of(run, bodies, first, last);
  GltfFile file;
  Json animation = {
      {"name", run.manifest.scene}, {"channels", Json::array()}, {"samplers", Json::array()}};
  const int times = file.floats(motion.times, "SCALAR", false);
  std::map<const Archetype*, MorphedMesh> meshes;
  std::vector<int> children;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (motion.tracks[b].q.empty()) continue;  // it never appeared
    const Archetype& a = *bodies[b].archetype;
    if (!meshes.contains(&a))
      meshes[&a] = add_archetype(a, run.manifest.bodies[b].archetype, extremes(a, bodies, motion),
                                 body_palette_in_light(static_cast<int>(meshes.size())), file);
    children.push_back(add_body(run.manifest.bodies[b].name, motion.tracks[b], meshes[&a], times,
                                file, animation));
  }
  const int shown = static_cast<int>(children.size());
  add_obstacles(run, file, children);
  if (!animation["channels"].empty()) file.add("animations", animation);
  const double half = std::sqrt(0.5);
  Json root = {{"name", run.manifest.scene},
               {"rotation", {-half, 0.0, 0.0, half}}};  // z up to y up
  if (!children.empty()) root["children"] = children;
  file.set_scene(run.manifest.scene, {file.add("nodes", root)});
  return {file.bytes(), shown, static_cast<int>(meshes.size()),
          static_cast<int>(motion.frames.size()), distance_to_frame(run, bodies, motion)};
}

}  // namespace archetide
