#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/files/atomic_file.h"

namespace archetide {

/// What one dataset holds: a type, a shape (row-major, empty for a scalar) and its bytes in native
/// order.
struct DataArray {
  enum class Type : std::uint8_t { kFloat64, kFloat32, kInt32, kInt64, kUint8, kText };
  Type type = Type::kFloat64;
  std::vector<std::size_t> shape;  // kText: one entry, the length in bytes
  std::vector<char> bytes;
};

/// Writes an HDF5 file atomically. The same calls give the same bytes: no times are stored, and
/// metadata carry checksums (format 1.8). Throws MachineError.
class Hdf5Writer {
 public:
  /// The file format of HDF5 1.8, which every reader knows, or 1.10, which has views.
  enum class Format { k18, k110 };
  explicit Hdf5Writer(const std::string& path, Format format = Format::k18);
  ~Hdf5Writer();
  /// A dataset with text attributes `unit` and `shape`. Groups in `name` ("group/field") are made
  /// on demand.
  void write(const std::string& name, const DataArray& data, const std::string& unit,
             const std::string& shape_text);
  /// A dataset that shows slice `index` (along the first axis) of the float64 dataset `source`, of
  /// that `shape`, without storing it again (a virtual dataset).
  void view(const std::string& name, const std::string& source,
            const std::vector<std::size_t>& shape, std::size_t index);
  /// A text (ASCII, fixed length) or list attribute of a group that is there.
  void group_attribute(const std::string& group, const std::string& name, const std::string& text);
  void group_attribute(const std::string& group, const std::string& name,
                       const std::vector<std::int64_t>& list);
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
  const std::string& path() const { return path_; }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string path_, advice_;
  std::size_t file_bytes_ = 0;
  std::int64_t id_ = -1;
};

}  // namespace archetide
