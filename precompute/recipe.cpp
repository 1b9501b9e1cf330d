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
       .meaning = "surface (.obj, .off, .ply, .stl) or tets (.msh, .mesh), relative to this file"},
      {.path = "scale",
       .type = kNumber,
       .range = above(0),
       .fallback = "1.0",
       .meaning = "factor from mesh coordinates to metres"},
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
       .fallback = "10_000",
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
       .choices = {"pressure", "gravity"},
       .meaning =
           "static responses behind the modes: \"pressure\" to the pressure of the modes' own "
           "normal motion (added mass), \"gravity\" to hydrostatic pressure along x, y, z"},
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
  for (const std::string& load : root.strings("modes.static"))
    (load == "pressure" ? r.modes.loads.pressure : r.modes.loads.gravity) = true;
  document.check_all_read();
  return r;
}

}  // namespace archetide
