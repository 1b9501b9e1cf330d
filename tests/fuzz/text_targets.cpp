#include <algorithm>
#include <string>

#include "common/files/surface_io.h"
#include "common/params/param_tree.h"
#include "precompute/intake/tet_io.h"
#include "precompute/recipe.h"
#include "runtime/scene/parse_scene.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/refusal.h"

namespace archetide {
namespace {

void demand(bool holds, const char* what) {
  if (!holds) throw Finding(what);
}

/// What is written of a file says what the file says.
void fuzz_params(std::string_view bytes) {
  accepts([&] {
    const std::string text = to_toml(parse_param_text(std::string(bytes), "any.toml"));
    std::string again;
    demand(accepts([&] { again = to_toml(parse_param_text(text, "written.toml")); }),
           "what is written cannot be read");
    demand(text == again, "what is written is not what was read");
  });
}

void fuzz_scene(std::string_view bytes) {
  accepts([&] { parse_scene_text(std::string(bytes), "any.scene.toml"); });
}

/// `--set` words, one a line, on a small scene.
void fuzz_set(std::string_view bytes) {
  const std::string scene =
      "schema = 1\ntime = { end = 1.0, fps = 24 }\n[fluid]\ngrid = [8, 8, 8]\ncell = 0.1\n"
      "[[body]]\narchetype = \"a\"\nposition = [0.4, 0.4, 0.4]\n";
  std::vector<std::string> words(1);
  for (const char c : bytes) {
    if (c == '\n')
      words.emplace_back();
    else
      words.back() += c;
  }
  accepts([&] { parse_scene_text(scene, "any.scene.toml", words); });
}

void fuzz_body(std::string_view bytes) {
  accepts([&] { parse_recipe(std::string(bytes), "any.body.toml"); });
}

void fuzz_surface(const char* path, std::string_view bytes) {
  accepts([&] {
    const SurfaceFile file = parse_surface(path, bytes);
    demand(!file.mesh.triangles.empty(), "a surface without triangles");
    demand(file.face_numbers.size() == file.mesh.triangles.size(), "triangles without a number");
    const int n = static_cast<int>(file.mesh.vertices.size());
    for (const Vec3i& t : file.mesh.triangles)
      demand(t.minCoeff() >= 0 && t.maxCoeff() < n, "a corner that is no vertex");
  });
}

void fuzz_tets(const char* path, std::string_view bytes) {
  accepts([&] {
    TetGroups groups;
    const TetMesh mesh = parse_tets(path, bytes, 1.0, &groups);
    demand(!mesh.tets.empty(), "a mesh without tets");
    for (const auto& tet : mesh.tets)
      for (const int node : tet)
        demand(node >= 0 && node < static_cast<int>(mesh.nodes.size()), "a corner that is no node");
    for (const Vec3& x : mesh.nodes) demand(x.allFinite(), "a node that is nowhere");
    for (const auto& [name, members] : groups)
      for (const int tet : members)
        demand(tet >= 0 && tet < static_cast<int>(mesh.tets.size()), "a group of no tets");
  });
}

}  // namespace

const std::vector<FuzzTarget>& text_targets() {
  static const std::vector<FuzzTarget> targets = {
      {"params", fuzz_params},
      {"scene", fuzz_scene},
      {"set", fuzz_set},
      {"body", fuzz_body},
      {"obj", [](std::string_view bytes) { fuzz_surface("any.obj", bytes); }},
      {"off", [](std::string_view bytes) { fuzz_surface("any.off", bytes); }},
      {"ply", [](std::string_view bytes) { fuzz_surface("any.ply", bytes); }},
      {"stl", [](std::string_view bytes) { fuzz_surface("any.stl", bytes); }},
      {"vtu", [](std::string_view bytes) { fuzz_tets("any.vtu", bytes); }},
      {"msh", [](std::string_view bytes) { fuzz_tets("any.msh", bytes); }},
      {"medit", [](std::string_view bytes) { fuzz_tets("any.mesh", bytes); }}};
  return targets;
}

const FuzzTarget* find_fuzz_target(std::string_view name) {
  for (const auto* list : {&text_targets(), &stored_targets()})
    for (const FuzzTarget& target : *list)
      if (target.name == name) return &target;
  return nullptr;
}

}  // namespace archetide
