#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/archetype/archetype.h"
#include "common/archetype/skin.h"
#include "common/base/sha256.h"
#include "common/files/state_file.h"
#include "common/mesh/mesh_sdf.h"
#include "runtime/simulation.h"
#include "runtime/solid/inversion_limit.h"
#include "tests/fuzz/field_edits.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/refusal.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

/// A file of this process, gone at its end.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& name)
      : path_((std::filesystem::temp_directory_path() /
               fmt::format("archetide_fuzz_{}{}", ::getpid(), name))
                  .string()) {}
  ~ScratchFile() { std::filesystem::remove(path_); }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Bytes that call themselves an HDF5 file.
void fuzz_hdf5(std::string_view bytes) {
  static const ScratchFile file("_raw.h5");
  std::ofstream(file.path(), std::ios::binary) << bytes;
  accepts([&] { read_archetype(file.path()); });
  accepts([&] { read_archetype(file.path(), Part::kRuntime); });
  accepts([&] { read_skin(file.path()); });
  accepts([&] {
    StateReader state(file.path(), "archetide checkpoint", 7, "");
    std::string text;
    VecX numbers;
    state.field("scene_hash", text);
    state.field("bodies/P", numbers);
  });
}

// ---- archetypes whose fields were changed, with hashes that fit --------------------------------

const std::vector<std::string> kRuntimeFields = {"name",
                                                 "generator",
                                                 "recipe",
                                                 "mesh_file",
                                                 "mesh_hash",
                                                 "mesher",
                                                 "mass_kind",
                                                 "blas",
                                                 "clamped",
                                                 "density",
                                                 "young",
                                                 "poisson",
                                                 "alpha",
                                                 "beta",
                                                 "volume",
                                                 "centre",
                                                 "min_dihedral",
                                                 "min_radius_ratio",
                                                 "surface_vertices",
                                                 "surface_triangles",
                                                 "surface_to_node",
                                                 "surface_normals",
                                                 "surface_areas",
                                                 "sdf_origin",
                                                 "sdf_spacing",
                                                 "sdf_nodes",
                                                 "sdf_values",
                                                 "point_set_names",
                                                 "point_set_ends",
                                                 "point_set_vertices",
                                                 "joint_frame_names",
                                                 "joint_frame_points",
                                                 "joint_frame_axes",
                                                 "omega2",
                                                 "residuals",
                                                 "is_static",
                                                 "frequency_error",
                                                 "surface_modes",
                                                 "M_r",
                                                 "K_r",
                                                 "mass",
                                                 "Sxx",
                                                 "I3",
                                                 "A",
                                                 "B"};
const std::vector<std::string> kFullFields = {"nodes", "tets", "mids", "node_modes"};

/// Made once, and its distances: they are most of what making a simulation costs.
const std::shared_ptr<const Archetype>& soft_box() {
  static const std::shared_ptr<const Archetype> box = [] {
    SyntheticOptions soft;
    soft.r = 2, soft.density = 600.0, soft.first_omega = 30.0;
    Archetype a =
        *deformable_archetype(box_tets(Vec3(0.2, 0.2, 0.15), Vec3i(1, 1, 1)), soft).archetype;
    a.sdf = sample_distance(a.surface);
    return std::make_shared<const Archetype>(std::move(a));
  }();
  return box;
}

/// Every field of a good archetype with all that it may have, by "group/name".
FieldMap good_archetype() {
  const ScratchFile file("_good.h5");
  Archetype a = *soft_box();
  a.name = "box";
  a.point_sets = {{"rim", {0, 1}}, {"tip", {2}}};
  a.joint_frames = {{"hook", Vec3(0.1, 0, 0), Mat3::Identity()}};
  a.sdf = {Vec3::Constant(-0.2), 0.2, Vec3i(3, 3, 3), std::vector<float>(27, 0.1f)};
  write_archetype(file.path(), a);
  const Hdf5Reader stored(file.path(), "");
  FieldMap fields;
  for (const std::string& name : kRuntimeFields)
    fields["runtime/" + name] = stored.read("runtime/" + name);
  for (const std::string& name : kFullFields) fields["full/" + name] = stored.read("full/" + name);
  return fields;
}

