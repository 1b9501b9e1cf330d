#include "runtime/fluid/time_splitting.h"

namespace archetide {

void continue_in_time(const MacField& now, const MacField& before, double steps,
                      const FaceField<unsigned char>& valid, MacField& out) {
  for (int a = 0; a < 3; ++a) {
#pragma omp parallel for schedule(static)
    for (std::size_t n = 0; n < now[a].size(); ++n) {
      const double change = valid[a][n] == 1 ? now[a][n] - before[a][n] : 0.0;
      out[a][n] = now[a][n] + steps * change;
    }
  }
}

void subtract_solved(const MacField& u, const FaceField<unsigned char>& valid, MacField& push) {
  for (int a = 0; a < 3; ++a) {
#pragma omp parallel for schedule(static)
    for (std::size_t n = 0; n < u[a].size(); ++n)
      push[a][n] = valid[a][n] == 1 ? push[a][n] - u[a][n] : 0.0;
  }
}

void add_push(const MacField& push, double factor, const FaceField<unsigned char>& target,
              MacField& u) {
  for (int a = 0; a < 3; ++a) {
#pragma omp parallel for schedule(static)
    for (std::size_t n = 0; n < u[a].size(); ++n)
      if (target[a][n]) u[a][n] += factor * push[a][n];
  }
}

}  // namespace archetide
