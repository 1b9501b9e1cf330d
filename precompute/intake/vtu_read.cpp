#include <fmt/core.h>

#include <cstring>
#include <map>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/base64.h"
#include "precompute/intake/tet_file.h"

namespace archetide {
namespace {

/// The file and what its head says.
struct Vtu {
  const std::string& path;
  const std::string text;
  std::size_t appended = std::string::npos;  // first byte behind the '_'
  bool appended_base64 = false;
  std::size_t length_bytes = 4;  // of the number before each binary array

  [[noreturn]] void refuse(const std::string& what, const std::string& hint = "") const {
    throw InputError({Diagnostic{{path, 0, 0}, what, hint}});
  }
};

/// A start tag: its attributes and where it ends.
struct Tag {
  std::map<std::string, std::string> attributes;
  std::size_t end = std::string::npos;  // behind the '>'
  std::string operator[](const std::string& name) const {
    const auto found = attributes.find(name);
    return found == attributes.end() ? "" : found->second;
  }
};

/// The next tag `name` from `from` on, or one with end = npos.
Tag find_tag(const std::string& text, const std::string& name, std::size_t from) {
  Tag tag;
  const std::size_t start = text.find("<" + name, from);
  if (start == std::string::npos) return tag;
  const std::size_t close = text.find('>', start);
  if (close == std::string::npos) return tag;
  for (std::size_t at = start + 1 + name.size(); at < close;) {
    const std::size_t equals = text.find('=', at);
    if (equals == std::string::npos || equals > close) break;
    const std::size_t open = text.find_first_of("\"'", equals);
    const std::size_t quote = open == std::string::npos ? open : text.find(text[open], open + 1);
    if (quote == std::string::npos) break;
    const std::size_t first = text.find_first_not_of(" \t\r\n", at);
    const std::size_t last = text.find_last_not_of(" \t\r\n", equals - 1);
    tag.attributes[text.substr(first, last + 1 - first)] = text.substr(open + 1, quote - open - 1);
    at = quote + 1;
  }
  tag.end = close + 1;
  return tag;
}

template <class T>
void convert(const std::string& bytes, std::vector<double>& values) {
  for (std::size_t at = 0; at + sizeof(T) <= bytes.size();)
    values.push_back(static_cast<double>(take_number<T>(bytes, at)));
}

std::vector<double> numbers(const Vtu& file, const std::string& type, const std::string& bytes) {
  using Convert = void (*)(const std::string&, std::vector<double>&);
  static const std::map<std::string, Convert> kTypes = {
      {"Float64", convert<double>},     {"Float32", convert<float>},
      {"Int64", convert<std::int64_t>}, {"UInt64", convert<std::uint64_t>},
      {"Int32", convert<std::int32_t>}, {"UInt32", convert<std::uint32_t>},
      {"Int16", convert<std::int16_t>}, {"UInt16", convert<std::uint16_t>},
      {"Int8", convert<std::int8_t>},   {"UInt8", convert<std::uint8_t>}};
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) file.refuse("an array of type \"" + type + "\" cannot be read");
  std::vector<double> values;
  found->second(bytes, values);
  return values;
}

/// Takes the length off the front of a binary array and what is behind its end.
std::string payload(const Vtu& file, const std::string& raw) {
  std::uint64_t length = 0;
  if (raw.size() < file.length_bytes) file.refuse("truncated: an array without its length");
  std::memcpy(&length, raw.data(), file.length_bytes);
  if (length > raw.size() - file.length_bytes) file.refuse("truncated: an array ends too early");
  return raw.substr(file.length_bytes, length);
}

std::string decoded(const Vtu& file, const std::string& text) {
  std::string raw;
  if (!from_base64(text, raw)) file.refuse("an array is not base64");
  return raw;
}

std::string appended_bytes(const Vtu& file, const Tag& tag) {
  if (file.appended == std::string::npos) file.refuse("no appended data in this file");
  const std::size_t start = file.appended + std::strtoull(tag["offset"].c_str(), nullptr, 10);
  if (start >= file.text.size()) file.refuse("truncated: an array begins behind the end");
  if (!file.appended_base64) return payload(file, file.text.substr(start));
  const std::size_t end = std::min(file.text.find('<', start), file.text.find('=', start));
  return payload(file, decoded(file, file.text.substr(start, end - start)));
}

std::vector<double> read_array(const Vtu& file, const Tag& tag) {
  if (tag["format"] == "appended") return numbers(file, tag["type"], appended_bytes(file, tag));
  const std::size_t end = file.text.find("</DataArray", tag.end);
  if (end == std::string::npos) file.refuse("truncated: an array without end");
  const std::string inside = file.text.substr(tag.end, end - tag.end);
  if (tag["format"] == "binary")
    return numbers(file, tag["type"], payload(file, decoded(file, inside)));
  std::vector<double> values;
  std::istringstream words(inside);
  for (double value; words >> value;) values.push_back(value);
  if (!words.eof()) file.refuse("an array holds something that is not a number");
  return values;
}

/// The array `name` (any name if empty) of section <Points> or <Cells>.
std::vector<double> array_of(const Vtu& file, const std::string& section, const std::string& name) {
  const Tag outer = find_tag(file.text, section, 0);
  const std::size_t end = file.text.find("</" + section, 0);
  for (Tag tag = outer; tag.end < end;) {
    tag = find_tag(file.text, "DataArray", tag.end);
    if (tag.end < end && (name.empty() || tag["Name"] == name)) return read_array(file, tag);
  }
  file.refuse("no array " + name + " in <" + section + ">");
}

void read_head(Vtu& file) {
  const Tag head = find_tag(file.text, "VTKFile", 0);
  if (head.end == std::string::npos || head["type"] != "UnstructuredGrid")
    file.refuse("not a VTK XML file of type UnstructuredGrid");
  if (!head["compressor"].empty())
    file.refuse("compressed (" + head["compressor"] + ")",
                "save it without compression, or as ASCII");
  if (head["byte_order"] == "BigEndian") file.refuse("big endian", "save it as ASCII");
  if (head["header_type"] == "UInt64") file.length_bytes = 8;
  const Tag tail = find_tag(file.text, "AppendedData", 0);
  if (tail.end == std::string::npos) return;
  file.appended = file.text.find('_', tail.end);
  if (file.appended != std::string::npos) ++file.appended;
  file.appended_base64 = tail["encoding"] == "base64";
  if (!file.appended_base64 && tail["encoding"] != "raw")
    file.refuse("appended data of encoding \"" + tail["encoding"] + "\"");
  if (find_tag(file.text, "Piece", find_tag(file.text, "Piece", 0).end).end < tail.end)
    file.refuse("several pieces", "merge them into one");
}

/// A number of a cell or node: they are read as doubles, whatever their type.
template <class T>
T whole(const Vtu& file, double value) {
  if (!(value >= 0.0 && value < 2147483648.0))
    file.refuse("a cell holds a number that is no index");
  return static_cast<T>(value);
}

}  // namespace

