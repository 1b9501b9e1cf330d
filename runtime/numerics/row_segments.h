#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace archetide {

/// What a cell is to the row loops: one that is no unknown (0), one whose coefficients have to be
/// read (kGeneral), or one whose faces to unknowns all have the same coefficient and whose diagonal
/// is that times their number, which is given (1 to 6; walls leave fewer than six).
using RowCell = std::uint8_t;
inline constexpr RowCell kNoUnknown = 0, kGeneral = 255;

/// A stretch of unknowns [begin, end) in the x direction of row j of some plane.
struct Segment {
  int j, begin, end;
  // Neighbours of its first, its inner and its last cells where no coefficient need be read; else 0
  std::uint8_t first = 0, inner = 0, last = 0;

  bool uniform() const { return inner != 0; }
};

/// The unknowns of a box as row segments, plane by plane, rows ascending: loops over them cost what
/// the water costs, not what the box costs.
class RowSegments {
 public:
  /// Uniform stretches shorter than this are not worth a loop of their own.
  static constexpr int kMinUniform = 16;

  void reset(int planes);
  /// Appends the segments of row j of plane k; calls of one plane come with ascending j.
  void add_row(int k, int j, const RowCell* cells, int n);
  void add(int k, const Segment& segment) {
    planes_[k].push_back(segment);
    unknowns_[k] += segment.end - segment.begin;
    work_[k] += work_of(segment);
  }

  int planes() const { return static_cast<int>(planes_.size()); }
  const std::vector<Segment>& plane(int k) const { return planes_[k]; }
  /// Of plane k.
  std::size_t unknowns(int k) const { return unknowns_[k]; }
  std::size_t unknowns() const;
  /// What a loop over plane k costs, in unknowns of uniform segments.
  std::size_t work(int k) const { return work_[k]; }
  /// Those of rows first <= j < end of plane k.
  std::span<const Segment> rows(int k, int first, int end) const {
    const auto at = [&](int j) {
      return std::partition_point(planes_[k].begin(), planes_[k].end(),
                                  [j](const Segment& s) { return s.j < j; });
    };
    return {at(first), at(end)};
  }
  std::size_t bytes() const;

 private:
  static std::size_t work_of(const Segment& s) {
    constexpr int kBegin = 8, kCoefficients = 3;  // to begin with it; a general unknown
    return kBegin + (s.uniform() ? 1 : kCoefficients) * (s.end - s.begin);
  }

  std::vector<std::vector<Segment>> planes_;
  std::vector<std::size_t> unknowns_, work_;  // of each plane
};

}  // namespace archetide
