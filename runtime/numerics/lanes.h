#pragma once

#include <algorithm>
#include <cstring>

namespace archetide {

/// Cells of a row that are worked on at once.
inline constexpr int kLanes = 16;

typedef float Lanes __attribute__((vector_size(4 * kLanes)));
typedef int Places __attribute__((vector_size(4 * kLanes)));
inline constexpr Places kPlace = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

template <class T, class Block>
void read_block(const T* p, Block& out) {
  std::memcpy(&out, p, sizeof(out));
}
template <class Block>
void write_block(const Block& b, float* p) {
  std::memcpy(p, &b, sizeof(b));
}

/// Which cells of a block are meant: all bits set, or none. (Comparisons of such blocks become a
/// branch for every cell in GCC 12.)
struct Choice {
  Places bits;

  /// value where meant, else otherwise
  void select(const Lanes& value, const Lanes& otherwise, Lanes& out) const {
    out = (Lanes)(((Places)value & bits) | ((Places)otherwise & ~bits));
  }
};

/// The cells of a block from the first-th on and before the end-th, which may lie beyond it.
inline void stretch(int first, int end, Choice& out) {
  static constexpr int kStretch[3 * kLanes] = {
      0,  0,  0,  0,  0,  0,  0,  0,  0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1,
      -1, -1, -1, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0, 0, 0, 0,  0,  0,  0,  0,  0,  0,  0};
  Places begun;
  read_block(kStretch + kLanes - first, begun);
  read_block(kStretch + 2 * kLanes - std::min(end, kLanes), out.bits);
  out.bits &= begun;
}

}  // namespace archetide
