#pragma once

namespace archetide {

/// Modes whose frequencies differ by less than this share belong to one cluster: anisotropy of the
/// mesh splits equal frequencies by less, and the directions within a cluster are arbitrary.
inline constexpr double kClusterGap = 1e-2;

}  // namespace archetide
