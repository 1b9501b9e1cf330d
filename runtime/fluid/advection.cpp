#include "runtime/fluid/advection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "common/base/check.h"
#include "common/base/exception_carrier.h"
#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/path_block.h"
#include "runtime/fluid/sampling.h"
#include "runtime/numerics/largest.h"

namespace archetide {
namespace {

using Mask = Array3<unsigned char>;

// What MacCormack steps damp goes to zero with the step, and then eddies that the grid does not
// resolve gain energy. So much as third-order upwind differences carry, |u| dx^3 / 12 times the
// fourth derivative, keeps them bounded [D22].
constexpr double kUpwind = 1.0 / 12.0;

struct Marks {
  Mask mask;
  RowShares rows;
};

RowShares rows_of(const Mask& m) {
  return row_shares(m, [marks = m.data()](std::size_t n) { return marks[n] != 0; });
}

// out[i] = op(out[i], in[i])
template <class Op>
void combine_row(const unsigned char* __restrict in, int count, const Op& op,
                 unsigned char* __restrict out) {
#pragma omp simd
  for (int i = 0; i < count; ++i) out[i] = op(out[i], in[i]);
}

// out(c) = op over the points c + {first .. last}^3 that are in the lattice; `nothing`, as 0 or 1,
// changes no result, and the other one is the result wherever it occurs.
template <class Op>
Marks combine(const Mask& in, const RowShares& rows, int first, int last, unsigned char nothing,
              const Op& op) {
  const int nx = in.nx(), ny = in.ny(), nz = in.nz();
  Marks out{Mask(nx, ny, nz, Unfilled{}), {ny, std::vector<Share>(rows.row.size())}};
  const Share same = nothing ? Share::kAll : Share::kNone,
              other = nothing ? Share::kNone : Share::kAll;
  ExceptionCarrier carrier;
#pragma omp parallel
  {
    std::vector<unsigned char> line;
    carrier.run([&] { line.assign(nx + last - first, nothing); });
#pragma omp for schedule(dynamic)
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny && !carrier.caught(); ++j) {
        Share& share = out.rows.row[j + static_cast<std::size_t>(ny) * k];
        unsigned char* row = &out.mask(0, j, k);
        const int k0 = std::max(k + first, 0), k1 = std::min(k + last, nz - 1),
                  j0 = std::max(j + first, 0), j1 = std::min(j + last, ny - 1);
        bool alike = true, settled = false;
        for (int kk = k0; kk <= k1; ++kk)
          for (int jj = j0; jj <= j1; ++jj) {
            alike &= rows(jj, kk) == same;
            settled |= rows(jj, kk) == other;
          }
        if (alike || settled) {
          share = alike ? same : other;
          std::fill_n(row, nx, share == Share::kAll);
          continue;
        }
        unsigned char* middle = line.data() - first;
        std::fill_n(middle, nx, nothing);
        for (int kk = k0; kk <= k1; ++kk)
          for (int jj = j0; jj <= j1; ++jj) combine_row(&in(0, jj, kk), nx, op, middle);
        std::fill_n(row, nx, nothing);
        for (int offset = first; offset <= last; ++offset)
          combine_row(middle + offset, nx, op, row);
        share = Share::kSome;
      }
  }
  carrier.rethrow();
  return out;
}

constexpr auto kBoth = [](unsigned char a, unsigned char b) {
  return static_cast<unsigned char>((a != 0) & (b != 0));
};
constexpr auto kEither = [](unsigned char a, unsigned char b) {
  return static_cast<unsigned char>((a != 0) | (b != 0));
};

// 1 where all eight corners of the interpolation cell at n are valid.
Mask whole_stencils(const Mask& valid, const RowShares& rows) {
  return combine(valid, rows, 0, 1, 1, kBoth).mask;
}
// 1 where all 27 points around are valid.
Marks deep_inside(const Mask& valid, const RowShares& rows) {
  return combine(valid, rows, -1, 1, 1, kBoth);
}
// `target` and its 26 neighbours.
Marks surroundings(const Mask& target) {
  return combine(target, rows_of(target), -1, 1, 0, kEither);
}

// Velocity at MAC face (i,j,k) of axis A: its own component and the mean of the four around it.
template <int A>
void face_velocity(const Grid& g, const MacField& u, int i, int j, int k, double v[3]) {
  v[A] = u[A](i, j, k);
  const int c[3] = {i, j, k};
  const int low = std::max(c[A] - 1, 0), high = std::min(c[A], g.size(A) - 1);
  for (int b = 0; b < 3; ++b) {
    if (b == A) continue;
    int p[3] = {i, j, k}, q[3] = {i, j, k};
    p[A] = low, q[A] = high;
    const Array3<double>& f = u[b];
    const std::size_t step = b == 0   ? 1
                             : b == 1 ? f.nx()
                                      : static_cast<std::size_t>(f.nx()) * f.ny();
    const double* fp = f.data() + f.index(p[0], p[1], p[2]);
    const double* fq = f.data() + f.index(q[0], q[1], q[2]);
    v[b] = 0.25 * ((fp[0] + fq[0]) + (fp[step] + fq[step]));
  }
}

// Where the path of face (i,j,k) over -h or +h ends, as slots of the component's own lattice.
template <int A>
void path_end(const Grid& g, const MacField& u, const MacSampler& sampler, int i, int j, int k,
              double h, Slot s[3]) {
  double v[3];
  face_velocity<A>(g, u, i, j, k, v);
  const Axes x = {A == 0 ? i : i + 0.5, A == 1 ? j : j + 0.5, A == 2 ? k : k + 0.5, 0.0};
  Axes y;
  sampler.trace(x, Axes{v[0], v[1], v[2], 0.0}, h, y);
  sampler.slots<A>(y, s);
}

bool all_ones(const unsigned char* m) {
  std::uint64_t bytes;
  static_assert(sizeof(bytes) == kBlock);
  std::memcpy(&bytes, m, sizeof(bytes));
  return bytes == kEachByte;
}

bool none_zero(const unsigned char* m) { return std::memchr(m, 0, kBlock) == nullptr; }

constexpr int kEnd = 1;  // points at the ends of the rows that blocks leave out

// body(i, j, k, n) for the marked points of a row, but for blocks that are `deep` inside and for
// which block(first, n) does it; blocks may hold points that are not marked, and overlap. `every`:
// all of the row are marked.
template <class BlockBody, class Body>
void for_each_marked_of_row(const Mask& mask, bool every, const Marks& deep, int j, int k,
                            const BlockBody& block, const Body& body) {
  const std::size_t n = mask.index(0, j, k);
  const bool all_deep = deep.rows(j, k) == Share::kAll;
  const int nx = mask.nx(), last = nx - kEnd - kBlock;
  for (int i = 0; i < nx;) {
    if (!every && !mask[n + i]) {
      ++i;
      continue;
    }
    const int first = std::min(i, last);
    const bool whole = i >= kEnd && i < nx - kEnd && first >= kEnd &&
                       (all_deep || all_ones(&deep.mask[n + first]));
    if (whole && block(first, n + first)) {
      i = first + kBlock;
      continue;
    }
    for (const int end = whole ? std::min(i + kBlock, nx) : i + 1; i < end; ++i)
      if (every || mask[n + i]) body(i, j, k, n + i);
  }
}

// The same for all rows, block(row_of(j, k), i, j, k, n), in bars of rows whose neighbours above
// and below are still in the cache when they are read.
template <class RowOf, class BlockBody, class Body>
void for_each_marked(const Mask& mask, const RowShares& rows, const Marks& deep,
                     const RowOf& row_of, const BlockBody& block, const Body& body) {
  constexpr int kWide = 8, kHigh = 16;
  const int ny = mask.ny(), nz = mask.nz();
#pragma omp parallel for collapse(2) schedule(dynamic)
  for (int k0 = 0; k0 < nz; k0 += kHigh)
    for (int j0 = 0; j0 < ny; j0 += kWide)
      for (int k = k0; k < std::min(k0 + kHigh, nz); ++k)
        for (int j = j0; j < std::min(j0 + kWide, ny); ++j) {
          if (rows(j, k) == Share::kNone) continue;
          const auto row = row_of(j, k);
          for_each_marked_of_row(
              mask, rows(j, k) == Share::kAll, deep, j, k,
              [&](int first, std::size_t at) { return block(row, first, j, k, at); }, body);
        }
}

template <class Real>
Real second_difference(const Real& low, const Real& here, const Real& high) {
  return (low + high) - 2.0 * here;
}

// Sum over the axes of a weight times the fourth difference of f at the point nearest to the foot
// of the path to lattice point `to`; c: cells that the path crosses along each axis. The weight is
// the distance of the foot from that point, and goes back to 0 where the nearest point changes:
// half-way between two, interpolation itself leaves nothing of waves of two cells. (Differences at
// the path's end feed waves that stand the other way round at its foot; a weight that stays at 1/4
// turns waves into mean flow where neighbours have different nearest points.) Second differences
// that do not stand on three solved points count nothing, in the second difference of them: beside
// the tank's walls and the surface energy is taken as well, and what is linear stays. An axis with
// a closed face within two points counts nothing [D22].
double biharmonic(const Array3<double>& f, const Mask& valid, const int to[3], const double c[3]) {
  const auto stride = strides(f);
  const int size[3] = {f.nx(), f.ny(), f.nz()};
  int at[3];
  double weight[3];
  for (int a = 0; a < 3; ++a) {
    const double nearest = std::rint(c[a]), off = std::abs(c[a] - nearest);
    at[a] = std::clamp(to[a] - static_cast<int>(nearest), 0, size[a] - 1);
    weight[a] = std::min(off, 0.5 - off);
  }
  const std::size_t n = f.index(at[0], at[1], at[2]);
  double sum = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double* p = f.data() + n;
    const unsigned char* v = valid.data() + n;
    const std::ptrdiff_t s = stride[a];
    bool closed = false, solved[5];
    for (int m = -2; m <= 2; ++m) {
      const bool there = at[a] + m >= 0 && at[a] + m < size[a];
      solved[m + 2] = there && v[m * s] == 1;
      closed |= there && v[m * s] == kClosedFace;
    }
    if (closed) continue;
    const auto bend = [&](int m) {
      const bool counts = solved[m + 1] && solved[m + 2] && solved[m + 3];
      return counts ? second_difference(p[(m - 1) * s], p[m * s], p[(m + 1) * s]) : 0.0;
    };
    sum += weight[a] * second_difference(bend(-1), bend(0), bend(1));
  }
  return sum;
}

