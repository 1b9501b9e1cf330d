#include "runtime/numerics/row_segments.h"

#include <algorithm>
#include <numeric>

namespace archetide {

void RowSegments::reset(int planes) {
  planes_.resize(planes);
  for (auto& plane : planes_) plane.clear();
  unknowns_.assign(planes, 0);
  work_.assign(planes, 0);
}

std::size_t RowSegments::unknowns() const {
  return std::accumulate(unknowns_.begin(), unknowns_.end(), std::size_t{0});
}

void RowSegments::add_row(int k, int j, const RowCell* cells, int n) {
  std::vector<Segment>& out = planes_[k];
  const std::size_t first = out.size();
  unknowns_[k] += n - std::count(cells, cells + n, kNoUnknown);
  const auto uniform = [&](int i) {
    return i < n && cells[i] != kNoUnknown && cells[i] != kGeneral;
  };
  // From a uniform cell on: equal inner ones, and one more that may differ.
  const auto end_of_uniform = [&](int i) {
    if (!uniform(++i)) return i;
    const RowCell inner = cells[i];
    while (i < n && cells[i] == inner) ++i;
    return uniform(i) ? i + 1 : i;
  };
  for (int i = 0, end; i < n; i = end) {
    end = i + 1;
    if (cells[i] == kNoUnknown) continue;
    if (uniform(i)) {
      end = end_of_uniform(i);
      if (end - i >= kMinUniform) {
        out.push_back({j, i, end, cells[i], cells[i + 1], cells[end - 1]});
        continue;
      }
      end = i + 1;
    }
    // A general stretch swallows its general left neighbour.
    Segment* last = out.empty() ? nullptr : &out.back();
    if (last && last->j == j && last->end == i && !last->uniform())
      last->end = end;
    else
      out.push_back({j, i, end});
  }
  for (std::size_t s = first; s < out.size(); ++s) work_[k] += work_of(out[s]);
}

std::size_t RowSegments::bytes() const {
  std::size_t total = planes_.capacity() * sizeof(planes_[0]) +
                      (unknowns_.capacity() + work_.capacity()) * sizeof(std::size_t);
  for (const auto& plane : planes_) total += plane.capacity() * sizeof(Segment);
  return total;
}

}  // namespace archetide
