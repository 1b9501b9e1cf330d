#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "common/mesh/tet_mesh.h"
#include "common/mesh/tri_mesh.h"
#include "precompute/base/material.h"

namespace archetide {

inline const Material kRubber{.density = 1000.0, .young = 1e6, .poisson = 0.3};

}  // namespace archetide

namespace archetide::shapes {

/// Icosahedron whose triangles are split in four `levels` times, projected on the sphere; 20 *
/// 4^levels faces.
inline TriMesh sphere(double radius, int levels) {
  const double g = (1.0 + std::sqrt(5.0)) / 2.0;
  TriMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto midpoint = [&](int a, int b) {
      const auto [entry, is_new] = middle.try_emplace(std::minmax(a, b), int(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
      return entry->second;
    };
    std::vector<Vec3i> split;
    for (const Vec3i& t : mesh.triangles) {
      const int a = midpoint(t[0], t[1]), b = midpoint(t[1], t[2]), c = midpoint(t[2], t[0]);
      for (const Vec3i& s :
           {Vec3i(t[0], a, c), Vec3i(t[1], b, a), Vec3i(t[2], c, b), Vec3i(a, b, c)})
        split.push_back(s);
    }
    mesh.triangles = split;
    for (Vec3& x : mesh.vertices) x.normalize();
  }
  for (Vec3& x : mesh.vertices) x = radius * x.normalized();
  return mesh;
}

/// Torus about z with ring radius R and tube radius r, nu x nv vertices.
inline TriMesh torus(double R, double r, int nu, int nv) {
  TriMesh mesh;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const double u = 2 * std::numbers::pi * i / nu, v = 2 * std::numbers::pi * j / nv;
      const double q = R + r * std::cos(v);
      mesh.vertices.emplace_back(q * std::cos(u), q * std::sin(u), r * std::sin(v));
      const int a = i * nv + j, b = (i + 1) % nu * nv + j;
      const int c = (i + 1) % nu * nv + (j + 1) % nv, d = i * nv + (j + 1) % nv;
      mesh.triangles.emplace_back(a, b, c);
      mesh.triangles.emplace_back(a, c, d);
    }
  return mesh;
}

/// Axis-aligned box from the origin to `size`, every side split into `n` cells.
inline TriMesh box(const Vec3& size, int n) {
  TriMesh mesh;
  std::map<std::array<int, 3>, int> index;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [entry, is_new] = index.try_emplace(at, int(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(Vec3(at[0], at[1], at[2]).cwiseProduct(size) / n);
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> at;
            at[axis] = side * n, at[(axis + 1) % 3] = i + di, at[(axis + 2) % 3] = j + dj;
            return vertex(at);
          };
          const int a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          mesh.triangles.push_back(side ? Vec3i(a, b, c) : Vec3i(a, c, b));
          mesh.triangles.push_back(side ? Vec3i(a, c, d) : Vec3i(a, d, c));
        }
  return mesh;
}

/// Solid box of nx x ny x nz cubes of edge h, six tets (Kuhn) each, positively oriented.
inline TetMesh tet_box(int nx, int ny, int nz, double h) {
  TetMesh mesh;
  const auto node = [&](int i, int j, int k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) mesh.nodes.emplace_back(h * i, h * j, h * k);
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        for (int o = 0; o < 6; ++o) {
          // From the low corner to the high one along the axes in this order.
          std::array<int, 3> at = {i, j, k};
          std::array<int, 4> tet;
          tet[0] = node(at[0], at[1], at[2]);
          for (int step = 0; step < 3; ++step) {
            ++at[kOrders[o][step]];
            tet[step + 1] = node(at[0], at[1], at[2]);
          }
          if (o >= 3) std::swap(tet[2], tet[3]);
          mesh.tets.push_back(tet);
        }
  return mesh;
}

}  // namespace archetide::shapes
