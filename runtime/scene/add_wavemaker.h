#pragma once

#include "runtime/scene/scene_builder.h"

namespace archetide {

/// Wave number of linear waves in water of this depth (m), rad/m: omega^2 = g k tanh(k h).
/// omega in rad/s, g in m/s^2.
double wave_number(double omega, double depth, double g);

/// Height of the waves over the stroke of the board at the water level, by linear theory
/// (docs/bibliography.md, [DD91]); kh: wave number times depth.
double height_over_stroke(bool flap, double kh);

/// A wave maker as an obstacle that moves: a block from outside of the side up to its front.
/// Complains (InputError) about water without a level, gravity that is not along -z, and strokes
/// that do not fit.
void add_wavemaker(const WavemakerSpec& spec, const SceneSpec& scene, BuiltScene& built);

}  // namespace archetide