// The same for a block of points; false where the points nearest to the feet are not they
// themselves. `solved`: every point that is requested is.
ARCHETIDE_INLINE bool biharmonic_block(const Array3<double>& f, const Mask& valid, bool solved,
                                       const int to[3], const Block c[3], Block& sum) {
  const std::size_t n = f.index(to[0], to[1], to[2]);
  const auto stride = strides(f);
  const int size[3] = {f.nx(), f.ny(), f.nz()};
  if (n < 2 || n + kBlock + 2 > f.size()) return false;  // its neighbours' neighbours do not exist
  const double* p = f.data() + n;
  const unsigned char* v = valid.data() + n;
  Block weight[3];
  BlockBits over = {};
  for (int a = 0; a < 3; ++a) {
    Block off;
    magnitude(c[a], off);
    const Block rest = 0.5 - off;
    over |= (BlockBits)rest;
    weight[a] = off < rest ? off : rest;
  }
  if (bytes_of(over >> 63) != 0) return false;
  sum = Block{};
  for (int a = 0; a < 3; ++a) {
    const std::ptrdiff_t s = stride[a];
    // Points along the axis that all of the block have.
    const int first = a == 0 ? -2 : std::max(-2, -to[a]),
              last = a == 0 ? 2 : std::min(2, size[a] - 1 - to[a]);
    if (solved && last - first == 4) {
      Block low2, low, here, high, high2;
      load(p - 2 * s, low2), load(p - s, low), load(p, here), load(p + s, high);
      load(p + 2 * s, high2);
      sum += weight[a] * second_difference(second_difference(low2, low, here),
                                           second_difference(low, here, high),
                                           second_difference(here, high, high2));
      continue;
    }
    Block value[5] = {}, bend[3] = {};
    BlockBytes solved_at[5], closed = {};
    for (int m = -2; m <= 2; ++m) {
      BlockBytes there = {}, mark = {};
      if (m >= first && m <= last) {
        load(p + m * s, value[m + 2]);
        std::memcpy(&mark, v + m * s, sizeof(mark));
        there = ~there;
        for (int l = 0; a == 0 && l < kBlock; ++l)
          if (to[0] + l + m < 0 || to[0] + l + m >= size[0]) there[l] = 0;
      }
      solved_at[m + 2] = there & (BlockBytes)(mark == 1);
      closed |= there & (BlockBytes)(mark == kClosedFace);
    }
    for (int m = 0; m < 3; ++m) {
      const BlockBytes counts = solved_at[m] & solved_at[m + 1] & solved_at[m + 2] & ~closed;
      bend[m] = second_difference(value[m], value[m + 1], value[m + 2]);
      bend[m] = (Block)((BlockBits)bend[m] & __builtin_convertvector(counts != 0, BlockBits));
    }
    sum += weight[a] * second_difference(bend[0], bend[1], bend[2]);
  }
  return true;
}

