#include "tests/support/synthetic_archetype.h"

#include <Eigen/Dense>
#include <random>

#include "common/archetype/rigid_archetype.h"
#include "common/base/check.h"

namespace archetide {
namespace {

void fill_surface_samples(Archetype& a) {
  vertex_normals_and_areas(a.surface, a.surface_normals, a.surface_areas);
}

void fill_provenance(Archetype& a, const std::string& name, double density) {
  a.name = name;
  a.generator = "synthetic";
  a.mesher = "input";
  a.mass_kind = "consistent";
  a.density = density;
  a.young = 1e6;
  a.poisson = 0.3;
  a.min_dihedral = 60.0;
  a.min_radius_ratio = 1.0;
}

/// ∫ ρ N_a N_b = ρ V / 20 (1 + δ_ab) on linear tets.
MatX consistent_mass(const TetMesh& mesh, double density) {
  const int n = static_cast<int>(mesh.nodes.size());
  MatX M = MatX::Zero(n, n);
  for (int t = 0; t < static_cast<int>(mesh.tets.size()); ++t) {
    const double v = tet_volume(mesh, t);
    ARCHETIDE_CHECK_OP(v, >, 0.0);
    for (int a : mesh.tets[t])
      for (int b : mesh.tets[t]) M(a, b) += density * v / 20.0 * (a == b ? 2.0 : 1.0);
  }
  return M;
}

/// The six rigid motions at every node, 3 n x 6.
MatX rigid_motions(const std::vector<Vec3>& x) {
  MatX J(3 * x.size(), 6);
  for (std::size_t v = 0; v < x.size(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      J.block<3, 1>(3 * v, axis) = Vec3::Unit(axis);
      J.block<3, 1>(3 * v, 3 + axis) = Vec3::Unit(axis).cross(x[v]);
    }
  return J;
}

/// Random polynomials of degree 2 in the coordinates scaled to the body's size, 3 n x r.
MatX smooth_fields(const std::vector<Vec3>& x, unsigned seed, int r) {
  double size = 0.0;
  for (const Vec3& p : x) size = std::max(size, p.norm());
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MatX S(3 * x.size(), r);
  for (int i = 0; i < r; ++i) {
    const Eigen::Matrix<double, 3, 9> c =
        Eigen::Matrix<double, 3, 9>::NullaryExpr([&] { return normal(random); });
    for (std::size_t v = 0; v < x.size(); ++v) {
      const Vec3 p = x[v] / size;
      Eigen::Matrix<double, 9, 1> monomials;
      monomials << p, p.cwiseProduct(p), p.x() * p.y(), p.y() * p.z(), p.z() * p.x();
      S.block<3, 1>(3 * v, i) = c * monomials;
    }
  }
  return S;
}

/// M S with M the scalar mass times the 3 x 3 identity.
MatX times_mass(const MatX& scalar_mass, const MatX& S) {
  MatX out(S.rows(), S.cols());
  const long n = scalar_mass.rows();
  for (long c = 0; c < S.cols(); ++c) {
    const Eigen::Map<const MatX> field(S.col(c).data(), 3, n);
    Eigen::Map<MatX>(out.col(c).data(), 3, n) = field * scalar_mass;
  }
  return out;
}

/// Gram-Schmidt in the mass matrix, twice, against the rigid motions and the columns before.
MatX orthonormal_modes(const MatX& scalar_mass, const MatX& rigid, MatX S) {
  MatX basis(S.rows(), 6 + S.cols());
  basis << rigid, S;
  for (long c = 0; c < basis.cols(); ++c) {
    for (int pass = 0; pass < 2 && c > 0; ++pass) {
      const MatX weighted = times_mass(scalar_mass, basis.col(c));
      const VecX along = basis.leftCols(c).transpose() * weighted;
      basis.col(c) -= basis.leftCols(c) * along;
    }
    basis.col(c) /= std::sqrt(basis.col(c).dot(times_mass(scalar_mass, basis.col(c)).col(0)));
  }
  return basis.rightCols(S.cols());
}

/// Σ m a bᵀ over all pairs of nodes, for node fields a, b (3 x n).
Mat3 mass_weighted(const MatX& scalar_mass, const MatX& a, const MatX& b) {
  return a * scalar_mass * b.transpose();
}

MomentumIntegrals direct_integrals(const std::vector<Vec3>& nodes, const MatX& scalar_mass,
                                   const MatX& S) {
  const long n = scalar_mass.rows();
  const int r = static_cast<int>(S.cols());
  const auto mode = [&](int i) { return MatX(Eigen::Map<const MatX>(S.col(i).data(), 3, n)); };
  MatX x(3, n);
  for (long v = 0; v < n; ++v) x.col(v) = nodes[v];

  MomentumIntegrals out;
  out.mass = scalar_mass.sum();
  out.Sxx = mass_weighted(scalar_mass, x, x);
  for (int i = 0; i < r; ++i) {
    out.I3.push_back(mode(i) * scalar_mass.rowwise().sum());
    out.A.push_back(mass_weighted(scalar_mass, x, mode(i)));
    for (int j = 0; j < r; ++j) out.B.push_back(mass_weighted(scalar_mass, mode(i), mode(j)));
  }
  return out;
}

}  // namespace

std::shared_ptr<const Archetype> rigid_surface_archetype(const TriMesh& surface, double density) {
  auto a = std::make_shared<Archetype>(rigid_archetype("rigid", surface, density));
  fill_provenance(*a, "rigid", density);
  return a;
}

SyntheticBody deformable_archetype(const TetMesh& tets, const SyntheticOptions& options) {
  const int r = options.r;
  SyntheticBody body = deformable_archetype(
      tets, options.density, smooth_fields(tets.nodes, options.seed, r),
      options.first_omega * (1.0 + 0.4 * VecX::LinSpaced(r, 0, r - 1).array()));
  body.archetype->alpha = options.alpha;
  body.archetype->beta = options.beta;
  return body;
}

SyntheticBody deformable_archetype(const TetMesh& tets, double density, const MatX& shapes,
                                   const VecX& omega) {
  SyntheticBody body{std::make_shared<Archetype>(), consistent_mass(tets, density)};
  Archetype& a = *body.archetype;
  fill_provenance(a, "synthetic", density);
  a.tets = tets;
  a.surface = boundary_surface(tets, a.surface_to_node);
  fill_surface_samples(a);
  a.volume = enclosed_volume(a.surface);

  const long r = shapes.cols();
  a.node_modes = orthonormal_modes(body.scalar_mass, rigid_motions(tets.nodes), shapes);
  a.surface_modes.resize(3 * static_cast<long>(a.surface.vertices.size()), r);
  for (std::size_t v = 0; v < a.surface.vertices.size(); ++v)
    a.surface_modes.middleRows<3>(3 * v) = a.node_modes.middleRows<3>(3 * a.surface_to_node[v]);
  derive_shapes(a);

  a.omega2 = omega.cwiseAbs2();
  a.is_static.assign(static_cast<std::size_t>(r), 0);
  a.residuals = VecX::Zero(r);
  a.M_r = MatX::Identity(r, r);
  a.K_r = a.omega2.asDiagonal();
  a.integrals = direct_integrals(tets.nodes, body.scalar_mass, a.node_modes);
  return body;
}

SyntheticBody linear_alone(SyntheticBody body) {
  body.archetype->linear = {};
  return body;
}

SyntheticBody random_archetype(unsigned seed, int r) {
  SyntheticOptions options;
  options.seed = seed;
  options.r = r;
  return deformable_archetype(blob_tets(seed, Vec3(0.5, 0.4, 0.3), Vec3i(4, 3, 3)), options);
}

}  // namespace archetide
