#include "common/archetype.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/check.h"
#include "common/hdf5_file.h"
#include "common/input_error.h"
#include "common/sha256.h"

namespace archetide {
namespace {

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

template <class Io, class A>
void full_fields(Io& io, A& a) {
  io("nodes", a.tets.nodes, "m", "n x 3");
  io("tets", a.tets.tets, "1", "nt x 4");
  io("mids", a.tets.mids, "1", "nt x 6, or 0 x 6");
  io.modes("node_modes", a.node_modes, "m", "r x n x 3");
}

// ---- members to arrays and back ---------------------------------------------------------------

using Type = DataArray::Type;
using Shape = std::vector<std::size_t>;

template <class T>
DataArray pack(Type type, Shape shape, const T* data) {
  DataArray array{type, std::move(shape), {}};
  std::size_t items = 1;
  for (const std::size_t n : array.shape) items *= n;
  array.bytes.resize(items * sizeof(T));
  if (items > 0) std::memcpy(array.bytes.data(), data, array.bytes.size());
  return array;
}

/// Row-major copy, as files store matrices.
std::vector<double> rows_first(const Eigen::Ref<const MatX>& m) {
  std::vector<double> values;
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) values.push_back(m(i, j));
  }
  return values;
}

DataArray to_array(const std::string& x) { return pack(Type::kText, {x.size()}, x.data()); }
DataArray to_array(double x) { return pack(Type::kFloat64, {}, &x); }
DataArray to_array(const Vec3& x) { return pack(Type::kFloat64, {3}, x.data()); }
DataArray to_array(const Vec3i& x) { return pack(Type::kInt32, {3}, x.data()); }
DataArray to_array(const Mat3& x) { return pack(Type::kFloat64, {3, 3}, rows_first(x).data()); }
DataArray to_array(const VecX& x) {
  return pack(Type::kFloat64, {static_cast<std::size_t>(x.size())}, x.data());
}
DataArray to_array(const std::vector<int>& x) { return pack(Type::kInt32, {x.size()}, x.data()); }
DataArray to_array(const std::vector<float>& x) {
  return pack(Type::kFloat32, {x.size()}, x.data());
}
DataArray to_array(const std::vector<double>& x) {
  return pack(Type::kFloat64, {x.size()}, x.data());
}
DataArray to_array(const std::vector<Vec3>& x) {
  return pack(Type::kFloat64, {x.size(), 3}, reinterpret_cast<const double*>(x.data()));
}
DataArray to_array(const std::vector<Vec3i>& x) {
  return pack(Type::kInt32, {x.size(), 3}, reinterpret_cast<const int*>(x.data()));
}
DataArray to_array(const std::vector<std::array<int, 4>>& x) {
  return pack(Type::kInt32, {x.size(), 4}, reinterpret_cast<const int*>(x.data()));
}
DataArray to_array(const std::vector<std::array<int, 6>>& x) {
  return pack(Type::kInt32, {x.size(), 6}, reinterpret_cast<const int*>(x.data()));
}
DataArray to_array(const std::vector<Mat3>& x) {
  std::vector<double> values;
  for (const Mat3& m : x) {
    const std::vector<double> rows = rows_first(m);
    values.insert(values.end(), rows.begin(), rows.end());
  }
  return pack(Type::kFloat64, {x.size(), 3, 3}, values.data());
}

/// Reads one array into members and reports a shape that does not fit.
struct Unpack {
  const DataArray& array;

