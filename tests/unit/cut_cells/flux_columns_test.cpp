// Products with a body's flux against the same in one piece.
#include "runtime/cut_cells/flux_columns.h"

#include <gtest/gtest.h>

namespace archetide {
namespace {

// n whole numbers: sums are exact in whatever order.
MatX numbers(int rows, int columns) {
  MatX m(rows, columns);
  for (int c = 0; c < columns; ++c)
    for (int r = 0; r < rows; ++r) m(r, c) = (7 * r + 13 * c) % 19 - 9;
  return m;
}

TEST(FluxColumns, SumsAreThoseOfTheWholeMatrix) {
  for (int rows = 6; rows <= 40; ++rows)
    for (const int columns : {0, 1, 2, 9}) {
      const MatX F = numbers(rows, columns);
      std::vector<std::int64_t> cell;
      std::vector<std::size_t> place;
      for (int c = 0; c < columns; ++c) cell.push_back(2 * c + 1), place.push_back(3 * c);
      std::vector<double> x(2 * columns + 1);
      std::vector<float> z(3 * columns + 1);
      VecX at_cell(columns), at_place(columns);
      for (int c = 0; c < columns; ++c) {
        x[cell[c]] = at_cell[c] = c - 3;
        z[place[c]] = static_cast<float>(at_place[c] = 5 - c);
      }
      EXPECT_EQ(gather_columns(F, cell, x.data()), VecX(F * at_cell)) << rows << " x " << columns;
      EXPECT_EQ(gather_columns(F, place, z.data()), VecX(F * at_place)) << rows << " x " << columns;

      const VecX v = numbers(rows, 1);
      const VecX pushed = F.transpose() * v + at_cell;
      const std::size_t middle = cell.size() / 3;  // in two parts
      scatter_columns(F, cell, middle, cell.size(), v, x.data());
      scatter_columns(F, cell, 0, middle, v, x.data());
      for (int c = 0; c < columns; ++c)
        EXPECT_EQ(x[cell[c]], pushed[c]) << rows << " x " << columns;
    }
}

}  // namespace
}  // namespace archetide
