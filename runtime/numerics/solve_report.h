#pragma once

#include <chrono>
#include <ctime>

namespace archetide {

/// What an iterative solve did. Not converging is a result, not an exception: the caller decides.
struct SolveReport {
  int iterations = 0;
  double residual = 0.0;  // true |b - A x|_2 / |b|_2 at the end (recomputed, not the recursion's)
  bool converged = false;
  double setup_seconds = 0.0, solve_seconds = 0.0;          // wall
  double setup_cpu_seconds = 0.0, solve_cpu_seconds = 0.0;  // of all threads of the process
  /// Water that touches no air: its regions, and the largest flow into one of them, m^3/s, that
  /// neither water nor bodies can answer. The rest of the right-hand side is solved.
  int closed_regions = 0;
  double incompatible_flow = 0.0;

  /// Counts of this one and of the next solve of the same problem, otherwise as the next.
  void add(const SolveReport& next) {
    const SolveReport before = *this;
    *this = next;
    iterations += before.iterations;
    setup_seconds += before.setup_seconds, solve_seconds += before.solve_seconds;
    setup_cpu_seconds += before.setup_cpu_seconds, solve_cpu_seconds += before.solve_cpu_seconds;
  }
};

/// Wall and CPU seconds since it was made.
class Stopwatch {
 public:
  double wall() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
  }
  double cpu() const { return static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC; }

 private:
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  std::clock_t cpu_ = std::clock();
};

}  // namespace archetide
