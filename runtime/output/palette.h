#pragma once

#include <array>

namespace archetide {

/// The colour of body number b in pictures and charts, sRGB in [0, 1]; neighbours differ clearly.
inline const std::array<float, 3>& body_palette(int b) {
  static constexpr std::array<std::array<float, 3>, 8> kColours = {{{0.90f, 0.30f, 0.13f},
                                                                    {0.96f, 0.66f, 0.10f},
                                                                    {0.20f, 0.56f, 0.28f},
                                                                    {0.74f, 0.16f, 0.30f},
                                                                    {0.44f, 0.27f, 0.62f},
                                                                    {0.93f, 0.48f, 0.50f},
                                                                    {0.85f, 0.83f, 0.74f},
                                                                    {0.13f, 0.42f, 0.62f}}};
  return kColours[b % kColours.size()];
}

/// The same in linear light, which the square of sRGB is close to.
inline std::array<float, 3> body_palette_in_light(int b) {
  const auto& c = body_palette(b);
  return {c[0] * c[0], c[1] * c[1], c[2] * c[2]};
}

}  // namespace archetide