  std::size_t dim(std::size_t i) const { return array.shape[i]; }
  bool is(Type type, std::size_t rank, std::size_t last = 0) const {
    return array.type == type && array.shape.size() == rank &&
           (last == 0 || array.shape.back() == last);
  }
  template <class T>
  bool copy(T* to) const {
    if (!array.bytes.empty())
      std::memcpy(static_cast<void*>(to), array.bytes.data(), array.bytes.size());
    return true;
  }
  bool into(std::string& x) const {
    if (array.type != Type::kText) return false;
    x.assign(array.bytes.begin(), array.bytes.end());
    return true;
  }
  bool into(double& x) const { return is(Type::kFloat64, 0) && copy(&x); }
  bool into(Vec3& x) const { return is(Type::kFloat64, 1, 3) && copy(x.data()); }
  bool into(Vec3i& x) const { return is(Type::kInt32, 1, 3) && copy(x.data()); }
  bool into(Mat3& x) const {
    if (!is(Type::kFloat64, 2, 3) || dim(0) != 3) return false;
    copy(x.data());
    x.transposeInPlace();
    return true;
  }
  bool into(VecX& x) const {
    if (!is(Type::kFloat64, 1)) return false;
    x.resize(static_cast<Eigen::Index>(dim(0)));
    return copy(x.data());
  }
  template <class T>
  bool into_list(Type type, std::vector<T>& x, std::size_t width) const {
    if (!is(type, width == 0 ? 1 : 2, width)) return false;
    x.resize(dim(0));
    return copy(x.data());
  }
  bool into(std::vector<int>& x) const { return into_list(Type::kInt32, x, 0); }
  bool into(std::vector<float>& x) const { return into_list(Type::kFloat32, x, 0); }
  bool into(std::vector<double>& x) const { return into_list(Type::kFloat64, x, 0); }
  bool into(std::vector<Vec3>& x) const { return into_list(Type::kFloat64, x, 3); }
  bool into(std::vector<Vec3i>& x) const { return into_list(Type::kInt32, x, 3); }
  bool into(std::vector<std::array<int, 4>>& x) const { return into_list(Type::kInt32, x, 4); }
  bool into(std::vector<std::array<int, 6>>& x) const { return into_list(Type::kInt32, x, 6); }
  bool into(std::vector<Mat3>& x) const {
    if (!is(Type::kFloat64, 3, 3) || dim(1) != 3) return false;
    x.resize(dim(0));
    copy(x.data());
    for (Mat3& m : x) m.transposeInPlace();
    return true;
  }
};

/// Names as one text, a line each.
template <class List>
std::string names_of(const List& list) {
  std::string text;
  for (const auto& item : list) text += item.name + "\n";
  return text;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    lines.push_back(text.substr(at, end - at));
  return lines;
}

// ---- writer and reader over the table of fields -----------------------------------------------

void hash_field(Sha256& hash, const std::string& name, const DataArray& array) {
  hash.update(name);
  const auto type = static_cast<std::uint8_t>(array.type);
  hash.update(&type, 1);
  for (const std::uint64_t n : array.shape) hash.update(&n, sizeof n);
  hash.update(array.bytes.data(), array.bytes.size());
}

struct FieldWriter {
  Hdf5Writer& file;
  std::string group;
  Sha256 hash{};

  void put(const std::string& field, const DataArray& array, const char* unit, const char* shape) {
    const std::string name = group + "/" + field;
    file.write(name, array, unit, shape);
    hash_field(hash, name, array);
  }
  template <class T>
  void operator()(const char* field, const T& value, const char* unit, const char* shape) {
    put(field, to_array(value), unit, shape);
  }
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
  /// 3 n x r by columns is (r, n, 3) by rows: modes are stored as they stand in memory.
  void modes(const char* field, const MatX& m, const char* unit, const char* shape) {
    const auto r = static_cast<std::size_t>(m.cols());
    const auto n = static_cast<std::size_t>(m.rows()) / 3;
    put(field, pack(Type::kFloat64, {r, n, 3}, m.data()), unit, shape);
  }
  void square(const char* field, const MatX& m, const char* unit, const char* shape) {
    const auto r = static_cast<std::size_t>(m.rows());
    put(field, pack(Type::kFloat64, {r, r}, rows_first(m).data()), unit, shape);
  }
};

struct FieldReader {
  const Hdf5Reader& file;
  std::string group;
  Sha256 hash{};

  DataArray take(const std::string& field) {
    const std::string name = group + "/" + field;
    DataArray array = file.read(name);
    hash_field(hash, name, array);
    return array;
  }
  void demand(bool fits, const char* field, const char* shape) const {
    if (!fits) file.fail(std::string("field ") + field + " is not of shape " + shape);
  }
  template <class T>
  void operator()(const char* field, T& value, const char*, const char* shape) {
    demand(Unpack{take(field)}.into(value), field, shape);
  }
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
  void modes(const char* field, MatX& m, const char*, const char* shape) {
    const DataArray array = take(field);
    demand(Unpack{array}.is(Type::kFloat64, 3, 3), field, shape);
    m.resize(static_cast<Eigen::Index>(3 * array.shape[1]),
             static_cast<Eigen::Index>(array.shape[0]));
    Unpack{array}.copy(m.data());
  }
  void square(const char* field, MatX& m, const char*, const char* shape) {
    const DataArray array = take(field);
    demand(Unpack{array}.is(Type::kFloat64, 2) && array.shape[0] == array.shape[1], field, shape);
    m.resize(static_cast<Eigen::Index>(array.shape[0]), static_cast<Eigen::Index>(array.shape[0]));
    Unpack{array}.copy(m.data());
    m.transposeInPlace();
  }
};

