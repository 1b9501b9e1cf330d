#include "runtime/scene/initial_water.h"

#include <algorithm>
#include <cmath>

#include "runtime/scene/closed_mesh.h"

namespace archetide {
namespace {

constexpr int kBand = 3;  // cells around a mesh in which its distance is exact

double box_distance(const BoxSpec& box, const Vec3& x) {
  const Vec3 outside = (box.low - x).cwiseMax(x - box.high);
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

double ball_distance(const SphereSpec& ball, const Vec3& x) {
  return (x - ball.centre).norm() - ball.radius;
}

// Signed distance at x to everything but the mesh; `far` where there is nothing.
double shape_distance(const FluidSpec& fluid, const Vec3& x, double far) {
  double phi = far;
  const WaterSpec& water = fluid.water;
  if (water.level && *water.level > 0.0) phi = x[2] - (fluid.origin[2] + *water.level);
  for (const BoxSpec& box : water.boxes) phi = std::min(phi, box_distance(box, x));
  for (const SphereSpec& ball : water.spheres) phi = std::min(phi, ball_distance(ball, x));
  return phi;
}

// Velocity of the water at x, m/s: in boxes and balls that have one their own, of the last where
// they overlap; in the air that of the nearest water, which the first step continues anyway.
Vec3 velocity_at(const FluidSpec& fluid, const Vec3& x) {
  const WaterSpec& water = fluid.water;
  double at_rest = water.full ? -INFINITY : INFINITY, nearest = INFINITY;
  if (!water.mesh.empty()) at_rest = fluid.cell;  // its distance is not known here
  if (water.level) at_rest = std::min(at_rest, x[2] - (fluid.origin[2] + *water.level));
  Vec3 velocity = fluid.velocity, beside = fluid.velocity;
  bool inside = false;
  const auto look = [&](const auto& shape, double distance) {
    if (!shape.velocity) {
      at_rest = std::min(at_rest, distance);
    } else if (distance <= 0.0) {
      velocity = *shape.velocity, inside = true;
    } else if (distance < nearest) {
      beside = *shape.velocity, nearest = distance;
    }
  };
  for (const WaterBox& box : water.boxes) look(box, box_distance(box, x));
  for (const WaterBall& ball : water.spheres) look(ball, ball_distance(ball, x));
  if (inside || at_rest <= 0.0) return velocity;
  return nearest < at_rest ? beside : fluid.velocity;
}

// Nothing where all of it is at rest.
void set_velocity(const Grid& g, const FluidSpec& fluid, MacField& u) {
  const WaterSpec& water = fluid.water;
  const auto moves = [](const auto& shape) { return shape.velocity && !shape.velocity->isZero(0); };
  if (fluid.velocity.isZero(0) && std::ranges::none_of(water.boxes, moves) &&
      std::ranges::none_of(water.spheres, moves))
    return;
  u.resize(g, 0.0);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < u[a].nz(); ++k)
      for (int j = 0; j < u[a].ny(); ++j)
        for (int i = 0; i < u[a].nx(); ++i)
          u[a](i, j, k) = velocity_at(fluid, g.face_centre(a, i, j, k))[a];
}

// Unsigned distance within the band around one triangle: far <- min(far, distance).
void splat_triangle(const Grid& g, const Vec3 (&corners)[3], Array3<double>& distance) {
  const Vec3 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
  const Vec3 high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  int first[3], last[3];
  for (int a = 0; a < 3; ++a) {
    const double from = (low[a] - g.origin[a]) / g.dx - 0.5 - kBand;
    const double to = (high[a] - g.origin[a]) / g.dx - 0.5 + kBand;
    first[a] = static_cast<int>(std::clamp(std::ceil(from), 0.0, double(g.size(a))));
    last[a] = static_cast<int>(std::clamp(std::floor(to), -1.0, double(g.size(a) - 1)));
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      for (int i = first[0]; i <= last[0]; ++i) {
        const double d =
            distance_to_triangle(g.cell_centre(i, j, k), corners[0], corners[1], corners[2]);
        distance(i, j, k) = std::min(distance(i, j, k), d);
      }
    }
  }
}

// Twice the signed area of the triangle o, a, b in the yz plane.
double area_yz(const Vec3& o, const Vec3& a, const Vec3& b) {
  return (a[1] - o[1]) * (b[2] - o[2]) - (a[2] - o[2]) * (b[1] - o[1]);
}

// Adds the crossing of the line (y, z) along x with each triangle to its row of cells: +1 or -1 by
// orientation, so that the sum over x' > x is the winding number. Lines are shifted by an
// irrational part of a cell, as a line through an edge would be counted twice or not at all.
void count_crossings(const Grid& g, const Vec3 (&corners)[3],
                     std::vector<std::vector<std::pair<double, int>>>& rows) {
  const Vec3 shift = g.dx * Vec3(0.0, 1.0e-7 * std::sqrt(2.0), 1.0e-7 * std::sqrt(3.0));
  const Vec3 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
  const Vec3 high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  const auto first = [&](int a) {
    return static_cast<int>(
        std::clamp((low[a] - g.origin[a]) / g.dx - 1.0, 0.0, double(g.size(a))));
  };
  const auto last = [&](int a) {
    return static_cast<int>(
        std::clamp((high[a] - g.origin[a]) / g.dx + 1.0, 0.0, double(g.size(a))));
  };
  const double whole = area_yz(corners[0], corners[1], corners[2]);
  if (whole == 0.0) return;
  for (int k = first(2); k < last(2); ++k) {
    for (int j = first(1); j < last(1); ++j) {
      const Vec3 o = g.cell_centre(0, j, k) + shift;
      const double a = area_yz(o, corners[1], corners[2]) / whole;
      const double b = area_yz(o, corners[2], corners[0]) / whole;
      const double c = 1.0 - a - b;
      if (a < 0.0 || b < 0.0 || c < 0.0) continue;
      const double x = a * corners[0][0] + b * corners[1][0] + c * corners[2][0];
      rows[j + static_cast<std::size_t>(g.ny) * k].emplace_back(x, whole > 0.0 ? 1 : -1);
    }
  }
}

}  // namespace

