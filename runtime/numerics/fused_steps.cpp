#include "runtime/numerics/fused_steps.h"

#include <algorithm>
#include <numeric>

#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// out = inner p - the six neighbours; returns p . out
double uniform_row(const PaddedLayout& l, double inner, const float* p, int n, double* out) {
  const float *south = p - l.sy, *north = p + l.sy, *down = p - l.sz, *up = p + l.sz;
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (int i = 0; i < n; ++i) {
    const double here = p[i];
    const double q =
        inner * here - ((double(p[i - 1]) + double(p[i + 1])) +
                        (double(south[i]) + double(north[i])) + (double(down[i]) + double(up[i])));
    out[i] = q;
    sum += here * q;
  }
  return sum;
}

double general_row(const PaddedLayout& l, const double* c, std::size_t m, const float* p, int n,
                   double* out) {
  const float *south = p - l.sy, *north = p + l.sy, *down = p - l.sz, *up = p + l.sz;
  const double *xl = c + m, *xh = c + 2 * m, *yl = c + 3 * m, *yh = c + 4 * m, *zl = c + 5 * m,
               *zh = c + 6 * m;
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (int i = 0; i < n; ++i) {
    const double here = p[i];
    const double q =
        c[i] * here - ((xl[i] * p[i - 1] + xh[i] * p[i + 1]) +
                       (yl[i] * south[i] + yh[i] * north[i]) + (zl[i] * down[i] + zh[i] * up[i]));
    out[i] = q;
    sum += here * q;
  }
  return sum;
}

}  // namespace

double product_row(const PoissonOperator& op, const PaddedLayout& layout, int k,
                   std::size_t segment, int begin, int end, const float* p, double* out) {
  const Segment& s = op.rows().plane(k)[segment];
  const float* row = p + layout(begin, s.j, k);
  if (!s.uniform())
    return general_row(layout, op.coefficients(k, segment) + (begin - s.begin), s.end - s.begin,
                       row, end - begin, out);
  double sum = uniform_row(layout, s.inner, row, end - begin, out);
  const auto complete = [&](int i, int more) {
    const double here = row[i - begin];
    out[i - begin] += more * here;
    sum += more * here * here;
  };
  if (begin == s.begin) complete(begin, s.first - s.inner);
  if (end == s.end) complete(end - 1, s.last - s.inner);
  return sum;
}

bool FusedSteps::parallel() const { return op_->unknowns() >= kParallelCells; }

template <class F>
void FusedSteps::for_planes(F&& f) {
  sum_.assign(layout_.nz, 0.0);
  for_each_index(layout_.nz, parallel(), f);
}

double FusedSteps::total() const { return std::accumulate(sum_.begin(), sum_.end(), 0.0); }

double FusedSteps::direction(double step, float zs, const float* z, float beta, float* p, double* x,
                             double* q) {
  const PoissonMatrix& a = op_->matrix();
  sum_.assign(layout_.nz, 0.0);
  constexpr int kStages = 2;
  const std::size_t row_bytes = layout_.sy * (2 * sizeof(float) + 2 * sizeof(double));
  wavefront(
      layout_.nz, layout_.ny, strip_rows(kStages, row_bytes), kStages, parallel(),
      [&](int plane) { return op_->rows().work(plane + layout_.low[2]); },
      [&](int stage, int plane, int first, int end) {
        const int k = plane + layout_.low[2];
        const auto& all = op_->rows().plane(k);
        const auto rows = op_->rows().rows(k, first + layout_.low[1], end + layout_.low[1]);
        double sum = 0.0;
        for (const Segment& s : rows) {
          const std::size_t at = layout_(s.begin, s.j, k), cell = a.kind.index(s.begin, s.j, k);
          const int n = s.end - s.begin;
          if (stage == 0) {
            const float* zr = z + at;
            float* pr = p + at;
            double* xr = x + cell;
#pragma omp simd
            for (int i = 0; i < n; ++i) {
              xr[i] += step * static_cast<double>(pr[i]);
              pr[i] = zs * zr[i] + beta * pr[i];
            }
          } else {
            sum += product_row(*op_, layout_, k, &s - all.data(), s.begin, s.end, p, q + cell);
          }
        }
        if (stage == 1) sum_[plane] += sum;
      });
  return total();
}

