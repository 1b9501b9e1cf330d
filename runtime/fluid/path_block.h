#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "runtime/grid/grid.h"

namespace archetide {

/// Paths of a block of faces in a row at once. They are short, so the points that trilinear
/// interpolation reads are the same neighbours for all of them: the eight corners where all places
/// lie on the same sides of their points, or else hat functions' weights for all 27 points around,
/// 0 where a point is not read.
constexpr int kBlock = 8;
typedef double Block __attribute__((vector_size(8 * kBlock)));
typedef long BlockBits __attribute__((vector_size(8 * kBlock)));
typedef unsigned char BlockBytes __attribute__((vector_size(kBlock)));

#define ARCHETIDE_INLINE inline __attribute__((always_inline))

ARCHETIDE_INLINE void load(const double* p, Block& out) { std::memcpy(&out, p, sizeof(out)); }
ARCHETIDE_INLINE void store(const Block& b, double* p) { std::memcpy(p, &b, sizeof(b)); }

ARCHETIDE_INLINE void magnitude(const Block& d, Block& out) {
  constexpr long kAllButSign = 0x7fffffffffffffff;
  out = (Block)((BlockBits)d & kAllButSign);
}

/// A byte of each number's bits as one number.
ARCHETIDE_INLINE std::uint64_t bytes_of(const BlockBits& bits) {
  const BlockBytes packed = __builtin_convertvector(bits, BlockBytes);
  std::uint64_t out;
  static_assert(sizeof(out) == kBlock);
  std::memcpy(&out, &packed, sizeof(out));
  return out;
}
/// Every byte 1.
constexpr std::uint64_t kEachByte = 0x0101010101010101;

/// Whether |d| <= most for all of them along all axes. (What is not a number may count as either.)
ARCHETIDE_INLINE bool all_within(const Block d[3], double most) {
  BlockBits over = {};
  for (int a = 0; a < 3; ++a) {
    Block size;
    magnitude(d[a], size);
    over |= (BlockBits)(most - size);
  }
  return bytes_of(over >> 63) == 0;
}

/// Strides along x, y, z of an array.
template <class T>
std::array<std::ptrdiff_t, 3> strides(const Array3<T>& a) {
  return {1, a.nx(), static_cast<std::ptrdiff_t>(a.nx()) * a.ny()};
}

/// Steps in memory from a point of a lattice to its neighbours along each axis; 0 where there is
/// none: the field goes on as it is at the outermost points.
struct Steps {
  std::array<std::ptrdiff_t, 3> low, high;
};

/// Places of a block beside their points: bit a set where below along axis a, kFar where farther
/// than tested along any. (What is not a number may count as either: it stays so.)
struct BlockSides {
  static constexpr unsigned char kFar = 8;
  std::uint64_t bytes;

