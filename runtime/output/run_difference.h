#pragma once

#include <string>

namespace archetide {

/// How far a run is from another one: root mean squares over the frames that both have (same time)
/// and, where bodies are compared, over all bodies of both. NaN: there is nothing to compare.
struct RunDifference {
  int frames = 0;                 // that both have
  double position = 0.0;          // of centres of mass / cube root of the body's volume
  double rotation = 0.0;          // angle between the two, rad
  double modal = 0.0;             // |q - q_ref| / rms of |q_ref|; a mode that one lacks is 0
  double momentum = 0.0;          // |p - p_ref| of water and bodies / largest |p_ref|
  double angular_momentum = 0.0;  // of the bodies, likewise
  double volume = 0.0;            // of the water / its first volume
  double kinetic = 0.0;           // energy of water and bodies / its largest value
};

/// Reads manifest.json, stats.csv and bodies.csv of both folders. Throws FileError.
RunDifference run_difference(const std::string& run, const std::string& reference);

}  // namespace archetide
