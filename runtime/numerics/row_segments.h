#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace archetide {

/// A stretch of unknowns [begin, end) in the x direction of row j of some plane.
struct Segment {
  int j, begin, end;
  bool uniform;  // interior: all six faces fully open to unknowns, so that no coefficient need be
                 // read
};

/// What a cell is to the row loops.
enum class RowCell : std::uint8_t { kNone, kGeneral, kUniform };

/// The unknowns of a box as row segments, plane by plane, rows ascending: loops over them cost what
/// the water costs, not what the box costs.
class RowSegments {
 public:
  /// Uniform stretches shorter than this are not worth a loop of their own.
  static constexpr int kMinUniform = 16;

  void reset(int planes);
  /// Appends the segments of row j of plane k; calls of one plane come with ascending j.
  void add_row(int k, int j, const RowCell* cells, int n);
  void add(int k, const Segment& segment) { planes_[k].push_back(segment); }

  int planes() const { return static_cast<int>(planes_.size()); }
  const std::vector<Segment>& plane(int k) const { return planes_[k]; }
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
  std::vector<std::vector<Segment>> planes_;
};

}  // namespace archetide