// Points of a row from begin to before end.
struct Stretch {
  int begin = 0, end = 0;

  bool holds(int first, int last) const { return first >= begin && last <= end; }
};

// The longest stretch of each row's solved points: all but the ends, or what is left beside bodies.
std::vector<Stretch> solved_stretches(const Mask& valid) {
  const int nx = valid.nx();
  std::vector<Stretch> rows(static_cast<std::size_t>(valid.ny()) * valid.nz());
#pragma omp parallel for schedule(static)
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const unsigned char* row = valid.data() + r * nx;
    int solved = 0;
#pragma omp simd reduction(+ : solved)
    for (int i = 0; i < nx; ++i) solved += row[i] == 1;
    if (solved == nx) rows[r] = {0, nx};
    for (int i = 0; i < nx && solved > 0 && solved < nx; ++i) {
      if (row[i] != 1) continue;
      const int begin = i;
      while (i < nx && row[i] == 1) ++i;
      if (i - begin > rows[r].end - rows[r].begin) rows[r] = {begin, i};
    }
  }
  return rows;
}

// What is solved of row (j, k) and of the rows up to two points away along y and z.
Stretch solved_around(const Mask& valid, const std::vector<Stretch>& rows, int j, int k) {
  Stretch common{0, valid.nx()};
  const auto meet = [&](int jj, int kk) {
    const Stretch& s = rows[jj + static_cast<std::size_t>(valid.ny()) * kk];
    common = {std::max(common.begin, s.begin), std::min(common.end, s.end)};
  };
  for (int m = std::max(j - 2, 0); m <= std::min(j + 2, valid.ny() - 1); ++m) meet(m, k);
  for (int m = std::max(k - 2, 0); m <= std::min(k + 2, valid.nz() - 1); ++m) meet(j, m);
  return common;
}

