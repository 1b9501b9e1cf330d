#include "precompute/recipe.h"

#include <filesystem>
#include <limits>

#include "common/byte_stream.h"
#include "common/input_error.h"
#include "common/params.h"

namespace archetide {
namespace {

std::vector<Key> body_keys() {
  using enum KeyType;
  return {
      {.path = "schema",
       .type = kInteger,
       .range = between(1, 1),
       .fallback = "required",
       .meaning = "version of this file's format"},
      {.path = "mesh",
       .type = kString,
       .fallback = "required",
       .meaning =
           "surface (.obj, .off, .ply, .stl) or tets (.msh, .vtu, .mesh), relative to this file"},
      {.path = "scale",
       .type = kNumber,
       .range = above(0),
       .fallback = "1.0",
       .meaning = "factor from mesh coordinates to metres"},
      {.path = "repair",
       .type = kString,
       .fallback = "\"none\"",
       .choices = {"none", "fill", "union", "wrap"},
       .meaning = "of a surface that does not bound a body: fill holes, unite overlapping closed "
                  "parts, wrap whatever is there from outside; none: refuse it"},
      {.path = "wrap.alpha",
       .type = kNumber,
       .unit = "m",
       .range = at_least(0),
       .fallback = "0.0",
       .meaning =
           "a wrap closes gaps narrower than twice this; 0 = a fiftieth of the diagonal, and "
           "cones over the holes first"},
      {.path = "wrap.offset",
       .type = kNumber,
       .unit = "m",
       .range = at_least(0),
       .fallback = "0.0",
       .meaning = "how far outside the input a wrap lies; 0 = wrap.alpha / 30"},
      {.path = "seed",
       .type = kInteger,
       .range = between(0, std::numeric_limits<int>::max()),
       .fallback = "1",
       .meaning = "of the mesher's random numbers"},
      {.path = "mass",
       .type = kString,
       .fallback = "\"auto\"",
       .choices = {"auto", "consistent", "lumped"},
       .meaning = "mass matrix of the tets; auto: lumped for tet.order 1, consistent for 2"},
      {.path = "tet.mesher",
       .type = kString,
       .fallback = "\"cgal\"",
       .choices = {"cgal", "gmsh"},
       .meaning = "cgal: remeshes the surface; gmsh: keeps its triangles"},
      {.path = "tet.target",
       .type = kInteger,
       .range = between(100, 5e6),
       .fallback = "4_000",
       .meaning = "wanted number of tets (not for meshes of tets)"},
      {.path = "tet.order",
       .type = kInteger,
       .range = between(1, 2),
       .fallback = "2",
       .meaning = "1: linear tets; 2: quadratic ones with curved boundary"},
      {.path = "material.density",
       .type = kNumber,
       .unit = "kg/m^3",
       .range = above(0),
       .fallback = "required",
       .meaning = "mass density"},
      {.path = "material.young",
       .type = kNumber,
       .unit = "Pa",
       .range = above(0),
       .fallback = "required",
       .meaning = "Young's modulus"},
      {.path = "material.poisson",
       .type = kNumber,
       .range = strictly_between(-1, 0.5),
       .fallback = "required",
       .meaning = "Poisson's ratio"},
      {.path = "material_region[]",
       .type = kTables,
       .fallback = "absent",
       .meaning =
           "another material where the tets' centroids lie in a box or a ball, or in a named "
           "physical group of a .msh file; the last wins"},
      {.path = "material_region[].group",
       .type = kString,
       .fallback = "absent",
       .meaning = "physical group of the .msh file: its name, or its number when it has none"},
      {.path = "material_region[].box",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "two opposite corners"},
      {.path = "material_region[].center",
       .type = kVec3,
       .unit = "m",
       .fallback = "absent",
       .meaning = "of a ball, in the coordinates of the mesh file times scale"},
      {.path = "material_region[].radius",
       .type = kNumber,
       .unit = "m",
       .range = above(0),
       .fallback = "absent",
       .meaning = "of a ball"},
      {.path = "material_region[].density",
       .type = kNumber,
       .unit = "kg/m^3",
       .range = above(0),
       .fallback = "required",
       .meaning = "mass density"},
      {.path = "material_region[].young",
       .type = kNumber,
       .unit = "Pa",
       .range = above(0),
       .fallback = "required",
       .meaning = "Young's modulus"},
      {.path = "material_region[].poisson",
       .type = kNumber,
       .range = strictly_between(-1, 0.5),
       .fallback = "required",
       .meaning = "Poisson's ratio"},
      {.path = "points[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "a named set of surface points, by a box, a ball or a list"},
      {.path = "points[].name",
       .type = kString,
       .fallback = "required",
       .meaning = "for clamped, modes.static and scenes"},
      {.path = "points[].box",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "two opposite corners"},
      {.path = "points[].center",
       .type = kVec3,
       .unit = "m",
       .fallback = "absent",
       .meaning = "of a ball, in the coordinates of the mesh file times scale"},
      {.path = "points[].radius",
       .type = kNumber,
       .unit = "m",
       .range = above(0),
       .fallback = "absent",
       .meaning = "of a ball"},
      {.path = "points[].list",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "the nearest surface vertex of each point"},
      {.path = "joint_frame[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "a named point with axes, for joints"},
      {.path = "joint_frame[].name",
       .type = kString,
       .fallback = "required",
       .meaning = "its name"},
      {.path = "joint_frame[].point",
       .type = kVec3,
       .unit = "m",
       .fallback = "required",
       .meaning = "in the coordinates of the mesh file times scale"},
      {.path = "joint_frame[].x", .type = kVec3, .fallback = "[1, 0, 0]", .meaning = "first axis"},
      {.path = "joint_frame[].z",
       .type = kVec3,
       .fallback = "[0, 0, 1]",
       .meaning = "third axis; made normal to the first"},
      {.path = "clamped",
       .type = kString,
       .fallback = "absent",
       .meaning = "point set held still while the modes are computed (absent: a free body)"},
      {.path = "damping.alpha",
       .type = kNumber,
       .unit = "1/s",
       .range = at_least(0),
       .fallback = "0.0",
       .meaning = "Rayleigh damping C = alpha M + beta K"},
      {.path = "damping.beta",
       .type = kNumber,
       .unit = "s",
       .range = at_least(0),
       .fallback = "0.0",
       .meaning = "Rayleigh damping C = alpha M + beta K"},
      {.path = "modes.count",
       .type = kInteger,
       .range = between(0, 1000),
       .fallback = "10",
       .meaning =
           "elastic modes to keep, lowest first; 0 = a rigid body; up to 5 more or fewer where "
           "it would cut through equal frequencies"},
      {.path = "modes.residual",
       .type = kNumber,
       .range = between(1e-14, 1e-2),
       .fallback = "1e-8",
       .meaning = "largest accepted |K phi - omega^2 M phi| / |K phi|"},
      {.path = "modes.static",
       .type = kStrings,
       .fallback = "[]",
       .meaning =
           "static responses behind the modes: \"pressure\" to the pressure of the modes' own "
           "normal motion (added mass), \"gravity\" to hydrostatic pressure along x, y, z"},
  };
}

/// "assets/bodies/torus.body.toml" -> "torus"
std::string body_name(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  for (const std::string ending : {".toml", ".body"}) {
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  }
  return name;
}

std::string beside(const std::string& path, const std::string& name) {
  return (std::filesystem::path(path).parent_path() / name).string();
}

/// Empty: the default of the order.
std::optional<MassKind> mass_kind(const Section& root, int order) {
  const std::string word = root.string("mass");
  if (word == "auto") return {};
  if (word == "consistent") return MassKind::kConsistent;
  if (order == 2)
    throw InputError({Diagnostic{root.location("mass"), "quadratic tets have no lumped mass",
                                 "leave mass out, or set tet.order = 1"}});
  return MassKind::kLumped;
}

/// A box, a ball or a list (of a point set) or a group (of tets).
Region read_region(const Section& s, bool of_points) {
  Region region;
  const bool list = of_points && s.has("list"), group = !of_points && s.has("group");
  const bool ball = s.has("center") || s.has("radius");
  if (s.has("box") + ball + list + group != 1)
    throw InputError({s.error("", of_points ? "needs one of box, center with radius, and list"
                                            : "needs one of box, center with radius, and group")});
  if (group) region.group = s.string("group");
  if (list) region.list = s.points("list");
  if (s.has("box")) {
    const std::vector<Vec3> corners = s.points("box");
    if (corners.size() != 2)
      throw InputError({s.error("box", "a box has two corners, [[x, y, z], [x, y, z]]")});
    region.box = {corners[0].cwiseMin(corners[1]), corners[0].cwiseMax(corners[1])};
  }
  if (ball) {
    if (!s.has("center") || !s.has("radius"))
      throw InputError({s.error("", "a ball needs both center and radius")});
    region.ball = {s.vec3("center"), s.number("radius")};
  }
  return region;
}

JointFrame read_joint_frame(const Section& s) {
  JointFrame frame{s.string("name"), s.vec3("point"), Mat3::Identity()};
  const Vec3 x = s.vec3("x"), z = s.vec3("z");
  const Vec3 y = z.cross(x);
  if (!(y.norm() > 1e-6 * x.norm() * z.norm()))
    throw InputError({s.error("", "x and z must be two different directions")});
  frame.axes << x.normalized(), y.normalized(), x.cross(y).normalized();
  return frame;
}

void require_point_set(const Section& root, const std::string& key, const std::string& name,
                       const Recipe& r) {
  std::string known;
  for (const NamedRegion& set : r.points) {
    if (set.name == name) return;
    known += (known.empty() ? "" : ", ") + set.name;
  }
  throw InputError({root.error(
      key, "there is no point set \"" + name + "\"",
      known.empty() ? "add [[points]] with this name" : "the point sets are: " + known)});
}

/// Regions, point sets, frames and what refers to them.
void read_parts(const Section& root, Recipe& r) {
  for (const Section& s : root.sections("material_region"))
    r.material_regions.push_back({read_region(s, false),
                                  {s.number("density"), s.number("young"), s.number("poisson")},
                                  s.location()});
  for (const Section& s : root.sections("points"))
    r.points.push_back({s.string("name"), read_region(s, true), s.location()});
  for (const Section& s : root.sections("joint_frame"))
    r.joint_frames.push_back(read_joint_frame(s));
  if (root.has("clamped")) {
    r.clamped = root.string("clamped");
    require_point_set(root, "clamped", r.clamped, r);
  }
  for (const std::string& load : root.strings("modes.static")) {
    if (load == "pressure") {
      r.modes.loads.pressure = true;
    } else if (load == "gravity") {
      r.modes.loads.gravity = true;
    } else {
      require_point_set(root, "modes.static", load, r);
      r.point_loads.push_back(load);
    }
  }
  if (!r.clamped.empty() && (r.modes.loads.any() || !r.point_loads.empty()))
    throw InputError({root.error("modes.static", "static responses are those of a free body",
                                 "remove clamped or modes.static")});
}

RepairOptions read_repair(const Section& root) {
  RepairOptions repair;
  const std::string kind = root.string("repair");
  for (const Repair r : {Repair::kFill, Repair::kUnion, Repair::kWrap})
    if (kind == name_of(r)) repair.kind = r;
  repair.alpha = root.number("wrap.alpha");
  repair.offset = root.number("wrap.offset");
  return repair;
}

}  // namespace

const Schema& body_schema() {
  static const Schema schema("body file (NAME.body.toml)", body_keys());
  return schema;
}

Recipe read_recipe(const std::string& path) {
  const Document document = Document::read(path, body_schema());
  const Section root = document.root();
  Recipe r;
  r.path = path;
  r.text = read_whole_file(path);
  r.name = body_name(path);
  root.integer("schema");
  r.mesh = root.string("mesh");
  r.mesh_path = beside(path, r.mesh);
  r.mesh_where = root.location("mesh");
  r.scale = root.number("scale");

  r.repair = read_repair(root);
  r.tet.mesher = root.string("tet.mesher") == "cgal" ? Mesher::kCgal : Mesher::kGmsh;
  r.tet.target = root.integer("tet.target");
  r.tet.seed = static_cast<unsigned>(root.integer("seed"));
  r.tet.order = root.integer("tet.order");

  r.material.density = root.number("material.density");
  r.material.young = root.number("material.young");
  r.material.poisson = root.number("material.poisson");
  r.alpha = root.number("damping.alpha");
  r.beta = root.number("damping.beta");

  r.modes.count = root.integer("modes.count");
  r.modes.residual = root.number("modes.residual");
  r.modes.mass = mass_kind(root, r.tet.order);
  read_parts(root, r);
  document.check_all_read();
  return r;
}

}  // namespace archetide