TetFile parse_vtu(const std::string& path, std::string_view bytes) {
  Vtu vtu{path, std::string(bytes)};
  read_head(vtu);
  TetFile file;
  file.coordinates = array_of(vtu, "Points", "");
  for (std::size_t i = 0; i < file.coordinates.size() / 3; ++i) file.tags.push_back(i);
  const std::vector<double> connectivity = array_of(vtu, "Cells", "connectivity"),
                            ends = array_of(vtu, "Cells", "offsets"),
                            types = array_of(vtu, "Cells", "types");
  constexpr int kTetra = 10, kLastOfLowerDimension = 9;
  for (std::size_t c = 0; c < types.size() && c < ends.size(); ++c) {
    const int type = whole<int>(vtu, types[c]);
    if (type <= kLastOfLowerDimension) continue;
    if (type != kTetra)
      vtu.refuse(fmt::format("cells of VTK type {} are not supported", type),
                 "export linear tetrahedra (type 10)");
    const auto end = whole<std::size_t>(vtu, ends[c]);
    if (end < 4 || end > connectivity.size())
      vtu.refuse(fmt::format("cell {} has no four corners", c + 1));
    for (std::size_t k = end - 4; k < end; ++k)
      file.corners.push_back(whole<std::size_t>(vtu, connectivity[k]));
  }
  if (file.corners.empty()) vtu.refuse("no tetrahedra in this file", "save the volume mesh");
  return file;
}

}  // namespace archetide
