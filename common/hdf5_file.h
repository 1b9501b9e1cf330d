#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/atomic_file.h"

namespace archetide {

/// What one dataset holds: a type, a shape (row-major, empty for a scalar) and its bytes in native
/// order.
struct DataArray {
  enum class Type : std::uint8_t { kFloat64, kFloat32, kInt32, kText };
  Type type = Type::kFloat64;
  std::vector<std::size_t> shape;  // kText: one entry, the length in bytes
  std::vector<char> bytes;
};

/// Writes an HDF5 file atomically. The same calls give the same bytes: no times are stored, and
/// metadata carry checksums (format 1.8). Throws MachineError.
class Hdf5Writer {
 public:
  explicit Hdf5Writer(const std::string& path);
  ~Hdf5Writer();
  /// A dataset with text attributes `unit` and `shape`. Groups in `name` ("group/field") are made
  /// on demand.
  void write(const std::string& name, const DataArray& data, const std::string& unit,
             const std::string& shape_text);
  /// A text or integer attribute of the file's root.
  void attribute(const std::string& name, const std::string& text);
  void attribute(const std::string& name, int value);
  /// Closes, syncs and renames. Without it the file never appears.
  void commit();

 private:
  [[noreturn]] void fail(const std::string& what) const;
  AtomicFile file_;
  std::string path_;
  std::int64_t id_ = -1;
};

/// Reads such a file. Throws FileError whose message names the file, what is wrong and `advice`.
class Hdf5Reader {
 public:
  Hdf5Reader(const std::string& path, std::string advice);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;
  DataArray read(const std::string& name) const;
  bool has_attribute(const std::string& name) const;
  std::string text_attribute(const std::string& name) const;
  int int_attribute(const std::string& name) const;
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string path_, advice_;
  std::size_t file_bytes_ = 0;
  std::int64_t id_ = -1;
};

}  // namespace archetide