/// Writes the fields of a group that are there, in the order of the file; returns their hash.
std::string write_group(Hdf5Writer& out, const std::string& group,
                        const std::vector<std::string>& names, const FieldMap& fields) {
  Sha256 hash;
  for (const std::string& field : names) {
    const std::string name = group + "/" + field;
    const auto found = fields.find(name);
    if (found == fields.end()) continue;
    const DataArray& data = found->second;
    out.write(name, data, "1", "any");
    hash.update(name);
    const auto type = static_cast<std::uint8_t>(data.type);
    hash.update(&type, 1);
    for (const std::uint64_t n : data.shape) hash.update(&n, sizeof n);
    hash.update(data.bytes.data(), data.bytes.size());
  }
  return hash.hex();
}

void write_fields(const std::string& path, const FieldMap& fields) {
  Hdf5Writer out(path);
  out.attribute("format", "archetide body archetype");
  out.attribute("format_version", Archetype::kFormatVersion);
  const std::string runtime = write_group(out, "runtime", kRuntimeFields, fields),
                    full = write_group(out, "full", kFullFields, fields);
  out.attribute("runtime_hash", runtime);
  out.attribute("full_hash", full);
  out.attribute("content_hash", sha256_hex(runtime + full));
  out.commit();
}

/// What an archetype that was accepted is used for.
void use(const std::shared_ptr<const Archetype>& a) {
  ReducedBody body = make_body(a, a->r());
  body.q.setConstant(0.01);
  const InversionLimit limit(*a);
  for (const Vec3& x : {Vec3(0, 0, 0), Vec3(1e6, -1e6, 0.1)})
    static_cast<void>(a->sdf.value(x) + a->sdf.gradient(x).norm());
}

void fuzz_archetype(std::string_view bytes) {
  static const FieldMap good = good_archetype();
  static const ScratchFile file("_fields.h5");
  FieldMap fields = good;
  edit_fields(bytes, fields);
  write_fields(file.path(), fields);
  std::shared_ptr<Archetype> a;
  if (accepts([&] { a = std::make_shared<Archetype>(read_archetype(file.path())); })) use(a);
}

// ---- checkpoints whose fields were changed -------------------------------------------------------

/// Keeps what is stored, and gives it back.
class MemoryArchive : public StateArchive {
 public:
  explicit MemoryArchive(bool reading, FieldMap fields = {})
      : fields_(std::move(fields)), reading_(reading) {}
  bool reading() const override { return reading_; }
  [[noreturn]] void fail(const std::string& what) const override { throw FileError(what); }
  const FieldMap& fields() const { return fields_; }

 protected:
  void store(const std::string& name, DataArray data) override { fields_[name] = std::move(data); }
  DataArray load(const std::string& name) override {
    const auto found = fields_.find(name);
    if (found == fields_.end()) fail("field " + name + " is missing");
    return found->second;
  }

 private:
  FieldMap fields_;
  bool reading_;
};

/// Two soft boxes fall into water with drops, particles and markers.
Simulation small_tank() {
  constexpr int n = 6;
  SimulationOptions o;
  o.grid = {n, n, 2 * n, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.particles_per_cell = 2;
  o.spray = true;
  o.body_contact = o.wall_contact = true;
  o.scheme = Scheme::kSingle;
  o.on_fail = OnFail::kStop;
  FluidState water = water_to(o.grid, 0.5);
  water.phi(4, 4, 9) = -0.1;
  water.markers = {Vec3(0.4, 0.4, 0.3)};
  std::vector<ReducedBody> bodies(2, make_body(soft_box(), 2));
  bodies[0].position = Vec3(0.4, 0.5, 0.5);
  bodies[1].position = Vec3(0.45, 0.5, 0.62);
  return Simulation(o, std::move(water), bodies, {});
}

FieldMap good_state() {
  Simulation simulation = small_tank();
  for (int n = 0; n < 3; ++n) simulation.step(0.02);
  MemoryArchive archive(false);
  simulation.visit_state(archive);
  return archive.fields();
}

void fuzz_checkpoint(std::string_view bytes) {
  static const FieldMap good = good_state();
  FieldMap fields = good;
  edit_fields(bytes, fields);
  MemoryArchive archive(true, std::move(fields));
  Simulation simulation = small_tank();
  if (accepts([&] { simulation.visit_state(archive); })) accepts([&] { simulation.step(0.02); });
}

}  // namespace

const std::vector<FuzzTarget>& stored_targets() {
  static const std::vector<FuzzTarget> targets = {
      {"hdf5", fuzz_hdf5}, {"archetype", fuzz_archetype}, {"checkpoint", fuzz_checkpoint}};
  return targets;
}

}  // namespace archetide