  ARCHETIDE_INLINE BlockSides(const Block d[3], double most) {
    BlockBits bits = {};
    for (int a = 0; a < 3; ++a) {
      const Block place = d[a] + 0.0;  // -0 is not below
      Block beyond;
      magnitude(place, beyond);
      beyond = most - beyond;
      bits |= ((BlockBits)place >> 63) & (1L << a);
      bits |= ((BlockBits)beyond >> 63) & kFar;
    }
    bytes = bytes_of(bits);
  }
  bool any_far() const { return (bytes & kFar * kEachByte) != 0; }
  bool alike() const { return alike(bytes); }
  static bool alike(std::uint64_t sides) { return sides == (sides & 0xff) * kEachByte; }
};

/// Those of the points (i, j, k) of a lattice, but at the ends of its rows.
inline Steps steps_at(const Array3<double>& a, int j, int k) {
  const std::ptrdiff_t row = a.nx(), layer = row * a.ny();
  return {{-1, j > 0 ? -row : 0, k > 0 ? -layer : 0},
          {1, j + 1 < a.ny() ? row : 0, k + 1 < a.nz() ? layer : 0}};
}

/// The steps to the sides on which places with these bits lie.
ARCHETIDE_INLINE std::array<std::ptrdiff_t, 3> steps_to(const Steps& s, std::uint64_t sides) {
  return {sides & 1 ? s.low[0] : s.high[0], sides & 2 ? s.low[1] : s.high[1],
          sides & 4 ? s.low[2] : s.high[2]};
}

/// Values at the fractions w of the steps s from the points p, p + 1, ..
ARCHETIDE_INLINE void between_corners(const double* p, const std::array<std::ptrdiff_t, 3>& s,
                                      const Block w[3], Block& out) {
  Block plane[2];
  for (int k = 0; k < 2; ++k) {
    Block line[2];
    for (int j = 0; j < 2; ++j) {
      const double* q = p + k * s[2] + j * s[1];
      Block here, beside;
      load(q, here), load(q + s[0], beside);
      line[j] = here + w[0] * (beside - here);
    }
    plane[k] = line[0] + w[1] * (line[1] - line[0]);
  }
  out = plane[0] + w[2] * (plane[1] - plane[0]);
}

/// Weights of the points -1, 0, 1 for a place d from point 0, |d| <= 1.
struct Hat {
  Block at[3];
  ARCHETIDE_INLINE explicit Hat(const Block& d) {
    Block size;
    magnitude(d, size);
    at[2] = 0.5 * (size + d);
    at[0] = size - at[2];
    at[1] = 1.0 - size;
  }
};

/// Values at the places d (cells, |d| <= 1) from the points p, p + 1, ..
ARCHETIDE_INLINE void under_hats(const double* p, const Steps& s, const Block d[3], Block& out) {
  const Hat x(d[0]), y(d[1]), z(d[2]);
  const std::ptrdiff_t row[3] = {s.low[1], 0, s.high[1]}, layer[3] = {s.low[2], 0, s.high[2]};
  out = Block{};
  for (int k = 0; k < 3; ++k) {
    Block plane = {};
    for (int j = 0; j < 3; ++j) {
      const double* q = p + layer[k] + row[j];
      Block low, mid, high;
      load(q + s.low[0], low), load(q, mid), load(q + s.high[0], high);
      plane += y.at[j] * (x.at[0] * low + x.at[1] * mid + x.at[2] * high);
    }
    out += z.at[k] * plane;
  }
}

/// Values of a lattice at places d, in cells, beside the points p, p + 1, .. of a block.
ARCHETIDE_INLINE void interpolate_block(const double* p, const Steps& s, const Block d[3],
                                        const BlockSides& sides, Block& out) {
  if (!sides.alike()) {
    under_hats(p, s, d, out);
    return;
  }
  Block share[3];
  for (int a = 0; a < 3; ++a) magnitude(d[a], share[a]);
  between_corners(p, steps_to(s, sides.bytes), share, out);
}

/// Component B at the places d (|d| <= 1/2) from the centres of faces of component A, A != B; p is
/// the point of B with the indices of the first face, `alike` whether all places lie on the same
/// side along the third axis, and then `beside` the step there.
template <int A, int B>
ARCHETIDE_INLINE void across_block(const double* p, const Steps& s, std::ptrdiff_t beside,
                                   bool alike, const Block d[3], Block& out) {
  constexpr int C = 3 - A - B;
  const Block high_a = 0.5 + d[A], high_b = 0.5 + d[B];
  const auto square = [&](const double* q, Block& mean) {
    Block f00, f10, f01, f11;
    load(q + s.low[A], f00), load(q, f10);
    load(q + s.low[A] + s.high[B], f01), load(q + s.high[B], f11);
    const Block low = f00 + high_a * (f10 - f00), high = f01 + high_a * (f11 - f01);
    mean = low + high_b * (high - low);
  };
  Block here;
  square(p, here);
  if (alike) {
    Block next, share;
    square(p + beside, next);
    magnitude(d[C], share);
    out = here + share * (next - here);
    return;
  }
  Block low, high;
  square(p + s.low[C], low), square(p + s.high[C], high);
  const Hat c(d[C]);
  out = c.at[0] * low + c.at[1] * here + c.at[2] * high;
}

/// The rows of the three components around the faces (0, j, k), (1, j, k), .. of component A, and
/// the paths of blocks of these faces.
template <int A>
struct PathRow {
  static constexpr int B = (A + 1) % 3, C = (A + 2) % 3;
  const double* p[3];
  Steps s[3];

