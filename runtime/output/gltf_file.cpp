#include "runtime/output/gltf_file.h"

#include <algorithm>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

// Numbers of the standard.
constexpr int kFloat = 5126, kUnsigned = 5125;
constexpr int kVertices = 34962, kTriangles = 34963, kNoTarget = 0;
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;

int components(const std::string& type) { return type == "SCALAR" ? 1 : type == "VEC3" ? 3 : 4; }

void append_chunk(std::uint32_t kind, const std::string& content, std::string& bytes) {
  append_number(bytes, static_cast<std::uint32_t>(content.size()));
  append_number(bytes, kind);
  bytes += content;
}

void pad(std::string& content, char filler) {
  while (content.size() % 4 != 0) content += filler;
}

}  // namespace

GltfFile::GltfFile() {
  json_["asset"] = {{"version", "2.0"}, {"generator", "archetide"}};
  json_["scene"] = 0;
}

int GltfFile::add(const std::string& list, Json item) {
  json_[list].push_back(std::move(item));
  return static_cast<int>(json_[list].size()) - 1;
}

void GltfFile::set_scene(const std::string& name, const std::vector<int>& nodes) {
  json_["scenes"] = Json::array({{{"name", name}, {"nodes", nodes}}});
}

int GltfFile::accessor(const std::string& type, int component, std::size_t count,
                       std::size_t offset, int target) {
  Json view = {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", binary_.size() - offset}};
  if (target != kNoTarget) view["target"] = target;
  return add("accessors", {{"bufferView", add("bufferViews", view)},
                           {"componentType", component},
                           {"count", count},
                           {"type", type}});
}

int GltfFile::floats(const std::vector<float>& values, const std::string& type, bool of_vertices) {
  const int n = components(type);
  const std::size_t offset = binary_.size();
  std::vector<float> low(static_cast<std::size_t>(n), INFINITY), high(low.size(), -INFINITY);
  for (std::size_t i = 0; i < values.size(); ++i) {
    append_number(binary_, values[i]);
    const std::size_t c = i % low.size();
    low[c] = std::min(low[c], values[i]), high[c] = std::max(high[c], values[i]);
  }
  const int a = accessor(type, kFloat, values.size() / low.size(), offset,
                         of_vertices ? kVertices : kNoTarget);
  at("accessors", a)["min"] = low, at("accessors", a)["max"] = high;
  return a;
}

int GltfFile::indices(const std::vector<std::uint32_t>& values) {
  const std::size_t offset = binary_.size();
  for (const std::uint32_t value : values) append_number(binary_, value);
  return accessor("SCALAR", kUnsigned, values.size(), offset, kTriangles);
}

std::string GltfFile::bytes() {
  json_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
  std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
  pad(text, ' ');
  pad(binary_, '\0');
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  const std::size_t size = kHeader + 2 * kChunkHeader + text.size() + binary_.size();
  if (size > UINT32_MAX)
    throw InputError("more than 4 GiB, which a .glb file cannot hold",
                     "take fewer frames with --frames");
  std::string bytes;
  bytes.reserve(size);
  append_number(bytes, kMagic);
  append_number(bytes, kVersion);
  append_number(bytes, static_cast<std::uint32_t>(size));
  append_chunk(kJson, text, bytes);
  append_chunk(kBinary, binary_, bytes);
  return bytes;
}

}  // namespace archetide
