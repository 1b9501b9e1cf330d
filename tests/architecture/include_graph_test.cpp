// Folders know each other in one direction only: the graph of the #include "..." lines against the
// allowed edges.

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "source_tree.h"

namespace {

using source_tree::Include;
using Graph = std::map<std::string, std::set<std::string>>;

/// Which folders a folder may include, besides itself. "runtime" and "precompute" are the files at
/// their roots; the rooms of precompute do not know its root, but for commands. A main.cpp is a
/// node of its own. Keys and TOML (common/params) are for those who read files that people write.
const Graph& allowed() {
  static const Graph graph = [] {
    const std::set<std::string> method = {
        "common/base",       "common/mesh",          "common/files",     "runtime/grid",
        "runtime/numerics",  "runtime/fluid",        "runtime/solid",    "runtime/contact",
        "runtime/cut_cells", "runtime/articulation", "runtime/pressure", "runtime/coupling"};
    std::set<std::string> users = method;
    users.insert("runtime");
    std::set<std::string> scene = users;
    scene.insert({"common/params", "common/archetype"});
    std::set<std::string> bench = users;
    bench.insert({"common/params", "runtime/scene", "runtime/output"});
    const std::set<std::string> bodies = {
        "common/base",      "common/params",     "common/mesh",       "common/files",
        "common/archetype", "precompute/base",   "precompute/intake", "precompute/meshing",
        "precompute/modal", "precompute/inspect"};
    std::set<std::string> body_commands = bodies;
    body_commands.insert("precompute");
    std::set<std::string> commands = bench;
    commands.insert({"common/archetype", "runtime/bench"});
    return Graph{
        {"common/base", {}},
        {"common/params", {"common/base"}},
        {"common/mesh", {"common/base"}},
        {"common/files", {"common/base", "common/mesh"}},
        {"common/archetype", {"common/base", "common/mesh", "common/files"}},
        {"assets/generate", {"common/base", "common/mesh"}},
        {"assets/generate/main.cpp", {"common/base", "common/mesh", "assets/generate"}},
        {"precompute/base", {"common/base", "common/mesh", "common/files"}},
        {"precompute/intake",
         {"common/base", "common/mesh", "common/files", "common/archetype", "precompute/base"}},
        {"precompute/meshing",
         {"common/base", "common/mesh", "precompute/base", "precompute/intake"}},
        {"precompute/modal", {"common/base", "common/mesh", "common/archetype", "precompute/base"}},
        {"precompute/inspect",
         {"common/base", "common/mesh", "common/files", "common/archetype", "precompute/base",
          "precompute/meshing"}},
        {"precompute", bodies},
        {"precompute/commands", body_commands},
        {"precompute/main.cpp", {"common/base", "precompute/commands"}},
        {"runtime/grid", {"common/base", "common/files"}},
        {"runtime/numerics", {"common/base", "runtime/grid"}},
        {"runtime/fluid", {"common/base", "runtime/grid", "runtime/numerics"}},
        {"runtime/solid", {"common/base", "common/mesh", "common/archetype"}},
        {"runtime/contact",
         {"common/base", "common/mesh", "common/archetype", "runtime/grid", "runtime/solid"}},
        {"runtime/articulation",
         {"common/base", "common/mesh", "common/archetype", "runtime/solid"}},
        {"runtime/cut_cells",
         {"common/base", "common/mesh", "runtime/grid", "runtime/numerics", "runtime/fluid",
          "runtime/solid", "runtime/articulation"}},
        {"runtime/pressure",
         {"common/base", "runtime/grid", "runtime/numerics", "runtime/fluid", "runtime/solid",
          "runtime/cut_cells"}},
        {"runtime/coupling",
         {"common/base", "common/mesh", "common/files", "runtime/grid", "runtime/numerics",
          "runtime/fluid", "runtime/solid", "runtime/contact", "runtime/articulation",
          "runtime/cut_cells", "runtime/pressure"}},
        {"runtime", method},
        {"runtime/scene", scene},
        {"runtime/output", users},
        {"runtime/bench", bench},
        {"runtime/commands", commands},
        {"runtime/main.cpp", {"common/base", "runtime/commands"}}};
  }();
  return graph;
}

/// The node of the graph that a file belongs to.
std::string folder_of(const std::string& file) {
  return file.ends_with("/main.cpp") ? file : file.substr(0, file.find_last_of('/'));
}

/// Every include that leaves its folder against the allowed edges.
std::vector<std::string> layering_faults(const std::vector<Include>& includes) {
  std::vector<std::string> faults;
  for (const Include& include : includes) {
    const std::string from = folder_of(include.file), to = folder_of(include.target);
    if (!include.quoted || from == to) continue;
    const auto edges = allowed().find(from);
    if (edges == allowed().end() || !edges->second.count(to))
      faults.push_back(include.file + " may not include " + include.target);
  }
  return faults;
}

Graph folder_graph(const std::vector<Include>& includes) {
  Graph graph;
  for (const Include& include : includes) {
    const std::string from = folder_of(include.file), to = folder_of(include.target);
    if (include.quoted && from != to) graph[from].insert(to);
  }
  return graph;
}

/// What is left of a graph after taking away, again and again, the nodes without edges: empty
/// without cycle.
std::set<std::string> nodes_on_cycles(Graph graph) {
  for (bool shrunk = true; shrunk;) {
    shrunk = false;
    for (auto& [node, edges] : graph)
      shrunk |= std::erase_if(edges, [&](const auto& to) { return !graph.count(to); }) > 0;
    shrunk |= std::erase_if(graph, [](const auto& entry) { return entry.second.empty(); }) > 0;
  }
  std::set<std::string> left;
  for (const auto& [node, edges] : graph) left.insert(node);
  return left;
}

}  // namespace

