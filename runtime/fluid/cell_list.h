#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <type_traits>
#include <vector>

#include "common/base/exception_carrier.h"
#include "runtime/grid/grid.h"

namespace archetide {

/// Index of one lattice point taken apart.
struct Ijk {
  int i, j, k;
};

template <class T>
Ijk unravel(const Array3<T>& a, int n) {
  const unsigned row = static_cast<unsigned>(n) / static_cast<unsigned>(a.nx());
  const unsigned slab = row / static_cast<unsigned>(a.ny());
  return {n - static_cast<int>(row) * a.nx(), static_cast<int>(row - slab * a.ny()),
          static_cast<int>(slab)};
}

/// The cell around x, of the outermost ones where x lies outside.
inline int cell_of(const Grid& g, const Vec3& x) {
  const Vec3 c = (x - g.origin) / g.dx;
  const int i = std::clamp(static_cast<int>(c[0]), 0, g.nx - 1),
            j = std::clamp(static_cast<int>(c[1]), 0, g.ny - 1),
            k = std::clamp(static_cast<int>(c[2]), 0, g.nz - 1);
  return i + g.nx * (j + g.ny * k);
}

/// f(cell) for the cells that lie at a side of the grid.
template <class F>
void for_cells_at_side(const Grid& g, int side, const F& f) {
  const int axis = side / 2, b = (axis + 1) % 3, c = (axis + 2) % 3;
  Vec3i at;
  at[axis] = side % 2 ? g.size(axis) - 1 : 0;
  for (at[c] = 0; at[c] < g.size(c); ++at[c])
    for (at[b] = 0; at[b] < g.size(b); ++at[b]) f(Ijk{at[0], at[1], at[2]});
}

/// Shorter lists are not worth waking the threads for.
constexpr int kParallelFrom = 2048;

/// `value`, but `old` where they differ by at most `rounding`; from there to twice as much in
/// between, so that nothing depends on the last digit.
inline double unless_rounding(double old, double value, double rounding) {
  const double change = value - old;
  if (std::abs(change) >= 2.0 * rounding) return value;
  return old + std::max(std::abs(change) / rounding - 1.0, 0.0) * change;
}

/// Joins the lists, or `list` of each of the parts, in their order.
template <class Part, class List = std::identity>
auto concatenate(const std::vector<Part>& parts, List list = {}) {
  std::vector<std::size_t> start(parts.size() + 1, 0);
  for (std::size_t n = 0; n < parts.size(); ++n)
    start[n + 1] = start[n] + std::invoke(list, parts[n]).size();
  std::decay_t<decltype(std::invoke(list, parts[0]))> all(start.back());
#pragma omp parallel for schedule(static) if (start.back() > 16 * kParallelFrom)
  for (std::size_t n = 0; n < parts.size(); ++n)
    std::ranges::copy(std::invoke(list, parts[n]), all.data() + start[n]);
  return all;
}

/// How much of each row along x of a lattice has a property. What holds for whole rows, as for most
/// of the water, need not be tested point by point.
enum class Share : unsigned char { kNone, kSome, kAll };
struct RowShares {
  int ny = 0;
  std::vector<Share> row;  // (j, k), j fastest

  Share operator()(int j, int k) const { return row[j + static_cast<std::size_t>(ny) * k]; }
};
template <class T, class Property>
RowShares row_shares(const Array3<T>& shape, const Property& has) {
  const int nx = shape.nx();
  RowShares rows{shape.ny(), std::vector<Share>(static_cast<std::size_t>(shape.ny()) * shape.nz())};
#pragma omp parallel for schedule(static)
  for (std::size_t r = 0; r < rows.row.size(); ++r) {
    const std::size_t first = r * nx;
    unsigned char any = 0, all = 1;
#pragma omp simd reduction(| : any) reduction(& : all)
    for (int i = 0; i < nx; ++i) {
      const unsigned char here = has(first + i);
      any |= here, all &= here;
    }
    rows.row[r] = all ? Share::kAll : any ? Share::kSome : Share::kNone;
  }
  return rows;
}

/// Indices n of the lattice of `shape` with keep(i, j, k, n), ascending whatever the number of
/// threads.
template <class T, class Predicate>
std::vector<int> collect_cells(const Array3<T>& shape, const Predicate& keep) {
  std::vector<std::vector<int>> parts(shape.nz());
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < shape.nz(); ++k)
    carrier.run([&] {
      for (int j = 0; j < shape.ny(); ++j) {
        int n = static_cast<int>(shape.index(0, j, k));
        for (int i = 0; i < shape.nx(); ++i, ++n)
          if (keep(i, j, k, n)) parts[k].push_back(n);
      }
    });
  carrier.rethrow();
  return concatenate(parts);
}

