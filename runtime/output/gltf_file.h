#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace archetide {

/// A binary glTF 2.0 file (.glb) under construction: the JSON part, and arrays of numbers that it
/// names by the index of their accessor.
class GltfFile {
 public:
  using Json = nlohmann::ordered_json;

  GltfFile();

  /// Appends to a list of the file ("nodes", "meshes", ..); its index there.
  int add(const std::string& list, Json item);
  Json& at(const std::string& list, int index) {
    return json_[list][static_cast<std::size_t>(index)];
  }
  /// What the file shows: indices of nodes without a parent.
  void set_scene(const std::string& name, const std::vector<int>& nodes);

  /// Numbers as float32; `type` SCALAR, VEC3 or VEC4. `of_vertices`: for the graphics card.
  int floats(const std::vector<float>& values, const std::string& type, bool of_vertices);
  /// Vertex indices of triangles, uint32.
  int indices(const std::vector<std::uint32_t>& values);

  /// The whole file. Throws InputError beyond 4 GiB, which the format cannot hold.
  std::string bytes();

 private:
  int accessor(const std::string& type, int component, std::size_t count, std::size_t offset,
               int target);

  Json json_;
  std::string binary_;
};

}  // namespace archetide