TEST(IncludeGraph, HasNoEdgeThatTheArchitectureLacks) {
  const auto includes = source_tree::includes_under(source_tree::kCode);
  ASSERT_GT(includes.size(), 100u);  // the tree was found
  EXPECT_TRUE(layering_faults(includes).empty()) << source_tree::joined(layering_faults(includes));
}

TEST(IncludeGraph, HasNoCycleBetweenFolders) {
  const auto cyclic =
      nodes_on_cycles(folder_graph(source_tree::includes_under(source_tree::kCode)));
  EXPECT_TRUE(cyclic.empty()) << source_tree::joined({cyclic.begin(), cyclic.end()});
}

TEST(IncludeGraph, NamesFilesFromTheTopFolder) {
  for (const Include& include : source_tree::includes_under(source_tree::kCode)) {
    if (!include.quoted) continue;
    EXPECT_TRUE(std::filesystem::is_regular_file(source_tree::root() / include.target))
        << include.file << " includes " << include.target;
  }
}

TEST(IncludeGraph, IsReadFromIncludeLinesOnly) {
  const auto includes = source_tree::includes_of("runtime/a.cpp",
                                                 "#include \"runtime/b.h\"\n  #include <vector>\n"
                                                 "// #include \"runtime/c.h\"\n");
  ASSERT_EQ(includes.size(), 2u);
  EXPECT_EQ(includes[0].target, "runtime/b.h");
  EXPECT_TRUE(includes[0].quoted);
  EXPECT_EQ(includes[1].target, "vector");
  EXPECT_FALSE(includes[1].quoted);
}

TEST(IncludeGraph, PlantedBadEdgesAreFound) {
  const std::vector<Include> bad = {{"runtime/fluid/a.cpp", "runtime/solid/b.h"},
                                    {"runtime/solid/a.h", "runtime/fluid/b.h"},
                                    {"runtime/coupling/a.cpp", "runtime/simulation.h"},
                                    {"runtime/pressure/a.cpp", "runtime/coupling/b.h"},
                                    {"runtime/cut_cells/a.h", "runtime/pressure/b.h"},
                                    {"runtime/output/a.cpp", "runtime/scene/b.h"},
                                    {"runtime/bench/a.cpp", "runtime/commands/command.h"},
                                    {"precompute/a.cpp", "runtime/grid/grid.h"},
                                    {"precompute/intake/a.cpp", "precompute/recipe.h"},
                                    {"precompute/a.cpp", "precompute/commands/command.h"},
                                    {"precompute/modal/a.cpp", "precompute/meshing/b.h"},
                                    {"common/files/a.cpp", "common/archetype/b.h"},
                                    {"runtime/fluid/a.cpp", "common/params/b.h"},
                                    {"runtime/scene/a.cpp", "precompute/recipe.h"},
                                    {"common/base/a.cpp", "precompute/recipe.h"},
                                    {"runtime/new_folder/a.cpp", "common/base/types.h"}};
  for (const Include& include : bad)
    EXPECT_EQ(layering_faults({include}).size(), 1u) << include.file << " -> " << include.target;
}

TEST(IncludeGraph, AllowedEdgesAreNotFaults) {
  const std::vector<Include> good = {{"runtime/scene/a.cpp", "runtime/simulation.h"},
                                     {"runtime/commands/a.cpp", "runtime/output/report.h"},
                                     {"runtime/main.cpp", "runtime/commands/command.h"},
                                     {"runtime/coupling/a.h", "runtime/fluid/b.h"},
                                     {"runtime/coupling/a.h", "runtime/pressure/b.h"},
                                     {"precompute/a.cpp", "precompute/modal/b.h"},
                                     {"precompute/a.cpp", "precompute/b.h"}};
  EXPECT_TRUE(layering_faults(good).empty()) << source_tree::joined(layering_faults(good));
}

TEST(IncludeGraph, PlantedCycleIsFound) {
  const Graph chain = {{"a", {"b"}}, {"b", {"c"}}};
  EXPECT_TRUE(nodes_on_cycles(chain).empty());
  Graph ring = chain;
  ring["c"].insert("a");
  EXPECT_EQ(nodes_on_cycles(ring), (std::set<std::string>{"a", "b", "c"}));
  EXPECT_TRUE(nodes_on_cycles(allowed()).empty());
}
