#include "precompute/build.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <numbers>
#include <numeric>
#include <sstream>

#include "common/base/input_error.h"
#include "common/base/sha256.h"
#include "common/files/make_word.h"
#include "common/files/surface_io.h"
#include "common/mesh/mesh_sdf.h"
#include "common/params/cli.h"
#include "precompute/base/child_process.h"
#include "precompute/base/defects.h"
#include "precompute/base/joined.h"
#include "precompute/base/tet_element.h"
#include "precompute/frequency_error.h"
#include "precompute/intake/cut.h"
#include "precompute/intake/tet_io.h"
#include "precompute/meshing/restore_volume.h"
#include "precompute/modal/cubature_error.h"
#include "precompute/modal/energy_cubature.h"
#include "precompute/modal/keep_matrices.h"
#include "precompute/modal/memory.h"
#include "precompute/surface_ladder.h"

namespace archetide {
namespace {

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
  if (!recipe.cuts.empty())
    throw InputError({Diagnostic{recipe.cuts.front().where, "tets cannot be cut",
                                 "cut a surface (.obj, .off, .ply, .stl)"}});
  BodyMesh body;
  body.mesher = "input";
  {
    const ScopedTimer timer(profile, "read");
    body.tets = read_tets(recipe.mesh_path, recipe.scale, &body.groups);
    if (recipe.tet.order == 2) body.tets = with_middle_nodes(body.tets);
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

/// What the recipe's cuts leave, accepted like any other surface.
TriMesh cut_surface(const Recipe& recipe, const TriMesh& whole, double& cpu_seconds,
                    IntakeReport& report, Profile& profile) {
  const ScopedTimer timer(profile, "cut");
  const double volume = report.volume;
  const auto cut = [&](IntakeReport& found) {
    SurfaceFile part;
    part.path = recipe.mesh_path;
    part.mesh = cut_solid(whole, recipe.cuts);
    part.face_numbers.resize(part.mesh.triangles.size());
    std::iota(part.face_numbers.begin(), part.face_numbers.end(), 1);
    return accept_surface(part, 1.0, found);
  };
  try {
    TriMesh surface = in_time("cutting " + counted(whole.triangles.size(), "face", "faces"),
                              cpu_seconds, report, cut);
    log_info(joined<4>("cut: ", 100.0 * report.volume / volume, " % of ", volume, " m^3"));
    return surface;
  } catch (const OutOfTime& error) {
    throw InputError({Diagnostic{recipe.cuts.front().where, error.what(), kOutOfTimeHint}});
  } catch (const SurfaceDefects& error) {
    std::vector<Diagnostic> list = error.diagnostics;
    for (Diagnostic& d : list) d.what = "after the cuts: " + d.what;
    list.front().where = recipe.cuts.front().where;
    throw SurfaceDefects(list, error.offenders);
  }
}

BodyMesh mesh_from_surface(const Recipe& recipe, Profile& profile) {
  BodyMesh body;
  demand_memory(
      least_memory(recipe.tet.target, recipe.tet.order, recipe.modes.count),
      joined<4>(recipe.name, ": ", recipe.tet.target, " tets with ", recipe.modes.count, " modes"),
      "lower tet.target or modes.count");
  body.mesher = recipe.tet.mesher == Mesher::kCgal ? "cgal" : "gmsh";
  SurfaceFile file;
  {
    const ScopedTimer timer(profile, "read");
    file = read_surface(recipe.mesh_path);
  }
  TriMesh surface;
  TetrahedralizeOptions meshing = recipe.tet;  // with the time that the steps before leave
  {
    const ScopedTimer timer(profile, "intake");
    surface = accept_surface(file, recipe.scale, recipe.repair, meshing.cpu_seconds, body.intake);
  }
  for (const std::string& note : body.intake.notes()) log_info(recipe.mesh_path + ": " + note);
  if (!recipe.cuts.empty())
    surface = cut_surface(recipe, surface, meshing.cpu_seconds, body.intake, profile);
  log_info(joined<4>("surface: ", body.intake.vertices, " vertices, ", body.intake.faces,
                     " faces, volume ", body.intake.volume, " m^3"));
  const ScopedTimer timer(profile, "mesh");
  TetrahedralizeResult result = tetrahedralize(surface, meshing);
  body.tets = std::move(result.mesh);
  body.quality = result.quality;
  body.surface = std::move(surface);
  return body;
}

void describe_material(const Recipe& recipe, Archetype& a) {
  a.name = recipe.name;
  a.generator = "archetide-precompute " ARCHETIDE_VERSION;
  a.recipe = recipe.text;
  a.mesh_file = recipe.mesh;
  a.mesh_hash = sha256_of_file(recipe.mesh_path);
  a.density = recipe.material.density;
  a.young = recipe.material.young;
  a.poisson = recipe.material.poisson;
  a.alpha = recipe.alpha;
  a.beta = recipe.beta;
}

/// Fills in mesh and mean density; returns the material of every tet.
MaterialField take_mesh(BodyMesh& body, const Recipe& recipe, Archetype& a) {
  a.mesher = body.mesher;
  a.min_dihedral = body.quality.min_dihedral;
  a.min_radius_ratio = body.quality.min_radius_ratio;
  a.volume = body.quality.volume;
  a.tets = std::move(body.tets);
  MaterialField materials =
      find_materials(recipe.material, recipe.material_regions, a.tets, Vec3::Zero(), body.groups);
  a.centre = move_to_centre_of_mass(a.tets, materials);
  return materials;
}

/// Named points and frames in the rest frame; the nodes that they mean go to the options.
ModesOptions take_points(const Recipe& recipe, Archetype& a) {
  ModesOptions options = recipe.modes;
  const auto nodes = [&](const std::string& name) {
    std::vector<int> result;
    for (const PointSet& set : a.point_sets)
      if (set.name == name)
        for (const int v : set.vertices) result.push_back(a.surface_to_node[v]);
    return result;
  };
  for (const NamedRegion& named : recipe.points)
    a.point_sets.push_back(find_points(named, a.surface, a.centre));
  for (JointFrame frame : recipe.joint_frames) {
    frame.point -= a.centre;
    a.joint_frames.push_back(frame);
  }
  a.clamped = recipe.clamped;
  if (!a.clamped.empty()) options.clamped = nodes(a.clamped);
  for (const std::string& load : recipe.point_loads) options.loads.nodes.push_back(nodes(load));
  return options;
}

/// Flat triangles lie a little inside curved tets. Gives the surface the volume and the centroid of
/// the tets, so that a body as dense as water hovers exactly.
void match_tets(const TetMesh& tets, TriMesh& surface) {
  TetMoments whole;
  for (int t = 0; t < int(tets.tets.size()); ++t) {
    const TetMoments part = tet_moments(tets, t);
    whole.volume += part.volume;
    whole.first += part.first;
  }
  if (!restore_volume(surface, whole.volume))
    throw NumericsError(joined<4>("the surface encloses ", enclosed_volume(surface),
                                  " m^3, the curved tets have ", whole.volume,
                                  " m^3\n  raise tet.target, or set tet.order = 1"));
  for (int pass = 0; pass < 2; ++pass) {
    const Vec3 move = whole.first / whole.volume - enclosed_centroid(surface);
    for (Vec3& x : surface.vertices) x += move;
  }
}

void sample_surface(Archetype& a, Profile& profile) {
  const ScopedTimer timer(profile, "surface");
  a.surface = boundary_surface(a.tets, a.surface_to_node);
  if (a.tets.order() == 2) match_tets(a.tets, a.surface);
  vertex_normals_and_areas(a.surface, a.surface_normals, a.surface_areas);
  a.sdf = sample_distance(a.surface);
}

void warn_about_modes(const ModesResult& modes, int wanted) {
  if (modes.slow_blas) {
    log_warning("the reference BLAS (" + modes.blas +
                ") is 4 to 10 times slower; install libopenblas0-pthread");
  }
  if (modes.cluster_cut) {
    log_warning(
        joined<4>("no gap of the frequencies near modes.count: the last mode has a neighbour ",
                  100 * modes.cluster_gap, " % above it, so the basis depends on the mesh"));
  } else if (modes.vibration_modes() != wanted) {
    log_warning(joined<4>("modes.count = ", wanted,
                          " cuts through a cluster of equal frequencies; kept ",
                          modes.vibration_modes(), " modes, whole clusters"));
  }
}

void take_modes(ModesResult&& modes, Archetype& a) {
  a.mass_kind = modes.mass == MassKind::kLumped ? "lumped" : "consistent";
  a.is_static.assign(std::size_t(modes.omega2.size()), 0);
  std::fill(a.is_static.end() - modes.static_count, a.is_static.end(), 1);
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

/// What the runtime needs for large deformation of nonlinear bodies: an energy.
void describe_deformation(const MaterialField& materials, bool nonlinear, Archetype& a,
                          Profile& profile) {
  if (!nonlinear || a.r() == 0) return;
  const ScopedTimer timer(profile, "cubature");
  TrainedCubature trained = train_cubature(a.tets, materials, a.node_modes, a.K_r, {});
  const DeflectionError error =
      cubature_error(a.tets, materials, a.node_modes, a.K_r, trained.energy);
  log_info(joined<3>("elastic energy: ", trained.energy.points(),
                     " cubature points; deflections by 10 to 30 % of the size are ",
                     100 * error.mean, " % off in the mean, ", 100 * error.worst, " % at most"));
  a.elastic = std::move(trained.energy);
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
  const Eigen::Index vibration = std::count(a.is_static.begin(), a.is_static.end(), 0);
  const std::string error = a.frequency_error.size() == 0
                                ? ""
                                : joined<4>(", estimated error up to ",
                                            100 * a.frequency_error.cwiseAbs().maxCoeff(), " %");
  return joined<4>("modes: ", vibration, ", ", to_hz * std::sqrt(a.omega2[0]), " to ",
                   to_hz * std::sqrt(a.omega2[vibration - 1]), " Hz, largest residual ",
                   a.residuals.head(vibration).maxCoeff(), error,
                   "; static vectors: ", a.r() - vibration);
}

}  // namespace

BodyMesh mesh_body(const Recipe& recipe, Profile& profile) {
  return blaming(recipe, [&] {
    if (is_tet_file(recipe.mesh_path)) return mesh_from_tets(recipe, profile);
    if (is_surface_file(recipe.mesh_path)) return mesh_from_surface(recipe, profile);
    throw InputError(
        {Diagnostic{recipe.mesh_where, "unknown kind of mesh file \"" + recipe.mesh + "\"",
                    "use .obj, .off, .ply or .stl (surface), .msh, .vtu or .mesh (tets)"}});
  });
}

Archetype build_archetype(const Recipe& recipe, Profile& profile, BuildRecord* record) {
  Archetype a;
  BuildRecord unused;
  BuildRecord& rec = record ? *record : unused;
  const auto note_memory = [&rec](const char* step) {
    rec.memory.emplace_back(step, peak_memory());
  };
  BodyMesh body = mesh_body(recipe, profile);
  note_intake(body.intake, rec);
  note_memory("mesh");
  describe_material(recipe, a);
  const MaterialField materials = blaming(recipe, [&] { return take_mesh(body, recipe, a); });
  log_info(joined<4>("tets: ", a.tets.tets.size(),
                     a.tets.order() == 2 ? " quadratic, " : " linear, ", 3 * a.tets.nodes.size(),
                     " degrees of freedom, volume ", a.volume, " m^3, smallest dihedral ",
                     a.min_dihedral, " degrees, radius ratio ", a.min_radius_ratio));
  sample_surface(a, profile);
  note_memory("surface");
  const ModesOptions options = take_points(recipe, a);
  ModesResult modes =
      blaming(recipe, [&] { return compute_modes(a.tets, materials, options, profile); });
  note_memory("modes");
  const int vibration = modes.vibration_modes();
  warn_about_modes(modes, options.every_motion ? vibration : options.count);
  const MassKind mass = modes.mass;
  rec.patch_error_of_modes = modes.patch_error_of_modes;
  const DeflectionError patch_error = modes.patch_error;
  take_modes(std::move(modes), a);
  describe_deformation(materials, options.nonlinear, a, profile);
  {
    const ScopedTimer timer(profile, "ladder");
    a.ladder = surface_ladder(a);
    derive_shapes(a);
  }
  if (recipe.keep_tets) a.matrices = keep_matrices(a.tets, materials, mass, a.nonlinear());
  a.density = a.integrals.mass / a.volume;
  if (recipe.material_regions.empty()) a.density = recipe.material.density;
  const bool few = vibration > 0 && !options.every_motion;
  if (few && recipe.clamped.empty() && !body.surface.triangles.empty())
    a.frequency_error = estimate_frequency_errors(recipe, body.surface, a.omega2.head(vibration),
                                                  int(a.tets.tets.size()), profile);
  log_info(modes_line(a));
  if (patch_error.worst > 0.0)
    log_info(joined<3>("loads on patches: small deflections ", 100 * patch_error.mean,
                       " % off in the mean, ", 100 * patch_error.worst,
                       " % at most; more modes tell more"));
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

std::string depfile_text(const std::string& target, const Recipe& recipe) {
  std::vector<std::string> read = {recipe.path, recipe.mesh_path};
  if (recipe.skin)
    read.insert(read.end(), recipe.skin->part_paths.begin(), recipe.skin->part_paths.end());
  return make_fragment(target, read);
}

}  // namespace archetide
