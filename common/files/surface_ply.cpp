#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

#include "common/files/surface_formats.h"

namespace archetide {
namespace {

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct Property {
  std::string name;
  Scalar type = Scalar::kFloat32;
  Scalar count_type = Scalar::kUint8;
  bool is_list = false;
};

struct Element {
  std::string name;
  int count = 0;
  std::vector<Property> properties;
};

struct Header {
  enum class Format { kText, kLittleEndian, kBigEndian } format = Format::kText;
  std::vector<Element> elements;
};

Scalar parse_type(std::string_view word, const std::string& path, int line) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames = {{{"char", "int8"},
                                                                      {"uchar", "uint8"},
                                                                      {"short", "int16"},
                                                                      {"ushort", "uint16"},
                                                                      {"int", "int32"},
                                                                      {"uint", "uint32"},
                                                                      {"float", "float32"},
                                                                      {"double", "float64"}}};
  for (std::size_t t = 0; t < kNames.size(); ++t) {
    if (word == kNames[t][0] || word == kNames[t][1]) return static_cast<Scalar>(t);
  }
  refuse(path, line, "unknown type \"" + std::string(word) + "\" of a property");
}

Header::Format parse_format(std::string_view word, const std::string& path, int line) {
  if (word == "ascii") return Header::Format::kText;
  if (word == "binary_little_endian") return Header::Format::kLittleEndian;
  if (word == "binary_big_endian") return Header::Format::kBigEndian;
  refuse(path, line, "unknown PLY format \"" + std::string(word) + "\"");
}

Property parse_property(TextScanner& scan, const std::string& path) {
  Property property;
  std::string_view word = scan.word();
  if (word == "list") {
    property.is_list = true;
    property.count_type = parse_type(scan.word(), path, scan.line());
    word = scan.word();
  }
  property.type = parse_type(word, path, scan.line());
  property.name = scan.word();
  return property;
}

Header parse_header(TextScanner& scan, const std::string& path) {
  Header header;
  if (!scan.next_line(false) || scan.word() != "ply") refuse(path, 1, "not a PLY file");
  while (scan.next_line(false)) {
    const std::string_view keyword = scan.word();
    if (keyword == "end_header") return header;
    if (keyword == "format") {
      header.format = parse_format(scan.word(), path, scan.line());
    } else if (keyword == "element") {
      Element element;
      element.name = scan.word();
      element.count = scan_integer(scan, path, "number of elements");
      header.elements.push_back(element);
    } else if (keyword == "property") {
      if (header.elements.empty()) refuse(path, scan.line(), "a property before any element");
      header.elements.back().properties.push_back(parse_property(scan, path));
    }
  }
  refuse(path, scan.line(), "the file ends inside its header");
}

/// Values one after the other, from text or from bytes.
class Values {
 public:
  Values(const TextScanner& scan, Header::Format format, const std::string& path)
      : scan_(scan), bytes_(scan.rest()), format_(format), path_(path) {}

  /// `what` names the element in a refusal.
  double next(Scalar type, const std::string& what) {
    return format_ == Header::Format::kText ? next_word(what) : next_bytes(type, what);
  }

 private:
  double next_word(const std::string& what) {
    std::string_view word = scan_.word();
    while (word.empty()) {
      if (!scan_.next_line(false)) refuse(path_, scan_.line(), "the file ends at " + what);
      word = scan_.word();
    }
    double value = 0.0;
    if (parse_number(word, value)) return value;
    refuse(path_, scan_.line(), what + ": expected a number, found \"" + std::string(word) + "\"");
  }

  template <class T>
  double take(const std::string& what) {
    if (bytes_.size() < sizeof(T)) refuse(path_, 0, "the file is truncated at " + what);
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data(), sizeof(T));
    bytes_.remove_prefix(sizeof(T));
    if (format_ == Header::Format::kBigEndian) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return static_cast<double>(value);
  }

  double next_bytes(Scalar type, const std::string& what) {
    switch (type) {
      case Scalar::kInt8:
        return take<std::int8_t>(what);
      case Scalar::kUint8:
        return take<std::uint8_t>(what);
      case Scalar::kInt16:
        return take<std::int16_t>(what);
      case Scalar::kUint16:
        return take<std::uint16_t>(what);
      case Scalar::kInt32:
        return take<std::int32_t>(what);
      case Scalar::kUint32:
        return take<std::uint32_t>(what);
      case Scalar::kFloat32:
        return take<float>(what);
      case Scalar::kFloat64:
        break;
    }
    return take<double>(what);
  }

  TextScanner scan_;
  std::string_view bytes_;
  Header::Format format_;
  const std::string& path_;
};

int axis_of(const std::string& property) {
  return property == "x" ? 0 : property == "y" ? 1 : property == "z" ? 2 : -1;
}

bool is_corner_list(const Property& p) {
  return p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index");
}

void demand_property(const Element& element, bool (*wanted)(const Property&), int count,
                     const std::string& names, const std::string& path) {
  if (std::count_if(element.properties.begin(), element.properties.end(), wanted) != count) {
    refuse(path, 0, "the header gives element " + element.name + " no " + names);
  }
}

// Bytes may stand for any number.
int as_integer(double value, const std::string& what, const std::string& path) {
  constexpr double kMost = std::numeric_limits<int>::max();
  if (!(std::abs(value) <= kMost) || value != std::floor(value))
    refuse(path, 0, fmt::format("{}: expected an integer below 2^31, found {}", what, value));
  return static_cast<int>(value);
}

void read_element(Values& values, const Element& element, SurfaceFile& out) {
  if (element.properties.empty()) return;  // takes no bytes, however many there are
  std::vector<int> corners;
  for (int i = 0; i < element.count; ++i) {
    const std::string what = fmt::format("{} {} of {}", element.name, i + 1, element.count);
    Vec3 x = Vec3::Zero();
    for (const Property& property : element.properties) {
      const int length =
          property.is_list ? as_integer(values.next(property.count_type, what), what, out.path) : 1;
      const bool lists_corners = element.name == "face" && is_corner_list(property);
      corners.clear();
      for (int j = 0; j < length; ++j) {
        const double value = values.next(property.type, what);
        if (lists_corners)
          corners.push_back(as_integer(value, what, out.path));
        else if (const int axis = axis_of(property.name); axis >= 0 && !property.is_list)
          x[axis] = value;
      }
      if (lists_corners) {
        if (length < 3) refuse(out.path, 0, fmt::format("{} has {} corners", what, length));
        add_face(out, corners, i + 1);
      }
    }
    if (element.name == "vertex") out.mesh.vertices.push_back(x);
  }
}

}  // namespace

void read_ply(std::string_view bytes, SurfaceFile& out) {
  TextScanner scan(bytes);
  const Header header = parse_header(scan, out.path);
  Values values(scan, header.format, out.path);
  for (const Element& element : header.elements) {
    if (element.name == "vertex") {
      demand_property(
          element, [](const Property& p) { return !p.is_list && axis_of(p.name) >= 0; }, 3,
          "x, y and z", out.path);
    }
    if (element.name == "face") {
      demand_property(element, is_corner_list, 1, "list vertex_indices", out.path);
    }
    read_element(values, element, out);
  }
}

}  // namespace archetide
