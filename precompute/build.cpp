#include "precompute/build.h"

#include <cmath>
#include <iomanip>
#include <numbers>
#include <sstream>

#include "common/atomic_file.h"
#include "common/input_error.h"
#include "common/sha256.h"
#include "common/surface_io.h"
#include "precompute/defects.h"
#include "precompute/memory.h"
#include "precompute/sdf.h"
#include "precompute/tet_io.h"

namespace archetide {
namespace {

template <class... Parts>
std::string join(const Parts&... parts) {
  std::ostringstream text;
  text << std::setprecision(4);
  (text << ... << parts);
  return text.str();
}

/// Runs `work`; complaints that name no place are about the body file.
template <class Work>
auto blaming(const Recipe& recipe, Work work) {
  try {
    return work();
  } catch (const SurfaceDefects&) {
    throw;  // about the mesh file
  } catch (const InputError& error) {
    std::vector<Diagnostic> list = error.diagnostics;
    for (Diagnostic& d : list) {
      if (d.where.file.empty()) d.where.file = recipe.path;
    }
    throw InputError(list);
  }
}

BodyMesh mesh_from_tets(const Recipe& recipe, Profile& profile) {
  BodyMesh body;
  body.mesher = "input";
  {
    const ScopedTimer timer(profile, "read");
    body.tets = read_tets(recipe.mesh_path, recipe.scale);
  }
  body.quality = measure_quality(body.tets, 0.0);
  try {
    require_quality(body.tets, body.quality, QualityLimits{}, "mesh file " + recipe.mesh_path,
                    "mesh the body again");
  } catch (const TetDefects& error) {  // the tets are the user's
    throw SurfaceDefects({{{}, error.what(), ""}}, error.offenders);
  }
  return body;
}

BodyMesh mesh_from_surface(const Recipe& recipe, Log& log, Profile& profile) {
  BodyMesh body;
  demand_memory(
      least_memory(recipe.tet.target, 1, recipe.modes.count),
      join(recipe.name, ": ", recipe.tet.target, " tets with ", recipe.modes.count, " modes"),
      "lower tet.target or modes.count");
  body.mesher = recipe.tet.mesher == Mesher::kCgal ? "cgal" : "gmsh";
  SurfaceFile file;
  {
    const ScopedTimer timer(profile, "read");
    file = read_surface(recipe.mesh_path);
  }
  TriMesh surface;
  {
    const ScopedTimer timer(profile, "intake");
    surface = accept_surface(file, recipe.scale, recipe.repair, body.intake);
  }
  for (const std::string& note : body.intake.notes()) log.say(recipe.mesh_path + ": " + note);
  log.say(join("surface: ", body.intake.vertices, " vertices, ", body.intake.faces,
               " faces, volume ", body.intake.volume, " m^3"));
  const ScopedTimer timer(profile, "mesh");
  TetrahedralizeResult result = tetrahedralize(surface, recipe.tet);
  body.tets = std::move(result.mesh);
  body.quality = result.quality;
  return body;
}

void describe_material(const Recipe& recipe, Archetype& a) {
  a.name = recipe.name;
  a.generator = "archetide-precompute " ARCHETIDE_VERSION;
  a.recipe = recipe.text;
  a.mesh_file = recipe.mesh;
  a.mesh_hash = sha256_of_file(recipe.mesh_path);
  a.mass_kind = recipe.modes.mass == MassKind::kLumped ? "lumped" : "consistent";
  a.density = recipe.material.density;
  a.young = recipe.material.young;
  a.poisson = recipe.material.poisson;
  a.alpha = recipe.alpha;
  a.beta = recipe.beta;
}

void take_mesh(BodyMesh&& body, Archetype& a) {
  a.mesher = body.mesher;
  a.min_dihedral = body.quality.min_dihedral;
  a.min_radius_ratio = body.quality.min_radius_ratio;
  a.volume = body.quality.volume;
  a.tets = std::move(body.tets);
  a.centre = move_to_centre_of_mass(a.tets);
}

void sample_surface(Archetype& a, Profile& profile) {
  const ScopedTimer timer(profile, "surface");
  a.surface = boundary_surface(a.tets, a.surface_to_node);
  vertex_normals_and_areas(a.surface, a.surface_normals, a.surface_areas);
  a.sdf = sample_distance(a.surface);
}

void warn_about_modes(const ModesResult& modes, Log& log) {
  if (modes.slow_blas) {
    log.warn("the reference BLAS (" + modes.blas +
             ") is 4 to 10 times slower; install libopenblas0-pthread");
  }
  if (modes.cluster_cut) {
    log.warn(join("modes.count cuts through a cluster of equal frequencies (relative gap ",
                  modes.cluster_gap, "): the basis depends on the mesh; take more or fewer modes"));
  }
}

void take_modes(ModesResult&& modes, Archetype& a) {
  a.omega2 = std::move(modes.omega2);
  a.residuals = std::move(modes.residuals);
  a.node_modes = std::move(modes.node_modes);
  a.M_r = std::move(modes.M_r);
  a.K_r = std::move(modes.K_r);
  a.integrals = std::move(modes.integrals);
  a.blas = modes.blas;
  // The rows of the modes at the surface: all that the runtime looks at.
  a.surface_modes.resize(3 * static_cast<Eigen::Index>(a.surface_to_node.size()),
                         a.node_modes.cols());
  for (std::size_t v = 0; v < a.surface_to_node.size(); ++v) {
    a.surface_modes.middleRows<3>(3 * static_cast<Eigen::Index>(v)) =
        a.node_modes.middleRows<3>(3 * a.surface_to_node[v]);
  }
}

void note_intake(const IntakeReport& intake, BuildRecord& record) {
  record.notes = intake.notes();
  record.surface_volume = intake.volume;
  record.surface_area = intake.area;
  record.surface_centroid = intake.centroid;
  record.surface_inertia = intake.inertia;
}

std::string modes_line(const Archetype& a) {
  if (a.r() == 0) return "modes: none (a rigid body)";
  const double to_hz = 0.5 / std::numbers::pi;
  return join("modes: ", a.r(), ", ", to_hz * std::sqrt(a.omega2[0]), " to ",
              to_hz * std::sqrt(a.omega2[a.r() - 1]), " Hz, largest residual ",
              a.residuals.maxCoeff());
}

std::string make_word(const std::string& path) {
  std::string word;
  for (const char c : path) {
    if (c == ' ' || c == '#') word += '\\';
    if (c == '$') word += '$';
    word += c;
  }
  return word;
}

}  // namespace

BodyMesh mesh_body(const Recipe& recipe, Log& log, Profile& profile) {
  return blaming(recipe, [&] {
    if (is_tet_file(recipe.mesh_path)) return mesh_from_tets(recipe, profile);
    if (is_surface_file(recipe.mesh_path)) return mesh_from_surface(recipe, log, profile);
    throw InputError(
        {Diagnostic{recipe.mesh_where, "unknown kind of mesh file \"" + recipe.mesh + "\"",
                    "use .obj, .off, .ply or .stl (surface), .msh, .vtu or .mesh (tets)"}});
  });
}

Archetype build_archetype(const Recipe& recipe, Log& log, Profile& profile, BuildRecord* record) {
  Archetype a;
  BuildRecord unused;
  BuildRecord& rec = record ? *record : unused;
  const auto note_memory = [&rec](const char* step) {
    rec.memory.emplace_back(step, peak_memory());
  };
  BodyMesh body = mesh_body(recipe, log, profile);
  note_intake(body.intake, rec);
  note_memory("mesh");
  describe_material(recipe, a);
  take_mesh(std::move(body), a);
  log.say(join("tets: ", a.tets.tets.size(), ", ", 3 * a.tets.nodes.size(),
               " degrees of freedom, volume ", a.volume, " m^3, smallest dihedral ", a.min_dihedral,
               " degrees, radius ratio ", a.min_radius_ratio));
  sample_surface(a, profile);
  note_memory("surface");
  ModesResult modes = blaming(
      recipe, [&] { return compute_modes(a.tets, recipe.material, recipe.modes, profile); });
  note_memory("modes");
  warn_about_modes(modes, log);
  take_modes(std::move(modes), a);
  log.say(modes_line(a));
  validate(a);
  return a;
}

std::string phase_table(const Profile& profile) {
  std::ostringstream text;
  double total = 0.0;
  text << std::fixed << std::setprecision(2) << "seconds:";
  for (const std::string& phase : profile.phases()) {
    text << ' ' << phase << ' ' << profile.seconds(phase);
    total += profile.seconds(phase);
  }
  text << " = " << total;
  return text.str();
}

void write_depfile(const std::string& path, const std::string& target, const Recipe& recipe) {
  const std::string body = make_word(recipe.path), mesh = make_word(recipe.mesh_path);
  // Rules without commands: a file that was deleted or renamed does not stop make.
  write_file_atomically(
      path, make_word(target) + ": " + body + " " + mesh + "\n" + body + ":\n" + mesh + ":\n");
}

}  // namespace archetide
