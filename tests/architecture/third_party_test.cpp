// A third-party library stays in the folder that needs it, behind headers that do not name it.

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "source_tree.h"

namespace {

using source_tree::Include;

/// Beginnings of third-party header names and the beginnings of the paths that may include them.
const std::map<std::string, std::vector<std::string>>& homes() {
  static const std::map<std::string, std::vector<std::string>> map = {
      {"CGAL/", {"precompute/intake/", "precompute/meshing/"}},
      {"gmsh", {"precompute/meshing/"}},
      {"arpack", {"precompute/modal/"}},
      {"suitesparse/", {"precompute/modal/"}},
      {"cholmod", {"precompute/modal/"}},
      {"umfpack", {"precompute/modal/"}},
      {"metis", {"precompute/modal/"}},
      {"cblas", {"precompute/modal/"}},
      {"lapack", {"precompute/modal/"}},
      {"hdf5", {"common/files/hdf5_file.cpp"}},
      {"H5", {"common/files/hdf5_file.cpp"}},
      {"openssl/", {"common/base/sha256.cpp"}},
      {"toml++", {"common/params/"}},
      {"embree", {"runtime/output/"}},
      {"png", {"common/files/image.cpp"}},
      {"tbb/", {"runtime/output/", "precompute/"}},
      {"CLI/", {"common/params/program.cpp", "precompute/commands/", "runtime/commands/"}},
      {"nlohmann/",
       {"common/params/", "common/archetype/archetype_json.cpp", "precompute/", "runtime/output/"}},
  };
  return map;
}

/// The paths where the header may be included, or null if it belongs to no third-party library
/// listed.
const std::vector<std::string>* homes_of(const std::string& header) {
  for (const auto& [prefix, paths] : homes())
    if (header.starts_with(prefix)) return &paths;
  return nullptr;
}

bool is_third_party(const Include& include) {
  return !include.quoted && homes_of(include.target) != nullptr;
}

/// Third-party includes outside their home.
std::vector<std::string> misplaced(const std::vector<Include>& includes) {
  std::vector<std::string> faults;
  for (const Include& include : includes) {
    if (!is_third_party(include)) continue;
    bool at_home = false;
    for (const std::string& path : *homes_of(include.target))
      at_home |= include.file.starts_with(path);
    if (!at_home) faults.push_back(include.file + " may not include <" + include.target + ">");
  }
  return faults;
}

std::string parent_of(const std::string& file) { return file.substr(0, file.find_last_of('/')); }

/// A header that includes a third-party one is private to the .cpp files of its folder: any other
/// file that includes it is a fault.
std::vector<std::string> leaking(const std::vector<Include>& includes) {
  std::set<std::string> private_headers;
  for (const Include& include : includes)
    if (is_third_party(include) && include.file.ends_with(".h"))
      private_headers.insert(include.file);
  std::vector<std::string> faults;
  for (const Include& include : includes)
    if (include.quoted && private_headers.count(include.target) &&
        (include.file.ends_with(".h") || parent_of(include.file) != parent_of(include.target)))
      faults.push_back(include.file + " may not include the private " + include.target);
  return faults;
}

}  // namespace

TEST(ThirdParty, LibrariesStayInTheirFolders) {
  const auto faults = misplaced(source_tree::includes_under(source_tree::kCode));
  EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
}

TEST(ThirdParty, HeadersThatNameLibrariesArePrivate) {
  const auto faults = leaking(source_tree::includes_under(source_tree::kCode));
  EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
}

TEST(ThirdParty, PlantedBadIncludesAreFound) {
  EXPECT_EQ(misplaced({{"runtime/solid/a.cpp", "CGAL/Surface_mesh.h", false}}).size(), 1u);
  EXPECT_EQ(misplaced({{"precompute/modal/a.cpp", "CGAL/Surface_mesh.h", false}}).size(), 1u);
  EXPECT_EQ(misplaced({{"precompute/a.cpp", "hdf5.h", false}}).size(), 1u);
  EXPECT_EQ(misplaced({{"runtime/scene/a.cpp", "toml++/toml.h", false}}).size(), 1u);
  EXPECT_EQ(misplaced({{"runtime/grid/a.h", "png.h", false}}).size(), 1u);
  EXPECT_TRUE(misplaced({{"precompute/meshing/a.cpp", "CGAL/Surface_mesh.h", false}}).empty());
  EXPECT_TRUE(misplaced({{"runtime/grid/a.h", "vector", false}}).empty());
}

TEST(ThirdParty, PlantedLeaksAreFound) {
  const std::string mesher = "precompute/meshing/mesher.h";
  const Include inside = {mesher, "CGAL/Surface_mesh.h", false};
  EXPECT_EQ(leaking({inside, {"precompute/meshing/a.h", mesher}}).size(), 1u);
  EXPECT_EQ(leaking({inside, {"precompute/intake/a.cpp", mesher}}).size(), 1u);
  EXPECT_TRUE(leaking({inside, {"precompute/meshing/a.cpp", mesher}}).empty());
}
