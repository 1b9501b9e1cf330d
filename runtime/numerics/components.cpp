#include "runtime/numerics/components.h"

#include <algorithm>
#include <numeric>

namespace archetide {
namespace {

// Unknowns of one row connected in x: cells [begin, end).
struct Run {
  int begin, end;
};

// Disjoint sets of runs; a set is open once one of its runs touches a Dirichlet value.
class RunSets {
 public:
  int add() {
    parent_.push_back(static_cast<int>(parent_.size()));
    open_.push_back(false);
    return parent_.back();
  }
  int root(int a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(int a, int b) {
    a = root(a), b = root(b);
    if (a == b) return;
    parent_[std::max(a, b)] = std::min(a, b);
    open_[std::min(a, b)] = open_[a] || open_[b];
  }
  void mark_open(int a) { open_[root(a)] = true; }
  bool is_open(int a) { return open_[root(a)] != 0; }

 private:
  std::vector<int> parent_;
  std::vector<char> open_;
};

// Row by row labelling of the water.
class Labelling {
 public:
  explicit Labelling(const PoissonOperator& op)
      : a_(op.matrix()), first_run_(a_.ny * a_.nz + 1, 0) {
    const PoissonMatrix& a = a_;
    for (int k = 0; k < a.nz; ++k)
      for (int j = 0; j < a.ny; ++j) {
        add_row(j, k, op.rows().rows(k, j, j + 1));
        if (j > 0) join_rows(j, k, j - 1, k, &a.w[1](0, j, k));
        if (k > 0) join_rows(j, k, j, k - 1, &a.w[2](0, j, k));
      }
    // From above, where the surface is: what is known to be open needs no further look.
    for (int k = a.nz - 1; k >= 0; --k)
      for (int j = 0; j < a.ny; ++j) mark_open_runs(j, k);
  }

  // Those that are open, or the others.
  std::vector<Blocks> components(bool open) {
    std::vector<int> component_of(runs_.size(), -1);
    std::vector<Blocks> components;
    for (int row = 0; row < a_.ny * a_.nz; ++row)
      for (int r = first_run_[row]; r < first_run_[row + 1]; ++r) {
        if (sets_.is_open(r) != open) continue;
        int& component = component_of[sets_.root(r)];
        if (component < 0) {
          component = static_cast<int>(components.size());
          components.emplace_back();
        }
        const std::size_t start = static_cast<std::size_t>(row) * a_.nx;
        components[component].add(start + runs_[r].begin, start + runs_[r].end);
      }
    return components;
  }

  // Whether the water is in several parts.
  bool parted() {
    for (int r = 1; r < static_cast<int>(runs_.size()); ++r)
      if (sets_.root(r) != sets_.root(0)) return true;
    return false;
  }

 private:
  int row_of(int j, int k) const { return j + a_.ny * k; }

  void add_row(int j, int k, std::span<const Segment> segments) {
    const double* wx = &a_.w[0](0, j, k);
    int end = -1;  // of the last run
    for (const Segment& s : segments)
      for (int i = s.begin; i < s.end;) {
        const int begin = i++;
        if (s.uniform())
          i = s.end;
        else
          while (i < s.end && wx[i] > 0.0) ++i;
        if (begin == end && wx[begin] > 0.0) {
          runs_.back().end = i;
        } else {
          runs_.push_back({begin, i});
          sets_.add();
        }
        end = i;
      }
    first_run_[row_of(j, k) + 1] = static_cast<int>(runs_.size());
  }

  // Joins the runs of row (j, k) with those of an earlier row across the faces w between them.
  void join_rows(int j, int k, int j_other, int k_other, const double* w) {
    const int end = first_run_[row_of(j, k) + 1];
    const int end_other = first_run_[row_of(j_other, k_other) + 1];
    int r = first_run_[row_of(j, k)], o = first_run_[row_of(j_other, k_other)];
    while (r < end && o < end_other) {
      const int low = std::max(runs_[r].begin, runs_[o].begin);
      const int high = std::min(runs_[r].end, runs_[o].end);
      if (std::any_of(w + std::min(low, high), w + high, [](double f) { return f > 0.0; }))
        sets_.join(r, o);
      runs_[r].end < runs_[o].end ? ++r : ++o;
    }
  }

  // Marks the runs of row (j, k) that reach a Dirichlet cell or an open side through an open face.
  void mark_open_runs(int j, int k) {
    const Sides& side = a_.open_side;
    const double* wx = &a_.w[0](0, j, k);
    for (int r = first_run_[row_of(j, k)]; r < first_run_[row_of(j, k) + 1]; ++r) {
      if (sets_.is_open(r)) continue;
      const auto [begin, end] = runs_[r];
      const bool west = begin > 0 ? air(begin - 1, j, k) : side[kXMin];
      const bool east = end < a_.nx ? air(end, j, k) : side[kXMax];
      const bool open = (west && wx[begin] > 0.0) || (east && wx[end] > 0.0) ||
                        touches(begin, end, j - 1, k, side[kYMin], &a_.w[1](0, j, k)) ||
                        touches(begin, end, j + 1, k, side[kYMax], &a_.w[1](0, j + 1, k)) ||
                        touches(begin, end, j, k - 1, side[kZMin], &a_.w[2](0, j, k)) ||
                        touches(begin, end, j, k + 1, side[kZMax], &a_.w[2](0, j, k + 1));
      if (open) sets_.mark_open(r);
    }
  }

  bool air(int i, int j, int k) const { return a_.kind(i, j, k) == CellKind::kDirichlet; }

  // Is there an open face w[i], begin <= i < end, to a Dirichlet cell of row (j, k) or, where that
  // row lies beyond the box, to an open side?
  bool touches(int begin, int end, int j, int k, bool open_side, const double* w) const {
    if (j < 0 || k < 0 || j == a_.ny || k == a_.nz)
      return open_side && std::any_of(w + begin, w + end, [](double f) { return f > 0.0; });
    const CellKind* kind = &a_.kind(0, j, k);
    for (int i = begin; i < end; ++i)
      if (kind[i] == CellKind::kDirichlet && w[i] > 0.0) return true;
    return false;
  }

  const PoissonMatrix& a_;
  std::vector<int> first_run_;  // rows + 1
  std::vector<Run> runs_;
  RunSets sets_;
};

}  // namespace

void ClosedComponents::setup(const PoissonOperator& op) {
  cells_of_.clear(), open_.clear();
  if (op.size() == 0) return;
  Labelling labelling(op);
  cells_of_ = labelling.components(false);
  if (labelling.parted()) open_ = labelling.components(true);
}

void ClosedComponents::setup(const PoissonMatrix& matrix) {
  PoissonOperator op;
  op.setup(matrix);
  setup(op);
}

int ClosedComponents::region(std::size_t cell) const {
  const auto found =
      std::ranges::find_if(cells_of_, [cell](const Blocks& of) { return of.holds(cell); });
  return found == cells_of_.end() ? -1 : static_cast<int>(found - cells_of_.begin());
}

double ClosedComponents::mean(std::size_t c, const double* v) const {
  return sum(cells_of_[c], v) / static_cast<double>(cells_of_[c].entries);
}

void ClosedComponents::project(double* v) const {
  for (std::size_t c = 0; c < count(); ++c) add_constant(c, -mean(c, v), v);
}

void ClosedComponents::add_constant(std::size_t c, double s, double* v) const {
  for (const Blocks::Range& range : cells_of_[c].ranges)
    for (std::size_t i = range.begin; i < range.end; ++i) v[i] += s;
}

}  // namespace archetide