void demand_our_format(const Hdf5Reader& file) {
  if (!file.has_attribute("format") || file.text_attribute("format") != kFormat) {
    file.fail("an HDF5 file, but not a body archetype");
  }
  const int version = file.int_attribute("format_version");
  if (version != Archetype::kFormatVersion) {
    file.fail("format version " + std::to_string(version) + ", this program reads version " +
              std::to_string(Archetype::kFormatVersion));
  }
}

void demand_hash(const Hdf5Reader& file, const char* attribute, const std::string& computed) {
  if (file.text_attribute(attribute) != computed) {
    file.fail(std::string("the contents do not match their ") + attribute +
              " (damaged or changed by hand)");
  }
}

// ---- validation -------------------------------------------------------------------------------

void demand_field(bool holds, const std::string& field, const std::string& rule) {
  if (!holds) throw AssertionError("archetype field " + field + ": " + rule);
}

template <class T>
void demand_size(const T& list, Eigen::Index size, const char* field) {
  const auto found = static_cast<Eigen::Index>(list.size());
  demand_field(found == size, field,
               "size " + std::to_string(found) + ", expected " + std::to_string(size));
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
               "shape " + std::to_string(m.rows()) + " x " + std::to_string(m.cols()) +
                   ", expected " + std::to_string(rows) + " x " + std::to_string(cols));
  demand_finite(m, field);
}

void validate_material(const Archetype& a) {
  demand_field(a.density > 0 && std::isfinite(a.density), "density", "not positive");
  demand_field(a.young > 0 && std::isfinite(a.young), "young", "not positive");
  demand_field(a.poisson > -1 && a.poisson < 0.5, "poisson", "not in (-1, 0.5)");
  demand_field(a.alpha >= 0 && std::isfinite(a.alpha), "alpha", "negative");
  demand_field(a.beta >= 0 && std::isfinite(a.beta), "beta", "negative");
  demand_field(a.volume > 0 && std::isfinite(a.volume), "volume", "not positive");
  demand_finite(a.centre, "centre");
}

void validate_surface(const Archetype& a) {
  const auto ns = static_cast<Eigen::Index>(a.surface.vertices.size());
  demand_field(ns > 0, "surface_vertices", "empty");
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
  const Eigen::Matrix<Eigen::Index, 3, 1> nodes = a.sdf.nodes.cast<Eigen::Index>();
  demand_field(nodes.minCoeff() >= 0, "sdf_nodes", "negative");
  demand_size(a.sdf.values, nodes.prod(), "sdf_values");
  for (const float v : a.sdf.values) demand_finite(v, "sdf_values");
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
  demand_field(a.integrals.mass > 0 && std::isfinite(a.integrals.mass), "mass", "not positive");
  demand_finite(a.integrals.Sxx, "Sxx");
  demand_size(a.integrals.I3, r, "I3");
  demand_finite(a.integrals.I3, "I3");
  demand_size(a.integrals.A, r, "A");
  demand_finite(a.integrals.A, "A");
  demand_size(a.integrals.B, r * r, "B");
  demand_finite(a.integrals.B, "B");
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

}  // namespace

void validate(const Archetype& a) {
  validate_material(a);
  validate_surface(a);
  validate_modes(a);
  validate_tets(a);
}

std::string write_archetype(const std::string& path, const Archetype& a) {
  validate(a);
  Hdf5Writer file(path);
  file.attribute("format", kFormat);
  file.attribute("format_version", Archetype::kFormatVersion);
  FieldWriter runtime{file, "runtime"};
  runtime_fields(runtime, a);
  FieldWriter full{file, "full"};
  full_fields(full, a);

  // The content hash joins the hashes of the two parts, so that a reader of one part can check it.
  const std::string runtime_hash = runtime.hash.hex(), full_hash = full.hash.hex();
  file.attribute("runtime_hash", runtime_hash);
  file.attribute("full_hash", full_hash);
  const std::string content_hash = sha256_hex(runtime_hash + full_hash);
  file.attribute("content_hash", content_hash);
  file.commit();
  return content_hash;
}

Archetype read_archetype(const std::string& path, Part part) {
  const Hdf5Reader file(path, kAdvice);
  demand_our_format(file);
  Archetype a;
  FieldReader runtime{file, "runtime"};
  runtime_fields(runtime, a);
  demand_hash(file, "runtime_hash", runtime.hash.hex());
  if (part == Part::kAll) {
    FieldReader full{file, "full"};
    full_fields(full, a);
    demand_hash(file, "full_hash", full.hash.hex());
  }
  a.content_hash =
      sha256_hex(file.text_attribute("runtime_hash") + file.text_attribute("full_hash"));
  demand_hash(file, "content_hash", a.content_hash);
  try {
    validate(a);
  } catch (const AssertionError& wrong) {
    file.fail(wrong.what());
  }
  return a;
}

}  // namespace archetide
