#include "runtime/coupling/displaced_push.h"

#include <algorithm>

#include "runtime/cut_cells/clip.h"

namespace archetide {

namespace {

// Beyond this way, cells along an axis, the push is that of other water, and the debt falls as
// 1 / way. (A light body struck by a stream moved by two cells in half a step: it was thrown off at
// 36 times the speed of the stream. From half a cell on a ball rising at CFL 1 would lose energy.)
constexpr double kFarthestDebt = 1.0;

// A side that water follows as the body leaves it: near the surface that water comes from elsewhere
// as soon as the way is more than this part of the depth [D61].
constexpr double kFollowedDebt = 0.1;

double share_of_way(double cells, double farthest) {
  const double beyond = cells / farthest;
  return beyond > 1.0 ? 1.0 / (beyond * beyond) : 1.0;
}

std::vector<Mat3> push_on_some(const Grid& g, const WetSurface& s, const std::vector<Vec3>& before,
                               const FreeSurface& water, double density, double dt,
                               std::span<const Vec3i> triangles) {
  std::vector<Mat3> impulses;
  impulses.reserve(triangles.size());
  const double scale = density * dt / water.push_seconds;
  for (const Vec3i& t : triangles) {
    Vec3 x[3], way[3], middle[3];
    bool moved = false;
    for (int v = 0; v < 3; ++v) {
      const Vec3 &now = (*s.points)[t[v]], &then = before[t[v]];
      x[v] = (now - g.origin) / g.dx, way[v] = now - then, middle[v] = 0.5 * (now + then);
      moved = moved || !way[v].isZero(0.0);
    }
    Mat3& impulse = impulses.emplace_back(Mat3::Zero());
    if (!moved) continue;
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      if (!water.phi->contains(cell[0], cell[1], cell[2])) return;
      const Vec3 w = centroid_weights(piece);
      const auto at_centroid = [&](const Vec3 corner[3]) {
        return Vec3(w[0] * corner[0] + w[1] * corner[1] + w[2] * corner[2]);
      };
      const Vec3 place = at_centroid(middle);
      const double depth = 0.5 - interpolate(g, *water.phi, place) / g.dx;
      if (depth <= 0.0) return;
      const Vec3 swept = at_centroid(way);
      const double volume = g.dx * g.dx * swept.dot(vector_area(piece));
      const double farthest =
          volume < 0.0 ? std::min(kFarthestDebt, kFollowedDebt * depth) : kFarthestDebt;
      const double share =
          std::min(depth, 1.0) * share_of_way(swept.cwiseAbs().maxCoeff() / g.dx, farthest);
      const Vec3 load = (scale * share * volume) * interpolate(g, *water.push, place);
      impulse += load * w.transpose();
    });
  }
  return impulses;
}

}  // namespace

std::vector<VecX> displaced_push(const Grid& g, const WetSurface& s,
                                 const std::vector<Vec3>& before, const FreeSurface& water,
                                 double density, double dt) {
  return generalised_forces(s, parts_of(*s.triangles, [&](std::span<const Vec3i> some) {
                              return push_on_some(g, s, before, water, density, dt, some);
                            }));
}

}  // namespace archetide
