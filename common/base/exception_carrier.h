#pragma once

#include <atomic>
#include <exception>
#include <utility>

namespace archetide {

/// Carries the first exception out of a parallel region, which none may leave by itself (the
/// program would end there):
///   ExceptionCarrier carrier;
///   #pragma omp parallel for
///   for (..) carrier.run([&] { .. });
///   carrier.rethrow();
/// Costs nothing but a look at a flag for each run, so a run should be a row, a plane or a body
/// rather than a cell.
class ExceptionCarrier {
 public:
  /// Does f() unless an earlier one has thrown.
  template <class F>
  void run(F&& f) noexcept {
    if (caught()) return;
    try {
      std::forward<F>(f)();
    } catch (...) {
      if (!caught_.exchange(true)) first_ = std::current_exception();
    }
  }

  bool caught() const noexcept { return caught_.load(std::memory_order_relaxed); }

  /// Behind the region: throws what was thrown first, if anything was.
  void rethrow() const {
    if (first_) std::rethrow_exception(first_);
  }

 private:
  std::atomic<bool> caught_ = false;
  std::exception_ptr first_;
};

}  // namespace archetide
