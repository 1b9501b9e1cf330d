#include "runtime/numerics/box_cycle.h"

#include <algorithm>

#include "runtime/numerics/v_cycle.h"

namespace archetide {

void BlockLevel::load(const MultigridLevel& level, const int begin[3], const int end[3]) {
  int size[3];
  for (int a = 0; a < 3; ++a) low[a] = begin[a] & ~1, size[a] = std::max(end[a] - low[a], 1);
  nx = size[0], ny = size[1], nz = size[2];
  parallel = static_cast<std::size_t>(nx) * ny * nz >= kParallelCells;
  sy_ = nx + 2, sz_ = sy_ * (ny + 2);
  const std::size_t blocks = sz_ * (nz + 2);
  x.resize(blocks * kLanes), b.resize(blocks * kLanes);
  coefficient_.resize(blocks * kCoefficients);
  stretch_.resize(nz);
  for_each_index(nz + 2, parallel, [&](int k) {
    std::fill_n(x.begin() + sz_ * kLanes * k, sz_ * kLanes, 0.0f);
    if (k > 0 && k <= nz) load_plane(level, begin, end, k - 1);
  });
}

void BlockLevel::load_plane(const MultigridLevel& level, const int begin[3], const int end[3],
                            int plane) {
  const int k = low[2] + plane;
  stretch_[plane].clear();
  if (k < begin[2] || k >= end[2]) return;
  std::vector<float> scratch(nx + 1);
  for (const Segment& s : level.rows.rows(k, begin[1], end[1])) {
    const Stretch t{s.j, std::max(s.begin, begin[0]), std::min(s.end, end[0])};
    const int n = t.end - t.begin;
    if (n <= 0) continue;
    stretch_[plane].push_back(t);
    float* to = coefficient_.data() + index(t.begin, t.j, k) * kCoefficients;
    if (s.uniform()) {  // faces to what is no unknown meet 0: any coefficient will do
      for (int i = 0; i < n; ++i, to += kCoefficients) {
        const int at = t.begin + i, beside = at == s.begin     ? s.first
                                             : at == s.end - 1 ? s.last
                                                               : s.inner;
        const float diagonal = static_cast<float>(beside) * level.c;
        to[0] = 1.0f / diagonal, to[7] = diagonal;
        std::fill_n(to + 1, 6, level.c);
      }
      continue;
    }
    const auto put = [&](int c, const float* from) {
      for (int i = 0; i < n; ++i) to[i * kCoefficients + c] = from[i];
    };
    put(7, level.diagonal(t.begin, t.j, k, n, scratch.data()));
    for (int i = 0; i < n; ++i) to[i * kCoefficients] = inverse_of(to[i * kCoefficients + 7]);
    const float* along = level.faces(0, t.begin, t.j, k, n + 1, scratch.data());
    put(1, along), put(2, along + 1);
    put(3, level.faces(1, t.begin, t.j, k, n, scratch.data()));
    put(4, level.faces(1, t.begin, t.j + 1, k, n, scratch.data()));
    put(5, level.faces(2, t.begin, t.j, k, n, scratch.data()));
    put(6, level.faces(2, t.begin, t.j, k + 1, n, scratch.data()));
  }
}

std::size_t BlockLevel::work_of(int k) const {
  std::size_t count = 0;
  for (const Stretch& s : stretch_[k]) count += s.end - s.begin;
  return count;
}

int BlockLevel::strip(int stages) const {
  return strip_rows(stages, sizeof(float) * (2 * kLanes + kCoefficients) * sy_);
}

// f(i, j, k, block) for the unknowns of some rows.
template <class F>
void BlockLevel::for_cells(const Rows& r, F&& f) const {
  const int k = low[2] + r.k;
  for (const Stretch& s : stretch_[r.k]) {
    if (s.j < low[1] + r.first || s.j >= low[1] + r.end) continue;
    const std::size_t block = index(s.begin, s.j, k);
    for (int i = s.begin; i < s.end; ++i) f(i, s.j, k, block + (i - s.begin));
  }
}

template <class F>
void BlockLevel::for_coloured(const Rows& r, Colour colour, F&& f) const {
  const int k = low[2] + r.k;
  for (const Stretch& s : stretch_[r.k]) {
    if (s.j < low[1] + r.first || s.j >= low[1] + r.end) continue;
    const std::size_t block = index(s.begin, s.j, k);
    const int first = s.begin + ((s.begin + s.j + k + static_cast<int>(colour)) & 1);
    for (int i = first; i < s.end; i += 2) f(i, s.j, k, block + (i - s.begin));
  }
}

// sum = those of a cell, each times its face
void BlockLevel::neighbours(std::size_t cell, Lanes& sum) const {
  const float *c = coefficient_.data() + cell * kCoefficients, *p = x.data() + cell * kLanes;
  const std::size_t row = sy_ * kLanes, plane = sz_ * kLanes;
  Lanes west, east, south, north, down, up;
  read_block(p - kLanes, west), read_block(p + kLanes, east);
  read_block(p - row, south), read_block(p + row, north);
  read_block(p - plane, down), read_block(p + plane, up);
  sum = (c[1] * west + c[2] * east) + (c[3] * south + c[4] * north) + (c[5] * down + c[6] * up);
}

// x = diag^-1 (b + sum w x_neighbour)
void BlockLevel::relax(const Rows& r, Colour colour, MultigridLevel::Prefetch) {
  for_coloured(r, colour, [&](int, int, int, std::size_t cell) {
    Lanes sum, rhs;
    neighbours(cell, sum);
    read_block(b.data() + cell * kLanes, rhs);
    write_block(coefficient_[cell * kCoefficients] * (rhs + sum), x.data() + cell * kLanes);
  });
}

// The first red relaxation from x = 0; 0 on black.
void BlockLevel::start(const Rows& r) {
  for_coloured(r, Colour::kRed, [&](int, int, int, std::size_t cell) {
    Lanes rhs;
    read_block(b.data() + cell * kLanes, rhs);
    write_block(coefficient_[cell * kCoefficients] * rhs, x.data() + cell * kLanes);
  });
  for_coloured(r, Colour::kBlack, [&](int, int, int, std::size_t cell) {
    write_block(Lanes{}, x.data() + cell * kLanes);
  });
}

void BlockLevel::clear_rhs() { std::fill(b.begin(), b.end(), 0.0f); }

void BlockLevel::restrict_residual(const Rows& r, BlockLevel& coarse) const {
  for_cells(r, [&](int i, int j, int k, std::size_t cell) {
    Lanes sum, rhs, here, old;
    neighbours(cell, sum);
    read_block(b.data() + cell * kLanes, rhs), read_block(x.data() + cell * kLanes, here);
    float* to = coarse.b.data() + coarse.index(i / 2, j / 2, k / 2) * kLanes;
    read_block(to, old);
    const float diagonal = coefficient_[cell * kCoefficients + 7];
    write_block(old + ((rhs - diagonal * here) + sum), to);
  });
}

void BlockLevel::prolong(const Rows& r, const BlockLevel& coarse) {
  for_coloured(r, Colour::kRed, [&](int i, int j, int k, std::size_t cell) {
    Lanes here, add;
    read_block(x.data() + cell * kLanes, here);
    read_block(coarse.x.data() + coarse.index(i / 2, j / 2, k / 2) * kLanes, add);
    write_block(here + add, x.data() + cell * kLanes);
  });
}

void BoxCycle::setup(const Multigrid& whole, const int low[3], const int size[3]) {
  constexpr int kSmall = 4;  // cells along the longest side of the coarsest level
  std::copy_n(whole.layout().low, 3, offset_);
  int begin[3], end[3];
  for (int a = 0; a < 3; ++a)
    begin[a] = low[a] - offset_[a], end[a] = low[a] - offset_[a] + size[a];
  used_ = 0;
  for (int l = 0; l < whole.levels(); ++l) {
    const MultigridLevel& level = whole.level(l);
    const int most[3] = {level.nx, level.ny, level.nz};
    int longest = 0;
    for (int a = 0; a < 3; ++a) {
      begin[a] = std::max(begin[a], 0), end[a] = std::min(end[a], most[a]);
      longest = std::max(longest, end[a] - begin[a]);
    }
    if (static_cast<int>(levels_.size()) == used_) levels_.emplace_back();
    levels_[used_++].load(level, begin, end);
    if (longest <= kSmall) break;
    // Parents all of whose children are in the box: what vanishes beyond it must do so on all
    // levels.
    for (int a = 0; a < 3; ++a)
      begin[a] = (begin[a] + 1) / 2, end[a] = end[a] == most[a] ? (end[a] + 1) / 2 : end[a] / 2;
  }
  levels_[0].clear_rhs();
}

std::size_t BoxCycle::place(int i, int j, int k) const {
  return levels_[0].index(i - offset_[0], j - offset_[1], k - offset_[2]) * kLanes;
}

void BoxCycle::cycle() {
  for (int l = 1; l < used_; ++l) levels_[l].clear_rhs();
  cycle(0);
}

// x = V b on level l, from x = 0
void BoxCycle::cycle(int l) {
  constexpr int kCoarsest = 8;  // sweeps there: zero beyond so few cells is soon felt
  BlockLevel& level = levels_[l];
  if (l + 1 < used_) {
    descend(level, levels_[l + 1], [&](const BlockLevel::Rows& r) { level.start(r); });
    cycle(l + 1);
    ascend(level, levels_[l + 1], [](const BlockLevel::Rows&) {});
    return;
  }
  const auto all_rows = [&](const auto& f) {
    for (int k = 0; k < level.nz; ++k) f(BlockLevel::Rows{k, 0, level.ny});
  };
  all_rows([&](const BlockLevel::Rows& r) { level.start(r); });
  for (int sweep = 0; sweep < 2 * kCoarsest; ++sweep)
    all_rows([&](const BlockLevel::Rows& r) {
      level.relax(r, sweep % 2 == 0 ? Colour::kBlack : Colour::kRed, {});
    });
}

}  // namespace archetide
