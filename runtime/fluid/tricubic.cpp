#include "runtime/fluid/tricubic.h"

#include <algorithm>

namespace archetide {
namespace {

// Lagrange weights of the up to four lattice points around s along one axis with n points, and
// their derivatives.
struct CubicSlot {
  int first, count;
  double w[4], dw[4];
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

}  // namespace

double tricubic(const Array3<double>& f, const double s[3]) {
  const CubicSlot x = cubic_slot(s[0], f.nx()), y = cubic_slot(s[1], f.ny()),
                  z = cubic_slot(s[2], f.nz());
  double sum = 0.0;
  for (int k = 0; k < z.count; ++k)
    for (int j = 0; j < y.count; ++j) {
      const double* p = f.data() + f.index(x.first, y.first + j, z.first + k);
      double line = 0.0;
      for (int i = 0; i < x.count; ++i) line += x.w[i] * p[i];
      sum += z.w[k] * y.w[j] * line;
    }
  return sum;
}

double tricubic(const Array3<double>& f, const double s[3], Vec3& gradient) {
  const CubicSlot x = cubic_slot(s[0], f.nx()), y = cubic_slot(s[1], f.ny()),
                  z = cubic_slot(s[2], f.nz());
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
