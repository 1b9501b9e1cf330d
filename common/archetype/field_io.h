#pragma once

// Fields of HDF5 files by name, with their unit and shape, hashed as they are written and read.
// Shared by the formats of this folder; nobody else includes it.

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "common/base/sha256.h"
#include "common/base/types.h"
#include "common/files/hdf5_file.h"

namespace archetide::fields {

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
inline std::vector<double> rows_first(const Eigen::Ref<const MatX>& m) {
  std::vector<double> values;
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) values.push_back(m(i, j));
  }
  return values;
}

inline DataArray to_array(const std::string& x) { return pack(Type::kText, {x.size()}, x.data()); }
inline DataArray to_array(double x) { return pack(Type::kFloat64, {}, &x); }
inline DataArray to_array(const Vec3& x) { return pack(Type::kFloat64, {3}, x.data()); }
inline DataArray to_array(const Vec3i& x) { return pack(Type::kInt32, {3}, x.data()); }
inline DataArray to_array(const Mat3& x) {
  return pack(Type::kFloat64, {3, 3}, rows_first(x).data());
}
inline DataArray to_array(const VecX& x) {
  return pack(Type::kFloat64, {static_cast<std::size_t>(x.size())}, x.data());
}
inline DataArray to_array(const std::vector<int>& x) {
  return pack(Type::kInt32, {x.size()}, x.data());
}
inline DataArray to_array(const std::vector<float>& x) {
  return pack(Type::kFloat32, {x.size()}, x.data());
}
inline DataArray to_array(const std::vector<double>& x) {
  return pack(Type::kFloat64, {x.size()}, x.data());
}
inline DataArray to_array(const std::vector<Vec3>& x) {
  return pack(Type::kFloat64, {x.size(), 3}, reinterpret_cast<const double*>(x.data()));
}
inline DataArray to_array(const std::vector<Vec3i>& x) {
  return pack(Type::kInt32, {x.size(), 3}, reinterpret_cast<const int*>(x.data()));
}
inline DataArray to_array(const std::vector<std::array<int, 4>>& x) {
  return pack(Type::kInt32, {x.size(), 4}, reinterpret_cast<const int*>(x.data()));
}
inline DataArray to_array(const std::vector<std::array<int, 6>>& x) {
  return pack(Type::kInt32, {x.size(), 6}, reinterpret_cast<const int*>(x.data()));
}
inline DataArray to_array(const std::vector<Mat3>& x) {
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

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    lines.push_back(text.substr(at, end - at));
  return lines;
}

// ---- writer and reader over the table of fields -----------------------------------------------

inline void hash_field(Sha256& hash, const std::string& name, const DataArray& array) {
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

}  // namespace archetide::fields
