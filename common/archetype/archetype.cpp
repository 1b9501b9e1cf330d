#include "common/archetype/archetype.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/archetype/field_io.h"
#include "common/archetype/ladder_io.h"
#include "common/archetype/skin.h"
#include "common/archetype/swelling.h"
#include "common/base/check.h"
#include "common/base/input_error.h"
#include "common/base/matter.h"
#include "common/base/sha256.h"
#include "common/files/hdf5_file.h"

namespace archetide {
namespace {

using fields::FieldReader, fields::FieldWriter, fields::lines_of, fields::names_of,
    fields::to_array;

constexpr char kFormat[] = "archetide body archetype";
constexpr char kAdvice[] = "rebuild it with: archetide-precompute build BODY.body.toml -o OUT.h5";

// ---- the fields of the file: name, member, unit, shape. Writing, reading and hashing follow this
// order ----

template <class Io, class A>
void runtime_fields(Io& io, A& a) {
  io("name", a.name, "1", "text");
  io("generator", a.generator, "1", "text");
  io("recipe", a.recipe, "1", "text");
  io("mesh_file", a.mesh_file, "1", "text");
  io("mesh_hash", a.mesh_hash, "1", "text: SHA-256, hexadecimal");
  io("mesher", a.mesher, "1", "text: cgal | gmsh | input");
  io("mass_kind", a.mass_kind, "1", "text: consistent | lumped");
  io("blas", a.blas, "1", "text");
  io("clamped", a.clamped, "1", "text: a point set, or empty");
  io("density", a.density, "kg/m^3", "scalar");
  io("young", a.young, "Pa", "scalar");
  io("poisson", a.poisson, "1", "scalar");
  io("alpha", a.alpha, "1/s", "scalar");
  io("beta", a.beta, "s", "scalar");
  io("volume", a.volume, "m^3", "scalar");
  io("centre", a.centre, "m", "3");
  io("min_dihedral", a.min_dihedral, "degree", "scalar");
  io("min_radius_ratio", a.min_radius_ratio, "1", "scalar");
  io("surface_vertices", a.surface.vertices, "m", "ns x 3");
  io("surface_triangles", a.surface.triangles, "1", "nf x 3");
  io("surface_to_node", a.surface_to_node, "1", "ns");
  io("surface_normals", a.surface_normals, "1", "ns x 3");
  io("surface_areas", a.surface_areas, "m^2", "ns");
  io("sdf_origin", a.sdf.origin, "m", "3");
  io("sdf_spacing", a.sdf.spacing, "m", "scalar");
  io("sdf_nodes", a.sdf.nodes, "1", "3");
  io("sdf_values", a.sdf.values, "m", "nx ny nz, x fastest");
  io.point_sets(a.point_sets);
  io.joint_frames(a.joint_frames);
  io("omega2", a.omega2, "1/s^2", "r");
  io("residuals", a.residuals, "1", "r");
  io("is_static", a.is_static, "1", "r");
  io("frequency_error", a.frequency_error, "1", "vibration modes, or 0");
  io.modes("surface_modes", a.surface_modes, "m", "r x ns x 3");
  io.square("M_r", a.M_r, "kg", "r x r");
  io.square("K_r", a.K_r, "N/m", "r x r");
  io("mass", a.integrals.mass, "kg", "scalar");
  io("Sxx", a.integrals.Sxx, "kg m^2", "3 x 3");
  io("I3", a.integrals.I3, "kg", "r x 3");
  io("A", a.integrals.A, "kg m", "r x 3 x 3");
  io("B", a.integrals.B, "kg", "r r x 3 x 3");
}

/// Of nonlinear bodies only.
template <class Io, class Matrix, class Vector>
void elastic_fields(Io& io, Matrix& gradients, Vector& weights, Vector& lambda, Vector& mu) {
  io("weights", weights, "m^3", "points");
  io("lambda", lambda, "Pa", "points");
  io("mu", mu, "Pa", "points");
  io.modes("gradients", gradients, "1", "r x 3 points x 3: d phi_a / d x_c, row c points + point");
}

template <class Io, class A>
void full_fields(Io& io, A& a) {
  io("nodes", a.tets.nodes, "m", "n x 3");
  io("tets", a.tets.tets, "1", "nt x 4");
  io("mids", a.tets.mids, "1", "nt x 6, or 0 x 6");
  io.modes("node_modes", a.node_modes, "m", "r x n x 3");
}

template <class Io, class M>
void matrix_fields(Io& io, M& m) {
  io("order", m.order, "1", "n: nodes in their order of elimination");
  io("row_ends", m.row_ends, "1", "n");
  io("column", m.column, "1", "blocks: the lower triangle, rows one after the other");
  io("mass", m.mass, "kg", "blocks");
  io("stiffness", m.stiffness, "N/m", "blocks x 3 x 3");
}

template <class Io, class M>
void tet_material_fields(Io& io, M& m) {
  io("lambda", m.lambda, "Pa", "nt");
  io("mu", m.mu, "Pa", "nt");
}

constexpr auto kRungFields = [](auto& io, auto& rung) {
  io("surface_vertices", rung.surface.vertices, "m", "n x 3");
  io("surface_triangles", rung.surface.triangles, "1", "nf x 3");
  io.modes("surface_modes", rung.modes, "m", "r x n x 3");
  io("deviation", rung.deviation, "m", "scalar");
};

struct ArchetypeWriter : FieldWriter {
  void point_sets(const std::vector<PointSet>& sets) {
    std::vector<int> ends, vertices;
    for (const PointSet& set : sets) {
      vertices.insert(vertices.end(), set.vertices.begin(), set.vertices.end());
      ends.push_back(static_cast<int>(vertices.size()));
    }
    put("point_set_names", to_array(names_of(sets)), "1", "text: a line each");
    put("point_set_ends", to_array(ends), "1", "sets");
    put("point_set_vertices", to_array(vertices), "1", "all sets, one after the other");
  }
  void joint_frames(const std::vector<JointFrame>& frames) {
    std::vector<Vec3> points;
    std::vector<Mat3> axes;
    for (const JointFrame& f : frames) points.push_back(f.point), axes.push_back(f.axes);
    put("joint_frame_names", to_array(names_of(frames)), "1", "text: a line each");
    put("joint_frame_points", to_array(points), "m", "frames x 3");
    put("joint_frame_axes", to_array(axes), "1", "frames x 3 x 3, axes are columns");
  }
};

struct ArchetypeReader : FieldReader {
  void point_sets(std::vector<PointSet>& sets) {
    std::string names;
    std::vector<int> ends, vertices;
    (*this)("point_set_names", names, "", "text");
    (*this)("point_set_ends", ends, "", "sets");
    (*this)("point_set_vertices", vertices, "", "all sets");
    const std::vector<std::string> lines = lines_of(names);
    bool fits = lines.size() == ends.size();
    for (std::size_t i = 0, begin = 0; fits && i < ends.size(); ++i) {
      const auto end = static_cast<std::size_t>(ends[i]);
      fits = begin <= end && end <= vertices.size();
      if (!fits) break;
      sets.push_back({lines[i],
                      {vertices.begin() + static_cast<std::ptrdiff_t>(begin),
                       vertices.begin() + static_cast<std::ptrdiff_t>(end)}});
      begin = end;
    }
    demand(fits, "point_set_ends", "sets");
  }
  void joint_frames(std::vector<JointFrame>& frames) {
    std::string names;
    std::vector<Vec3> points;
    std::vector<Mat3> axes;
    (*this)("joint_frame_names", names, "", "text");
    (*this)("joint_frame_points", points, "", "frames x 3");
    (*this)("joint_frame_axes", axes, "", "frames x 3 x 3");
    const std::vector<std::string> lines = lines_of(names);
    demand(lines.size() == points.size() && points.size() == axes.size(), "joint_frame_points",
           "frames x 3");
    for (std::size_t i = 0; i < lines.size(); ++i) frames.push_back({lines[i], points[i], axes[i]});
  }
};

void demand_our_format(const Hdf5Reader& file) {
  if (!file.has_attribute("format") || file.text_attribute("format") != kFormat) {
    const bool skin = file.has_attribute("format") && file.text_attribute("format") == kSkinFormat;
    if (skin)  // nothing has to be built again
      throw FileError(file.path() + ": a skin, not a body: it belongs in a [[skin]] of a scene");
    file.fail("an HDF5 file, but not a body archetype");
  }
  const int version = file.int_attribute("format_version");
  if (version != Archetype::kFormatVersion && version != Archetype::kNonlinearFormatVersion) {
    file.fail(fmt::format("format version {}, this program reads versions {} and {}", version,
                          Archetype::kFormatVersion, Archetype::kNonlinearFormatVersion));
  }
}

void demand_hash(const Hdf5Reader& file, const char* attribute, const std::string& computed) {
  if (file.text_attribute(attribute) != computed) {
    file.fail(std::string("the contents do not match their ") + attribute +
              " (damaged or changed by hand)");
  }
}

ElasticCubature read_elastic(const Hdf5Reader& file) {
  if (file.int_attribute("elastic_version") != ElasticCubature::kVersion)
    file.fail(fmt::format("an elastic energy of version {}, this program reads version {}",
                          file.int_attribute("elastic_version"), ElasticCubature::kVersion));
  MatX gradients;
  VecX weights, lambda, mu;
  ArchetypeReader elastic{{file, "elastic"}};
  elastic_fields(elastic, gradients, weights, lambda, mu);
  demand_hash(file, "elastic_hash", elastic.hash.hex());
  const Eigen::Index points = weights.size();
  if (points == 0 || gradients.rows() != 9 * points || lambda.size() != points ||
      mu.size() != points)
    file.fail("elastic: not one gradient, weight and material for each point");
  return ElasticCubature(std::move(gradients), std::move(weights), std::move(lambda),
                         std::move(mu));
}

// ---- validation -------------------------------------------------------------------------------

void demand_field(bool holds, const std::string& field, const std::string& rule) {
  if (!holds) throw AssertionError("archetype field " + field + ": " + rule);
}

template <class T>
void demand_size(const T& list, Eigen::Index size, const char* field) {
  const auto found = static_cast<Eigen::Index>(list.size());
  demand_field(found == size, field, fmt::format("size {}, expected {}", found, size));
}

void demand_finite(double x, const char* field) {
  demand_field(std::isfinite(x), field, "not finite");
}
template <class D>
void demand_finite(const Eigen::MatrixBase<D>& m, const char* field) {
  demand_field(m.allFinite(), field, "not finite");
}
template <class T>
void demand_finite(const std::vector<T>& list, const char* field) {
  for (const T& x : list) demand_finite(x, field);
}

template <class Corners>
void demand_indices(const std::vector<Corners>& cells, std::size_t count, const char* field) {
  for (const Corners& cell : cells) {
    for (const int i : cell) {
      demand_field(i >= 0 && static_cast<std::size_t>(i) < count, field, "index out of range");
    }
  }
}

void demand_shape(const MatX& m, Eigen::Index rows, Eigen::Index cols, const char* field) {
  demand_field(m.rows() == rows && m.cols() == cols, field,
               fmt::format("shape {} x {}, expected {} x {}", m.rows(), m.cols(), rows, cols));
  demand_finite(m, field);
}

void validate_material(const Archetype& a) {
  demand_field(a.density >= kLeastDensity && a.density <= kLargestDensity, "density",
               "not that of matter (1e-9 to 1e12 kg/m^3)");
  demand_field(a.young > 0 && std::isfinite(a.young), "young", "not positive");
  demand_field(a.poisson > -1 && a.poisson < 0.5, "poisson", "not in (-1, 0.5)");
  demand_field(a.alpha >= 0 && std::isfinite(a.alpha), "alpha", "negative");
  demand_field(a.beta >= 0 && std::isfinite(a.beta), "beta", "negative");
  demand_field(a.volume > 0 && std::isfinite(a.volume), "volume", "not positive");
  demand_finite(a.centre, "centre");
}

/// Distances on a grid, or none at all.
void validate_sdf(const GridSdf& sdf) {
  demand_field(sdf.nodes.minCoeff() >= 0, "sdf_nodes", "negative");
  const double count = sdf.nodes.cast<double>().prod();  // may be more than any integer holds
  demand_field(count == static_cast<double>(sdf.values.size()), "sdf_values",
               "not one for each of the sdf_nodes");
  for (const float v : sdf.values) demand_finite(v, "sdf_values");
  if (sdf.values.empty()) return;
  demand_field(sdf.nodes.minCoeff() >= 2, "sdf_nodes", "less than two along an axis");
  demand_field(sdf.spacing > 0 && std::isfinite(sdf.spacing), "sdf_spacing", "not positive");
  demand_finite(sdf.origin, "sdf_origin");
}

void validate_surface(const Archetype& a) {
  const auto ns = static_cast<Eigen::Index>(a.surface.vertices.size());
  demand_field(ns > 0, "surface_vertices", "empty");
  demand_field(!a.surface.triangles.empty(), "surface_triangles", "empty");
  demand_finite(a.surface.vertices, "surface_vertices");
  demand_indices(a.surface.triangles, a.surface.vertices.size(), "surface_triangles");
  demand_size(a.surface_to_node, ns, "surface_to_node");
  demand_size(a.surface_normals, ns, "surface_normals");
  demand_finite(a.surface_normals, "surface_normals");
  demand_size(a.surface_areas, ns, "surface_areas");
  demand_finite(a.surface_areas, "surface_areas");
  for (const PointSet& set : a.point_sets) {
    demand_field(!set.name.empty() && set.name.find('\n') == std::string::npos, "point_set_names",
                 "empty or with a line end");
    for (const int v : set.vertices)
      demand_field(v >= 0 && v < ns, "point_set_vertices", "index out of range");
  }
  for (const JointFrame& frame : a.joint_frames) {
    demand_finite(frame.point, "joint_frame_points");
    demand_finite(frame.axes, "joint_frame_axes");
  }
  validate_sdf(a.sdf);
}

/// Mass and second moment are those of a body with this density, volume and surface.
void validate_mass(const Archetype& a) {
  const double mass = a.integrals.mass, expected = a.density * a.volume;
  demand_field(mass > 0 && std::isfinite(mass), "mass", "not positive");
  demand_field(mass < 2 * expected && expected < 2 * mass, "mass", "not density times volume");
  demand_finite(a.integrals.Sxx, "Sxx");
  double reach = 0.0;
  for (const Vec3& x : a.surface.vertices) reach = std::max(reach, x.norm());
  const Vec3 moments = a.integrals.Sxx.diagonal();
  demand_field(moments.minCoeff() > 0 && moments.sum() < 2 * mass * reach * reach, "Sxx",
               "not that of a body of this size");
}

void validate_modes(const Archetype& a) {
  const Eigen::Index r = a.r();
  demand_finite(a.omega2, "omega2");
  demand_field(r == 0 || a.omega2.minCoeff() > 0, "omega2", "not positive");
  demand_size(a.residuals, r, "residuals");
  demand_size(a.is_static, r, "is_static");
  demand_field(std::is_sorted(a.is_static.begin(), a.is_static.end()), "is_static",
               "a vibration mode behind a static vector");
  demand_finite(a.frequency_error, "frequency_error");
  if (a.frequency_error.size() > 0)
    demand_size(a.frequency_error, std::count(a.is_static.begin(), a.is_static.end(), 0),
                "frequency_error");
  demand_shape(a.surface_modes, 3 * static_cast<Eigen::Index>(a.surface.vertices.size()), r,
               "surface_modes");
  demand_shape(a.M_r, r, r, "M_r");
  demand_shape(a.K_r, r, r, "K_r");
  demand_field(r == 0 || a.M_r.diagonal().minCoeff() > 0, "M_r", "not positive on its diagonal");
  demand_field(r == 0 || a.K_r.diagonal().minCoeff() > 0, "K_r", "not positive on its diagonal");
  demand_size(a.integrals.I3, r, "I3");
  demand_finite(a.integrals.I3, "I3");
  demand_size(a.integrals.A, r, "A");
  demand_finite(a.integrals.A, "A");
  demand_size(a.integrals.B, r * r, "B");
  demand_finite(a.integrals.B, "B");
}

void demand_lame(const VecX& lambda, const VecX& mu, const std::string& prefix) {
  demand_finite(lambda, (prefix + "lambda").c_str());
  demand_finite(mu, (prefix + "mu").c_str());
  demand_field(mu.minCoeff() > 0, prefix + "mu", "not positive");
  demand_field((lambda + 2.0 / 3.0 * mu).minCoeff() > 0, prefix + "lambda",
               "no bulk modulus above 0");
}

/// The energy of these modes, with their stiffness at rest.
void validate_elastic(const Archetype& a) {
  if (!a.nonlinear()) return;
  const ElasticCubature& e = a.elastic;
  demand_shape(e.gradients, 9 * e.points(), a.r(), "elastic gradients");
  demand_size(e.lambda, e.points(), "elastic lambda");
  demand_size(e.mu, e.points(), "elastic mu");
  demand_finite(e.weights, "elastic weights");
  demand_field(e.weights.minCoeff() > 0, "elastic weights", "not positive");
  demand_lame(e.lambda, e.mu, "elastic ");
  const VecX ratio = e.stiffness(VecX::Zero(a.r())).diagonal().cwiseQuotient(a.K_r.diagonal());
  demand_field(ratio.minCoeff() > 0.5 && ratio.maxCoeff() < 2.0, "elastic gradients",
               "another stiffness at rest than K_r");
}

void validate_tets(const Archetype& a) {
  if (a.tets.nodes.empty()) return;
  demand_finite(a.tets.nodes, "nodes");
  demand_indices(a.tets.tets, a.tets.nodes.size(), "tets");
  demand_indices(a.tets.mids, a.tets.nodes.size(), "mids");
  demand_field(a.tets.mids.empty() || a.tets.mids.size() == a.tets.tets.size(), "mids",
               "neither one for each tet nor none");
  demand_shape(a.node_modes, 3 * static_cast<Eigen::Index>(a.tets.nodes.size()), a.r(),
               "node_modes");
  for (const int node : a.surface_to_node) {
    demand_field(node >= 0 && static_cast<std::size_t>(node) < a.tets.nodes.size(),
                 "surface_to_node", "index out of range");
  }
}

/// Each node once.
bool is_permutation_of_nodes(const std::vector<int>& order, std::size_t n) {
  std::vector<char> seen(n, 0);
  for (const int node : order) {
    if (node < 0 || static_cast<std::size_t>(node) >= n || seen[node]) return false;
    seen[node] = 1;
  }
  return order.size() == n;
}

/// Rows of the lower triangle, ascending, each with its diagonal.
void validate_pattern(const TetMatrices& m, int n) {
  for (int p = 0; p < n; ++p) {
    const int begin = m.row_begin(p), end = m.row_end(p);
    demand_field(begin < end && static_cast<std::size_t>(end) <= m.column.size(), "row_ends",
                 "a row without entries, or beyond them");
    for (int e = begin; e < end; ++e)
      demand_field(m.column[e] >= (e == begin ? 0 : m.column[e - 1] + 1) && m.column[e] <= p,
                   "column", "not ascending up to the diagonal");
    demand_field(m.column[end - 1] == p, "column", "a row without its diagonal");
    demand_field(m.mass[end - 1] > 0.0, "mass", "not positive on its diagonal");
  }
}

/// Coarser surfaces hold what the body's own does, or it would float higher or lower.
void validate_ladder(const Archetype& a) {
  constexpr double kSame = 1e-9;  // relative
  const double volume = enclosed_volume(a.surface);
  for (const SurfaceRung& rung : a.ladder) {
    demand_field(!rung.surface.triangles.empty(), "ladder surface_triangles", "empty");
    demand_finite(rung.surface.vertices, "ladder surface_vertices");
    demand_indices(rung.surface.triangles, rung.surface.vertices.size(),
                   "ladder surface_triangles");
    demand_shape(rung.modes, 3 * static_cast<Eigen::Index>(rung.surface.vertices.size()), a.r(),
                 "ladder surface_modes");
    demand_field(rung.deviation >= 0.0 && std::isfinite(rung.deviation), "ladder deviation",
                 "negative");
    demand_field(std::abs(enclosed_volume(rung.surface) - volume) <= kSame * std::abs(volume),
                 "ladder surface_vertices", "another volume than the body's surface");
  }
}

void validate_matrices(const Archetype& a) {
  const TetMatrices& m = a.matrices;
  if (m.empty()) return;
  const std::size_t n = a.tets.nodes.size();
  demand_field(is_permutation_of_nodes(m.order, n), "order", "not every node once");
  demand_size(m.row_ends, static_cast<Eigen::Index>(n), "row_ends");
  const auto blocks = static_cast<Eigen::Index>(m.column.size());
  demand_field(blocks == m.row_ends.back(), "row_ends", "not all of the blocks");
  demand_size(m.mass, blocks, "mass");
  demand_finite(m.mass, "mass");
  demand_size(m.stiffness, blocks, "stiffness");
  demand_finite(m.stiffness, "stiffness");
  validate_pattern(m, static_cast<int>(n));
  if (m.lambda.size() == 0 && m.mu.size() == 0) return;
  const auto tets = static_cast<Eigen::Index>(a.tets.tets.size());
  demand_size(m.lambda, tets, "lambda");
  demand_size(m.mu, tets, "mu");
  demand_lame(m.lambda, m.mu, "");
}

void write_matrices(Hdf5Writer& file, const TetMatrices& matrices) {
  if (matrices.empty()) return;
  ArchetypeWriter io{{file, "matrices"}};
  matrix_fields(io, matrices);
  const bool material = matrices.lambda.size() > 0;
  if (material) tet_material_fields(io, matrices);
  file.attribute("matrices_version",
                 material ? Archetype::kNonlinearMatricesVersion : Archetype::kMatricesVersion);
  file.attribute("matrices_hash", io.hash.hex());
}

void read_matrices(const Hdf5Reader& file, TetMatrices& matrices) {
  if (!file.has_attribute("matrices_version")) return;
  const int version = file.int_attribute("matrices_version");
  const bool material = version == Archetype::kNonlinearMatricesVersion;
  if (version != Archetype::kMatricesVersion && !material)
    file.fail(fmt::format("matrices of version {}, this program reads versions {} and {}", version,
                          Archetype::kMatricesVersion, Archetype::kNonlinearMatricesVersion));
  ArchetypeReader io{{file, "matrices"}};
  matrix_fields(io, matrices);
  if (material) tet_material_fields(io, matrices);
  demand_hash(file, "matrices_hash", io.hash.hex());
}

}  // namespace

void validate(const Archetype& a) {
  validate_material(a);
  validate_surface(a);
  validate_mass(a);
  validate_modes(a);
  validate_elastic(a);
  validate_ladder(a);
  validate_tets(a);
  validate_matrices(a);
}

std::string write_archetype(const std::string& path, const Archetype& a) {
  validate(a);
  Hdf5Writer file(path);
  file.attribute("format", kFormat);
  file.attribute("format_version",
                 a.nonlinear() ? Archetype::kNonlinearFormatVersion : Archetype::kFormatVersion);
  ArchetypeWriter runtime{{file, "runtime"}};
  runtime_fields(runtime, a);
  ArchetypeWriter full{{file, "full"}};
  full_fields(full, a);

  // The content hash joins the hashes of the parts, so that a reader of one part can check it.
  const std::string runtime_hash = runtime.hash.hex(), full_hash = full.hash.hex();
  file.attribute("runtime_hash", runtime_hash);
  file.attribute("full_hash", full_hash);
  std::string hashes = runtime_hash + full_hash;
  if (a.nonlinear()) {
    ArchetypeWriter elastic{{file, "elastic"}};
    elastic_fields(elastic, a.elastic.gradients, a.elastic.weights, a.elastic.lambda, a.elastic.mu);
    const std::string elastic_hash = elastic.hash.hex();
    file.attribute("elastic_version", ElasticCubature::kVersion);
    file.attribute("elastic_hash", elastic_hash);
    hashes += elastic_hash;
  }
  hashes += fields::write_ladder(file, a.ladder, kRungFields);
  const std::string content_hash = sha256_hex(hashes);
  file.attribute("content_hash", content_hash);
  write_matrices(file, a.matrices);
  file.commit();
  return content_hash;
}

void derive_shapes(Archetype& a) {
  a.linear = linear_shape(a.surface, a.surface_modes);
  for (SurfaceRung& rung : a.ladder) rung.linear = linear_shape(rung.surface, rung.modes);
  if (!a.nonlinear() || a.ladder.empty()) return;
  const Swelling own = second_order_swelling(a.surface, a.surface_modes);
  for (SurfaceRung& rung : a.ladder) {
    rung.swelling = second_order_swelling(rung.surface, rung.modes);
    rung.swelling.volume -= own.volume;
    for (int k = 0; k < 3; ++k) rung.swelling.centroid[k] -= own.centroid[k];
  }
}

Archetype read_archetype(const std::string& path, Part part) {
  const Hdf5Reader file(path, kAdvice);
  demand_our_format(file);
  Archetype a;
  ArchetypeReader runtime{{file, "runtime"}};
  runtime_fields(runtime, a);
  demand_hash(file, "runtime_hash", runtime.hash.hex());
  if (part == Part::kAll) {
    ArchetypeReader full{{file, "full"}};
    full_fields(full, a);
    demand_hash(file, "full_hash", full.hash.hex());
    read_matrices(file, a.matrices);
  }
  std::string hashes = file.text_attribute("runtime_hash") + file.text_attribute("full_hash");
  if (file.int_attribute("format_version") == Archetype::kNonlinearFormatVersion) {
    a.elastic = read_elastic(file);
    hashes += file.text_attribute("elastic_hash");
  }
  hashes += fields::read_ladder(file, a.ladder, kRungFields);
  a.content_hash = sha256_hex(hashes);
  demand_hash(file, "content_hash", a.content_hash);
  try {
    validate(a);
    if (part == Part::kAll)
      demand_field(!a.tets.nodes.empty() && !a.tets.tets.empty(), "tets", "empty");
  } catch (const AssertionError& wrong) {
    file.fail(wrong.what());
  }
  derive_shapes(a);
  return a;
}

}  // namespace archetide
