#include "tests/support/skinned_bar.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "tests/support/dry_body.h"

namespace archetide {
namespace {

constexpr double kCell = 0.1;  // m, of the bar's surface and of its tets

double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// The bar's surface with vertices on the grid of its cells.
TriMesh bar_surface() {
  std::vector<int> node;
  const double w = SkinnedBar::kWidth;
  const TetMesh tets = box_tets(Vec3(SkinnedBar::kLength, w, w), Vec3i(6, 2, 2));
  return boundary_surface(tets, node);
}

}  // namespace

SkinnedBar skinned_bar(const std::vector<double>& ends, double blend, double overlap, int r,
                       double density, const Vec3& place, const Quat& rotation) {
  SkinnedBar bar;
  const std::size_t parts = ends.size() - 1;
  const double w = SkinnedBar::kWidth;
  auto skin = std::make_shared<Skin>();
  skin->name = "bar";
  skin->blend = blend;
  skin->surface = bar_surface();
  std::vector<std::shared_ptr<const Archetype>> archetypes;
  for (std::size_t p = 0; p < parts; ++p) {
    const double low = ends[p] - (p > 0 ? overlap : 0.0),
                 high = ends[p + 1] + (p + 1 < parts ? overlap : 0.0);
    const Vec3 lengths(high - low, w, w), centre(0.5 * (low + high), 0, 0);
    std::shared_ptr<Archetype> archetype;
    if (r == 0) {
      archetype =
          std::make_shared<Archetype>(*rigid_surface_archetype(box_surface(lengths, 1), density));
    } else {
      SyntheticOptions options;
      options.seed = static_cast<unsigned>(p) + 1;
      options.r = r;
      options.density = density;
      const int cells = static_cast<int>(std::lround(lengths[0] / kCell));
      bar.shapes.push_back(
          linear_alone(deformable_archetype(box_tets(lengths, Vec3i(cells, 2, 2)), options)));
      archetype = bar.shapes.back().archetype;
    }
    archetype->name = fmt::format("part{}", p);
    archetype->centre = centre;
    skin->parts.push_back(archetype->name);
    archetypes.push_back(archetype);
    bar.bodies.push_back(make_body(archetype, r));
    place_in_skin(place, rotation, Vec3::Zero(), Vec3::Zero(), bar.bodies.back());
    bar.skin.bodies.push_back(static_cast<int>(p));
  }
  // w_p = step(x - end_p) - step(x - end_{p+1}): smooth, and their sum is 1
  const auto passed = [&](double x, std::size_t end) {
    if (end == 0) return 1.0;
    if (end == parts) return 0.0;
    return smooth_step((x - ends[end]) / blend + 0.5);
  };
  for (const Vec3& x : skin->surface.vertices) {
    std::array<int, Skin::kMostParts> of{};
    std::array<double, Skin::kMostParts> weights{};
    for (std::size_t p = 0; p < parts; ++p) {
      of[p] = static_cast<int>(p);
      weights[p] = passed(x[0], p) - passed(x[0], p + 1);
    }
    skin->part_of.push_back(of);
    skin->weights.insert(skin->weights.end(), weights.begin(), weights.end());
  }
  validate(*skin);
  bar.skin.shape = bind_skin(skin, archetypes);
  return bar;
}

SkinnedBodies own_skin(const ReducedBody& body, int index) {
  auto skin = std::make_shared<Skin>();
  skin->surface = body.archetype->surface;
  for (Vec3& x : skin->surface.vertices) x += body.archetype->centre;
  skin->parts = {body.archetype->name};
  skin->part_of.assign(skin->surface.vertices.size(), {});
  for (std::size_t v = 0; v < skin->surface.vertices.size(); ++v)
    skin->weights.insert(skin->weights.end(), {1.0, 0.0, 0.0, 0.0});
  return {bind_skin(skin, {body.archetype}), {index}};
}

}  // namespace archetide
