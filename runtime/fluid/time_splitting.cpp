#include "runtime/fluid/time_splitting.h"

#include <algorithm>

namespace archetide {
namespace {

// Calls marked(first, last) for the rows along x of the mask in which anything is marked, and
// bare(first, last) for the others: of the air nothing else is read.
template <class Marked, class Bare>
void for_each_row(const Array3<unsigned char>& mask, const Marked& marked, const Bare& bare) {
  const int rows = mask.ny() * mask.nz();
#pragma omp parallel for schedule(static)
  for (int row = 0; row < rows; ++row) {
    const std::size_t first = static_cast<std::size_t>(row) * mask.nx(), last = first + mask.nx();
    unsigned char any = 0;
    for (std::size_t n = first; n < last; ++n) any |= mask[n];
    if (any)
      marked(first, last);
    else
      bare(first, last);
  }
}

}  // namespace

void continue_in_time(const MacField& now, const MacField& before, double steps,
                      const FaceField<unsigned char>& valid, MacField& out) {
  for (int a = 0; a < 3; ++a) {
    const double *u = now[a].data(), *old = before[a].data();
    const unsigned char* solved = valid[a].data();
    double* to = out[a].data();
    for_each_row(
        valid[a],
        [&](std::size_t first, std::size_t last) {
#pragma omp simd
          for (std::size_t n = first; n < last; ++n)
            to[n] = u[n] + steps * (solved[n] == 1 ? u[n] - old[n] : 0.0);
        },
        [&](std::size_t first, std::size_t last) { std::copy(u + first, u + last, to + first); });
  }
}

void subtract_solved(const MacField& u, const FaceField<unsigned char>& valid, MacField& push) {
  for (int a = 0; a < 3; ++a) {
    const double* from = u[a].data();
    const unsigned char* solved = valid[a].data();
    double* to = push[a].data();
    for_each_row(
        valid[a],
        [&](std::size_t first, std::size_t last) {
#pragma omp simd
          for (std::size_t n = first; n < last; ++n) to[n] = solved[n] == 1 ? to[n] - from[n] : 0.0;
        },
        [&](std::size_t first, std::size_t last) { std::fill(to + first, to + last, 0.0); });
  }
}

void add_push(const MacField& push, double factor, const FaceField<unsigned char>& target,
              MacField& u) {
  for (int a = 0; a < 3; ++a) {
    const double* from = push[a].data();
    const unsigned char* wanted = target[a].data();
    double* to = u[a].data();
    for_each_row(
        target[a],
        [&](std::size_t first, std::size_t last) {
#pragma omp simd
          for (std::size_t n = first; n < last; ++n) to[n] += wanted[n] ? factor * from[n] : 0.0;
        },
        [](std::size_t, std::size_t) {});
  }
}

}  // namespace archetide
