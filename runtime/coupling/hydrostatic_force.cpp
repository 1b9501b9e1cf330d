#include "runtime/coupling/hydrostatic_force.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/cut_cells/clip.h"

namespace archetide {
namespace {

// Accumulates -integral h v . n for polygons of one triangle, v linear on it.
class TriangleForce {
 public:
  TriangleForce(const WetSurface& s, const Vec3i& t) {
    for (int v = 0; v < 3; ++v) corner_[v] = (*s.points)[t[v]];
    normal_ = (corner_[1] - corner_[0]).cross(corner_[2] - corner_[0]).stableNormalized();
  }
  Vec3 at(const Vec3& bary) const {
    return bary[0] * corner_[0] + bary[1] * corner_[1] + bary[2] * corner_[2];
  }

  // Triangle of corners with weights w[0..2] and values h[0..2]: the product of two linear
  // functions integrates to area / 12 (sum h_a v_a + sum h sum v).
  void add(const Vec3 w[3], const double h[3]) {
    const Vec3 x[3] = {at(w[0]), at(w[1]), at(w[2])};
    const double area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).dot(normal_);
    const double h_sum = h[0] + h[1] + h[2];
    for (int a = 0; a < 3; ++a) mean_weight_ += area / 12.0 * (h[a] + h_sum) * w[a];
  }
  /// On the corners, N, one a column.
  Mat3 force() const { return -normal_ * mean_weight_.transpose(); }

 private:
  Vec3 corner_[3], normal_;
  Vec3 mean_weight_ = Vec3::Zero();  // integral of h times the weights of the corners
};

// What the surface carries beside p' (rho g . (x - x_ref) under water, the interface's pressure
// above it where the cell holds an unknown, and what lies under the interface where it does not),
// or rho g . (x - x_ref) wherever it is wet.
enum class Loads { kBesideDynamic, kStill };

struct CellCorners {
  Vec3 x[3];  // grid coordinates
  CellCorners(const Grid& g, const WetSurface& s, const Vec3i& t) {
    for (int v = 0; v < 3; ++v) x[v] = ((*s.points)[t[v]] - g.origin) / g.dx;
  }
};

// Whether still water is where a cell outside the tank lies.
bool is_water_beyond(const Grid& g, const Sides& water_beyond, const Vec3i& cell) {
  for (int a = 0; a < 3; ++a) {
    if (cell[a] < 0 && !water_beyond[2 * a]) return false;
    if (cell[a] >= g.size(a) && !water_beyond[2 * a + 1]) return false;
  }
  return true;
}

// A triangle well below the surface, all of whose cells carry an unknown or lie inside solids.
bool is_deep(const Grid& g, const PressureSystem& water, const CellCorners& c) {
  const double deep = -2.0 * g.dx;
  const Vec3 lo = c.x[0].cwiseMin(c.x[1]).cwiseMin(c.x[2]),
             hi = c.x[0].cwiseMax(c.x[1]).cwiseMax(c.x[2]);
  if ((lo.array() < 0.0).any() || hi[0] >= g.nx || hi[1] >= g.ny || hi[2] >= g.nz) return false;
  const Vec3i a = lo.cast<int>(), b = hi.cast<int>();
  for (int k = a[2]; k <= b[2]; ++k)
    for (int j = a[1]; j <= b[1]; ++j)
      for (int i = a[0]; i <= b[0]; ++i)
        if ((*water.surface.phi)(i, j, k) > deep ||
            water.matrix.kind(i, j, k) == CellKind::kDirichlet)
          return false;
  return true;
}

bool all_deep(const Grid& g, const WetSurface& s, const PressureSystem& water) {
  return std::all_of(s.triangles->begin(), s.triangles->end(),
                     [&](const Vec3i& t) { return is_deep(g, water, CellCorners(g, s, t)); });
}

// The polygon as triangles about its middle, so that the sum does not depend on the corner that
// comes first where h is not linear.
template <class H>
void add_polygon(const ClipPolygon& part, const H& h_at, TriangleForce& triangle) {
  if (part.n < 3) return;
  Vec3 middle = Vec3::Zero();
  for (int a = 0; a < part.n; ++a) middle += part.corner[a].bary / part.n;
  const double h_middle = h_at(middle);
  for (int a = 0; a < part.n; ++a) {
    const Vec3 w[3] = {middle, part.corner[a].bary, part.corner[(a + 1) % part.n].bary};
    const double h[3] = {h_middle, h_at(w[1]), h_at(w[2])};
    triangle.add(w, h);
  }
}

std::vector<Mat3> forces_on_some(const Grid& g, const WetSurface& s,
                                 const std::vector<Vec3>& read_points, const PressureSystem& water,
                                 Loads loads, std::span<const Vec3i> triangles) {
  const Hydrostatics& hydro = water.hydrostatics;
  const FreeSurface& free = water.surface;
  std::vector<Mat3> forces;
  forces.reserve(triangles.size());
  const Array3<CellKind>& kind = water.matrix.kind;
  const Vec3 rho_g = hydro.density * hydro.gravity;
  const auto in_grid = [&](const Vec3i& c) { return kind.contains(c[0], c[1], c[2]); };

  for (const Vec3i& t : triangles) {
    const CellCorners corners(g, s, t);
    const bool deep = is_deep(g, water, corners);
    TriangleForce triangle(s, t);
    const Vec3 read[3] = {read_points[t[0]], read_points[t[1]], read_points[t[2]]};
    const auto read_at = [&](const Vec3& w) {
      return Vec3(w[0] * read[0] + w[1] * read[1] + w[2] * read[2]);
    };
    if (deep) {
      const Vec3 w[3] = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
      const double h[3] = {rho_g.dot(read[0] - hydro.reference),
                           rho_g.dot(read[1] - hydro.reference),
                           rho_g.dot(read[2] - hydro.reference)};
      triangle.add(w, h);
      forces.push_back(triangle.force());
      continue;
    }
    for_each_piece(g, corners.x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      if (!in_grid(cell)) {
        const Vec3& level = loads == Loads::kStill ? hydro.reference : free.level;
        const auto depth = [&](const Vec3& w) {  // above the level is air
          return std::max(rho_g.dot(read_at(w) - level), 0.0);
        };
        if (is_water_beyond(g, free.water_beyond, cell)) add_polygon(piece, depth, triangle);
        return;
      }
      const bool unknown = kind(cell[0], cell[1], cell[2]) == CellKind::kUnknown;
      const auto level = [&](const Vec3& at) { return interpolate(g, *free.phi, at); };
      std::array<double, ClipPolygon::kMaxCorners> phi;
      bool some_wet = false, some_dry = false;
      for (int a = 0; a < piece.n; ++a) {
        phi[a] = level(triangle.at(piece.corner[a].bary));
        some_wet = some_wet || phi[a] <= 0.0, some_dry = some_dry || phi[a] > 0.0;
      }
      const auto add_part = [&](double sign, const auto& h_at) {  // where sign phi <= 0
        if (!(some_wet && some_dry)) return add_polygon(piece, h_at, triangle);
        ClipPolygon part;
        clip_polygon(
            piece, [&](const auto& c) { return sign * phi[&c - piece.corner.data()]; }, part);
        add_polygon(part, h_at, triangle);
      };
      if (some_wet && (unknown || loads == Loads::kStill))
        add_part(1.0, [&](const Vec3& w) { return rho_g.dot(read_at(w) - hydro.reference); });
      if (loads == Loads::kStill || !(unknown ? some_dry : some_wet)) return;
      // Towards the interface, which carries a pressure of its own.
      const Vec3 centroid = triangle.at(centroid_weights(piece));
      const Vec3 slope = interpolate_gradient(g, *free.phi, centroid);
      constexpr double kFlattest = 0.5;
      const Vec3 up = slope.stableNormalized() / std::max(slope.norm(), kFlattest);
      const auto to_interface = [&](const Vec3& at) { return Vec3(level(at) * up); };
      if (!unknown)
        return add_part(1.0,
                        [&](const Vec3& w) { return rho_g.dot(to_interface(triangle.at(w))); });
      const double back = hydro.density * carried_pressure(g, free, hydro.gravity, centroid);
      add_part(-1.0, [&](const Vec3& w) {
        const Vec3 at = triangle.at(w);
        return rho_g.dot(at - to_interface(at) - hydro.reference) - back;
      });
    });
    forces.push_back(triangle.force());
  }
  return forces;
}

