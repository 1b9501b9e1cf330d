// Medit's text format.

#include <string>

#include "common/files/surface_formats.h"
#include "precompute/intake/tet_file.h"

namespace archetide {
namespace {

/// The words of the file; a '#' ends a line.
class Words {
 public:
  Words(const std::string& path, std::string_view bytes) : path_(path), scan_(bytes) {}

  /// The next one; false at the end.
  bool next() {
    word_ = scan_.word();
    while (word_.empty()) {
      if (!scan_.next_line()) return false;
      word_ = scan_.word();
    }
    return true;
  }
  std::string_view word() const { return word_; }

  double number() {
    demand();
    double value = 0.0;
    if (parse_number(word_, value)) return value;
    refuse("expected a number, found \"" + std::string(word_.substr(0, 40)) + "\"");
  }
  int whole() {
    demand();
    int value = 0;
    if (parse_integer(word_, value)) return value;
    refuse("expected a whole number, found \"" + std::string(word_.substr(0, 40)) + "\"");
  }
  [[noreturn]] void refuse(const std::string& what, const std::string& hint = "") const {
    archetide::refuse(path_, scan_.line(), what, hint);
  }

 private:
  void demand() {
    if (!next()) refuse("the file is truncated");
  }

  const std::string& path_;
  TextScanner scan_;
  std::string_view word_;
};

void read_vertices(Words& in, TetFile& file) {
  const int n = in.whole();
  for (int v = 1; v <= n; ++v) {
    file.tags.push_back(static_cast<std::size_t>(v));
    for (int axis = 0; axis < 3; ++axis) file.coordinates.push_back(in.number());
    in.number();  // reference
  }
}

void read_tetrahedra(Words& in, TetFile& file) {
  const int n = in.whole();
  for (int t = 0; t < n; ++t) {
    for (int k = 0; k < 4; ++k) file.corners.push_back(static_cast<std::size_t>(in.whole()));
    in.number();  // reference
  }
}

void demand_dimension(Words& in) {
  if (in.whole() != 3) in.refuse("the mesh is not in three dimensions");
}

}  // namespace

TetFile parse_medit(const std::string& path, std::string_view bytes) {
  Words in(path, bytes);
  if (!in.next() || in.word() != "MeshVersionFormatted")
    in.refuse("this is no Medit mesh: it does not begin with MeshVersionFormatted");
  in.whole();
  TetFile file;
  while (in.next() && in.word() != "End") {
    if (in.word() == "Dimension") demand_dimension(in);
    if (in.word() == "Vertices") read_vertices(in, file);
    if (in.word() == "Tetrahedra") read_tetrahedra(in, file);
    for (const char* other : {"Hexahedra", "Prisms", "Pyramids"}) {
      if (in.word() == other && in.whole() > 0)
        in.refuse(std::string("elements of type ") + other + " are not supported",
                  "export linear tetrahedra");
    }
    // All other sections are numbers, which are passed by.
  }
  if (file.corners.empty()) in.refuse("no tetrahedra in this file", "save the volume mesh");
  return file;
}

}  // namespace archetide
