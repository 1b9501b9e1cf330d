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
