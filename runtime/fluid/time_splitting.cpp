#include "runtime/fluid/time_splitting.h"

#include <algorithm>
#include <cmath>

namespace archetide {
namespace {

// Calls marked(first, count) for the rows along x of the mask in which anything is marked, and
// bare(first, count) for the others: of the air nothing else is read.
template <class Marked, class Bare>
void for_each_row(const Array3<unsigned char>& mask, const Marked& marked, const Bare& bare) {
  const int rows = mask.ny() * mask.nz(), nx = mask.nx();
  constexpr int kAtOnce = 64;  // in turn: the upper rows are air
#pragma omp parallel for schedule(static, kAtOnce)
  for (int row = 0; row < rows; ++row) {
    const std::size_t first = static_cast<std::size_t>(row) * nx;
    const unsigned char* marks = mask.data() + first;
    unsigned char any = 0;
#pragma omp simd reduction(| : any)
    for (int i = 0; i < nx; ++i) any |= marks[i];
    if (any)
      marked(first, nx);
    else
      bare(first, nx);
  }
}

// Rows of `count` faces; the compiler makes vector code of these with pointers of their own only.
// to = u later where solved, `elsewhere` (may be `to`) where not
void continue_row(const double* u, const double* old, const unsigned char* solved, double steps,
                  const double* elsewhere, int count, double* to) {
#pragma omp simd
  for (int i = 0; i < count; ++i) {
    const double later = u[i] + steps * (u[i] - old[i]);
    to[i] = solved[i] == 1 ? later : elsewhere[i];
  }
}

void subtract_row(const double* from, const unsigned char* solved, int count, double* to) {
#pragma omp simd
  for (int i = 0; i < count; ++i) {
    const double change = to[i] - from[i];
    to[i] = solved[i] == 1 ? change : 0.0;
  }
}

void add_row(const double* from, double factor, const unsigned char* wanted, int count,
             double* to) {
#pragma omp simd
  for (int i = 0; i < count; ++i) {
    const double more = factor * from[i];
    to[i] += wanted[i] ? more : 0.0;
  }
}

// The part of a push that is reflected: all of it in deep water.
double reflected(double push, double per_usual, unsigned char deep) {
  return deep ? push : push * share_without_impact(std::abs(push) * per_usual);
}

// to += way * (reflected part of from) + plain * from where wanted
void reflect_row(const double* from, double way, double plain, double per_usual,
                 const unsigned char* deep, const unsigned char* wanted, int count, double* to) {
#pragma omp simd
  for (int i = 0; i < count; ++i) {
    const double more = way * reflected(from[i], per_usual, deep[i]) + plain * from[i];
    to[i] += wanted[i] ? more : 0.0;
  }
}

}  // namespace

void continue_in_time(const MacField& now, const MacField& before, double steps,
                      const FaceField<unsigned char>& valid, MacField& out) {
  for (int a = 0; a < 3; ++a) {
    const double *u = now[a].data(), *old = before[a].data();
    double* to = out[a].data();
    for_each_row(
        valid[a],
        [&](std::size_t n, int count) {
          continue_row(u + n, old + n, valid[a].data() + n, steps, u + n, count, to + n);
        },
        [&](std::size_t n, int count) { std::copy_n(u + n, count, to + n); });
  }
}

void start_reflection(const MacField& before, double steps, const Reflection& reflection,
                      const FaceField<unsigned char>& valid, MacField& u, MacField& carrier) {
  const double per_usual = reflection.usual > 0.0 ? 1.0 / reflection.usual : 0.0;
  const MacField& push = reflection.push;
  for (int a = 0; a < 3; ++a)
    for_each_row(
        valid[a],
        [&](std::size_t n, int count) {
          const unsigned char* marks = valid[a].data() + n;
          double *here = u[a].data() + n, *on = carrier[a].data() + n;
          continue_row(here, before[a].data() + n, marks, steps, on, count, on);
          reflect_row(push[a].data() + n, -1.0, 0.0, per_usual, reflection.deep[a].data() + n,
                      marks, count, here);
        },
        [](std::size_t, int) {});
}

void end_reflection(const Reflection& reflection, const FaceField<unsigned char>& valid,
                    const FaceField<unsigned char>& target, MacField& u, MacField& u_star) {
  const double per_usual = reflection.usual > 0.0 ? 1.0 / reflection.usual : 0.0;
  const MacField& push = reflection.push;
  for (int a = 0; a < 3; ++a) {
    const auto add_to_target = [&](std::size_t n, int count) {
      reflect_row(push[a].data() + n, 1.0, 1.0, per_usual, reflection.deep[a].data() + n,
                  target[a].data() + n, count, u_star[a].data() + n);
    };
    for_each_row(
        valid[a],
        [&](std::size_t n, int count) {
          reflect_row(push[a].data() + n, 1.0, 0.0, per_usual, reflection.deep[a].data() + n,
                      valid[a].data() + n, count, u[a].data() + n);
          add_to_target(n, count);
        },
        add_to_target);
  }
}

void subtract_solved(const MacField& u, const FaceField<unsigned char>& valid, MacField& push) {
  for (int a = 0; a < 3; ++a)
    for_each_row(
        valid[a],
        [&](std::size_t n, int count) {
          subtract_row(u[a].data() + n, valid[a].data() + n, count, push[a].data() + n);
        },
        [&](std::size_t n, int count) { std::fill_n(push[a].data() + n, count, 0.0); });
}

void add_push(const MacField& push, double factor, const FaceField<unsigned char>& target,
              MacField& u) {
  for (int a = 0; a < 3; ++a)
    for_each_row(
        target[a],
        [&](std::size_t n, int count) {
          add_row(push[a].data() + n, factor, target[a].data() + n, count, u[a].data() + n);
        },
        [](std::size_t, int) {});
}

}  // namespace archetide
