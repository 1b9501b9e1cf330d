#include "runtime/numerics/multigrid_level.h"

#include <algorithm>

namespace archetide {
namespace {

// Rows are worked off in pieces that fit a buffer on the stack; pieces end at even i.
constexpr int kPiece = 512;

// What the row operations read around n cells: neighbours by stride; where the row is not uniform,
// coefficients `stride` cells apart (multigrid_level.h), else null.
struct Row {
  const MultigridLevel& level;
  int j, k, begin, n;
  const float* coefficient;
  std::size_t stride;
  std::size_t at() const { return level.index(begin, j, k); }
  const float* part(int c) const { return coefficient + c * stride; }
};

// f(row) for each segment of some rows, in pieces.
template <class F>
void for_rows(const MultigridLevel& l, const MultigridLevel::Rows& r, F&& f) {
  const Segment* all = l.rows.plane(r.k).data();
  const MultigridLevel::PlaneCoefficients& plane = l.planes[r.k];
  for (const Segment& s : l.rows.rows(r.k, r.first, r.end)) {
    const float* c = s.uniform ? nullptr : plane.value.data() + plane.first[&s - all];
    for (int begin = s.begin; begin < s.end;) {
      const int end = std::min(s.end, (begin / kPiece + 1) * kPiece);
      f(Row{l, s.j, r.k, begin, end - begin, c ? c + (begin - s.begin) : nullptr,
            static_cast<std::size_t>(s.end - s.begin)});
      begin = end;
    }
  }
}

// x[i] = value[i] on the cells of a row where i + parity is even.
void blend(int n, int parity, const float* value, float* x) {
#pragma omp simd
  for (int i = 0; i < n; ++i) x[i] = ((i + parity) & 1) == 0 ? value[i] : x[i];
}

// out = diag^-1 (b + sum w x_neighbour)   (general: 8n reads besides x)
void relax_general(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at(), *b = l.b.data() + row.at(), *inverse = row.part(0);
  const float *xl = row.part(1), *xh = row.part(2), *yl = row.part(3), *yh = row.part(4),
              *zl = row.part(5), *zh = row.part(6);
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] =
        inverse[i] * (b[i] + (xl[i] * x[i - 1] + xh[i] * x[i + 1]) +
                      (yl[i] * south[i] + yh[i] * north[i]) + (zl[i] * down[i] + zh[i] * up[i]));
}

// out = (b / c + sum x_neighbour) / 6   (n reads besides x)
void relax_uniform(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at(), *b = l.b.data() + row.at();
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
  const float *x = l.x.data() + row.at(), *b = l.b.data() + row.at(), *diag = row.part(7);
  const float *xl = row.part(1), *xh = row.part(2), *yl = row.part(3), *yh = row.part(4),
              *zl = row.part(5), *zh = row.part(6);
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] = (b[i] - diag[i] * x[i]) + (xl[i] * x[i - 1] + xh[i] * x[i + 1]) +
             (yl[i] * south[i] + yh[i] * north[i]) + (zl[i] * down[i] + zh[i] * up[i]);
}

// out = b - c (6 x - sum x_neighbour)
void residual_uniform(const Row& row, float* out) {
  const MultigridLevel& l = row.level;
  const float *x = l.x.data() + row.at(), *b = l.b.data() + row.at();
  const float *south = x - l.sy, *north = x + l.sy, *down = x - l.sz, *up = x + l.sz;
  const float c = l.c;
#pragma omp simd
  for (int i = 0; i < row.n; ++i)
    out[i] = b[i] + c * (((x[i - 1] + x[i + 1]) + (south[i] + north[i]) + (down[i] + up[i])) -
                         6.0f * x[i]);
}

}  // namespace

void MultigridLevel::relax(const Rows& r, Colour colour) {
  for_rows(*this, r, [&](const Row& row) {
    float value[kPiece];
    if (row.n == 1) {  // beside a wall
      if ((row.begin + row.j + r.k + static_cast<int>(colour)) & 1) return;
      return relax_general(row, x.data() + row.at());
    }
    row.coefficient ? relax_general(row, value) : relax_uniform(row, value);
    blend(row.n, row.begin + row.j + r.k + static_cast<int>(colour), value, x.data() + row.at());
  });
}

void MultigridLevel::start(const Rows& r) {
  for_rows(*this, r, [&](const Row& row) {
    const float* rhs = b.data() + row.at();
    float* out = x.data() + row.at();
    const int parity = row.begin + row.j + r.k;
    const float inverse = 1.0f / (6.0f * c);
    if (const float* inv = row.coefficient) {
#pragma omp simd
      for (int i = 0; i < row.n; ++i) out[i] = ((i + parity) & 1) == 0 ? inv[i] * rhs[i] : 0.0f;
    } else {
#pragma omp simd
      for (int i = 0; i < row.n; ++i) out[i] = ((i + parity) & 1) == 0 ? inverse * rhs[i] : 0.0f;
    }
  });
}

double MultigridLevel::work(const Rows& r) const {
  double total = 0.0;
  for_rows(*this, r, [&](const Row& row) {
    const float *rhs = b.data() + row.at(), *value = x.data() + row.at();
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < row.n; ++i)
      sum += static_cast<double>(rhs[i]) * static_cast<double>(value[i]);
    total += sum;
  });
  return total;
}

void MultigridLevel::clear_rhs(int k) {
  float* plane = b.data() + index(-1, -1, k);
  std::fill(plane, plane + sz, 0.0f);
}

void MultigridLevel::restrict_residual(const Rows& r, MultigridLevel& coarse) const {
  for_rows(*this, r, [&](const Row& row) {
    // The residual in pairs (2I, 2I + 1), with 0 where the segment begins or ends inside a pair.
    float value[kPiece + 2];
    const int shift = row.begin & 1, pairs = (shift + row.n + 1) / 2;
    value[0] = value[2 * pairs - 1] = 0.0f;
    row.coefficient ? residual_general(row, value + shift) : residual_uniform(row, value + shift);
    float* sum = coarse.b.data() + coarse.index(row.begin / 2, row.j / 2, r.k / 2);
#pragma omp simd
    for (int I = 0; I < pairs; ++I) sum[I] += value[2 * I] + value[2 * I + 1];
  });
}

void MultigridLevel::prolong(const Rows& r, const MultigridLevel& coarse) {
  for_rows(*this, r, [&](const Row& row) {
    float value[kPiece + 2];
    const int shift = row.begin & 1, pairs = (shift + row.n + 1) / 2;
    const float* from = coarse.x.data() + coarse.index(row.begin / 2, row.j / 2, r.k / 2);
#pragma omp simd
    for (int I = 0; I < pairs; ++I) value[2 * I] = value[2 * I + 1] = from[I];
    float* out = x.data() + row.at();
    const float* add = value + shift;
    const int parity = row.begin + row.j + r.k;
#pragma omp simd
    for (int i = 0; i < row.n; ++i) out[i] += ((i + parity) & 1) == 0 ? add[i] : 0.0f;
  });
}

}  // namespace archetide
