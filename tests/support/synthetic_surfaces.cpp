#include <array>
#include <cmath>
#include <map>

#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Splits every triangle in four at its edges' middles, shared between neighbours.
TriMesh split_edges(const TriMesh& in) {
  TriMesh out;
  out.vertices = in.vertices;
  std::map<std::pair<int, int>, int> middle;
  const auto middle_of = [&](int a, int b) {
    const auto [at, is_new] =
        middle.try_emplace(std::minmax(a, b), static_cast<int>(out.vertices.size()));
    if (is_new) out.vertices.push_back(0.5 * (in.vertices[a] + in.vertices[b]));
    return at->second;
  };
  for (const Vec3i& t : in.triangles) {
    const int a = middle_of(t[0], t[1]), b = middle_of(t[1], t[2]), c = middle_of(t[2], t[0]);
    for (const Vec3i& s : {Vec3i(t[0], a, c), Vec3i(a, t[1], b), Vec3i(c, b, t[2]), Vec3i(a, b, c)})
      out.triangles.push_back(s);
  }
  return out;
}

TriMesh icosahedron() {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  TriMesh m;
  m.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  m.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                 {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                 {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                 {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  return m;
}

}  // namespace

TriMesh icosphere(int subdivisions, double radius) {
  TriMesh m = icosahedron();
  for (int s = 0; s < subdivisions; ++s) {
    m = split_edges(m);
    for (Vec3& x : m.vertices) x.normalize();
  }
  for (Vec3& x : m.vertices) x = radius * x.normalized();
  return m;
}

TriMesh box_surface(const Vec3& lengths, int subdivisions) {
  TriMesh m;
  for (int v = 0; v < 8; ++v)
    m.vertices.push_back(lengths.cwiseProduct(Vec3(v & 1, (v >> 1) & 1, (v >> 2) & 1)) -
                         0.5 * lengths);
  constexpr std::array<std::array<int, 4>, 6> kQuads = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& q : kQuads) {
    m.triangles.emplace_back(q[0], q[1], q[2]);
    m.triangles.emplace_back(q[0], q[2], q[3]);
  }
  for (int s = 0; s < subdivisions; ++s) m = split_edges(m);
  return m;
}

TriMesh torus_surface(double R, double r, int nu, int nv) {
  TriMesh m;
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      const double u = 2.0 * kPi * i / nu, v = 2.0 * kPi * j / nv;
      const double rho = R + r * std::cos(v);
      m.vertices.emplace_back(rho * std::cos(u), rho * std::sin(u), r * std::sin(v));
    }
  }
  const auto at = [&](int i, int j) { return (i % nu) * nv + j % nv; };
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      m.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      m.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return m;
}

}  // namespace archetide
