#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Products with a body's flux (6 + r rows, m columns), whose short columns cost more to begin than
/// to multiply: eight rows at once, up to 32 of them.

/// sum over the columns of values[place[m]] times column m; 6 + r.
VecX gather_columns(const MatX& columns, const std::vector<std::size_t>& place,
                    const float* values);
VecX gather_columns(const MatX& columns, const std::vector<std::int64_t>& place,
                    const double* values);

/// Sum over the columns, 6 + r; zero where there are none.
VecX sum_columns(const MatX& columns);

/// out[place[m]] += column m . v for m in [first, end)
void scatter_columns(const MatX& columns, const std::vector<std::int64_t>& place, std::size_t first,
                     std::size_t end, const VecX& v, double* out);

}  // namespace archetide