  PathRow(const Grid& g, const MacField& u, int j, int k) {
    for (int c = 0; c < 3; ++c) {
      int at[3] = {0, j, k};
      s[c] = steps_at(u[c], j, k);
      if (c != A && A != 0) {  // the cells to both sides of a face, or one beside the tank's side
        const bool outermost = at[A] == 0 || at[A] == g.size(A);
        at[A] = std::min(at[A], g.size(A) - 1);
        if (outermost) s[c].low[A] = 0;
      }
      p[c] = &u[c](at[0], at[1], at[2]);
    }
  }

  /// Fetches what the faces from i on of the next layer but one add to what this one reads: rows
  /// are too short for the hardware to look ahead.
  ARCHETIDE_INLINE void fetch_ahead(int i) const {
    for (int c = 0; c < 3; ++c) __builtin_prefetch(p[c] + i + 2 * s[c].high[2]);
  }

  /// Velocities at the centres of the faces from i on, m/s.
  ARCHETIDE_INLINE void velocities(int i, Block v[3]) const {
    load(p[A] + i, v[A]);
    mean<B>(i, v[B]), mean<C>(i, v[C]);
  }

  /// The displacements d, in cells, of the ends of the paths over h (s/m) with velocities v:
  /// second-order Runge-Kutta. False where a path is too long for this.
  ARCHETIDE_INLINE bool ends(int i, double h, const Block v[3], Block d[3]) const {
    Block mid[3];
    for (int a = 0; a < 3; ++a) mid[a] = (0.5 * h) * v[a];
    const BlockSides sides(mid, 0.5);
    if (sides.any_far()) return false;
    const bool alike = sides.alike();
    interpolate_block(p[A] + i, s[A], mid, sides, d[A]);
    across_block<A, B>(p[B] + i, s[B], steps_to(s[B], sides.bytes)[C], alike, mid, d[B]);
    across_block<A, C>(p[C] + i, s[C], steps_to(s[C], sides.bytes)[B], alike, mid, d[C]);
    for (int a = 0; a < 3; ++a) d[a] *= h;
    return true;
  }

 private:
  template <int D>
  ARCHETIDE_INLINE void mean(int i, Block& out) const {
    const double* q = p[D] + i;
    Block f00, f10, f01, f11;
    load(q + s[D].low[A], f00), load(q, f10);
    load(q + s[D].low[A] + s[D].high[D], f01), load(q + s[D].high[D], f11);
    out = 0.25 * ((f00 + f10) + (f01 + f11));
  }
};

/// Smallest and largest of the eight points around places on these sides of the points p, p + 1, ..
ARCHETIDE_INLINE void range_block(const double* p, const Steps& s, std::uint64_t sides, Block& low,
                                  Block& high) {
  if (BlockSides::alike(sides)) {
    const std::array<std::ptrdiff_t, 3> to = steps_to(s, sides);
    load(p, low);
    high = low;
    for (int c = 1; c < 8; ++c) {
      Block f;
      load(p + (c & 1 ? to[0] : 0) + (c & 2 ? to[1] : 0) + (c & 4 ? to[2] : 0), f);
      low = f < low ? f : low;
      high = f > high ? f : high;
    }
    return;
  }
  BlockBytes packed;
  std::memcpy(&packed, &sides, sizeof(packed));
  const BlockBits bits = __builtin_convertvector(packed, BlockBits);
  const BlockBits down[3] = {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
  const std::ptrdiff_t row[3] = {s.low[1], 0, s.high[1]}, layer[3] = {s.low[2], 0, s.high[2]};
  Block plane_low[3], plane_high[3];
  for (int k = 0; k < 3; ++k) {
    Block line_low[3], line_high[3];
    for (int j = 0; j < 3; ++j) {
      const double* q = p + layer[k] + row[j];
      Block before, here, after;
      load(q + s.low[0], before), load(q, here), load(q + s.high[0], after);
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

}  // namespace archetide