/// The same, of cells that differ from a neighbour by a property has(n) of single cells: rows of
/// cells that are, with the four rows beside them, all alike are not looked at.
template <class T, class Property, class Predicate>
std::vector<int> collect_cells_at_changes(const Array3<T>& shape, const Property& has,
                                          const Predicate& keep) {
  const int nx = shape.nx(), ny = shape.ny(), nz = shape.nz();
  const RowShares rows = row_shares(shape, has);
  const auto alike = [&](int j, int k) {
    const Share own = rows(j, k);
    const auto same = [&](int jj, int kk) {
      return jj < 0 || jj >= ny || kk < 0 || kk >= nz || rows(jj, kk) == own;
    };
    return own != Share::kSome && same(j - 1, k) && same(j + 1, k) && same(j, k - 1) &&
           same(j, k + 1);
  };
  std::vector<std::vector<int>> parts(nz);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < nz; ++k)
    carrier.run([&] {
      for (int j = 0; j < ny; ++j) {
        if (alike(j, k)) continue;
        int n = static_cast<int>(shape.index(0, j, k));
        for (int i = 0; i < nx; ++i, ++n)
          if (keep(i, j, k, n)) parts[k].push_back(n);
      }
    });
  carrier.rethrow();
  return concatenate(parts);
}

/// Calls f(axis, side, m) for each of the up to six neighbours m of point n; side is -1 or +1.
template <class T, class F>
void for_each_neighbour(const Array3<T>& shape, Ijk c, int n, const F& f) {
  const int sy = shape.nx(), sz = shape.nx() * shape.ny();
  if (c.i > 0) f(0, -1, n - 1);
  if (c.i < shape.nx() - 1) f(0, 1, n + 1);
  if (c.j > 0) f(1, -1, n - sy);
  if (c.j < shape.ny() - 1) f(1, 1, n + sy);
  if (c.k > 0) f(2, -1, n - sz);
  if (c.k < shape.nz() - 1) f(2, 1, n + sz);
}

/// f(m) for the up to 27 cells m around and at c.
template <class T, class F>
void for_each_around(const Array3<T>& shape, Ijk c, const F& f) {
  for (int k = std::max(c.k - 1, 0); k <= std::min(c.k + 1, shape.nz() - 1); ++k)
    for (int j = std::max(c.j - 1, 0); j <= std::min(c.j + 1, shape.ny() - 1); ++j)
      for (int i = std::max(c.i - 1, 0); i <= std::min(c.i + 1, shape.nx() - 1); ++i)
        f(static_cast<int>(shape.index(i, j, k)));
}

/// Whether the surface phi = 0 lies between open cell n and an open neighbour; `solid` may be
/// empty.
inline bool crosses_in_the_open(const Array3<double>& phi, const Array3<unsigned char>& solid,
                                Ijk c, int n) {
  const auto open = [&](int m) { return solid.size() == 0 || solid[m] == 0; };
  bool crosses = false;
  for_each_neighbour(
      phi, c, n, [&](int, int, int m) { crosses |= (phi[m] < 0.0) != (phi[n] < 0.0) && open(m); });
  return crosses && open(n);
}

/// What add(n, out) appends for the points n of a list, in their order whatever the number of
/// threads.
template <class Add>
std::vector<int> collect_from(const std::vector<int>& list, const Add& add) {
  constexpr int kChunk = 1024;
  const int count = static_cast<int>(list.size());
  std::vector<std::vector<int>> parts((count + kChunk - 1) / kChunk);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (count > kParallelFrom)
  for (int part = 0; part < static_cast<int>(parts.size()); ++part)
    carrier.run([&] {
      for (int t = part * kChunk; t < std::min(count, (part + 1) * kChunk); ++t)
        add(list[t], parts[part]);
    });
  carrier.rethrow();
  return concatenate(parts);
}

/// The points with mark 0 beside those of `front`, which are all that are marked `last`: each once,
/// from the first of its neighbours in the front, in an order that does not depend on the number of
/// threads.
inline std::vector<int> next_front(const Array3<unsigned char>& mark, const std::vector<int>& front,
                                   unsigned char last) {
  const int sy = mark.nx(), sz = mark.nx() * mark.ny(), beside[6] = {-1, 1, -sy, sy, -sz, sz};
  const auto deep = [&](int i, int count) { return i >= 2 && i < count - 2; };
  return collect_from(front, [&](int n, std::vector<int>& out) {
    const Ijk c = unravel(mark, n);
    if (deep(c.i, mark.nx()) && deep(c.j, mark.ny()) && deep(c.k, mark.nz())) {
      for (const int step : beside) {
        if (mark[n + step]) continue;
        const auto* from = std::find_if(beside, beside + 6,
                                        [&](int back) { return mark[n + step + back] == last; });
        if (*from == -step) out.push_back(n + step);
      }
      return;
    }
    for_each_neighbour(mark, c, n, [&](int axis, int side, int m) {
      if (mark[m]) return;
      const Ijk at = {c.i + (axis == 0) * side, c.j + (axis == 1) * side, c.k + (axis == 2) * side};
      int first = -1;
      for_each_neighbour(mark, at, m, [&](int, int, int from) {
        if (first < 0 && mark[from] == last) first = from;
      });
      if (first == n) out.push_back(m);
    });
  });
}

}  // namespace archetide