// A path's sides, or that its corner is in `foot`.
constexpr unsigned char kAtFoot = 255, kFootByte = 128;
struct Scratch {
  std::unique_ptr<double[]> hat;  // first-order result
  // where the path of a face ends: kAtFoot, or a bit for each axis on whose low side it lies
  std::unique_ptr<unsigned char[]> side;
  std::unique_ptr<int[]> foot;  // corner of the interpolation cell where the path of a face ends
};

// Corner of the interpolation cell beside point c on these sides, inside the lattice.
std::size_t corner_beside(const Array3<double>& f, const int c[3], unsigned char sides) {
  const int size[3] = {f.nx(), f.ny(), f.nz()};
  int at[3];
  for (int a = 0; a < 3; ++a)
    at[a] = std::clamp(c[a] - (sides >> a & 1), 0, std::max(size[a] - 2, 0));
  return f.index(at[0], at[1], at[2]);
}

// The same neighbours, but at the lattice's ends those inside.
Steps steps_inside(Steps s) {
  for (int a = 0; a < 3; ++a) {
    if (s.low[a] == 0) s.low[a] = s.high[a];
    if (s.high[a] == 0) s.high[a] = s.low[a];
  }
  return s;
}

// One component, in two passes: first order, and what that lacks.
template <int A>
class ComponentAdvection {
 public:
  ComponentAdvection(const Grid& grid, const MacField& carrier, const Array3<double>& values,
                     double steps, const Mask& valid_source, Scratch& s)
      : g(grid), u(carrier), f(values), h(steps), valid(valid_source), scratch(s) {}

