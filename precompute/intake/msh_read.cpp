// Gmsh's own format, read by ourselves: the library runs what it finds in some files.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <set>
#include <utility>

#include "common/base/input_error.h"
#include "common/files/surface_formats.h"
#include "precompute/intake/tet_file.h"

namespace archetide {
namespace {

/// A type of element: its number in Gmsh, its corners and nodes between them, and what it is.
struct ElementType {
  int number, dimension, nodes;
  const char* name;
};
constexpr std::array kTypes = {ElementType{1, 1, 2, "line"},
                               ElementType{2, 2, 3, "triangle"},
                               ElementType{3, 2, 4, "quadrangle"},
                               ElementType{4, 3, 4, "Tetrahedron 4"},
                               ElementType{5, 3, 8, "Hexahedron 8"},
                               ElementType{6, 3, 6, "Prism 6"},
                               ElementType{7, 3, 5, "Pyramid 5"},
                               ElementType{8, 1, 3, "line"},
                               ElementType{9, 2, 6, "triangle"},
                               ElementType{10, 2, 9, "quadrangle"},
                               ElementType{11, 3, 10, "Tetrahedron 10"},
                               ElementType{12, 3, 27, "Hexahedron 27"},
                               ElementType{13, 3, 18, "Prism 18"},
                               ElementType{14, 3, 14, "Pyramid 14"},
                               ElementType{15, 0, 1, "point"},
                               ElementType{16, 2, 8, "quadrangle"},
                               ElementType{17, 3, 20, "Hexahedron 20"},
                               ElementType{18, 3, 15, "Prism 15"},
                               ElementType{19, 3, 13, "Pyramid 13"},
                               ElementType{20, 2, 9, "triangle"},
                               ElementType{21, 2, 10, "triangle"},
                               ElementType{22, 2, 12, "triangle"},
                               ElementType{23, 2, 15, "triangle"},
                               ElementType{24, 2, 15, "triangle"},
                               ElementType{25, 2, 21, "triangle"},
                               ElementType{26, 1, 4, "line"},
                               ElementType{27, 1, 5, "line"},
                               ElementType{28, 1, 6, "line"},
                               ElementType{29, 3, 20, "Tetrahedron 20"},
                               ElementType{30, 3, 35, "Tetrahedron 35"},
                               ElementType{31, 3, 56, "Tetrahedron 56"},
                               ElementType{36, 2, 16, "quadrangle"},
                               ElementType{37, 2, 25, "quadrangle"},
                               ElementType{92, 3, 64, "Hexahedron 64"},
                               ElementType{93, 3, 125, "Hexahedron 125"}};
constexpr int kLinearTet = 4, kVolume = 3;

/// The bytes of the file from some place on: numbers as text, or in binary.
class Source {
 public:
  Source(const std::string& path, std::string_view bytes) : path_(path), rest_(bytes) {}

  bool binary = false, swapped = false;

  [[noreturn]] void refuse(const std::string& what, const std::string& hint = "") const {
    archetide::refuse(path_, 0, what, hint);
  }
  /// The rest of this line, and to the next one.
  std::string_view line() {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view text = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
  }
  bool at_end() const { return rest_.empty(); }
  std::string_view word() {
    constexpr std::string_view kBlank = " \t\r\n";
    const std::size_t start = rest_.find_first_not_of(kBlank);
    if (start == rest_.npos) refuse("the file is truncated");
    rest_.remove_prefix(start);
    const std::string_view found = rest_.substr(0, rest_.find_first_of(kBlank));
    rest_.remove_prefix(found.size());
    return found;
  }
  /// A whole number, in binary a signed or unsigned one of `bytes` bytes.
  std::int64_t whole(std::size_t bytes) {
    if (!binary) return whole_word();
    return bytes == 4 ? raw<std::int32_t>() : raw<std::int64_t>();
  }
  int int32() {
    const std::int64_t value = whole(4);
    if (value != static_cast<int>(value)) refuse(fmt::format("a number is too large: {}", value));
    return static_cast<int>(value);
  }
  /// How many of something follow: each takes a byte at least.
  std::int64_t count(std::size_t bytes) {
    const std::int64_t value = whole(bytes);
    if (value < 0 || static_cast<std::uint64_t>(value) > rest_.size())
      refuse(fmt::format("truncated: the file announces {} numbers that are not there", value));
    return value;
  }
  double real() {
    if (binary) return raw<double>();
    double value = 0.0;
    const std::string_view found = word();
    if (!parse_number(found, value))
      refuse("expected a number, found \"" + std::string(found.substr(0, 40)) + "\"");
    return value;
  }
  void skip_reals(int n) {
    for (int i = 0; i < n; ++i) real();
  }
  void skip_ints(std::int64_t n) {
    for (std::int64_t i = 0; i < n; ++i) whole(4);
  }
  /// Behind the next line that says `end`.
  void skip_to(const std::string& end) {
    while (!at_end())
      if (line() == end) return;
    refuse("truncated: there is no " + end);
  }

