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
  TetMesh tets = blob_tets(3, Vec3(0.5, 0.4, 0.3), Vec3i(2, 2, 2));
  SmallFem fem = small_fem(tets, 400.0, 2e4, 0.4);
  SyntheticBody synthetic;
  std::shared_ptr<Archetype> archetype;
  std::shared_ptr<const NodalSpace> nodes;

  explicit FullBlob(int stored = kAll, bool corrected = true);
};

/// The same of NeoHookean material, whose stored modes have the energy of all tets.
std::shared_ptr<const FullBlob> nonlinear_blob(int stored = FullBlob::kAll);

/// A body of the blob's stored modes, and one of its nodes, at rest.
ReducedBody body_of_modes(const FullBlob& blob);
ReducedBody body_of_nodes(const FullBlob& blob);

/// Between the surface points of two bodies of one surface, m.
double largest_distance(const ReducedBody& a, const ReducedBody& b);

}  // namespace archetide
