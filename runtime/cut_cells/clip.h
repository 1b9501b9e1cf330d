#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/types.h"
#include "runtime/grid/grid.h"

namespace archetide {

/// A convex polygon cut out of a triangle: corners in grid coordinates (cells) with the triangle's
/// barycentric weights, so that anything linear on the triangle is known at every corner.
struct ClipPolygon {
  static constexpr int kMaxCorners =
      12;  // 3 + one for each of the six cell planes + splits by the interface
  struct Corner {
    Vec3 x;     // grid coordinates, (world - origin) / dx
    Vec3 bary;  // weights of the triangle's vertices, sum 1
  };
  std::array<Corner, kMaxCorners> corner;
  int n = 0;

  void add(const Corner& c) { corner[n++] = c; }
};

/// The part of `in` with distance(corner) <= 0, for a distance that is linear along the edges.
template <class Distance>
void clip_polygon(const ClipPolygon& in, const Distance& distance, ClipPolygon& out) {
  out.n = 0;
  if (in.n == 0) return;
  double d_last = distance(in.corner[in.n - 1]);
  for (int a = 0; a < in.n; ++a) {
    const auto& last = in.corner[(a + in.n - 1) % in.n];
    const auto& next = in.corner[a];
    const double d_next = distance(next);
    if ((d_last <= 0.0) != (d_next <= 0.0)) {
      const double s = d_last / (d_last - d_next);
      out.add({last.x + s * (next.x - last.x), last.bary + s * (next.bary - last.bary)});
    }
    if (d_next <= 0.0) out.add(next);
    d_last = d_next;
  }
  if (out.n < 3) out.n = 0;
}

/// Splits the triangle x[0..2] (grid coordinates) along the cell planes and calls visit(cell,
/// polygon) for each piece. One that lies in a cell plane belongs to the cell that it faces: walls
/// flush with a side of the tank belong outside. Cells beyond the grid are clamped to the layer
/// just outside ([-1, n] along each axis), where only the sum of the pieces matters.
template <class Visit>
void for_each_piece(const Grid& g, const Vec3 x[3], const Visit& visit) {
  constexpr double kFlush = 1e-9;  // cells: round-off of poses
  int low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    const double lo = std::min({x[0][a], x[1][a], x[2][a]}),
                 hi = std::max({x[0][a], x[1][a], x[2][a]});
    const auto cell = [&](double s) {
      return static_cast<int>(
          std::floor(std::min(std::max(s, -1.0), static_cast<double>(g.size(a)))));
    };
    low[a] = cell(lo), high[a] = cell(hi);
    const double plane = std::round(lo);
    if (plane - lo < kFlush && std::abs(hi - plane) < kFlush && plane >= 0 && plane <= g.size(a)) {
      const int b = (a + 1) % 3, c = (a + 2) % 3;
      const Vec3 u = x[1] - x[0], v = x[2] - x[0];
      const bool down = u[b] * v[c] - u[c] * v[b] < 0.0;  // the normal along a
      low[a] = high[a] = static_cast<int>(plane) - down;
    }
  }
  ClipPolygon whole;
  for (int v = 0; v < 3; ++v) whole.add({x[v], Vec3::Unit(v)});

  // Slabs between cell planes; the outermost slab of the range takes all that lies beyond it. In
  // `room`, or `in` itself.
  const auto slab = [&](const ClipPolygon& in, int axis, int cell,
                        ClipPolygon& room) -> const ClipPolygon& {
    const bool cut_low = cell > low[axis], cut_high = cell < high[axis];
    const auto above = [&](const auto& c) { return cell - c.x[axis]; };
    const auto below = [&](const auto& c) { return c.x[axis] - (cell + 1); };
    if (cut_low && cut_high) {
      ClipPolygon half;
      clip_polygon(in, above, half);
      clip_polygon(half, below, room);
    } else if (cut_low) {
      clip_polygon(in, above, room);
    } else if (cut_high) {
      clip_polygon(in, below, room);
    } else {
      return in;
    }
    return room;
  };
  ClipPolygon room_x, room_xy, room_xyz;
  for (int i = low[0]; i <= high[0]; ++i) {
    const ClipPolygon& in_x = slab(whole, 0, i, room_x);
    if (in_x.n == 0) continue;
    for (int j = low[1]; j <= high[1]; ++j) {
      const ClipPolygon& in_xy = slab(in_x, 1, j, room_xy);
      if (in_xy.n == 0) continue;
      for (int k = low[2]; k <= high[2]; ++k) {
        const ClipPolygon& piece = slab(in_xy, 2, k, room_xyz);
        if (piece.n > 0) visit(Vec3i(i, j, k), piece);
      }
    }
  }
}

/// Vector area of the polygon, cells^2.
inline Vec3 vector_area(const ClipPolygon& p) {
  Vec3 sum = Vec3::Zero();
  for (int a = 1; a + 1 < p.n; ++a)
    sum += (p.corner[a].x - p.corner[0].x).cross(p.corner[a + 1].x - p.corner[0].x);
  return 0.5 * sum;
}

/// Barycentric weights of the polygon's centroid (the corner mean if its area vanishes).
inline Vec3 centroid_weights(const ClipPolygon& p) {
  const Vec3 normal = vector_area(p);
  Vec3 sum = Vec3::Zero(), mean = Vec3::Zero();
  double area = 0.0;
  for (int a = 1; a + 1 < p.n; ++a) {
    const double part =
        normal.dot((p.corner[a].x - p.corner[0].x).cross(p.corner[a + 1].x - p.corner[0].x));
    sum += part / 3.0 * (p.corner[0].bary + p.corner[a].bary + p.corner[a + 1].bary);
    area += part;
  }
  if (area > 0.0) return sum / area;
  for (int a = 0; a < p.n; ++a) mean += p.corner[a].bary;
  return mean / p.n;
}

/// Mean over the polygon of the squares of its coordinates about `centre`, cells^2 (that of the
/// corners if its area vanishes).
inline Vec3 mean_squares(const ClipPolygon& p, const Vec3& centre) {
  const Vec3 normal = vector_area(p), first = p.corner[0].x - centre;
  Vec3 sum = Vec3::Zero(), mean = Vec3::Zero();
  double area = 0.0;
  for (int a = 1; a + 1 < p.n; ++a) {
    const Vec3 x = p.corner[a].x - centre, y = p.corner[a + 1].x - centre, all = first + x + y;
    const double part = normal.dot((x - first).cross(y - first));
    sum +=
        part / 12.0 *
        (first.cwiseProduct(first) + x.cwiseProduct(x) + y.cwiseProduct(y) + all.cwiseProduct(all));
    area += part;
  }
  if (area > 0.0) return sum / area;
  for (int a = 0; a < p.n; ++a) mean += (p.corner[a].x - centre).cwiseAbs2();
  return mean / p.n;
}

}  // namespace archetide
