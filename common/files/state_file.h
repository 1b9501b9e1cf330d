#pragma once

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/sha256.h"
#include "common/base/types.h"
#include "common/files/hdf5_file.h"

namespace archetide {

/// Named numbers on their way into a file or out of it. A class lists its state once, as calls of
/// field(), and the list serves both directions, so that no field can be forgotten in one of them.
class StateArchive {
 public:
  using Type = DataArray::Type;
  using Shape = std::vector<std::size_t>;
  virtual ~StateArchive() = default;
  virtual bool reading() const = 0;

  /// A number, a text, a vector of numbers, of Vec3 or of VecX, an Eigen vector or a
  /// quaternion. Lists take
  /// the length that the file has.
  template <class T>
  void field(const std::string& name, T& x);
  /// Numbers whose shape the scene knows, from `data` on. Throws FileError when the file has
  /// another number of them.
  template <class T>
  void block(const std::string& name, T* data, const Shape& shape);

  /// Complains about what a file holds: FileError with its name.
  [[noreturn]] virtual void fail(const std::string& what) const = 0;

 protected:
  virtual void store(const std::string& name, DataArray data) = 0;
  virtual DataArray load(const std::string& name) = 0;

 private:
  /// load(), without infinities and the like.
  DataArray checked(const std::string& name);
  template <class T>
  static constexpr Type type_of();
  template <class T>
  void write_items(const std::string& name, const T* data, Shape shape);
  template <class T, class Room>
  void read_items(const std::string& name, std::size_t columns, const Room& room);
};

/// Writes `path` atomically, with a SHA-256 over all fields. The same state gives the same bytes.
class StateWriter : public StateArchive {
 public:
  StateWriter(const std::string& path, const std::string& format, int version);
  bool reading() const override { return false; }
  [[noreturn]] void fail(const std::string& what) const override;
  /// Closes, syncs, renames; returns the hash. Without it the file never appears.
  std::string commit();

 protected:
  void store(const std::string& name, DataArray data) override;
  DataArray load(const std::string& name) override;

 private:
  std::string path_;
  Hdf5Writer file_;
  Sha256 hash_;
};

/// Reads what StateWriter wrote, fields in the same order. Throws FileError: missing, damaged,
/// foreign, of another version.
class StateReader : public StateArchive {
 public:
  StateReader(const std::string& path, const std::string& format, int version, std::string advice);
  bool reading() const override { return true; }
  [[noreturn]] void fail(const std::string& what) const override { file_.fail(what); }
  /// After the last field: throws FileError when the fields do not match the file's hash.
  void demand_hash();

 protected:
  void store(const std::string& name, DataArray data) override;
  DataArray load(const std::string& name) override;

 private:
  Hdf5Reader file_;
  Sha256 hash_;
};

// --- what field() does with each kind of value ---

template <class T>
constexpr StateArchive::Type StateArchive::type_of() {
  if constexpr (std::is_same_v<T, double>) return Type::kFloat64;
  if constexpr (std::is_same_v<T, float>) return Type::kFloat32;
  if constexpr (std::is_integral_v<T>)
    return sizeof(T) == 1 ? Type::kUint8 : sizeof(T) == 4 ? Type::kInt32 : Type::kInt64;
}

template <class T>
void StateArchive::write_items(const std::string& name, const T* data, Shape shape) {
  std::size_t count = 1;
  for (const std::size_t n : shape) count *= n;
  const auto* bytes = reinterpret_cast<const char*>(data);
  store(name,
        {type_of<T>(), std::move(shape), std::vector<char>(bytes, bytes + count * sizeof(T))});
}

// `columns` numbers an item; room(items) makes room and says where the numbers go.
template <class T, class Room>
void StateArchive::read_items(const std::string& name, std::size_t columns, const Room& room) {
  const DataArray data = checked(name);
  if (data.type != type_of<T>() || data.bytes.size() % (columns * sizeof(T)) != 0)
    fail("field " + name + " is not what this program writes");
  T* to = room(data.bytes.size() / (columns * sizeof(T)));
  if (!data.bytes.empty()) std::memcpy(to, data.bytes.data(), data.bytes.size());
}

template <class T>
void StateArchive::block(const std::string& name, T* data, const Shape& shape) {
  if (!reading()) return write_items(name, data, shape);
  std::size_t count = 1;
  for (const std::size_t n : shape) count *= n;
  read_items<T>(name, 1, [&](std::size_t found) {
    if (found != count)
      fail(fmt::format("field {} has {} numbers, this scene {}", name, found, count));
    return data;
  });
}

template <class T>
void StateArchive::field(const std::string& name, T& x) {
  if constexpr (std::is_same_v<T, bool>) {
    std::uint8_t byte = x ? 1 : 0;
    block(name, &byte, {});
    x = byte != 0;
  } else if constexpr (std::is_arithmetic_v<T>) {
    block(name, &x, {});
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (!reading()) return store(name, {Type::kText, {x.size()}, {x.begin(), x.end()}});
    const DataArray data = load(name);
    if (data.type != Type::kText) fail("field " + name + " is not a text");
    x.assign(data.bytes.begin(), data.bytes.end());
  } else if constexpr (std::is_same_v<T, Quat>) {
    block(name, x.coeffs().data(), {4});
  } else if constexpr (std::is_same_v<T, Vec3>) {
    block(name, x.data(), {3});
  } else if constexpr (std::is_same_v<T, VecX>) {
    if (!reading()) return write_items(name, x.data(), {static_cast<std::size_t>(x.size())});
    read_items<double>(name, 1, [&](std::size_t n) {
      x.resize(static_cast<Eigen::Index>(n));
      return x.data();
    });
  } else if constexpr (std::is_same_v<T, std::vector<Vec3>>) {
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    if (!reading()) return write_items(name, x.empty() ? nullptr : x[0].data(), {x.size(), 3});
    read_items<double>(name, 3, [&](std::size_t n) {
      x.resize(n);
      return x.empty() ? nullptr : x[0].data();
    });
  } else if constexpr (std::is_same_v<T, std::vector<VecX>>) {
    std::vector<int> sizes;
    VecX all;
    for (const VecX& v : x) sizes.push_back(static_cast<int>(v.size()));
    if (!reading()) {
      all.resize(std::accumulate(sizes.begin(), sizes.end(), Eigen::Index{0}));
      Eigen::Index at = 0;
      for (const VecX& v : x) all.segment(at, v.size()) = v, at += v.size();
    }
    field(name + "_sizes", sizes);
    field(name, all);
    const bool negative = std::any_of(sizes.begin(), sizes.end(), [](int n) { return n < 0; });
    if (negative || std::accumulate(sizes.begin(), sizes.end(), Eigen::Index{0}) != all.size())
      fail("field " + name + " does not have its sizes");
    x.resize(sizes.size());
    Eigen::Index at = 0;
    for (std::size_t n = 0; n < x.size(); ++n) x[n] = all.segment(at, sizes[n]), at += sizes[n];
  } else {
    using Item = typename T::value_type;
    static_assert(std::is_same_v<T, std::vector<Item>> && std::is_arithmetic_v<Item>);
    if (!reading()) return write_items(name, x.data(), {x.size()});
    read_items<Item>(name, 1, [&](std::size_t n) {
      x.resize(n);
      return x.data();
    });
  }
}

}  // namespace archetide
