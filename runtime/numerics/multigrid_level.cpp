#include "runtime/numerics/multigrid_level.h"

#include <algorithm>
#include <cstring>

#include "runtime/numerics/lanes.h"

namespace archetide {
namespace {

typedef float HalfLanes __attribute__((vector_size(2 * kLanes)));
constexpr float kShare[] = {0.0f, 1.0f, 1 / 2.0f, 1 / 3.0f, 1 / 4.0f, 1 / 5.0f, 1 / 6.0f};

// Cells of a segment and what the row operations read of them: pointers to its first cell; where it
// is not uniform, coefficients n cells apart (multigrid_level.h), else null.
struct Row {
  const Segment& s;
  int k, n;
  std::size_t at, sy, sz;
  const float *x, *b, *coefficient;

  Row(const MultigridLevel& l, const Segment& segment, int plane, const float* c)
      : s(segment),
        k(plane),
        n(segment.end - segment.begin),
        at(l.index(segment.begin, segment.j, plane)),
        sy(l.sy),
        sz(l.sz),
        x(l.x.data() + at),
        b(l.b.data() + at),
        coefficient(c) {}
  const float* part(int c) const { return coefficient + static_cast<std::ptrdiff_t>(c) * n; }
  int parity() const { return (s.begin + s.j + k) & 1; }
};

// f(row) for each segment of some rows.
template <class F>
void for_rows(const MultigridLevel& l, const MultigridLevel::Rows& r, F&& f) {
  const Segment* all = l.rows.plane(r.k).data();
  const MultigridLevel::PlaneCoefficients& plane = l.planes[r.k];
  for (const Segment& s : l.rows.rows(r.k, r.first, r.end))
    f(Row(l, s, r.k, s.uniform() ? nullptr : plane.value.data() + plane.first[&s - all]));
}

#ifdef __clang__
// GCC's shuffles, lane by lane: clang, which checks the sources, has them for constant places only.
Lanes shuffled(const Lanes& a, const Places& order) {
  Lanes out;
  for (int n = 0; n < kLanes; ++n) out[n] = a[order[n] % kLanes];
  return out;
}
Lanes shuffled(const Lanes& a, const Lanes& b, const Places& order) {
  Lanes out;
  for (int n = 0; n < kLanes; ++n)
    out[n] = order[n] % (2 * kLanes) < kLanes ? a[order[n] % kLanes] : b[order[n] % kLanes];
  return out;
}
#define __builtin_shuffle shuffled
#endif

// Of a block of cells: their values, and those of their neighbours.
struct Stencil {
  Lanes here, west, east, south, north, down, up;

  void sum(Lanes& out) const { out = (west + east) + (south + north) + (down + up); }
  // The same with the coefficients of the faces, of cells from i on.
  void sum(const Row& row, int i, Lanes& out) const {
    Lanes xl, xh, yl, yh, zl, zh;
    read_block(row.part(1) + i, xl), read_block(row.part(2) + i, xh),
        read_block(row.part(3) + i, yl);
    read_block(row.part(4) + i, yh), read_block(row.part(5) + i, zl),
        read_block(row.part(6) + i, zh);
    out = (xl * west + xh * east) + (yl * south + yh * north) + (zl * down + zh * up);
  }
};

// The cells of a block that are first, third, .. (parity 0), or the others.
void every_second(int parity, Choice& out) {
  static constexpr int kAlternating[kLanes + 1] = {-1, 0,  -1, 0,  -1, 0,  -1, 0, -1,
                                                   0,  -1, 0,  -1, 0,  -1, 0,  -1};
  read_block(kAlternating + parity, out.bits);
}

// f(i, inside, chosen) for blocks of the cells i, i + 1, .. of a row, from i = -shift on: which of
// them belong to the row, and which of these are in the pattern as well.
template <class F>
void for_choices(const Row& row, int shift, const Choice& pattern, F&& f) {
  const auto partly = [&](int i) {
    Choice inside;
    stretch(std::max(-i, 0), row.n - i, inside);
    f(i, inside, Choice{inside.bits & pattern.bits});
  };
  const Choice all{Places{} - 1};
  int i = -shift;
  if (shift > 0) partly(i), i += kLanes;
  for (; i + kLanes <= row.n; i += kLanes) f(i, all, pattern);
  if (i < row.n) partly(i);
}

// f(i, stencil, chosen) for these blocks. (The row itself is read before f changes it: a load that
// overlaps a store still under way would wait for it.)
template <class F>
void for_stencils(const Row& row, int shift, const Choice& pattern, F&& f) {
  const float* x = row.x;
  Lanes before, after;
  Stencil s;
  read_block(x - shift - kLanes, before), read_block(x - shift, s.here);
  for_choices(row, shift, pattern, [&](int i, const Choice&, const Choice& chosen) {
    read_block(x + i + kLanes, after);
    s.west = __builtin_shuffle(before, s.here, kPlace + (kLanes - 1));
    s.east = __builtin_shuffle(s.here, after, kPlace + 1);
    read_block(x + i - row.sy, s.south), read_block(x + i + row.sy, s.north);
    read_block(x + i - row.sz, s.down), read_block(x + i + row.sz, s.up);
    before = s.here;
    f(i, s, chosen);
    s.here = after;
  });
}

// f(i, factor) for the ends of a uniform segment that have other neighbours than its inner cells.
template <class F>
void for_ends(const Segment& s, F&& f) {
  if (s.first != s.inner) f(0, s.first);
  if (s.last != s.inner) f(s.end - s.begin - 1, s.last);
}

// A cell of one colour got 1 / inner of a sum, and should get 1 / (its own neighbours).
void complete_ends(const Row& row, int parity, float* x) {
  if (!row.s.uniform()) return;
  for_ends(row.s, [&](int i, int own) {
    if (((i + parity) & 1) == 0) x[i] *= static_cast<float>(row.s.inner) * kShare[own];
  });
}

}  // namespace

// x = diag^-1 (b + sum w x_neighbour); in uniform rows (b / c + sum x_neighbour) / neighbours
void MultigridLevel::relax(const Rows& r, Colour colour, Prefetch prefetch) {
  const AlignedFloats& soon = prefetch.rhs ? b : x;
  const std::size_t further = r.k + prefetch.planes < nz ? prefetch.planes * sz : 0;
  for_rows(*this, r, [&](const Row& row) {
    const int parity = row.parity() ^ static_cast<int>(colour);
    const float* next = soon.data() + row.at + further;
    float* out = x.data() + row.at;
    Choice own;
    every_second(parity, own);
    const auto set = [&](int i, const Stencil& s, const Choice& chosen, const Lanes& value) {
      __builtin_prefetch(next + i);
      Lanes result;
      chosen.select(value, s.here, result);
      write_block(result, out + i);
    };
    if (row.coefficient) {
      for_stencils(row, 0, own, [&](int i, const Stencil& s, const Choice& chosen) {
        Lanes sum, rhs, inverse;
        s.sum(row, i, sum);
        read_block(row.b + i, rhs), read_block(row.part(0) + i, inverse);
        set(i, s, chosen, inverse * (rhs + sum));
      });
      return;
    }
    const float share = kShare[row.s.inner], scale = share / c;
    for_stencils(row, 0, own, [&](int i, const Stencil& s, const Choice& chosen) {
      Lanes sum, rhs;
      s.sum(sum);
      read_block(row.b + i, rhs);
      set(i, s, chosen, scale * rhs + share * sum);
    });
    complete_ends(row, parity, out);
  });
}

void MultigridLevel::start(const Rows& r) {
  for_rows(*this, r, [&](const Row& row) {
    float* out = x.data() + row.at;
    Choice own;
    every_second(row.parity(), own);
    const float share = row.coefficient ? 0.0f : kShare[row.s.inner] / c;
    for_choices(row, 0, own, [&](int i, const Choice& inside, const Choice& chosen) {
      Lanes rhs, here, inverse = share - Lanes{}, value;
      read_block(row.b + i, rhs), read_block(out + i, here);
      if (row.coefficient) read_block(row.part(0) + i, inverse);
      chosen.select(inverse * rhs, Lanes{}, value);
      inside.select(value, here, value);
      write_block(value, out + i);
    });
    complete_ends(row, row.parity(), out);
  });
}

double MultigridLevel::work(const Rows& r) const {
  double total = 0.0;
  for_rows(*this, r, [&](const Row& row) {
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < row.n; ++i)
      sum += static_cast<double>(row.b[i]) * static_cast<double>(row.x[i]);
    total += sum;
  });
  return total;
}

