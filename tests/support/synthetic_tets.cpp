#include <array>
#include <cmath>
#include <random>

#include "tests/support/random_vectors.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Lattice of `cells` hexahedra cut in six tets each around the main diagonal; `node` maps lattice
/// points to nodes.
template <class NodeOf>
void cut_cells(TetMesh& mesh, const Vec3i& cells, NodeOf&& node) {
  constexpr std::array<std::array<int, 3>, 6> kPaths = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int i = 0; i < cells.x(); ++i)
    for (int j = 0; j < cells.y(); ++j)
      for (int k = 0; k < cells.z(); ++k)
        for (const auto& path : kPaths) {
          Vec3i at(i, j, k);
          std::array<int, 4> tet{node(at), 0, 0, 0};
          for (int s = 0; s < 3; ++s) {
            ++at[path[s]];
            tet[s + 1] = node(at);
          }
          mesh.tets.push_back(tet);
          if (tet_volume(mesh, static_cast<int>(mesh.tets.size()) - 1) < 0)
            std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
        }
}

void recentre(TetMesh& mesh) {
  Vec3 first_moment = Vec3::Zero();
  double volume = 0.0;
  for (int t = 0; t < static_cast<int>(mesh.tets.size()); ++t) {
    const double v = tet_volume(mesh, t);
    for (int node : mesh.tets[t]) first_moment += 0.25 * v * mesh.nodes[node];
    volume += v;
  }
  for (Vec3& x : mesh.nodes) x -= first_moment / volume;
}

}  // namespace

TetMesh box_tets(const Vec3& lengths, const Vec3i& cells) {
  TetMesh mesh;
  const auto node = [&](const Vec3i& p) {
    return p.x() + (cells.x() + 1) * (p.y() + (cells.y() + 1) * p.z());
  };
  for (int k = 0; k <= cells.z(); ++k)
    for (int j = 0; j <= cells.y(); ++j)
      for (int i = 0; i <= cells.x(); ++i)
        mesh.nodes.push_back(lengths.cwiseProduct(Vec3(static_cast<double>(i) / cells.x(),
                                                       static_cast<double>(j) / cells.y(),
                                                       static_cast<double>(k) / cells.z()) -
                                                  Vec3::Constant(0.5)));
  cut_cells(mesh, cells, node);
  return mesh;
}

TetMesh torus_tets(double R, double r, int around, int across) {
  TetMesh mesh;
  const auto node = [&](const Vec3i& p) {
    return p.y() + (across + 1) * (p.z() + (across + 1) * (p.x() % around));
  };
  for (int i = 0; i < around; ++i)
    for (int k = 0; k <= across; ++k)
      for (int j = 0; j <= across; ++j) {
        const double u = 2.0 * kPi * i / around;
        const double rho = R + r * (2.0 * j / across - 1.0);
        mesh.nodes.emplace_back(rho * std::cos(u), rho * std::sin(u), r * (2.0 * k / across - 1.0));
      }
  cut_cells(mesh, Vec3i(around, across, across), node);
  recentre(mesh);
  return mesh;
}

TetMesh blob_tets(unsigned seed, const Vec3& lengths, const Vec3i& cells) {
  TetMesh mesh = box_tets(lengths, cells);
  std::mt19937 random(seed);
  // an eighth of the cell keeps every tet positive (checked where the mass matrix is summed)
  std::uniform_real_distribution<double> shift(-0.125, 0.125);
  const Vec3 cell = lengths.cwiseQuotient(cells.cast<double>());
  for (Vec3& x : mesh.nodes) x += cell.cwiseProduct(random_vec3(shift, random));
  recentre(mesh);
  return mesh;
}

}  // namespace archetide
