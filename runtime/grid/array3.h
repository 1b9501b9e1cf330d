#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Elements that a vector creates are left uninitialised.
template <class T>
struct UnfilledAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UnfilledAllocator<U>;
  };
  template <class U>
  void construct(U* p) {
    ::new (static_cast<void*>(p)) U;
  }
  template <class U, class... Args>
  void construct(U* p, Args&&... args) {
    ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
  }
};

/// An array whose values its owner is about to write.
struct Unfilled {};

/// A dense nx x ny x nz array, x fastest.
template <class T>
class Array3 {
 public:
  Array3() = default;
  Array3(int nx, int ny, int nz, T value = T()) { resize(nx, ny, nz, value); }
  Array3(int nx, int ny, int nz, Unfilled)
      : nx_(nx), ny_(ny), nz_(nz), data_(static_cast<std::size_t>(nx) * ny * nz) {}
  void resize(int nx, int ny, int nz, T value = T()) {
    nx_ = nx, ny_ = ny, nz_ = nz;
    data_.resize(static_cast<std::size_t>(nx) * ny * nz);
    fill(value);
  }
  /// The same array with nz layers: those that it has stay, further ones hold `value`.
  void set_layers(int nz, T value = T()) {
    const std::size_t layer = static_cast<std::size_t>(nx_) * ny_;
    Values layers;
    layers.reserve(layer * nz);
    const std::size_t kept = layer * std::min(nz, nz_);
    layers.assign(data_.begin(), data_.begin() + static_cast<std::ptrdiff_t>(kept));
    layers.resize(layer * nz, value);
    data_.swap(layers);
    nz_ = nz;
  }
  /// On all threads.
  void fill(T value) {
    constexpr std::size_t kParallelBytes = 1 << 16;
    T* values = data_.data();
    const std::size_t count = data_.size();
#pragma omp parallel for simd schedule(static) if (count * sizeof(T) > kParallelBytes)
    for (std::size_t n = 0; n < count; ++n) values[n] = value;
  }
  int nx() const { return nx_; }
  int ny() const { return ny_; }
  int nz() const { return nz_; }
  std::size_t size() const { return data_.size(); }
  std::size_t index(int i, int j, int k) const {
    return i + static_cast<std::size_t>(nx_) * (j + static_cast<std::size_t>(ny_) * k);
  }
  bool contains(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < nx_ && j < ny_ && k < nz_;
  }
  T& operator()(int i, int j, int k) { return data_[index(i, j, k)]; }
  const T& operator()(int i, int j, int k) const { return data_[index(i, j, k)]; }
  T& operator[](std::size_t n) { return data_[n]; }
  const T& operator[](std::size_t n) const { return data_[n]; }
  T* data() { return data_.data(); }
  const T* data() const { return data_.data(); }
  void swap(Array3& other) {
    std::swap(nx_, other.nx_), std::swap(ny_, other.ny_), std::swap(nz_, other.nz_);
    data_.swap(other.data_);
  }

 private:
  int nx_ = 0, ny_ = 0, nz_ = 0;
  using Values = std::vector<T, UnfilledAllocator<T>>;
  Values data_;
};

/// Sum of all values, plane by plane: threads do not change it.
inline double sum_by_plane(const Array3<double>& a) {
  const std::size_t layer = static_cast<std::size_t>(a.nx()) * a.ny();
  std::vector<double> planes(a.nz(), 0.0);
#pragma omp parallel for schedule(static)
  for (int k = 0; k < a.nz(); ++k) {
    const double* values = a.data() + layer * k;
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (std::size_t n = 0; n < layer; ++n) sum += values[n];
    planes[k] = sum;
  }
  double total = 0.0;
  for (const double plane : planes) total += plane;
  return total;
}

/// to = from, on all threads.
template <class T>
void copy_values(const std::vector<T>& from, std::vector<T>& to) {
  to.resize(from.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < from.size(); ++n) to[n] = from[n];
}
template <class T>
void copy_values(const Array3<T>& from, Array3<T>& to) {
  if (to.nx() != from.nx() || to.ny() != from.ny() || to.nz() != from.nz())
    to = Array3<T>(from.nx(), from.ny(), from.nz(), Unfilled{});
  const T* read = from.data();  // bytes that are written might be what an array says of itself
  T* written = to.data();
  const std::size_t count = from.size();
#pragma omp parallel for simd schedule(static)
  for (std::size_t n = 0; n < count; ++n) written[n] = read[n];
}

}  // namespace archetide
