#include "runtime/scene/check_placement.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "runtime/contact/overlap.h"

namespace archetide {
namespace {

using Pair = std::pair<int, int>;

class Placement {
 public:
  Placement(const SceneSpec& scene, const BuiltScene& built) : scene_(scene), built_(built) {
    for (const Joint& joint : built.joints) tie(joint.a, joint.b);
    for (const SkinnedBodies& skin : built.skins)
      for (const int a : skin.bodies)
        for (const int b : skin.bodies) tie(a, b);
  }

  std::vector<Diagnostic> complaints() const {
    std::vector<Diagnostic> bad;
    const int count = static_cast<int>(built_.bodies.size());
    for (int b = 0; b < count; ++b) {
      if (scene_.fluid && !is_told(b)) add_wall(b, bad);
      for (int a = 0; a < b; ++a) add_overlap(a, b, bad);
    }
    return bad;
  }

 private:
  void tie(int a, int b) { tied_.insert(std::minmax(a, b)); }

  const ReducedBody& body(int b) const { return built_.bodies[static_cast<std::size_t>(b)]; }

  /// A [[static]] that moves: it goes through walls and others of its kind.
  bool is_told(int b) const {
    return std::any_of(built_.prescribed.begin(), built_.prescribed.end(),
                       [&](const PrescribedBody& told) { return told.body == b; });
  }

  std::string name(int b) const {
    return fmt::format("body {} ({})", b + 1, built_.body_names[static_cast<std::size_t>(b)]);
  }

  SourceLocation where(int b) const {
    const auto n = static_cast<std::size_t>(b);
    return n < scene_.bodies.size() ? scene_.bodies[n].where : SourceLocation{scene_.file, 0, 0};
  }

  /// Beyond a closed side by more than a cell.
  void add_wall(int b, std::vector<Diagnostic>& bad) const {
    const Grid& g = built_.options.grid;
    Vec3 low = Vec3::Constant(INFINITY), high = -low;
    for (const Vec3& x : body(b).archetype->surface.vertices) {
      const Vec3 at = body(b).position + body(b).rotation * x;
      low = low.cwiseMin(at), high = high.cwiseMax(at);
    }
    const char* const sides[] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
    for (int side = 0; side < 6; ++side) {
      const int axis = side / 2;
      const double beyond = side % 2 ? high[axis] - g.high()[axis] : g.low()[axis] - low[axis];
      if (built_.options.open_side[side] || beyond <= g.dx) continue;
      bad.push_back({where(b),
                     fmt::format("{} reaches {:f} m beyond the closed side {} of the tank", name(b),
                                 beyond, sides[side]),
                     "move it into the tank, or open that side (fluid.walls)"});
      return;
    }
  }

  void add_overlap(int a, int b, std::vector<Diagnostic>& bad) const {
    const auto release = [&](int n) { return built_.release[static_cast<std::size_t>(n)]; };
    if (release(a) > 0.0 || release(b) > 0.0 || tied_.count(std::minmax(a, b))) return;
    if (is_told(a) && is_told(b)) return;
    const double cell = scene_.fluid ? built_.options.grid.dx : INFINITY;
    const double most = deepest_start(body(a), body(b), cell);
    const double found = overlap_depth(body(a), body(b));
    if (found <= most) return;
    bad.push_back({where(b),
                   fmt::format("{} begins {:f} m deep inside {}", name(b), found, name(a)),
                   "move them apart, or join them ([[joint]])"});
  }

  const SceneSpec& scene_;
  const BuiltScene& built_;
  std::set<Pair> tied_;
};

}  // namespace

std::vector<Diagnostic> misplaced_bodies(const SceneSpec& scene, const BuiltScene& built) {
  return Placement(scene, built).complaints();
}

}  // namespace archetide