  // First order, also one face beyond the target, whose values the way back reads.
  void go_there(const Mask& target) {
    const Marks wanted = surroundings(target);
    for_each_marked(
        wanted.mask, wanted.rows, deep_inside(valid, valid_rows),
        [this](int j, int k) { return PathRow<A>(g, u, j, k); },
        [&](const PathRow<A>& row, int i, int, int, std::size_t n) {
          return first_block(row, i, n);
        },
        [&](int i, int j, int k, std::size_t n) { first_point(i, j, k, n); });
    hat_rows = rows_of(hat_valid);
    whole_hat = whole_stencils(hat_valid, hat_rows);
    first_order.values = scratch.hat.get();
  }

  // [SFK08]: f^{n+1} = f^ + (f^n - f^^)/2, with f^^ the way back of f^, clamped to the corners at
  // the foot.
  void come_back(const Mask& target, Array3<double>& result) const {
    const RowShares wanted = rows_of(target);
    const std::vector<Stretch> solved = solved_stretches(valid);
    for_each_marked(
        target, wanted, deep_inside(hat_valid, hat_rows),
        [&](int j, int k) {
          return RowBack{
              {g, u, j, k}, solved_around(valid, solved, j, k), wanted(j, k) == Share::kAll};
        },
        [&](const RowBack& row, int i, int j, int k, std::size_t n) {
          Block value;
          if (!second_block(row, i, j, k, n, value)) return false;
          if (row.wanted || all_ones(&target[n]))
            store(value, &result[n]);
          else
            for (int l = 0; l < kBlock; ++l)
              if (target[n + l]) result[n + l] = value[l];
          return true;
        },
        [&](int i, int j, int k, std::size_t n) { result[n] = second_point(i, j, k, n); });
  }

 private:
  struct RowBack : PathRow<A> {
    Stretch solved;  // and its neighbours
    bool wanted;     // every face
  };

  bool first_block(const PathRow<A>& row, int i, std::size_t n) {
    Block v[3], d[3];
    row.fetch_ahead(i);
    row.velocities(i, v);
    if (!row.ends(i, -h, v, d)) return false;
    const BlockSides sides(d, 1.0);
    if (sides.any_far()) return false;
    Block value;
    const Steps& steps = row.s[A];
    __builtin_prefetch(f.data() + n + 2 * steps.high[2]);
    interpolate_block(f.data() + n, steps, d, sides, value);
    store(value, &scratch.hat[n]);
    std::memcpy(&scratch.side[n], &sides.bytes, kBlock);
    std::memset(&hat_valid[n], 1, kBlock);
    return true;
  }

