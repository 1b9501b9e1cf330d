#include "tests/support/full_blob.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "tests/support/dry_body.h"

namespace archetide {
namespace {

std::vector<int> shuffled(std::size_t n) {
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  unsigned state = 7;
  for (std::size_t k = n; k > 1; --k) {
    state = 1664525u * state + 1013904223u;
    std::swap(order[k - 1], order[(state >> 8) % k]);
  }
  return order;
}

}  // namespace

TetMatrices sparse_matrices(const TetMesh& mesh, const SmallFem& fem, std::vector<int> order) {
  TetMatrices m;
  m.order = std::move(order);
  std::vector<std::set<int>> neighbours(mesh.nodes.size());
  for (const auto& tet : mesh.tets)
    for (const int p : tet)
      for (const int q : tet)
        if (q <= p) neighbours[p].insert(q);
  for (int p = 0; p < static_cast<int>(mesh.nodes.size()); ++p) {
    for (const int q : neighbours[p]) {
      m.column.push_back(q);
      m.mass.push_back(fem.scalar_mass(p, q));
      m.stiffness.push_back(fem.K.block<3, 3>(3L * p, 3L * q));
    }
    m.row_ends.push_back(static_cast<int>(m.column.size()));
  }
  return m;
}

FullBlob::FullBlob(int stored, bool corrected) { derive(stored, corrected); }

FullBlob::FullBlob(TetMesh mesh, double rho, double E, int stored)
    : tets(std::move(mesh)), density(rho), young(E) {
  derive(stored, true);
}

void FullBlob::derive(int stored, bool corrected) {
  const ElasticModes modes = elastic_modes(fem);
  synthetic =
      deformable_archetype(tets, density, modes.shapes.leftCols(stored), modes.omega.head(stored));
  if (!corrected) synthetic = linear_alone(synthetic);
  archetype = synthetic.archetype;
  archetype->alpha = 0.1, archetype->beta = 1e-3;
  archetype->matrices = sparse_matrices(tets, fem, shuffled(tets.nodes.size()));
  nodes = std::make_shared<const NodalSpace>(archetype);
}

void FullBlob::make_nonlinear() {
  Archetype& a = *archetype;
  const auto count = static_cast<Eigen::Index>(a.tets.tets.size());
  a.matrices.lambda =
      VecX::Constant(count, young * kPoisson / ((1.0 + kPoisson) * (1.0 - 2.0 * kPoisson)));
  a.matrices.mu = VecX::Constant(count, 0.5 * young / (1.0 + kPoisson));
  const TetElasticity V(a.tets, a.matrices.lambda, a.matrices.mu);
  a.elastic = V.sampled(a.node_modes, V.points(), VecX::Ones(count));
  nodes = std::make_shared<const NodalSpace>(archetype);
}

std::shared_ptr<const FullBlob> nonlinear_blob(int stored) {
  auto blob = std::make_shared<FullBlob>(stored);
  blob->make_nonlinear();
  return blob;
}

ReducedBody body_of_modes(const FullBlob& blob) {
  return make_body(blob.archetype, blob.archetype->r());
}

ReducedBody body_of_nodes(const FullBlob& blob) {
  ReducedBody body = make_body(blob.archetype, 0);
  free_nodes(blob.nodes, body);
  return body;
}

double largest_distance(const ReducedBody& a, const ReducedBody& b) {
  std::vector<Vec3> x, y;
  surface_points(a, x), surface_points(b, y);
  double most = 0.0;
  for (std::size_t v = 0; v < x.size(); ++v) most = std::max(most, (x[v] - y[v]).norm());
  return most;
}

}  // namespace archetide
