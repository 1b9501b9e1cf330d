#include "precompute/recipe.h"

#include <algorithm>
#include <filesystem>
#include <limits>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/matter.h"
#include "common/params/params.h"

namespace archetide {
namespace {

using enum KeyType;
using Keys = std::vector<Key>;

/// The shapes of a region; regions are tables of several kinds.
Keys region_keys(const std::string& table) {
  return {{.path = table + ".box",
           .type = kPoints,
           .unit = "m",
           .fallback = "absent",
           .meaning = "two opposite corners, in the coordinates of the mesh file times scale"},
          {.path = table + ".center",
           .type = kVec3,
           .unit = "m",
           .fallback = "absent",
           .meaning = "of a ball"},
          {.path = table + ".axis",
           .type = kPoints,
           .unit = "m",
           .fallback = "absent",
           .meaning = "of a cylinder: the centres of its ends"},
          {.path = table + ".radius",
           .type = kNumber,
           .unit = "m",
           .range = above(0),
           .fallback = "absent",
           .meaning = "of a ball or a cylinder"},
          {.path = table + ".plane",
           .type = kPoints,
           .unit = "m",
           .fallback = "absent",
           .meaning = "of a half-space: a point, and a direction that points out of it"}};
}

Keys surface_keys() {
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
      {.path = "cut[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "takes a part out of the surface, which is closed where it is cut; one after the "
                  "other"},
      {.path = "cut[].keep",
       .type = kString,
       .fallback = "\"inside\"",
       .choices = {"inside", "outside"},
       .meaning = "which side of the region is the body"}};
}

Keys skin_keys() {
  return {
      {.path = "skin",
       .type = kTable,
       .fallback = "absent",
       .meaning = "the mesh is a skin over bodies that were cut out of it; only mesh, scale and "
                  "repair count beside it"},
      {.path = "skin.parts",
       .type = kStrings,
       .fallback = "required",
       .meaning = "body files of the parts, relative to this file; their cuts share out the "
                  "surface"},
      {.path = "skin.blend",
       .type = kNumber,
       .unit = "m",
       .range = above(0),
       .fallback = "0.03",
       .meaning = "width along the surface over which one part hands over to the next"},
      {.path = "skin.joint[]",
       .type = kTables,
       .fallback = "absent",
       .meaning =
           "points where two parts stay together (one: ball joint, two: hinge, three: weld)"},
      {.path = "skin.joint[].parts",
       .type = kStrings,
       .fallback = "required",
       .meaning = "names of two parts, their body files without .body.toml"},
      {.path = "skin.joint[].points",
       .type = kPoints,
       .unit = "m",
       .fallback = "required",
       .meaning = "in the coordinates of the mesh file times scale"}};
}

Keys solid_keys() {
  return {
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
      {.path = "keep",
       .type = kString,
       .fallback = "\"modes\"",
       .choices = {"modes", "tets"},
       .meaning = "tets: mass and stiffness of the tets too, for bodies of nodes"},
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
       .range = between(kLeastDensity, kLargestDensity),
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
       .meaning = "another material where the tets' centroids lie in a region, or in a named "
                  "physical group of a .msh file; the last wins"},
      {.path = "material_region[].group",
       .type = kString,
       .fallback = "absent",
       .meaning = "physical group of the .msh file: its name, or its number when it has none"},
      {.path = "material_region[].density",
       .type = kNumber,
       .unit = "kg/m^3",
       .range = between(kLeastDensity, kLargestDensity),
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
  };
}

Keys point_keys() {
  return {
      {.path = "points[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "a named set of surface points, by a region or a list"},
      {.path = "points[].name",
       .type = kString,
       .fallback = "required",
       .meaning = "for clamped, modes.static and scenes"},
      {.path = "points[].list",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "the nearest surface vertex of each point"},
  };
}

Keys motion_keys() {
  return {
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
       .type = kIntegerOrString,
       .range = between(0, 1000),
       .fallback = "10",
       .choices = {"full"},
       .meaning =
           "elastic modes to keep, lowest first; 0 = a rigid body; up to 5 more or fewer where "
           "it would cut through equal frequencies; \"full\" = every degree of freedom of the "
           "tets, at most 1500 modes (502 nodes)"},
      {.path = "modes.kind",
       .type = kString,
       .fallback = "\"linear\"",
       .choices = {"linear", "nonlinear"},
       .meaning = "linear: small strains and turns; nonlinear: bends, twists and is squashed far, "
                  "with uniform strains, modal derivatives and a neo-Hookean energy"},
      {.path = "modes.derivatives",
       .type = kInteger,
       .range = between(0, 500),
       .fallback = "20",
       .meaning = "of a nonlinear body: vectors of modal derivatives behind the modes; about twice "
                  "modes.count"},
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
           "normal motion (added mass), \"gravity\" to hydrostatic pressure along x, y, z, a name "
           "of [[points]] to pushes on them along x, y, z"},
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

std::string in_folder_of(const std::string& path, const std::string& name) {
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

/// What may stand instead of a shape.
enum class Instead { kNothing, kList, kGroup };

/// Exactly one shape, or the list of a point set, or the group of tets of a material.
Region read_region(const Section& s, Instead instead = Instead::kNothing) {
  Region region;
  const bool list = instead == Instead::kList && s.has("list");
  const bool group = instead == Instead::kGroup && s.has("group");
  const bool axis = s.has("axis"), ball = s.has("center") || (s.has("radius") && !axis);
  if (s.has("box") + ball + axis + s.has("plane") + list + group != 1)
    throw InputError(
        {s.error("", std::string("needs one of box, center with radius, axis with radius, ") +
                         (instead == Instead::kList    ? "plane, and list"
                          : instead == Instead::kGroup ? "plane, and group"
                                                       : "and plane"))});
  const auto pair = [&](const std::string& key, const char* complaint) {
    const std::vector<Vec3> points = s.points(key);
    if (points.size() != 2) throw InputError({s.error(key, complaint)});
    return std::pair(points[0], points[1]);
  };
  if (group) region.group = s.string("group");
  if (list) region.list = s.points("list");
  if (s.has("box")) {
    const auto [p, q] = pair("box", "a box has two corners, [[x, y, z], [x, y, z]]");
    region.box = {p.cwiseMin(q), p.cwiseMax(q)};
  }
  if (ball) {
    if (!s.has("center") || !s.has("radius"))
      throw InputError({s.error("", "a ball needs both center and radius")});
    region.ball = {s.vec3("center"), s.number("radius")};
  }
  if (axis) {
    const auto [from, to] = pair("axis", "an axis has two ends, [[x, y, z], [x, y, z]]");
    if (!s.has("radius") || from == to)
      throw InputError({s.error("", "a cylinder needs an axis of some length and a radius")});
    region.cylinder = {from, to, s.number("radius")};
  }
  if (s.has("plane")) {
    const auto [point, normal] = pair("plane", "a plane is a point and a direction");
    if (!(normal.norm() > 0.0)) throw InputError({s.error("plane", "the direction has no length")});
    region.half_space = {point, normal.normalized()};
  }
  return region;
}

std::vector<Cut> read_cuts(const Section& root) {
  std::vector<Cut> cuts;
  for (const Section& s : root.sections("cut"))
    cuts.push_back({read_region(s), s.string("keep") == "inside", s.location()});
  return cuts;
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
    r.material_regions.push_back({read_region(s, Instead::kGroup),
                                  {s.number("density"), s.number("young"), s.number("poisson")},
                                  s.location()});
  for (const Section& s : root.sections("points"))
    r.points.push_back({s.string("name"), read_region(s, Instead::kList), s.location()});
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

void read_kind(const Section& root, Recipe& r) {
  r.modes.nonlinear = root.string("modes.kind") == "nonlinear";
  r.modes.derivatives = root.integer("modes.derivatives");
  if (!r.modes.nonlinear && root.has("modes.derivatives"))
    throw InputError({root.error("modes.derivatives", "linear modes have no derivatives",
                                 "set modes.kind = \"nonlinear\"")});
  if (!r.modes.nonlinear) return;
  if (!r.clamped.empty())
    throw InputError({root.error("clamped", "nonlinear modes are of a free body",
                                 "remove clamped, or set modes.kind = \"linear\"")});
  if (r.modes.every_motion)
    throw InputError(
        {root.error("modes.count", "nonlinear modes are a few of many", "give a number of modes")});
}

/// modes.count = "full" leaves nothing to add, and is of a free body.
void check_every_motion(const Section& root, const Recipe& r) {
  if (!r.modes.every_motion) return;
  if (r.modes.loads.any() || !r.point_loads.empty())
    throw InputError({root.error("modes.static", "a complete basis answers every load already",
                                 "remove modes.static, or give a number of modes")});
  if (!r.clamped.empty())
    throw InputError({root.error("clamped", "modes.count = \"full\" is of a free body",
                                 "remove clamped, or give a number of modes")});
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

SkinJoint read_skin_joint(const Section& s, const std::vector<std::string>& parts) {
  SkinJoint joint;
  const std::vector<std::string> names = s.strings("parts");
  if (names.size() != 2 || names[0] == names[1])
    throw InputError({s.error("parts", "expected the names of two parts")});
  const auto index = [&](const std::string& name) {
    const auto found = std::find(parts.begin(), parts.end(), name);
    if (found != parts.end()) return static_cast<int>(found - parts.begin());
    const std::string near = closest_match(name, parts);
    throw InputError({s.error("parts", "the skin has no part \"" + name + "\"",
                              near.empty() ? "parts are named like their body files, without "
                                             ".body.toml"
                                           : "did you mean \"" + near + "\"?")});
  };
  joint.a = index(names[0]), joint.b = index(names[1]);
  joint.points = s.points("points");
  if (joint.points.empty()) throw InputError({s.error("points", "the joint has no points")});
  return joint;
}

/// A skin has no material of its own.
SkinRecipe read_skin(const Section& root, const std::string& path) {
  for (const char* key : {"cut", "seed", "mass", "tet", "material", "material_region", "points",
                          "joint_frame", "clamped", "damping", "modes", "keep"})
    if (root.has(key))
      throw InputError({root.error(key, std::string(key) + " is of no use in a skin",
                                   "give it in the body files of its parts")});
  SkinRecipe skin;
  const Section s = root.section("skin");
  skin.blend = s.number("blend");
  skin.parts_where = s.location("parts");
  for (const std::string& part : s.strings("parts")) {
    skin.part_paths.push_back(in_folder_of(path, part));
    skin.parts.push_back(body_name(part));
    if (std::count(skin.parts.begin(), skin.parts.end(), skin.parts.back()) > 1)
      throw InputError({s.error("parts", "two parts are called \"" + skin.parts.back() + "\"")});
  }
  if (skin.parts.empty()) throw InputError({s.error("parts", "the skin has no parts")});
  for (const Section& joint : s.sections("joint")) {
    skin.joints.push_back(read_skin_joint(joint, skin.parts));
    skin.joint_where.push_back(joint.location("points"));
  }
  return skin;
}

}  // namespace

namespace {

Schema make_schema(bool of_skin) {
  Keys keys;
  if (of_skin)
    keys.push_back({.path = "material",
                    .type = kTable,
                    .fallback = "absent",
                    .meaning = "that of the parts; it has none of its own"});
  for (const Keys& part :
       {surface_keys(), region_keys("cut[]"), skin_keys(), solid_keys(),
        region_keys("material_region[]"), point_keys(), region_keys("points[]"), motion_keys()})
    keys.insert(keys.end(), part.begin(), part.end());
  return Schema("body file (NAME.body.toml)", keys);
}

}  // namespace

const Schema& body_schema() {
  static const Schema schema = make_schema(false);
  return schema;
}

Recipe read_recipe(const std::string& path) { return parse_recipe(read_param_file(path), path); }

Recipe parse_recipe(const std::string& text, const std::string& path) {
  const bool is_skin = parse_param_text(text, path).find("skin") != nullptr;
  // A skin has no material.
  const Document document =
      Document::parse(text, path, is_skin ? make_schema(true) : body_schema());
  const Section root = document.root();
  Recipe r;
  r.path = path;
  r.text = text;
  r.name = body_name(path);
  root.integer("schema");
  r.mesh = root.string("mesh");
  r.mesh_path = in_folder_of(path, r.mesh);
  r.mesh_where = root.location("mesh");
  r.scale = root.number("scale");

  r.repair = read_repair(root);
  if (is_skin) {
    r.skin = read_skin(root, path);
    document.check_all_read();
    return r;
  }
  r.cuts = read_cuts(root);
  r.tet.mesher = root.string("tet.mesher") == "cgal" ? Mesher::kCgal : Mesher::kGmsh;
  r.tet.target = root.integer("tet.target");
  r.tet.seed = static_cast<unsigned>(root.integer("seed"));
  r.tet.order = root.integer("tet.order");

  r.material.density = root.number("material.density");
  r.material.young = root.number("material.young");
  r.material.poisson = root.number("material.poisson");
  r.alpha = root.number("damping.alpha");
  r.beta = root.number("damping.beta");

  r.modes.every_motion = root.is_string("modes.count");
  if (!r.modes.every_motion) r.modes.count = root.integer("modes.count");
  r.modes.residual = root.number("modes.residual");
  r.modes.mass = mass_kind(root, r.tet.order);
  r.keep_tets = root.string("keep") == "tets";
  read_parts(root, r);
  read_kind(root, r);
  check_every_motion(root, r);
  document.check_all_read();
  return r;
}

}  // namespace archetide