  void first_point(int i, int j, int k, std::size_t n) {
    Slot s[3];
    path_end<A>(g, u, sampler, i, j, k, -h, s);
    const std::size_t base = source.base(s[0], s[1], s[2]);
    scratch.foot[n] = static_cast<int>(base);
    scratch.side[n] = kAtFoot;
    hat_valid[n] = whole[base];
    scratch.hat[n] = whole[base]
                         ? source.at(base, s[0].f, s[1].f, s[2].f)
                         : mean_where(
                               source, s, [this](std::size_t m) { return valid[m] != 0; }, f[n]);
  }

  // Eq. W2.
  double corrected(int i, int j, int k, std::size_t n, double back, double damped) const {
    double low, high;
    const int at[3] = {i, j, k};
    const unsigned char side = scratch.side[n];
    source.range(side == kAtFoot ? scratch.foot[n] : corner_beside(f, at, side), low, high);
    return std::min(std::max(scratch.hat[n] + 0.5 * (f[n] - back) - damped, low), high);
  }

  double damping(int i, int j, int k) const {
    double v[3];
    face_velocity<A>(g, u, i, j, k, v);
    const int to[3] = {i, j, k};
    const double c[3] = {h * v[0], h * v[1], h * v[2]};
    return kUpwind * biharmonic(f, valid, to, c);
  }

  bool second_block(const RowBack& row, int i, int j, int k, std::size_t n, Block& value) const {
    Block v[3], d[3];
    row.fetch_ahead(i);
    row.velocities(i, v);
    if (!row.ends(i, h, v, d)) return false;
    const BlockSides sides(d, 1.0);
    if (sides.any_far()) return false;
    const Steps& steps = row.s[A];
    Block back;
    __builtin_prefetch(f.data() + n + 2 * steps.high[2]);
    __builtin_prefetch(scratch.hat.get() + n + 2 * steps.high[2]);
    interpolate_block(&scratch.hat[n], steps, d, sides, back);
    std::uint64_t at_foot;
    std::memcpy(&at_foot, &scratch.side[n], sizeof(at_foot));
    const bool solved = row.solved.holds(i - 2, i + kBlock + 2);
    const bool one_by_one =
        (at_foot & kFootByte * kEachByte) != 0 || !(solved || none_zero(&valid[n]));
    if (one_by_one) {
      for (int l = 0; l < kBlock; ++l)
        value[l] = valid[n + l] ? corrected(i + l, j, k, n + l, back[l], damping(i + l, j, k))
                                : scratch.hat[n + l];
      return true;
    }
    Block low, high, first, old, damped;
    for (int a = 0; a < 3; ++a) v[a] *= h;
    const int to[3] = {i, j, k};
    if (biharmonic_block(f, valid, solved, to, v, damped))
      damped *= kUpwind;
    else
      for (int l = 0; l < kBlock; ++l) damped[l] = damping(i + l, j, k);
    range_block(f.data() + n, steps_inside(steps), at_foot, low, high);
    load(&scratch.hat[n], first), load(f.data() + n, old);
    const Block raw = first + 0.5 * (old - back) - damped;
    const Block above = raw > low ? raw : low;
    value = above < high ? above : high;
    return true;
  }

  double second_point(int i, int j, int k, std::size_t n) const {
    if (!hat_valid[n] || !valid[n]) return scratch.hat[n];
    Slot s[3];
    path_end<A>(g, u, sampler, i, j, k, h, s);
    const std::size_t base = first_order.base(s[0], s[1], s[2]);
    if (!whole_hat[base]) return scratch.hat[n];
    return corrected(i, j, k, n, first_order.at(base, s[0].f, s[1].f, s[2].f), damping(i, j, k));
  }

