#include "runtime/scene/add_moving_obstacle.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "common/archetype/rigid_archetype.h"
#include "common/base/sha256.h"
#include "common/mesh/mesh_sdf.h"
#include "runtime/scene/timed_rows.h"

namespace archetide {
namespace {

MotionPath read_path(const StaticSpec& spec) {
  if (spec.motion_csv.empty()) return spec.motion;
  const std::vector<TimedRow> rows =
      read_timed_rows(spec.motion_csv, spec.motion_where, {"x", "y", "z", "qw", "qx", "qy", "qz"});
  const auto turns = [](const TimedRow& row) { return !row.values.tail<4>().isZero(0.0); };
  const bool any_turns = std::any_of(rows.begin(), rows.end(), turns);
  const auto refuse = [&](const TimedRow& row, const std::string& what, const std::string& hint) {
    throw InputError({{spec.motion_where,
                       fmt::format("{}: at t = {}: {}", spec.motion_csv, row.t, what), hint}});
  };
  MotionPath path;
  for (const TimedRow& row : rows) {
    Quat turn = Quat::Identity();
    if (any_turns && !turns(row))
      refuse(row, "a quaternion of length 0", "no turn is qw = 1, or leave out all four columns");
    const auto q = row.values.tail<4>();
    if (any_turns) turn = Quat(q[0], q[1], q[2], q[3]).normalized();
    if (!path.keys.empty() && turn.angularDistance(path.keys.back().turn) > kMostTurn)
      refuse(row, "a turn of more than 120 degrees since the last row", "give rows in between");
    path.keys.push_back({row.t, row.values.head<3>(), turn});
  }
  return path;
}

template <class T>
void append_bytes(const T& value, std::string& text) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  text.append(bytes, sizeof(T));
}

// Of what the file names do not tell: a run that goes on must have the same.
std::string hash_of(const TriMesh& surface, const MotionPath& path) {
  std::string text;
  for (const Vec3& x : surface.vertices)
    for (int axis = 0; axis < 3; ++axis) append_bytes(x[axis], text);
  for (const Vec3i& t : surface.triangles)
    for (int corner = 0; corner < 3; ++corner) append_bytes(t[corner], text);
  for (const MotionPath::Key& key : path.keys) {
    append_bytes(key.t, text);
    for (int axis = 0; axis < 3; ++axis) append_bytes(key.shift[axis], text);
    for (int part = 0; part < 4; ++part) append_bytes(key.turn.coeffs()[part], text);
  }
  return sha256_hex(text);
}

}  // namespace

void add_moving_obstacle(const StaticSpec& spec, const TriMesh& placed,
                         const std::optional<ContactMaterial>& contact, BuiltScene& built) {
  if (built.options.scheme == Scheme::kSingle)
    throw InputError({{spec.motion_where, "obstacles do not move with step.scheme = \"single\"",
                       "use \"newmark\", two solves a step"}});
  PrescribedBody told;
  told.path = read_path(spec);
  const std::string name = std::filesystem::path(spec.mesh).stem().string();
  // what it weighs is no matter: it answers nothing
  auto archetype =
      std::make_shared<Archetype>(rigid_archetype(name, placed, built.options.water_density));
  archetype->sdf = sample_distance(archetype->surface);
  archetype->content_hash = hash_of(placed, told.path);
  told.body = static_cast<int>(built.bodies.size());
  told.origin = spec.position;
  told.arm = archetype->centre - spec.position;
  ReducedBody body;
  body.position = archetype->centre;
  body.archetype = std::move(archetype);
  body.contact = contact;
  built.bodies.push_back(std::move(body));
  built.body_names.push_back(name);
  built.release.push_back(0.0);
  built.prescribed.push_back(std::move(told));
}

}  // namespace archetide