 private:
  std::int64_t whole_word() {
    const std::string_view found = word();
    std::int64_t value = 0;
    const auto [end, problem] = std::from_chars(found.data(), found.data() + found.size(), value);
    if (problem != std::errc() || end != found.data() + found.size())
      refuse("expected a whole number, found \"" + std::string(found.substr(0, 40)) + "\"");
    return value;
  }
  template <class T>
  T raw() {
    std::array<char, sizeof(T)> bytes{};
    if (rest_.size() < bytes.size()) refuse("the file is truncated");
    std::memcpy(bytes.data(), rest_.data(), bytes.size());
    rest_.remove_prefix(bytes.size());
    if (swapped) std::reverse(bytes.begin(), bytes.end());
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  const std::string& path_;
  std::string_view rest_;
};

/// Reads one file; each method reads a section.
class MshReader {
 public:
  MshReader(const std::string& path, std::string_view bytes) : in_(path, bytes) {}

  TetFile read() {
    if (in_.line() != "$MeshFormat")
      in_.refuse("this is no Gmsh mesh: it does not begin with $MeshFormat",
                 "save the mesh as MSH 2 or MSH 4; scripts are not run");
    read_format();
    while (!in_.at_end()) {
      const std::string section(in_.line());
      if (section.starts_with('$')) read_section(section.substr(1));
    }
    if (file_.corners.empty())
      in_.refuse("no tetrahedra in this file", "save the volume mesh, or give a surface file");
    make_groups();
    return std::move(file_);
  }

 private:
  void read_format() {
    version_ = in_.real();
    if (version_ != 2.0 && version_ != 2.1 && version_ != 2.2 && version_ != 4.0 && version_ != 4.1)
      in_.refuse("MSH of a version that is not known", "save it as MSH 2.2 or MSH 4.1");
    const int kind = in_.int32(), size = in_.int32();
    if (kind < 0 || kind > 1 || size != 8)
      in_.refuse("numbers of another kind than 8-byte ones", "save it as ASCII");
    in_.line();
    if (kind == 1) {
      in_.binary = true;
      const int one = in_.int32();
      if (one != 1 && one != 0x01000000) in_.refuse("its byte order is not known");
      in_.swapped = one != 1;
    }
    in_.skip_to("$EndMeshFormat");
  }

  void read_section(const std::string& name) {
    if (name == "PhysicalNames") {
      read_names();
    } else if (name == "Entities") {
      read_entities();
    } else if (name == "PartitionedEntities") {
      in_.refuse("the mesh is cut into partitions", "save it whole");
    } else if (name == "Nodes") {
      version_ < 4 ? read_nodes_2() : read_nodes_4();
    } else if (name == "Elements") {
      version_ < 4 ? read_elements_2() : read_elements_4();
    }
    in_.skip_to("$End" + name);
  }

  void read_names() {  // text in binary files too
    const bool binary = std::exchange(in_.binary, false);
    for (std::int64_t n = in_.count(4); n > 0; --n) {
      const int dimension = in_.int32(), number = in_.int32();
      const std::string_view rest = in_.line();
      const std::size_t open = rest.find('"'), close = rest.rfind('"');
      if (open == rest.npos || close == open) in_.refuse("a physical group has no name in quotes");
      if (dimension == kVolume) names_[number] = rest.substr(open + 1, close - open - 1);
    }
    in_.binary = binary;
  }

  void read_entities() {
    std::array<std::int64_t, 4> counts{};
    for (std::int64_t& n : counts) n = in_.count(8);
    for (int dimension = 0; dimension < 4; ++dimension)
      for (std::int64_t n = 0; n < counts[dimension]; ++n) read_entity(dimension);
  }
  void read_entity(int dimension) {
    const int tag = in_.int32();
    in_.skip_reals(dimension == 0 && version_ > 4.05 ? 3 : 6);  // a point, or a box
    for (std::int64_t n = in_.count(8); n > 0; --n) {
      const int physical = in_.int32();
      if (dimension == kVolume) physical_of_[tag].push_back(physical);
    }
    if (dimension > 0) in_.skip_ints(in_.count(8));  // what bounds it
  }

