#include "runtime/numerics/row_segments.h"

namespace archetide {

void RowSegments::reset(int planes) {
  planes_.resize(planes);
  for (auto& plane : planes_) plane.clear();
}

void RowSegments::add_row(int k, int j, const RowCell* cells, int n) {
  std::vector<Segment>& out = planes_[k];
  const auto end_of_run = [&](int i) {
    const RowCell cell = cells[i];
    while (i < n && cells[i] == cell) ++i;
    return i;
  };
  for (int i = 0, end; i < n; i = end) {
    end = end_of_run(i);
    if (cells[i] == RowCell::kNone) continue;
    const bool uniform = cells[i] == RowCell::kUniform && end - i >= kMinUniform;
    // A general stretch swallows its general left neighbour.
    Segment* last = out.empty() ? nullptr : &out.back();
    if (!uniform && last && last->j == j && last->end == i && !last->uniform)
      last->end = end;
    else
      out.push_back({j, i, end, uniform});
  }
}

std::size_t RowSegments::bytes() const {
  std::size_t total = planes_.capacity() * sizeof(planes_[0]);
  for (const auto& plane : planes_) total += plane.capacity() * sizeof(Segment);
  return total;
}

}  // namespace archetide
