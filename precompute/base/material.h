#pragma once

#include <utility>
#include <vector>

namespace archetide {

/// Isotropic linear elastic material.
struct Material {
  double density = 0.0;  // kg/m^3, > 0
  double young = 0.0;    // Pa, > 0
  double poisson = 0.0;  // 1, in (-1, 0.5)
};

/// The material of every tet.
struct MaterialField {
  std::vector<Material> materials;  // at least one
  std::vector<int> of_tet;          // nt: which of them, or empty: the first everywhere

  MaterialField(const Material& material)
      : materials{material} {}  // NOLINT: one material is a field
  MaterialField(std::vector<Material> list, std::vector<int> index)
      : materials(std::move(list)), of_tet(std::move(index)) {}
  const Material& at(int tet) const { return materials[of_tet.empty() ? 0 : of_tet[tet]]; }
};

}  // namespace archetide
