#include "precompute/recipe.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

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
       .fallback = "\"consistent\"",
       .choices = {"consistent", "lumped"},
       .meaning = "mass matrix of the tets"},
      {.path = "tet.mesher",
       .type = kString,
       .fallback = "\"cgal\"",
       .choices = {"cgal", "gmsh"},
       .meaning = "cgal: remeshes the surface; gmsh: keeps its triangles"},
      {.path = "tet.target",
       .type = kInteger,
       .range = between(100, 5e6),
       .fallback = "10_000",
       .meaning = "wanted number of tets (not for meshes of tets)"},
      {.path = "tet.order",
       .type = kInteger,
       .range = between(1, 2),
       .fallback = "1",
       .meaning = "polynomial order of the elements",
       .later = "quadratic tets",
       .later_values = {"2"}},
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
       .meaning = "elastic modes to keep, lowest first; 0 = a rigid body"},
      {.path = "modes.residual",
       .type = kNumber,
       .range = between(1e-14, 1e-2),
       .fallback = "1e-8",
       .meaning = "largest accepted |K phi - omega^2 M phi| / |K phi|"},
      {.path = "modes.static",
       .type = kStrings,
       .fallback = "[]",
       .choices = {"pressure", "gravity"},
       .meaning = "residual-flexibility vectors",
       .later = "residual-flexibility vectors",
       .later_values = {"pressure", "gravity"}},
  };
}

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw FileError(path + ": cannot be read");
  return text.str();
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
  r.text = read_text(path);
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
  root.integer("tet.order");

  r.material.density = root.number("material.density");
  r.material.young = root.number("material.young");
  r.material.poisson = root.number("material.poisson");
  r.alpha = root.number("damping.alpha");
  r.beta = root.number("damping.beta");

  r.modes.count = root.integer("modes.count");
  r.modes.residual = root.number("modes.residual");
  r.modes.mass = root.string("mass") == "lumped" ? MassKind::kLumped : MassKind::kConsistent;
  root.strings("modes.static");
  document.check_all_read();
  return r;
}

}  // namespace archetide