double FusedSteps::residual_step(double step, const double* q, double* r, double scale, float* b) {
  const PoissonMatrix& a = op_->matrix();
  for_planes([&](int plane) {
    const int k = plane + layout_.low[2];
    double total_plane = 0.0;
    for (const Segment& s : op_->rows().plane(k)) {
      const std::size_t cell = a.kind.index(s.begin, s.j, k);
      const double* qr = q + cell;
      double* rr = r + cell;
      float* br = b + layout_(s.begin, s.j, k);
      double sum = 0.0;
#pragma omp simd reduction(+ : sum)
      for (int i = 0; i < s.end - s.begin; ++i) {
        const double ri = rr[i] - step * qr[i];
        rr[i] = ri;
        br[i] = static_cast<float>(scale * ri);
        sum += ri * ri;
      }
      total_plane += sum;
    }
    sum_[plane] = total_plane;
  });
  return total();
}

double FusedSteps::residual(const double* b, const double* x, double* r) {
  const PoissonMatrix& a = op_->matrix();
  for_planes([&](int plane) {
    const int k = plane + layout_.low[2];
    double total_plane = 0.0;
    for (const Segment& s : op_->rows().plane(k)) {
      const std::size_t cell = a.kind.index(s.begin, s.j, k);
      op_->apply_segment(s, k, x, r);
      const double* br = b + cell;
      double* rr = r + cell;
      double sum = 0.0;
#pragma omp simd reduction(+ : sum)
      for (int i = 0; i < s.end - s.begin; ++i) {
        const double ri = br[i] - rr[i];
        rr[i] = ri;
        sum += ri * ri;
      }
      total_plane += sum;
    }
    sum_[plane] = total_plane;
  });
  return total();
}

void FusedSteps::advance(double step, const float* p, double* x) {
  const PoissonMatrix& a = op_->matrix();
  for_planes([&](int plane) {
    const int k = plane + layout_.low[2];
    for (const Segment& s : op_->rows().plane(k)) {
      const float* pr = p + layout_(s.begin, s.j, k);
      double* xr = x + a.kind.index(s.begin, s.j, k);
#pragma omp simd
      for (int i = 0; i < s.end - s.begin; ++i) xr[i] += step * static_cast<double>(pr[i]);
    }
  });
}

void FusedSteps::load(const double* r, double scale, float* b) {
  const PoissonMatrix& a = op_->matrix();
  for_planes([&](int plane) {
    const int k = plane + layout_.low[2];
    for (const Segment& s : op_->rows().plane(k)) {
      const double* rr = r + a.kind.index(s.begin, s.j, k);
      float* br = b + layout_(s.begin, s.j, k);
#pragma omp simd
      for (int i = 0; i < s.end - s.begin; ++i) br[i] = static_cast<float>(scale * rr[i]);
    }
  });
}

double FusedSteps::square(const double* r) {
  const PoissonMatrix& a = op_->matrix();
  for_planes([&](int plane) {
    const int k = plane + layout_.low[2];
    double total_plane = 0.0;
    for (const Segment& s : op_->rows().plane(k)) {
      const double* rr = r + a.kind.index(s.begin, s.j, k);
      double sum = 0.0;
#pragma omp simd reduction(+ : sum)
      for (int i = 0; i < s.end - s.begin; ++i) sum += rr[i] * rr[i];
      total_plane += sum;
    }
    sum_[plane] = total_plane;
  });
  return total();
}

double FusedSteps::work(const double* r, const float* z) {
  const PoissonMatrix& a = op_->matrix();
  for_planes([&](int plane) {
    const int k = plane + layout_.low[2];
    double total_plane = 0.0;
    for (const Segment& s : op_->rows().plane(k)) {
      const double* rr = r + a.kind.index(s.begin, s.j, k);
      const float* zr = z + layout_(s.begin, s.j, k);
      double sum = 0.0;
#pragma omp simd reduction(+ : sum)
      for (int i = 0; i < s.end - s.begin; ++i) sum += rr[i] * static_cast<double>(zr[i]);
      total_plane += sum;
    }
    sum_[plane] = total_plane;
  });
  return total();
}

}  // namespace archetide