void MultigridLevel::clear_rhs(int k) {
  float* plane = b.data() + sz * (k + 1);
  std::fill(plane, plane + sz, 0.0f);
}

// The residual b - diag x + sum w x_neighbour, in pairs of cells (2I, 2I + 1).
void MultigridLevel::restrict_residual(const Rows& r, MultigridLevel& coarse) const {
  constexpr Places kEven = 2 * kPlace, kOdd = 2 * kPlace + 1;
  const Choice all{Places{} - 1};
  for_rows(*this, r, [&](const Row& row) {
    const int shift = row.s.begin & 1;
    float* to = coarse.b.data() + coarse.index(row.s.begin / 2, row.s.j / 2, r.k / 2);
    const auto add = [&](int i, const Choice& chosen, const Lanes& residual) {
      Lanes kept;
      chosen.select(residual, Lanes{}, kept);
      const Lanes pairs = __builtin_shuffle(kept, kEven) + __builtin_shuffle(kept, kOdd);
      HalfLanes half, old;
      std::memcpy(&half, &pairs, sizeof(half));
      float* place = to + (i + shift) / 2;
      read_block(place, old);
      write_block(old + half, place);
    };
    if (row.coefficient) {
      for_stencils(row, shift, all, [&](int i, const Stencil& s, const Choice& chosen) {
        Lanes sum, rhs, diagonal;
        s.sum(row, i, sum);
        read_block(row.b + i, rhs), read_block(row.part(7) + i, diagonal);
        add(i, chosen, (rhs - diagonal * s.here) + sum);
      });
      return;
    }
    const float inner = row.s.inner;
    for_stencils(row, shift, all, [&](int i, const Stencil& s, const Choice& chosen) {
      Lanes sum, rhs;
      s.sum(sum);
      read_block(row.b + i, rhs);
      add(i, chosen, rhs + c * (sum - inner * s.here));
    });
    for_ends(row.s, [&](int i, int own) {
      to[(i + shift) / 2] += c * static_cast<float>(row.s.inner - own) * row.x[i];
    });
  });
}

void MultigridLevel::prolong(const Rows& r, const MultigridLevel& coarse) {
  for_rows(*this, r, [&](const Row& row) {
    const int shift = row.s.begin & 1;
    const float* from = coarse.x.data() + coarse.index(row.s.begin / 2, row.s.j / 2, r.k / 2);
    float* out = x.data() + row.at;
    const Places parent = (kPlace + shift) >> 1;
    Choice own;
    every_second(row.parity(), own);
    for_choices(row, 0, own, [&](int i, const Choice&, const Choice& chosen) {
      Lanes here, add, child;
      read_block(out + i, here), read_block(from + i / 2, add);
      chosen.select(__builtin_shuffle(add, parent), Lanes{}, child);
      write_block(here + child, out + i);
    });
  });
}

}  // namespace archetide
