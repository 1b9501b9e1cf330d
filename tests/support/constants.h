#pragma once

namespace archetide {

inline constexpr double kWaterDensity = 1000.0;  // kg/m^3

}  // namespace archetide