  const Grid& g;
  const MacField& u;
  const Array3<double>& f;
  const double h;  // s/m
  const Mask& valid;
  Scratch& scratch;
  const MacSampler sampler{g, u};
  const Lattice source{f};
  const RowShares valid_rows = rows_of(valid);
  const Mask whole = whole_stencils(valid, valid_rows);
  Mask hat_valid{f.nx(), f.ny(), f.nz()}, whole_hat;
  RowShares hat_rows;
  Lattice first_order{f};
};

template <int A>
void advect_component(const Grid& g, const MacField& u, const MacField& advected, double dt,
                      const FaceField<unsigned char>& valid, const FaceField<unsigned char>& target,
                      Scratch& scratch, MacField& result) {
  ComponentAdvection<A> advection(g, u, advected[A], dt / g.dx, valid[A], scratch);
  advection.go_there(target[A]);
  advection.come_back(target[A], result[A]);
}

}  // namespace

void advect_velocity(const Grid& g, const MacField& transporting, const MacField& advected,
                     double dt, const FaceField<unsigned char>& valid_source,
                     const FaceField<unsigned char>& target, MacField& result) {
  ARCHETIDE_CHECK(&result != &advected && &result != &transporting);
  std::size_t largest = 0;
  for (int a = 0; a < 3; ++a) largest = std::max(largest, advected[a].size());
  for (int a = 0; a < 3; ++a)
    if (result[a].size() != advected[a].size()) result.resize(g);
  Scratch scratch{std::make_unique_for_overwrite<double[]>(largest),
                  std::make_unique_for_overwrite<unsigned char[]>(largest),
                  std::make_unique_for_overwrite<int[]>(largest)};
  advect_component<0>(g, transporting, advected, dt, valid_source, target, scratch, result);
  advect_component<1>(g, transporting, advected, dt, valid_source, target, scratch, result);
  advect_component<2>(g, transporting, advected, dt, valid_source, target, scratch, result);
}

double cfl_speed(const MacField& u, const FaceField<unsigned char>* mask) {
  double fastest = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double* f = u[a].data();
    const unsigned char* m = mask ? (*mask)[a].data() : nullptr;
    fastest = std::max(
        fastest,
        m ? largest_of(u[a].size(), [=](std::size_t n) { return m[n] ? std::abs(f[n]) : 0.0; })
          : largest_of(u[a].size(), [=](std::size_t n) { return std::abs(f[n]); }));
  }
  return fastest;
}

double speed_of_most(const MacField& u, const FaceField<unsigned char>& valid, double share,
                     double factor) {
  constexpr int kBins = 64;
  const double fastest = cfl_speed(u, &valid), least = fastest / factor;
  if (share == 0.0 || fastest == 0.0) return fastest;
  const double width = (fastest - least) / kBins;
  std::array<std::int64_t, kBins> faster{};  // faces by speed, from `least` on
  std::int64_t wet = 0;
#pragma omp parallel
  {
    std::array<std::int64_t, kBins> mine{};
    std::int64_t seen = 0;
    for (int a = 0; a < 3; ++a) {
      const double* f = u[a].data();
      const unsigned char* v = valid[a].data();
#pragma omp for schedule(static)
      for (std::size_t n = 0; n < u[a].size(); ++n) {
        if (v[n] != 1) continue;
        ++seen;
        const double above = std::abs(f[n]) - least;
        if (above > 0.0) ++mine[std::min(static_cast<int>(above / width), kBins - 1)];
      }
    }
#pragma omp critical
    {
      wet += seen;
      for (int b = 0; b < kBins; ++b) faster[b] += mine[b];
    }
  }
  const auto spared = static_cast<std::int64_t>(share * static_cast<double>(wet));
  if (spared == 0) return fastest;
  int bin = kBins;
  for (std::int64_t count = 0; bin > 0; --bin) {
    count += faster[bin - 1];
    if (count > spared) break;
  }
  return least + bin * width;
}

}  // namespace archetide
