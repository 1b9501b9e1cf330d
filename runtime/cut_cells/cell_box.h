#pragma once

#include <algorithm>
#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Box of cells around a surface and one layer of cells more, clamped to one layer outside the
/// grid.
struct CellBox {
  Vec3i low = Vec3i::Zero(), size = Vec3i::Zero();
  std::size_t index(const Vec3i& c) const {
    const Vec3i d = c - low;
    return d[0] +
           static_cast<std::size_t>(size[0]) * (d[1] + static_cast<std::size_t>(size[1]) * d[2]);
  }
  std::size_t count() const { return static_cast<std::size_t>(size[0]) * size[1] * size[2]; }
};
CellBox cell_box(const Grid& g, const std::vector<Vec3>& points);
CellBox whole_box(const Grid& g);

/// Numbers the requested cells of a box, from 0 on.
class CellSlots {
 public:
  explicit CellSlots(const CellBox& box) : box_(box), slot_of_(box.count(), -1) {}
  const CellBox& box() const { return box_; }
  /// In the order of their numbers.
  const std::vector<Vec3i>& cells() const { return cells_; }
  /// The number of a cell, which it is given if it has none.
  int slot(const Vec3i& cell) {
    int& at = slot_of_[box_.index(cell)];
    if (at < 0) at = static_cast<int>(cells_.size()), cells_.push_back(cell);
    return at;
  }
  /// -1: it has none.
  int find(const Vec3i& cell) const { return slot_of_[box_.index(cell)]; }

 private:
  CellBox box_;
  std::vector<int> slot_of_;
  std::vector<Vec3i> cells_;
};

/// Calls f(first, last) for the rows of a lattice of cells or faces in a box, faces on its high
/// sides included; on all threads.
template <class T, class F>
void for_each_row(const Array3<T>& lattice, const CellBox& box, const F& f) {
  const Vec3i low = box.low.cwiseMax(0);
  const Vec3i end = (box.low + box.size + Vec3i::Ones())
                        .cwiseMin(Vec3i(lattice.nx(), lattice.ny(), lattice.nz()));
#pragma omp parallel for schedule(static) if (box.count() > 32768)
  for (int k = low[2]; k < end[2]; ++k)
    for (int j = low[1]; j < end[1]; ++j)
      if (low[0] < end[0]) f(lattice.index(low[0], j, k), lattice.index(end[0] - 1, j, k) + 1);
}

/// to = from in a box, faces on its high sides included.
template <class T>
void copy_box(const Array3<T>& from, const CellBox& box, Array3<T>& to) {
  for_each_row(to, box, [&](std::size_t first, std::size_t last) {
    std::copy(from.data() + first, from.data() + last, to.data() + first);
  });
}
template <class T>
void copy_box(const FaceField<T>& from, const CellBox& box, FaceField<T>& to) {
  for (int a = 0; a < 3; ++a) copy_box(from[a], box, to[a]);
}

}  // namespace archetide