Grid tank_grid(const FluidSpec& fluid) {
  return {fluid.cells[0], fluid.cells[1], fluid.cells[2], fluid.cell, fluid.origin};
}

bool has_water(const WaterSpec& water) {
  return water.full || water.level.value_or(0.0) > 0.0 || !water.boxes.empty() ||
         !water.spheres.empty() || !water.mesh.empty();
}

double highest_water(const FluidSpec& fluid) {
  const WaterSpec& water = fluid.water;
  if (water.full) return fluid.high()[2];
  double top = fluid.origin[2] + water.level.value_or(0.0);
  for (const BoxSpec& box : water.boxes) top = std::max(top, box.high[2]);
  for (const SphereSpec& ball : water.spheres) top = std::max(top, ball.centre[2] + ball.radius);
  return water.mesh.empty() ? std::min(top, fluid.high()[2]) : fluid.high()[2];
}

double water_distance(const FluidSpec& fluid, const Vec3& x) {
  if (fluid.water.full) return box_distance({fluid.origin, fluid.high()}, x);
  return shape_distance(fluid, x, INFINITY);
}

FluidState initial_fluid(const std::optional<FluidSpec>& fluid) {
  FluidState state;
  if (!fluid) return state;
  const Grid g = tank_grid(*fluid);
  const double far = (g.high() - g.low()).norm();
  state.phi.resize(g.nx, g.ny, g.nz, -far);
  set_velocity(g, *fluid, state.u);
  if (fluid->water.full) return state;
  for (int k = 0; k < g.nz; ++k) {
    for (int j = 0; j < g.ny; ++j) {
      for (int i = 0; i < g.nx; ++i) {
        state.phi(i, j, k) = shape_distance(*fluid, g.cell_centre(i, j, k), far);
      }
    }
  }
  if (!fluid->water.mesh.empty()) add_mesh(g, read_closed_mesh(fluid->water.mesh), state.phi);
  return state;
}

void add_mesh(const Grid& g, const TriMesh& mesh, Array3<double>& phi) {
  Array3<double> distance(g.nx, g.ny, g.nz, kBand * g.dx);
  std::vector<std::vector<std::pair<double, int>>> rows(static_cast<std::size_t>(g.ny) * g.nz);
  for (const Vec3i& t : mesh.triangles) {
    const Vec3 corners[3] = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    splat_triangle(g, corners, distance);
    count_crossings(g, corners, rows);
  }
  for (int k = 0; k < g.nz; ++k) {
    for (int j = 0; j < g.ny; ++j) {
      const auto& row = rows[j + static_cast<std::size_t>(g.ny) * k];
      for (int i = 0; i < g.nx; ++i) {
        const double x = g.cell_centre(i, j, k)[0];
        int winding = 0;
        for (const auto& [crossing, sign] : row) winding += crossing > x ? sign : 0;
        const double d = distance(i, j, k);
        phi(i, j, k) = std::min(phi(i, j, k), winding > 0 ? -d : d);
      }
    }
  }
}

double distance_to_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto to_segment = [&x](const Vec3& p, const Vec3& q) {
    const Vec3 edge = q - p;
    const double length2 = edge.squaredNorm();
    const double s = length2 > 0.0 ? std::clamp((x - p).dot(edge) / length2, 0.0, 1.0) : 0.0;
    return (x - p - s * edge).norm();
  };
  const Vec3 normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  const auto inside = [&](const Vec3& p, const Vec3& q) {
    return (q - p).cross(x - p).dot(normal) >= 0.0;
  };
  if (area2 > 0.0 && inside(a, b) && inside(b, c) && inside(c, a)) {
    return std::abs((x - a).dot(normal)) / std::sqrt(area2);
  }
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

}  // namespace archetide
