#include "runtime/numerics/multigrid_level.h"

#include <algorithm>

namespace archetide {
namespace {

// Rows are worked off in pieces that fit a buffer on the stack; pieces end at even i.
constexpr int kPiece = 512;

template <class F>
void for_pieces(const std::vector<Segment>& plane, F&& f) {
  for (const Segment& s : plane)
    for (int begin = s.begin; begin < s.end;) {
      const int end = std::min(s.end, (begin / kPiece + 1) * kPiece);
      f(Segment{s.j, begin, end, s.uniform});
      begin = end;
    }
}

// x[i] = value[i] on the cells of a row where i + parity is even.
void blend(int n, int parity, const float* value, float* x) {
#pragma omp simd
  for (int i = 0; i < n; ++i) x[i] = ((i + parity) & 1) == 0 ? value[i] : x[i];
}

// What the row operations read around the n cells at `at`; neighbours and coefficients by stride.
struct Row {
  const MultigridLevel& level;
  std::size_t at;
  int n;
};

// out = diag^-1 (b + sum w x_neighbour)   (general: 8n reads besides x)
void relax_general(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at, *b = l.b.data() + row.at,
              *inverse = l.inverse.data() + row.at;
  const float *wx = l.wx.data() + row.at, *wy = l.wy.data() + row.at, *wz = l.wz.data() + row.at;
  const float *wy_up = wy + l.sy, *wz_up = wz + l.sz;
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] = inverse[i] *
             (b[i] + (wx[i] * x[i - 1] + wx[i + 1] * x[i + 1]) +
              (wy[i] * south[i] + wy_up[i] * north[i]) + (wz[i] * down[i] + wz_up[i] * up[i]));
}

// out = (b / c + sum x_neighbour) / 6   (n reads besides x)
void relax_uniform(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at, *b = l.b.data() + row.at;
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
  const float sixth = 1.0f / 6.0f, scale = 1.0f / (6.0f * l.c);
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] =
        scale * b[i] + sixth * ((x[i - 1] + x[i + 1]) + (south[i] + north[i]) + (down[i] + up[i]));
}

// out = b - diag x + sum w x_neighbour
void residual_general(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at, *b = l.b.data() + row.at, *diag = l.diag.data() + row.at;
  const float *wx = l.wx.data() + row.at, *wy = l.wy.data() + row.at, *wz = l.wz.data() + row.at;
  const float *wy_up = wy + l.sy, *wz_up = wz + l.sz;
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] = (b[i] - diag[i] * x[i]) + (wx[i] * x[i - 1] + wx[i + 1] * x[i + 1]) +
             (wy[i] * south[i] + wy_up[i] * north[i]) + (wz[i] * down[i] + wz_up[i] * up[i]);
}

// out = b - c (6 x - sum x_neighbour)
void residual_uniform(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at, *b = l.b.data() + row.at;
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
  const float c = l.c;
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] = b[i] + c * (((x[i - 1] + x[i + 1]) + (south[i] + north[i]) + (down[i] + up[i])) -
                         6.0f * x[i]);
}

}  // namespace

void MultigridLevel::relax(int k, Colour colour) {
  for_pieces(rows.plane(k), [&](const Segment& s) {
    float value[kPiece];
    const Row row{*this, index(s.begin, s.j, k), s.end - s.begin};
    s.uniform ? relax_uniform(row, value) : relax_general(row, value);
    blend(row.n, s.begin + s.j + k + static_cast<int>(colour), value, x.data() + row.at);
  });
}

void MultigridLevel::start(int k) {
  for (const Segment& s : rows.plane(k)) {
    const std::size_t at = index(s.begin, s.j, k);
    const float *rhs = b.data() + at, *inv = inverse.data() + at;
    float* out = x.data() + at;
    const int parity = s.begin + s.j + k;
#pragma omp simd
    for (int i = 0; i < s.end - s.begin; ++i)
      out[i] = ((i + parity) & 1) == 0 ? inv[i] * rhs[i] : 0.0f;
  }
}

double MultigridLevel::work(int k) const {
  double total = 0.0;
  for (const Segment& s : rows.plane(k)) {
    const std::size_t at = index(s.begin, s.j, k);
    const float *rhs = b.data() + at, *value = x.data() + at;
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < s.end - s.begin; ++i)
      sum += static_cast<double>(rhs[i]) * static_cast<double>(value[i]);
    total += sum;
  }
  return total;
}

void MultigridLevel::restrict_residual(int k, MultigridLevel& coarse) const {
  float* plane = coarse.b.data() + coarse.index(-1, -1, k / 2);
  if (k % 2 == 0) std::fill(plane, plane + coarse.sz, 0.0f);
  for_pieces(rows.plane(k), [&](const Segment& s) {
    // The residual in pairs (2I, 2I + 1), with 0 where the segment begins or ends inside a pair.
    float value[kPiece + 2];
    const Row row{*this, index(s.begin, s.j, k), s.end - s.begin};
    const int shift = s.begin & 1, pairs = (shift + row.n + 1) / 2;
    value[0] = value[2 * pairs - 1] = 0.0f;
    s.uniform ? residual_uniform(row, value + shift) : residual_general(row, value + shift);
    float* sum = coarse.b.data() + coarse.index(s.begin / 2, s.j / 2, k / 2);
#pragma omp simd
    for (int I = 0; I < pairs; ++I) sum[I] += value[2 * I] + value[2 * I + 1];
  });
}

void MultigridLevel::prolong(int k, const MultigridLevel& coarse) {
  for_pieces(rows.plane(k), [&](const Segment& s) {
    float value[kPiece + 2];
    const int shift = s.begin & 1, n = s.end - s.begin, pairs = (shift + n + 1) / 2;
    const float* from = coarse.x.data() + coarse.index(s.begin / 2, s.j / 2, k / 2);
#pragma omp simd
    for (int I = 0; I < pairs; ++I) value[2 * I] = value[2 * I + 1] = from[I];
    float* out = x.data() + index(s.begin, s.j, k);
    const float* add = value + shift;
    const int parity = s.begin + s.j + k;
#pragma omp simd
    for (int i = 0; i < n; ++i) out[i] += ((i + parity) & 1) == 0 ? add[i] : 0.0f;
  });
}

}  // namespace archetide
