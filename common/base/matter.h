#pragma once

namespace archetide {

/// Densities of anything there is, kg/m^3; far from where squares of energies overflow.
constexpr double kLeastDensity = 1e-9, kLargestDensity = 1e12;

}  // namespace archetide
