#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Flux that the vertices of a surface push into cells: of each column (a cell) a few vertices with
/// a vector, the flux per unit velocity of the vertex. Sparse, 3 ns x columns.
struct SurfaceFlux {
  std::vector<std::size_t> ends;  // of each column, the end of its entries
  std::vector<int> vertex;
  std::vector<Vec3> area;  // m^2, world

  bool empty() const { return ends.empty(); }
  std::size_t begin(std::size_t column) const { return column == 0 ? 0 : ends[column - 1]; }
  void end_column() { ends.push_back(vertex.size()); }
  void add(int v, const Vec3& a) { vertex.push_back(v), area.push_back(a); }

  /// g += sum over columns m of value_of(m) times the column; g: 3 ns.
  template <class ValueOf>
  void gather(const ValueOf& value_of, Eigen::Ref<VecX> g) const {
    for (std::size_t m = 0, e = 0; m < ends.size(); ++m) {
      const double value = value_of(m);
      for (; e < ends[m]; ++e) g.segment<3>(3L * vertex[e]) += value * area[e];
    }
  }
  /// Column m times velocities of the vertices, 3 ns.
  double pushed(std::size_t m, const Eigen::Ref<const VecX>& v) const {
    double sum = 0.0;
    for (std::size_t e = begin(m); e < ends[m]; ++e)
      sum += area[e].dot(v.segment<3>(3L * vertex[e]));
    return sum;
  }
};

}  // namespace archetide
