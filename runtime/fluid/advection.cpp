#include "runtime/fluid/advection.h"

#include <cmath>
#include <cstring>
#include <memory>

#include "common/check.h"
#include "runtime/fluid/path_block.h"
#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

using Mask = Array3<unsigned char>;

// What MacCormack steps damp goes to zero with the step, and then eddies that the grid does not
// resolve gain energy (a gyre in a box of 16^3 at CFL 0.3 fourfold in 10 s). So much as third-order
// upwind differences carry, |u| dx^3 / 12 times the fourth derivative, keeps them bounded.
constexpr double kUpwind = 1.0 / 12.0;

// out(c) = op over the points c + offset along one axis, offset in [first, last], inside the
// lattice.
template <class Op>
void combine_along(Mask& m, int axis, int first, int last, const Op& op) {
  const Mask in = m;
  const int nx = m.nx(), size[3] = {m.nx(), m.ny(), m.nz()};
  const std::size_t stride[3] = {1, static_cast<std::size_t>(nx),
                                 static_cast<std::size_t>(nx) * m.ny()};
#pragma omp parallel for
  for (int k = 0; k < m.nz(); ++k)
    for (int j = 0; j < m.ny(); ++j)
      for (int offset = first; offset <= last; ++offset) {
        if (offset == 0) continue;
        const int at[3] = {0, j, k};
        if (axis > 0 && (at[axis] + offset < 0 || at[axis] + offset >= size[axis])) continue;
        const int low = axis == 0 ? std::max(0, -offset) : 0;
        const int high = axis == 0 ? std::min(nx, nx - offset) : nx;
        unsigned char* out = m.data() + m.index(0, j, k);
        const unsigned char* from =
            in.data() + m.index(0, j, k) + offset * static_cast<std::ptrdiff_t>(stride[axis]);
        for (int i = low; i < high; ++i) out[i] = op(out[i], from[i]);
      }
}

// 1 where all eight corners of the interpolation cell at n are valid.
Mask whole_stencils(const Mask& valid) {
  Mask whole = valid;
  for (int axis = 0; axis < 3; ++axis)
    combine_along(whole, axis, 0, 1, [](unsigned char a, unsigned char b) {
      return static_cast<unsigned char>((a != 0) & (b != 0));
    });
  return whole;
}

