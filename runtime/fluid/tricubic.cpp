#include "runtime/fluid/tricubic.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace archetide {
namespace {

// Lagrange weights of the up to four lattice points around s along one axis with n points (five on
// a lattice point, see central_slot), and their derivatives.
struct CubicSlot {
  int first, count;
  double w[5], dw[5];
};

CubicSlot cubic_slot(double s, int n) {
  s = std::clamp(s, 0.0, static_cast<double>(n - 1));
  CubicSlot slot;
  slot.count = std::min(n, 4);
  slot.first = std::clamp(static_cast<int>(s) - 1, 0, n - slot.count);
  const double t = s - slot.first;
  const double a = t, b = t - 1, c = t - 2, d = t - 3;
  switch (slot.count) {
    case 4:
      slot.w[0] = b * c * d / -6, slot.w[1] = a * c * d / 2, slot.w[2] = a * b * d / -2,
      slot.w[3] = a * b * c / 6;
      slot.dw[0] = (b * c + c * d + d * b) / -6, slot.dw[1] = (a * c + c * d + d * a) / 2,
      slot.dw[2] = (a * b + b * d + d * a) / -2, slot.dw[3] = (a * b + b * c + c * a) / 6;
      break;
    case 3:
      slot.w[0] = b * c / 2, slot.w[1] = -a * c, slot.w[2] = a * b / 2;
      slot.dw[0] = (b + c) / 2, slot.dw[1] = -(a + c), slot.dw[2] = (a + b) / 2;
      break;
    case 2:
      slot.w[0] = -b, slot.w[1] = a;
      slot.dw[0] = -1, slot.dw[1] = 1;
      break;
    default:
      slot.w[0] = 1;
      slot.dw[0] = 0;
  }
  return slot;
}

// On a lattice point, where the cubics of its two sides meet, the mean of their slopes: mirror
// images have mirrored slopes whatever the last digit of s.
CubicSlot central_slot(double s, int n) {
  constexpr double kOnPoint = 1e-9;
  const double point = std::round(s);
  if (std::abs(s - point) > kOnPoint || point < 2 || point > n - 3) return cubic_slot(s, n);
  return {static_cast<int>(point) - 2,
          5,
          {0.0, 0.0, 1.0, 0.0, 0.0},
          {1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0}};
}

// The weights of four points at a place a from the first one.
template <class Number>
void inner_weights(const Number& a, Number w[4]) {
  const Number b = a - 1, c = a - 2, d = a - 3, ab = a * b, cd = c * d;
  w[0] = b * cd / -6, w[1] = a * cd / 2, w[2] = ab * d / -2, w[3] = ab * c / 6;
}

// The four weights alone, away from the ends of the lattice.
struct InnerSlot {
  int first;
  double w[4];

  static bool fits(double s, int n) { return s >= 1.0 && s < n - 2; }
  explicit InnerSlot(double s) : first(static_cast<int>(s) - 1) { inner_weights(s - first, w); }
};

// The weights of the points -2 .. 2 at places d from point 0, |d| <= 1, and the range of those that
// are not all 0.
struct BlockSlot {
  Block w[5];
  int first, last;

  explicit BlockSlot(const Block& d) {
    const Block zero = {};
    const auto low = d < 0.0;
    Block path[4];  // one point behind, on a path from point 0 to d, the point, and two ahead
    inner_weights<Block>(1.0 + (low ? -d : d), path);
    w[0] = low ? path[3] : zero, w[1] = low ? path[2] : path[0], w[2] = path[1];
    w[3] = low ? path[0] : path[2], w[4] = low ? zero : path[3];
    int lower = 0;
    for (int l = 0; l < kBlock; ++l) lower += d[l] < 0.0 ? 1 : 0;
    first = lower > 0 ? 0 : 1, last = lower < kBlock ? 4 : 3;
  }
};

double inner_tricubic(const Array3<double>& f, const double s[3]) {
  typedef double Line __attribute__((vector_size(32)));
  const InnerSlot x(s[0]), y(s[1]), z(s[2]);
  const std::size_t row = f.nx(), slab = row * f.ny();
  const double* corner = f.data() + f.index(x.first, y.first, z.first);
  Line line = {};
  for (int k = 0; k < 4; ++k) {
    const double* p = corner + k * slab;
    Line plane = {};
    for (int j = 0; j < 4; ++j) {
      Line points;
      std::memcpy(&points, p + j * row, sizeof(points));
      plane += y.w[j] * points;
    }
    line += z.w[k] * plane;
  }
  return (x.w[0] * line[0] + x.w[1] * line[1]) + (x.w[2] * line[2] + x.w[3] * line[3]);
}

}  // namespace

double tricubic(const Array3<double>& f, const double s[3]) {
  if (InnerSlot::fits(s[0], f.nx()) && InnerSlot::fits(s[1], f.ny()) &&
      InnerSlot::fits(s[2], f.nz()))
    return inner_tricubic(f, s);
  const CubicSlot x = cubic_slot(s[0], f.nx()), y = cubic_slot(s[1], f.ny()),
                  z = cubic_slot(s[2], f.nz());
  // Along z and y first: the points along x, neighbours in memory, go together.
  typedef double Line __attribute__((vector_size(32)));
  Line line = {};
  for (int k = 0; k < z.count; ++k)
    for (int j = 0; j < y.count; ++j) {
      const double* p = f.data() + f.index(x.first, y.first + j, z.first + k);
      Line points = {};
      if (x.count == 4)
        std::memcpy(&points, p, sizeof(points));
      else
        for (int i = 0; i < x.count; ++i) points[i] = p[i];
      line += z.w[k] * y.w[j] * points;
    }
  double sum = 0.0;
  for (int i = 0; i < x.count; ++i) sum += x.w[i] * line[i];
  return sum;
}

void tricubic_block(const double* p, const std::array<std::ptrdiff_t, 3>& stride, const Block d[3],
                    Block& out) {
  const BlockSlot x(d[0]), y(d[1]), z(d[2]);
  out = Block{};
  for (int k = z.first; k <= z.last; ++k) {
    Block plane = {};
    for (int j = y.first; j <= y.last; ++j) {
      const double* q = p + (k - 2) * stride[2] + (j - 2) * stride[1] - 2;
      Block line = {};
      for (int i = 0; i < 5; ++i) {
        Block points;
        load(q + i, points);
        line += x.w[i] * points;
      }
      plane += y.w[j] * line;
    }
    out += z.w[k] * plane;
  }
}

double tricubic(const Array3<double>& f, const double s[3], Vec3& gradient) {
  const CubicSlot x = central_slot(s[0], f.nx()), y = central_slot(s[1], f.ny()),
                  z = central_slot(s[2], f.nz());
  double sum = 0.0;
  gradient.setZero();
  for (int k = 0; k < z.count; ++k)
    for (int j = 0; j < y.count; ++j) {
      const double* p = f.data() + f.index(x.first, y.first + j, z.first + k);
      double line = 0.0, slope = 0.0;
      for (int i = 0; i < x.count; ++i) line += x.w[i] * p[i], slope += x.dw[i] * p[i];
      sum += z.w[k] * y.w[j] * line;
      gradient[0] += z.w[k] * y.w[j] * slope;
      gradient[1] += z.w[k] * y.dw[j] * line;
      gradient[2] += z.dw[k] * y.w[j] * line;
    }
  return sum;
}

}  // namespace archetide
