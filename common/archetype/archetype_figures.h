#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/archetype/archetype.h"

namespace archetide {

// Figures that `info` and `report` of the programs derive from an archetype.

/// Of the modes; of a static response vector the square root of its Rayleigh quotient.
std::vector<double> frequencies_hz(const Archetype& a);

/// Of basis vector k: "mode" or "static".
std::string kind_of(const Archetype& a, int k);

/// Estimated relative error of the frequency of basis vector k; empty for static vectors and where
/// there is no estimate.
std::optional<double> frequency_error(const Archetype& a, int k);

/// About the centre of mass, kg m^2.
Mat3 inertia(const Archetype& a);

/// Principal moments, ascending, kg m^2.
Vec3 principal_moments(const Mat3& inertia);

/// Mass, centre and inertia of the solid that the stored surface encloses at the body's density,
/// exact by the divergence theorem: what the sums over the tets are compared with.
struct SolidFigures {
  double mass = 0.0;            // kg
  Vec3 centre = Vec3::Zero();   // m, rest frame
  Mat3 inertia = Mat3::Zero();  // about that centre, kg m^2
};
SolidFigures solid_of_surface(const Archetype& a);

/// How far the modes are from what they are meant to be; 0 up to round-off.
struct Orthogonality {
  double mass = 0.0;         // largest entry of |phi^T M phi - 1|, kg
  double translation = 0.0;  // largest |sum m phi_i| / sqrt(m 1 kg)
  double rotation = 0.0;     // largest |sum m x × phi_i| / sqrt(tr(I) 1 kg)
};
Orthogonality orthogonality(const Archetype& a);

}  // namespace archetide