std::vector<VecX> forces_on(const Grid& g, const WetSurface& s,
                            const std::vector<Vec3>& read_points, const PressureSystem& water,
                            Loads loads) {
  return generalised_forces(s, parts_of(*s.triangles, [&](std::span<const Vec3i> some) {
                              return forces_on_some(g, s, read_points, water, loads, some);
                            }));
}

}  // namespace

VecX hydrostatic_force(const Grid& g, const BodySurface& s, const std::vector<Vec3>& read_points,
                       const PressureSystem& water) {
  return forces_on(g, wet_surface(s), read_points, water, Loads::kBesideDynamic)[0];
}

std::vector<VecX> hydrostatic_forces(const Grid& g, const WetSurface& skin,
                                     const std::vector<Vec3>& read_points,
                                     const std::vector<const std::vector<Vec3>*>& own_read,
                                     const PressureSystem& water) {
  std::vector<VecX> forces;
  for (std::size_t m = 0; m < skin.members.size(); ++m) {
    const WetSurface own = wet_surface(*skin.members[m].body);
    forces.push_back(forces_on(g, own, *own_read[m], water, Loads::kStill)[0]);
  }
  if (all_deep(g, skin, water)) return forces;  // its two loads are one and the same
  const std::vector<VecX> beside = forces_on(g, skin, read_points, water, Loads::kBesideDynamic),
                          still = forces_on(g, skin, read_points, water, Loads::kStill);
  for (std::size_t m = 0; m < forces.size(); ++m) forces[m] += beside[m] - still[m];
  return forces;
}

}  // namespace archetide
