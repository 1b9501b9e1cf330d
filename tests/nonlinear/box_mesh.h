#pragma once

#include <array>
#include <utility>

#include "precompute/meshing/quadratic_tets.h"

namespace archetide {

/// Straight-sided quadratic tets, six in each of the cells of a box around the origin.
inline TetMesh box_mesh(const Vec3& size, const Vec3i& cells) {
  TetMesh mesh;
  const auto node = [&](int i, int j, int k) {
    return i + (cells.x() + 1) * (j + (cells.y() + 1) * k);
  };
  for (int k = 0; k <= cells.z(); ++k)
    for (int j = 0; j <= cells.y(); ++j)
      for (int i = 0; i <= cells.x(); ++i)
        mesh.nodes.push_back(size.cwiseProduct(Vec3(i, j, k).cwiseQuotient(cells.cast<double>()) -
                                               Vec3::Constant(0.5)));
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int k = 0; k < cells.z(); ++k)
    for (int j = 0; j < cells.y(); ++j)
      for (int i = 0; i < cells.x(); ++i)
        for (const auto& order : kOrders) {
          Vec3i at(i, j, k);
          std::array<int, 4> tet{node(i, j, k)};
          for (int n = 0; n < 3; ++n) {
            at[order[n]] += 1;
            tet[n + 1] = node(at.x(), at.y(), at.z());
          }
          mesh.tets.push_back(tet);
          if (tet_volume(mesh, int(mesh.tets.size()) - 1) < 0.0)
            std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
        }
  return with_middle_nodes(mesh);
}

}  // namespace archetide