  void add_node(std::int64_t tag) {
    file_.tags.push_back(static_cast<std::size_t>(tag));
    for (int axis = 0; axis < 3; ++axis) file_.coordinates.push_back(in_.real());
  }
  void read_nodes_2() {
    for (std::int64_t n = text_count(); n > 0; --n) add_node(in_.whole(4));
  }
  void read_nodes_4() {
    const bool tags_first = version_ > 4.05;
    const std::int64_t blocks = in_.count(8);
    for (int i = tags_first ? 3 : 1; i > 0; --i) in_.whole(8);  // number, lowest, highest tag
    std::vector<std::int64_t> tags;
    for (std::int64_t b = 0; b < blocks; ++b) {
      const int first = in_.int32(), second = in_.int32(), parametric = in_.int32();
      const int dimension = tags_first ? first : second;
      const std::int64_t count = in_.count(8);
      if (dimension < 0 || dimension > kVolume) in_.refuse("a block of nodes of no dimension");
      tags.clear();
      for (std::int64_t n = 0; tags_first && n < count; ++n) tags.push_back(in_.whole(8));
      for (std::int64_t n = 0; n < count; ++n) {
        add_node(tags_first ? tags[n] : in_.whole(4));
        if (parametric) in_.skip_reals(dimension);
      }
    }
  }

  /// The count of a section of MSH 2: a line of text in binary files too.
  std::int64_t text_count() {
    const bool binary = std::exchange(in_.binary, false);
    const std::int64_t n = in_.count(8);
    in_.binary = binary;
    if (binary) in_.line();
    return n;
  }
  void read_elements_2() {
    std::int64_t left = text_count();
    while (left > 0) {
      // Text: a header each; binary: a header for many of a kind.
      if (!in_.binary) in_.int32();
      const int kind = in_.int32();
      const std::int64_t many = in_.binary ? in_.count(4) : 1;
      const std::int64_t tags = in_.count(4);
      if (many < 1 || many > left) in_.refuse("a block of elements is longer than announced");
      for (std::int64_t n = 0; n < many; ++n) {
        if (in_.binary) in_.int32();
        int physical = 0;
        for (std::int64_t t = 0; t < tags; ++t) {
          const int tag = in_.int32();
          if (t == 0) physical = tag;
        }
        add_element(kind, 4, physical == 0 ? std::vector<int>{} : std::vector{physical});
      }
      left -= many;
    }
  }
  void read_elements_4() {
    const bool wide = version_ > 4.05;
    const std::int64_t blocks = in_.count(8);
    for (int i = wide ? 3 : 1; i > 0; --i) in_.whole(8);
    for (std::int64_t b = 0; b < blocks; ++b) {
      const int first = in_.int32(), second = in_.int32(), kind = in_.int32();
      const int entity = wide ? second : first, dimension = wide ? first : second;
      const std::int64_t count = in_.count(8);
      const auto found = physical_of_.find(entity);
      const std::vector<int> groups =
          dimension == kVolume && found != physical_of_.end() ? found->second : std::vector<int>{};
      for (std::int64_t n = 0; n < count; ++n) {
        in_.whole(wide ? 8 : 4);
        add_element(kind, wide ? 8 : 4, groups);
      }
    }
  }

  /// Its nodes: a linear tet is kept, lower dimensions are left out, anything else is refused.
  void add_element(int kind, std::size_t bytes, const std::vector<int>& groups) {
    const auto* type = std::find_if(kTypes.begin(), kTypes.end(),
                                    [&](const ElementType& t) { return t.number == kind; });
    if (type == kTypes.end())
      in_.refuse(fmt::format("elements of type number {} are not supported", kind),
                 "export linear tetrahedra");
    if (type->dimension == kVolume && kind != kLinearTet)
      in_.refuse("elements of type " + std::string(type->name) + " are not supported",
                 "export linear tetrahedra");
    for (int n = 0; n < type->nodes; ++n) {
      const std::int64_t node = in_.whole(bytes);
      if (kind == kLinearTet) file_.corners.push_back(static_cast<std::size_t>(node));
    }
    if (kind != kLinearTet) return;
    const int tet = static_cast<int>(file_.corners.size() / 4) - 1;
    // A negative group is the same volume turned inside out.
    for (const int group : groups) members_[std::abs(std::int64_t{group})].insert(tet);
  }

  void make_groups() {
    for (const auto& [number, tets] : members_) {
      const auto name = names_.find(number);
      const bool named = name != names_.end() && !name->second.empty();
      file_.groups[named ? name->second : std::to_string(number)].assign(tets.begin(), tets.end());
    }
  }

  Source in_;
  double version_ = 0.0;
  TetFile file_;
  std::map<std::int64_t, std::string> names_;      // of physical volumes
  std::map<int, std::vector<int>> physical_of_;    // groups of each volume, MSH 4
  std::map<std::int64_t, std::set<int>> members_;  // tets of each group
};

}  // namespace

TetFile parse_msh(const std::string& path, std::string_view bytes) {
  return MshReader(path, bytes).read();
}

}  // namespace archetide
