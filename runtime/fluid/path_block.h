#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "runtime/grid/grid.h"

namespace archetide {

/// Paths of eight faces in a row at once, away from the tank's sides. They are short, so the
/// points that trilinear interpolation reads are the same neighbours for all of them: a hat
/// function's weights, 0 where a point is not read, take the place of looking up cells.
constexpr int kBlock = 8;
typedef double Block __attribute__((vector_size(8 * kBlock)));

inline void load(const double* p, Block& out) { std::memcpy(&out, p, sizeof(out)); }
inline void store(const Block& b, double* p) { std::memcpy(p, &b, sizeof(b)); }

/// Whether |d| <= most for all of them along all axes. (What is not a number passes: it stays so.)
inline bool all_within(const Block d[3], double most) {
  typedef long Flags __attribute__((vector_size(8 * kBlock)));
  Flags over = {};
  for (int a = 0; a < 3; ++a) over |= (d[a] > most) | (d[a] < -most);
  long any = 0;
  for (int l = 0; l < kBlock; ++l) any |= over[l];
  return any == 0;
}

/// Weights of the points -1, 0, 1 for a place d from point 0, |d| <= 1.
struct Hat {
  Block at[3];
  explicit Hat(const Block& d) {
    const Block zero = {};
    at[0] = d < 0.0 ? -d : zero;
    at[2] = d > 0.0 ? d : zero;
    at[1] = 1.0 - at[0] - at[2];
  }
};

/// Strides along x, y, z of an array.
template <class T>
std::array<std::ptrdiff_t, 3> strides(const Array3<T>& a) {
  return {1, a.nx(), static_cast<std::ptrdiff_t>(a.nx()) * a.ny()};
}

/// Values at the places d (cells, |d| <= 1) from the points p, p + 1, ..
inline void interpolate_block(const double* p, const std::array<std::ptrdiff_t, 3>& stride,
                              const Block d[3], Block& out) {
  const Hat x(d[0]), y(d[1]), z(d[2]);
  out = Block{};
  for (int k = 0; k < 3; ++k) {
    Block plane = {};
    for (int j = 0; j < 3; ++j) {
      const double* q = p + (k - 1) * stride[2] + (j - 1) * stride[1];
      Block low, mid, high;
      load(q - 1, low), load(q, mid), load(q + 1, high);
      plane += y.at[j] * (x.at[0] * low + x.at[1] * mid + x.at[2] * high);
    }
    out += z.at[k] * plane;
  }
}

/// Bit a: d points down axis a.
inline void sides_of(const Block d[3], unsigned char sides[kBlock]) {
  typedef long Flags __attribute__((vector_size(8 * kBlock)));
  typedef unsigned char Bytes __attribute__((vector_size(kBlock)));
  const Flags bits = ((d[0] < 0.0) & 1) | ((d[1] < 0.0) & 2) | ((d[2] < 0.0) & 4);
  const Bytes packed = __builtin_convertvector(bits, Bytes);
  std::memcpy(sides, &packed, kBlock);
}

/// Smallest and largest of the eight points around places on these sides of the points p, p + 1, ..
inline void range_block(const double* p, const std::array<std::ptrdiff_t, 3>& stride,
                        const unsigned char sides[kBlock], Block& low, Block& high) {
  typedef long Flags __attribute__((vector_size(8 * kBlock)));
  typedef unsigned char Bytes __attribute__((vector_size(kBlock)));
  Bytes packed;
  std::memcpy(&packed, sides, kBlock);
  const Flags bits = __builtin_convertvector(packed, Flags);
  const Flags down[3] = {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
  Block plane_low[3], plane_high[3];
  for (int k = 0; k < 3; ++k) {
    Block line_low[3], line_high[3];
    for (int j = 0; j < 3; ++j) {
      const double* q = p + (k - 1) * stride[2] + (j - 1) * stride[1];
      Block before, here, after;
      load(q - 1, before), load(q, here), load(q + 1, after);
      const Block beside = down[0] ? before : after;
      line_low[j] = beside < here ? beside : here;
      line_high[j] = beside < here ? here : beside;
    }
    const Block other_low = down[1] ? line_low[0] : line_low[2],
                other_high = down[1] ? line_high[0] : line_high[2];
    plane_low[k] = other_low < line_low[1] ? other_low : line_low[1];
    plane_high[k] = other_high > line_high[1] ? other_high : line_high[1];
  }
  const Block other_low = down[2] ? plane_low[0] : plane_low[2],
              other_high = down[2] ? plane_high[0] : plane_high[2];
  low = other_low < plane_low[1] ? other_low : plane_low[1];
  high = other_high > plane_high[1] ? other_high : plane_high[1];
}

/// Component B at the places d (|d| <= 1/2) from the centres of faces of component A, A != B; p is
/// the point of B with the indices of the first face.
template <int A, int B>
void across_block(const double* p, const std::array<std::ptrdiff_t, 3>& stride, const Block d[3],
                  Block& out) {
  constexpr int C = 3 - A - B;
  const Block low_a = 0.5 - d[A], high_a = 0.5 + d[A], low_b = 0.5 - d[B], high_b = 0.5 + d[B];
  const Hat c(d[C]);
  out = Block{};
  for (int n = 0; n < 3; ++n) {
    const double* q = p + (n - 1) * stride[C];
    Block f00, f10, f01, f11;
    load(q - stride[A], f00), load(q, f10);
    load(q - stride[A] + stride[B], f01), load(q + stride[B], f11);
    out += c.at[n] * (low_b * (low_a * f00 + high_a * f10) + high_b * (low_a * f01 + high_a * f11));
  }
}

/// Velocities v of the faces of component A from (i, j, k) on, m/s, and the displacements d, in
/// cells, of the ends of their paths over h (s/m): second-order Runge-Kutta from v. False where a
/// path is too long for this.
template <int A>
bool path_block(const MacField& u, int i, int j, int k, double h, Block v[3], Block d[3]) {
  constexpr int B = (A + 1) % 3, C = (A + 2) % 3;
  const double* p[3];
  std::array<std::ptrdiff_t, 3> s[3];
  for (int a = 0; a < 3; ++a) p[a] = &u[a](i, j, k), s[a] = strides(u[a]);
  Block mid[3];
  const Block zero = {};
  const Block still[3] = {zero, zero, zero};
  load(p[A], v[A]);
  across_block<A, B>(p[B], s[B], still, v[B]);
  across_block<A, C>(p[C], s[C], still, v[C]);
  for (int a = 0; a < 3; ++a) mid[a] = 0.5 * h * v[a];
  if (!all_within(mid, 0.5)) return false;
  interpolate_block(p[A], s[A], mid, d[A]);
  across_block<A, B>(p[B], s[B], mid, d[B]);
  across_block<A, C>(p[C], s[C], mid, d[C]);
  for (int a = 0; a < 3; ++a) d[a] *= h;
  return all_within(d, 1.0);
}

}  // namespace archetide
