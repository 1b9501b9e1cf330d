#pragma once

#include <memory>

#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"
#include "tests/support/small_fem.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {

/// The blocks of a body's dense matrices that nodes of one tet share, in the given order of
/// elimination.
TetMatrices sparse_matrices(const TetMesh& mesh, const SmallFem& fem, std::vector<int> order);

/// A soft blob of 27 nodes, about 0.5 x 0.4 x 0.3 m and 400 kg/m^3, with `stored` of its 75 modes
/// and the matrices of its nodes.
struct FullBlob {
  static constexpr int kAll = 75;
  static constexpr double kDensity = 400.0, kYoung = 2e4, kPoisson = 0.4;  // kg/m^3, Pa, 1
  TetMesh tets = blob_tets(3, Vec3(0.5, 0.4, 0.3), Vec3i(2, 2, 2));
  double density = kDensity, young = kYoung;
  SmallFem fem = small_fem(tets, density, young, kPoisson);
  SyntheticBody synthetic;
  std::shared_ptr<Archetype> archetype;
  std::shared_ptr<const NodalSpace> nodes;

  explicit FullBlob(int stored = kAll, bool corrected = true);
  /// Another one, of linear tets.
  FullBlob(TetMesh mesh, double density, double young, int stored);
  /// NeoHookean from now on: the energy of the stored modes is that of all tets.
  void make_nonlinear();

 private:
  void derive(int stored, bool corrected);
};

/// The same of NeoHookean material.
std::shared_ptr<const FullBlob> nonlinear_blob(int stored = FullBlob::kAll);

/// A body of the blob's stored modes, and one of its nodes, at rest.
ReducedBody body_of_modes(const FullBlob& blob);
ReducedBody body_of_nodes(const FullBlob& blob);

/// Between the surface points of two bodies of one surface, m.
double largest_distance(const ReducedBody& a, const ReducedBody& b);

}  // namespace archetide