// `target` and its 26 neighbours.
Mask surroundings(const Mask& target) {
  Mask near = target;
  for (int axis = 0; axis < 3; ++axis)
    combine_along(near, axis, -1, 1, [](unsigned char a, unsigned char b) {
      return static_cast<unsigned char>(a | b);
    });
  return near;
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

// Weighted mean over the valid corners; `otherwise` when there are none.
double valid_mean(const Lattice& f, const unsigned char* valid, const Slot s[3], double otherwise) {
  const std::size_t n = f.base(s[0], s[1], s[2]);
  double sum = 0.0, weight = 0.0;
  for (int c = 0; c < 8; ++c) {
    const std::size_t m = n + (c & 1 ? f.sx : 0) + (c & 2 ? f.sy : 0) + (c & 4 ? f.sz : 0);
    if (!valid[m]) continue;
    const double w = (c & 1 ? s[0].f : 1 - s[0].f) * (c & 2 ? s[1].f : 1 - s[1].f) *
                     (c & 4 ? s[2].f : 1 - s[2].f);
    sum += w * f.values[m], weight += w;
  }
  return weight > 1e-12 ? sum / weight : otherwise;
}

// 1 where all 27 points around are valid, away from the ends of the rows.
Mask deep_inside(const Mask& valid) {
  Mask deep = valid;
  for (int axis = 0; axis < 3; ++axis)
    combine_along(deep, axis, -1, 1, [](unsigned char a, unsigned char b) {
      return static_cast<unsigned char>((a != 0) & (b != 0));
    });
  return deep;
}

bool all_ones(const unsigned char* m) {
  constexpr unsigned char kOnes[kBlock] = {1, 1, 1, 1, 1, 1, 1, 1};
  return std::memcmp(m, kOnes, kBlock) == 0;
}

// body(i, j, k, n) for all marked points, but for whole blocks of points that are `deep` inside and
// for which block(i, j, k, n) does it.
template <class BlockBody, class Body>
void for_each_marked(const Mask& mask, const Mask& deep, const BlockBody& block, const Body& body) {
#pragma omp parallel for collapse(2) schedule(dynamic, 8)
  for (int k = 0; k < mask.nz(); ++k)
    for (int j = 0; j < mask.ny(); ++j) {
      const std::size_t n = mask.index(0, j, k);
      const bool inner = j > 0 && j < mask.ny() - 1 && k > 0 && k < mask.nz() - 1;
      for (int i = 0; i < mask.nx();) {
        const bool whole = inner && i > 0 && i + kBlock < mask.nx() &&
                           all_ones(mask.data() + n + i) && all_ones(deep.data() + n + i);
        const int end = whole ? i + kBlock : i + 1;
        if (whole && block(i, j, k, n + i)) i = end;
        for (; i < end; ++i)
          if (mask[n + i]) body(i, j, k, n + i);
      }
    }
}

// Sum over the axes of a weight times the fourth difference of f at the point nearest to the foot
// of the path to lattice point `to`; c: cells that the path crosses along each axis. The weight is
// the distance of the foot from that point, and goes back to 0 where the nearest point changes:
// half-way between two, interpolation itself leaves nothing of waves of two cells. (Differences at
// the path's end feed waves that stand the other way round at its foot; a weight that stays at 1/4
// turns waves into mean flow where neighbours have different nearest points.) An axis without two
// solved points to each side counts nothing.
double biharmonic(const Array3<double>& f, const Mask& valid, const int to[3], const double c[3]) {
  const std::ptrdiff_t stride[3] = {1, f.nx(), static_cast<std::ptrdiff_t>(f.nx()) * f.ny()};
  const int size[3] = {f.nx(), f.ny(), f.nz()};
  int at[3];
  double weight[3];
  for (int a = 0; a < 3; ++a) {
    const double nearest = std::round(c[a]), off = std::abs(c[a] - nearest);
    at[a] = std::clamp(to[a] - static_cast<int>(nearest), 0, size[a] - 1);
    weight[a] = std::min(off, 0.5 - off);
  }
  const std::size_t n = f.index(at[0], at[1], at[2]);
  double sum = 0.0;
  for (int a = 0; a < 3; ++a) {
    if (at[a] < 2 || at[a] + 2 >= size[a]) continue;
    const double* p = f.data() + n;
    const unsigned char* v = valid.data() + n;
    const std::ptrdiff_t s = stride[a];
    if (v[-2 * s] != 1 || v[-s] != 1 || v[0] != 1 || v[s] != 1 || v[2 * s] != 1) continue;
    sum += weight[a] * ((p[-2 * s] + p[2 * s]) - 4.0 * (p[-s] + p[s]) + 6.0 * p[0]);
  }
  return sum;
}

// The same for eight points in a row; false where the points nearest to the feet are not they
// themselves, or not all around are solved.
bool biharmonic_block(const Array3<double>& f, const Mask& valid, const int to[3], const Block c[3],
                      Block& sum) {
  if (!all_within(c, 0.5) || to[0] < 2 || to[0] + kBlock + 2 > f.nx()) return false;
  const std::size_t n = f.index(to[0], to[1], to[2]);
  const auto stride = strides(f);
  const int size[3] = {f.nx(), f.ny(), f.nz()};
  Block here;
  load(f.data() + n, here);
  sum = Block{};
  for (int a = 0; a < 3; ++a) {
    if (a > 0 && (to[a] < 2 || to[a] + 2 >= size[a])) continue;
    const double* p = f.data() + n;
    const unsigned char* v = valid.data() + n;
    const std::ptrdiff_t s = stride[a];
    if (!all_ones(v - 2 * s) || !all_ones(v - s) || !all_ones(v) || !all_ones(v + s) ||
        !all_ones(v + 2 * s))
      return false;
    Block low2, low, high, high2;
    load(p - 2 * s, low2), load(p - s, low), load(p + s, high), load(p + 2 * s, high2);
    const Block off = c[a] < 0.0 ? -c[a] : c[a], rest = 0.5 - off;
    const Block weight = off < rest ? off : rest;
    sum += weight * ((low2 + high2) - 4.0 * (low + high) + 6.0 * here);
  }
  return true;
}

constexpr unsigned char kAtFoot = 255;
struct Scratch {
  std::unique_ptr<double[]> hat;  // first-order result
  // where the path of a face ends: kAtFoot, or a bit for each axis on whose low side it lies
  std::unique_ptr<unsigned char[]> side;
  std::unique_ptr<int[]> foot;  // corner of the interpolation cell where the path of a face ends
};

template <int A>
void advect_component(const Grid& g, const MacField& u, const Array3<double>& f, double dt,
                      const Mask& valid, const Mask& target, Scratch& scratch,
                      Array3<double>& result) {
  const double h = dt / g.dx;
  const MacSampler sampler(g, u);
  const Lattice source(f);
  double* hat = scratch.hat.get();
  int* foot = scratch.foot.get();
  unsigned char* side = scratch.side.get();

  // First order, also one face beyond the target, whose values the way back reads.
  const Mask whole = whole_stencils(valid);
  Mask hat_valid(f.nx(), f.ny(), f.nz());
  const auto stride = strides(f);
  const auto first_block = [&](int i, int j, int k, std::size_t n) {
    Block v[3], d[3], value;
    if (!path_block<A>(u, i, j, k, -h, v, d)) return false;
    interpolate_block(f.data() + n, stride, d, value);
    store(value, hat + n);
    std::memset(&hat_valid[n], 1, kBlock);
    sides_of(d, side + n);
    return true;
  };
  for_each_marked(surroundings(target), deep_inside(valid), first_block,
                  [&](int i, int j, int k, std::size_t n) {
                    Slot s[3];
                    path_end<A>(g, u, sampler, i, j, k, -h, s);
                    const std::size_t base = source.base(s[0], s[1], s[2]);
                    foot[n] = static_cast<int>(base);
                    side[n] = kAtFoot;
                    hat_valid[n] = whole[base];
                    hat[n] = whole[base] ? source.at(base, s[0].f, s[1].f, s[2].f)
                                         : valid_mean(source, valid.data(), s, f[n]);
                  });

  // [SFK08]: f^{n+1} = f^ + (f^n - f^^)/2, with f^^ the way back of f^, clamped to the corners at
  // the foot.
  const Mask whole_hat = whole_stencils(hat_valid);
  Lattice first_order(f);
  first_order.values = hat;
  const auto corrected = [&](std::size_t n, double back, double damped) {
    double low, high;
    std::size_t base = foot[n];
    if (side[n] != kAtFoot) {
      base = n;
      for (int a = 0; a < 3; ++a) base -= side[n] >> a & 1 ? stride[a] : 0;
    }
    source.range(base, low, high);
    return std::min(std::max(hat[n] + 0.5 * (f[n] - back) - damped, low), high);
  };
  const auto damping = [&](int i, int j, int k) {
    double v[3];
    face_velocity<A>(g, u, i, j, k, v);
    const int to[3] = {i, j, k};
    const double c[3] = {h * v[0], h * v[1], h * v[2]};
    return kUpwind * biharmonic(f, valid, to, c);
  };
  const auto second_block = [&](int i, int j, int k, std::size_t n) {
    Block v[3], d[3], back;
    if (!path_block<A>(u, i, j, k, h, v, d)) return false;
    interpolate_block(hat + n, stride, d, back);
    unsigned char at_foot = 0, solved = 1;
    for (int l = 0; l < kBlock; ++l) at_foot |= side[n + l] == kAtFoot, solved &= valid[n + l] != 0;
    if (at_foot || !solved) {
      for (int l = 0; l < kBlock; ++l)
        result[n + l] = valid[n + l] ? corrected(n + l, back[l], damping(i + l, j, k)) : hat[n + l];
      return true;
    }
    Block low, high, first, old, damped;
    for (Block& c : v) c *= h;
    const int to[3] = {i, j, k};
    if (biharmonic_block(f, valid, to, v, damped))
      damped *= kUpwind;
    else
      for (int l = 0; l < kBlock; ++l) damped[l] = damping(i + l, j, k);
    range_block(f.data() + n, stride, side + n, low, high);
    load(hat + n, first), load(f.data() + n, old);
    const Block value = first + 0.5 * (old - back) - damped;
    const Block above = value > low ? value : low;
    store(above < high ? above : high, &result[n]);
    return true;
  };
  for_each_marked(
      target, deep_inside(hat_valid), second_block, [&](int i, int j, int k, std::size_t n) {
        result[n] = hat[n];
        if (!hat_valid[n] || !valid[n]) return;
        Slot s[3];
        path_end<A>(g, u, sampler, i, j, k, h, s);
        const std::size_t base = first_order.base(s[0], s[1], s[2]);
        if (!whole_hat[base]) return;
        result[n] = corrected(n, first_order.at(base, s[0].f, s[1].f, s[2].f), damping(i, j, k));
      });
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
  advect_component<0>(g, transporting, advected[0], dt, valid_source[0], target[0], scratch,
                      result[0]);
  advect_component<1>(g, transporting, advected[1], dt, valid_source[1], target[1], scratch,
                      result[1]);
  advect_component<2>(g, transporting, advected[2], dt, valid_source[2], target[2], scratch,
                      result[2]);
}

double cfl_speed(const MacField& u, const FaceField<unsigned char>* mask) {
  double fastest = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double* f = u[a].data();
    const unsigned char* m = mask ? (*mask)[a].data() : nullptr;
#pragma omp parallel for reduction(max : fastest)
    for (std::size_t n = 0; n < u[a].size(); ++n)
      if (!m || m[n]) fastest = std::max(fastest, std::abs(f[n]));
  }
  return fastest;
}

}  // namespace archetide
