#include "runtime/output/water_surface.h"

#include <algorithm>
#include <limits>

#include "common/base/check.h"
#include "runtime/output/cube_cases.h"

namespace archetide {
namespace {

// The samples along one axis: pad, wall, n cell centres, wall, pad. A pad lies on its wall and
// holds air, so what crosses between wall and pad ends exactly on the wall.
struct SampleAxis {
  std::vector<double> position;  // n + 4, m

  SampleAxis(int n, double low, double dx) : position(n + 4) {
    for (int i = 0; i < n; ++i) position[i + 2] = low + dx * (i + 0.5);
    position[0] = position[1] = low;
    position[n + 2] = position[n + 3] = low + dx * n;
  }
  int size() const { return static_cast<int>(position.size()); }
  bool is_pad(int i) const { return i == 0 || i == size() - 1; }
  // Value at a wall or centre: linear extrapolation over the half cell to a wall.
  template <class Values>
  double value(int i, const Values& centre) const {
    const int n = size() - 4, c = i - 2;
    if (c >= 0 && c < n) return centre(c);
    const int nearest = c < 0 ? 0 : n - 1;
    const int second = n == 1 ? 0 : c < 0 ? 1 : n - 2;
    return 1.5 * centre(nearest) - 0.5 * centre(second);
  }
};

// Two layers of samples at a time march through the tank.
class Marcher {
 public:
  Marcher(const Grid& grid, const Array3<double>& phi)
      : grid_(grid),
        phi_(phi),
        axes_{SampleAxis(grid.nx, grid.origin[0], grid.dx),
              SampleAxis(grid.ny, grid.origin[1], grid.dx),
              SampleAxis(grid.nz, grid.origin[2], grid.dx)} {
    low_.resize(layer_size());
    high_.resize(layer_size());
  }

  SurfaceMesh run() {
    fill_layer(0, high_);
    for (int k = 0; k + 1 < axes_[2].size(); ++k) {
      std::swap(low_, high_);
      fill_layer(k + 1, high_);
      for (int j = 0; j + 1 < axes_[1].size(); ++j)
        for (int i = 0; i + 1 < axes_[0].size(); ++i) emit_cube(i, j, k);
    }
    return std::move(mesh_);
  }

 private:
  struct Layer {
    std::vector<double> value;                 // samples, m
    std::vector<std::array<int, 4>> vertices;  // samples: vertex on the x, y, z edge, and on a wall
    void resize(std::size_t n) { value.resize(n), vertices.resize(n); }
  };

  std::size_t layer_size() const {
    return static_cast<std::size_t>(axes_[0].size()) * axes_[1].size();
  }
  std::size_t sample(int i, int j) const {
    return i + static_cast<std::size_t>(axes_[0].size()) * j;
  }

  void fill_layer(int k, Layer& layer) const {
    std::fill(layer.vertices.begin(), layer.vertices.end(), std::array<int, 4>{-1, -1, -1, -1});
    std::fill(layer.value.begin(), layer.value.end(), std::numeric_limits<double>::max());
    if (axes_[2].is_pad(k)) return;
    for (int j = 1; j + 1 < axes_[1].size(); ++j)
      for (int i = 1; i + 1 < axes_[0].size(); ++i)
        layer.value[sample(i, j)] = axes_[2].value(k, [&](int c2) {
          return axes_[1].value(j, [&](int c1) {
            return axes_[0].value(i, [&](int c0) { return phi_(c0, c1, c2); });
          });
        });
  }

  void emit_cube(int i, int j, int k) {
    double value[8];
    int inside = 0;
    for (int c = 0; c < 8; ++c) {
      const Layer& layer = c & 4 ? high_ : low_;
      value[c] = layer.value[sample(i + (c & 1), j + (c >> 1 & 1))];
      inside |= (value[c] < 0.0) << c;
    }
    for (const auto& triangle : cube_cases()[inside]) {
      Vec3i t;
      for (int v = 0; v < 3; ++v) t[v] = vertex(Vec3i(i, j, k), triangle[v], value);
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh_.triangles.push_back(t);
    }
  }

  // The vertex on edge e of a cube, made when first asked for.
  int vertex(const Vec3i& cube, int e, const double (&value)[8]) {
    const int a = cube_edge_low(e), b = cube_edge_high(e), axis = cube_edge_axis(e);
    const Vec3i at_a = cube + corner_offset(a), at_b = cube + corner_offset(b);
    // A vertex between wall and pad belongs to the wall sample, shared by all its pads.
    const bool on_wall = axes_[axis].is_pad(at_a[axis]) || axes_[axis].is_pad(at_b[axis]);
    const int owner_corner = on_wall && axes_[axis].is_pad(at_a[axis]) ? b : a;
    const Vec3i owner = cube + corner_offset(owner_corner);
    Layer& layer = owner_corner & 4 ? high_ : low_;
    int& id = layer.vertices[sample(owner[0], owner[1])][on_wall ? 3 : axis];
    if (id >= 0) return id;
    id = static_cast<int>(mesh_.vertices.size());
    if (on_wall) {
      mesh_.vertices.push_back(position(owner));
      mesh_.normals.push_back(wall_normal(owner));
    } else {
      const double s = value[a] / (value[a] - value[b]);
      const Vec3 x = position(at_a) + s * (position(at_b) - position(at_a));
      mesh_.vertices.push_back(x);
      mesh_.normals.push_back(phi_normal(x));
    }
    return id;
  }

  static Vec3i corner_offset(int c) { return Vec3i(c & 1, c >> 1 & 1, c >> 2 & 1); }
  Vec3 position(const Vec3i& s) const {
    return Vec3(axes_[0].position[s[0]], axes_[1].position[s[1]], axes_[2].position[s[2]]);
  }

  Vec3 wall_normal(const Vec3i& s) const {
    Vec3 n = Vec3::Zero();
    for (int a = 0; a < 3; ++a) n[a] = (s[a] == axes_[a].size() - 2) - (s[a] == 1);
    return n.normalized();
  }

  // Central differences of the trilinear field over two cells, one-sided at the tank's sides.
  Vec3 phi_normal(const Vec3& x) const {
    Vec3 n = Vec3::Zero();
    for (int a = 0; a < 3; ++a) {
      Vec3 below = x, above = x;
      below[a] = std::max(x[a] - grid_.dx, axes_[a].position[2]);
      above[a] = std::min(x[a] + grid_.dx, axes_[a].position[axes_[a].size() - 3]);
      if (above[a] > below[a])
        n[a] = (interpolate(grid_, phi_, above) - interpolate(grid_, phi_, below)) /
               (above[a] - below[a]);
    }
    const double length = n.norm();
    return length > 0.0 ? Vec3(n / length) : Vec3(Vec3::UnitZ());
  }

  const Grid& grid_;
  const Array3<double>& phi_;
  std::array<SampleAxis, 3> axes_;
  Layer low_, high_;
  SurfaceMesh mesh_;
};

}  // namespace

SurfaceMesh water_surface(const Grid& grid, const Array3<double>& phi) {
  if (grid.cells() == 0) return {};
  ARCHETIDE_CHECK_OP(phi.size(), ==, grid.cells());
  return Marcher(grid, phi).run();
}

}  // namespace archetide
