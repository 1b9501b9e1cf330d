#pragma once

// Values as bytes and back, for what goes from one process of this program to another.

#include <array>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/check.h"
#include "common/mesh/tet_mesh.h"

namespace archetide {

/// Types whose bytes are all there is to them.
template <class T>
inline constexpr bool kPlain = std::is_trivially_copyable_v<T> || std::is_same_v<T, Vec3> ||
                               std::is_same_v<T, Vec3i> || std::is_same_v<T, Mat3>;

/// Appends values to `bytes`. A struct takes part by a function `fields(archive, struct)` that
/// calls the archive with its members; the same function unpacks it.
class Packer {
 public:
  std::string bytes;

  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (kPlain<T>)
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    else
      fields(*this, const_cast<T&>(value));
  }
  void put(const std::string& text) {
    put(text.size());
    bytes += text;
  }
  template <class T>
  void put(const std::vector<T>& list) {
    put(list.size());
    for (const T& item : list) put(item);
  }
};

/// Takes the values out again, in the same order.
class Unpacker {
 public:
  explicit Unpacker(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class... T>
  void operator()(T&... values) {
    (get(values), ...);
  }

 private:
  const char* take(std::size_t size) {
    ARCHETIDE_CHECK_OP(at_ + size, <=, bytes_.size());
    at_ += size;
    return bytes_.data() + at_ - size;
  }
  template <class T>
  void get(T& value) {
    if constexpr (kPlain<T>)
      std::memcpy(static_cast<void*>(&value), take(sizeof value), sizeof value);
    else
      fields(*this, value);
  }
  void get(std::string& text) {
    std::size_t size = 0;
    get(size);
    text.assign(take(size), size);
  }
  template <class T>
  void get(std::vector<T>& list) {
    std::size_t size = 0;
    get(size);
    list.resize(size);
    for (T& item : list) get(item);
  }

  std::string bytes_;
  std::size_t at_ = 0;
};

template <class Archive>
void fields(Archive& archive, TriMesh& mesh) {
  archive(mesh.vertices, mesh.triangles);
}

template <class Archive>
void fields(Archive& archive, TetMesh& mesh) {
  archive(mesh.nodes, mesh.tets, mesh.mids);
}

}  // namespace archetide
