#pragma once

#include <string>

#include "precompute/build.h"

namespace archetide {

/// A mesh of which a body is to be made.
struct ProposeRequest {
  std::string mesh;                                          // surface or tets
  std::string mesh_name;                                     // as the body file names it
  std::string body;                                          // path of the body file to be
  double scale = 1.0;                                        // mesh units to m
  double density = 500.0;                                    // kg/m^3
  double cpu_seconds = TetrahedralizeOptions().cpu_seconds;  // for each attempt
};

/// A body file that builds as it stands, and what to know about it.
struct Proposal {
  std::string text;     // of the body file
  std::string summary;  // lines for people
  std::string warning;  // about an odd size, or empty
};

/// Looks at a mesh: as many tets as pass the quality gate (4000 or, where they fail, up to 16000),
/// a repair where the surface needs one, the Young's modulus of proposed_young(), and 10 modes or, up
/// to 30, as many as bring small deflections under loads on patches within 15 %. The log gets
/// what intake did and why an attempt failed. Throws what building the last attempt throws.
Proposal propose_body(const ProposeRequest& request, Profile& profile);

/// Young's modulus (Pa, two digits) of a body as soft as one that visibly bends: the deflection
/// g / omega_1^2 of its first mode under its own weight is 4 % of `size` (longest side, m).
/// Frequencies grow with its square root: `omega2` (1/s^2) was found with `young` (Pa).
double proposed_young(double young, double omega2, double size);

/// Empty for a body of 1 cm to 10 m; else its longest side (`size`, m) and in which units the mesh
/// may be, with the scale of each. `scale`: the one that gave this size.
std::string size_warning(double size, double scale);

}  // namespace archetide
