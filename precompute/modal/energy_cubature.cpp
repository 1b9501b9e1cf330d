#include "precompute/modal/energy_cubature.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "precompute/base/bounding_diagonal.h"
#include "precompute/modal/nonlinear_elasticity.h"
#include "precompute/modal/nonnegative_fit.h"
#include "precompute/modal/static_balance.h"

namespace archetide {
namespace {

/// A random subset of the quadrature points, ascending, at most `count`.
std::vector<MaterialPoint> choose_points(const TetMesh& mesh, int count, std::mt19937& random) {
  std::vector<MaterialPoint> all = material_points(mesh), chosen;
  std::sample(all.begin(), all.end(), std::back_inserter(chosen), count, random);
  return chosen;
}

/// Coordinates (r x 6) whose gradients come closest to the six unit strains at the points.
MatX strain_coordinates(const ElasticCubature& all) {
  const Eigen::Index P = all.points();
  MatX strains = MatX::Zero(9 * P, 6);
  for (int k = 0; k < 6; ++k) {
    const int a = k % 3, b = k < 3 ? a : (a + 1) % 3;
    strains.block((3 * a + b) * P, k, P, 1).setOnes();
    strains.block((3 * b + a) * P, k, P, 1).setOnes();
  }
  const MatX gram = all.gradients.transpose() * all.gradients;
  return gram.ldlt().solve(all.gradients.transpose() * strains);
}

/// How far each coordinate may be driven by itself: as far as its linear displacement is
/// kLargestWay of the body, and its energy that of a uniform strain `largest_strain`.
VecX amplitudes(const TetMesh& mesh, const ElasticCubature& all, const MatX& basis, const MatX& K_r,
                double largest_strain) {
  constexpr double kLargestWay = 0.35;  // of the diagonal
  const double way = kLargestWay * bounding_diagonal(mesh.nodes);
  const double energy = largest_strain * largest_strain * all.weights.dot(all.mu);
  VecX a(basis.cols());
  for (Eigen::Index i = 0; i < a.size(); ++i)
    a[i] = std::min(way / basis.col(i).cwiseAbs().maxCoeff(), std::sqrt(2.0 * energy / K_r(i, i)));
  return a;
}

/// Loads (r x poses): on each coordinate alone, on the uniform strains, and on a few at a time at
/// random, every one in both directions.
MatX training_loads(const VecX& amplitude, const MatX& strains, const MatX& K_r,
                    const CubatureOptions& options, std::mt19937& random) {
  const Eigen::Index r = amplitude.size();
  std::vector<VecX> q;
  for (Eigen::Index k = 0; k < strains.cols(); ++k)
    q.push_back(options.largest_strain * strains.col(k));
  const Eigen::Index alone = std::min<Eigen::Index>(r, options.poses / 4);
  for (Eigen::Index i = 0; i < alone; ++i) q.push_back(amplitude[i] * VecX::Unit(r, i));
  std::uniform_real_distribution<double> share(-1.0, 1.0), place(0.0, 1.0);
  while (2 * Eigen::Index(q.size()) < options.poses) {
    VecX some = options.largest_strain * share(random) * strains *
                VecX::NullaryExpr(strains.cols(), [&](Eigen::Index) { return share(random); });
    for (int k = 0; k < 3; ++k) {  // low coordinates more often
      const auto i = Eigen::Index(double(r) * std::pow(place(random), 2));
      some[i] += amplitude[i] * share(random);
    }
    q.push_back(some);
  }
  MatX loads(r, 2 * Eigen::Index(q.size()));
  for (std::size_t k = 0; k < q.size(); ++k) {
    loads.col(2 * Eigen::Index(k)) = K_r * q[k];
    loads.col(2 * Eigen::Index(k) + 1) = -K_r * q[k];
  }
  return loads;
}

/// The balanced poses under each load, half and whole, r x 2 loads.
MatX balanced_poses(const ElasticCubature& V, const MatX& loads) {
  MatX poses(loads.rows(), 2 * loads.cols());
  for (Eigen::Index k = 0; k < loads.cols(); ++k) {
    const VecX half = static_balance(V, 0.5 * loads.col(k), VecX::Zero(loads.rows()));
    poses.col(2 * k) = half;
    poses.col(2 * k + 1) = static_balance(V, loads.col(k), half);
  }
  return poses;
}

// The force of an inverted pose comes from a few tets that are inside out, which no few points can
// tell. With weight 1 such poses leave the others wrong; without any nothing pushes back [D71].
constexpr double kInvertedWeight = 0.1;

/// The equations of the fit: a row for each force component of each pose and each entry of K_r, in
/// the norm K^-1 of forces, each pose and each vector with weight 1, inverted poses with
/// kInvertedWeight. A: rows x points.
struct Equations {
  MatX A;
  VecX b;
};

class Training {
 public:
  Training(const TetMesh& mesh, const MaterialField& material, const MatX& basis, const MatX& K_r,
           const ElasticCubature& unit)
      : mesh_(mesh), material_(material), basis_(basis), K_r_(K_r), unit_(unit) {
    scale_ = K_r.diagonal().cwiseSqrt().cwiseInverse();
  }

  Equations equations(const MatX& poses) const {
    const Eigen::Index r = basis_.cols(), linear = r * (r + 1) / 2;
    Equations e{MatX(linear + r * poses.cols(), unit_.points()), VecX(linear + r * poses.cols())};
    add_linear(e);
    for (Eigen::Index k = 0; k < poses.cols(); ++k) add_pose(poses.col(k), linear + k * r, e);
    return e;
  }

 private:
  // Entries of K_r, those beside the diagonal twice in the sum of squares.
  void add_linear(Equations& e) const {
    const Eigen::Index r = basis_.cols(), P = unit_.points();
    for (Eigen::Index i = 0, row = 0; i < r; ++i)
      for (Eigen::Index j = 0; j <= i; ++j, ++row) {
        const double scale = scale_[i] * scale_[j] * (i == j ? 1.0 : std::sqrt(2.0));
        VecX sum = VecX::Zero(P), trace_i = VecX::Zero(P), trace_j = VecX::Zero(P);
        for (int a = 0; a < 3; ++a) {
          trace_i += entry(4 * a, i), trace_j += entry(4 * a, j);
          for (int c = 0; c < 3; ++c)
            sum += entry(3 * c + a, i).cwiseProduct(entry(3 * c + a, j) + entry(3 * a + c, j));
        }
        const VecX part =
            unit_.mu.cwiseProduct(sum) + unit_.lambda.cwiseProduct(trace_i.cwiseProduct(trace_j));
        e.A.row(row) = scale * unit_.weights.cwiseProduct(part).transpose();
        e.b[row] = scale * K_r_(i, j);
      }
  }
  // The forces of a pose on all tets, and those of each point alone.
  void add_pose(const VecX& q, Eigen::Index row, Equations& e) const {
    const Eigen::Index r = basis_.cols();
    const VecX u = basis_ * q;
    const VecX whole = basis_.transpose() * internal_force(mesh_, material_, u);
    const VecX scaled = scale_.cwiseProduct(whole);
    const bool is_inverted =
        elastic_state(mesh_, material_, u).least_volume < NeoHookean::kLeastVolume;
    const double weight = (is_inverted ? kInvertedWeight : 1.0) / scaled.norm();
    e.b.segment(row, r) = weight * scaled;
    e.A.middleRows(row, r) = (weight * scale_).asDiagonal() * unit_.force_of_points(q);
  }
  VecX entry(int component, Eigen::Index vector) const {
    return unit_.gradients.col(vector).segment(component * unit_.points(), unit_.points());
  }

  const TetMesh& mesh_;
  const MaterialField& material_;
  const MatX& basis_;
  const MatX& K_r_;
  const ElasticCubature& unit_;
  VecX scale_;
};

/// The points with weights above 0.
ElasticCubature kept_points(const ElasticCubature& all, const VecX& factor) {
  std::vector<Eigen::Index> rows, kept;
  for (Eigen::Index p = 0; p < factor.size(); ++p)
    if (factor[p] > 0.0) kept.push_back(p);
  for (int k = 0; k < 9; ++k)
    for (const Eigen::Index p : kept) rows.push_back(k * all.points() + p);
  return ElasticCubature(all.gradients(rows, Eigen::all),
                         all.weights(kept).cwiseProduct(factor(kept)), all.lambda(kept),
                         all.mu(kept));
}

/// Poses that the cubature holds to be in balance although the material is inside out between its
/// points.
MatX inverted(const ElasticCubature& all, const MatX& poses) {
  std::vector<Eigen::Index> bad;
  for (Eigen::Index k = 0; k < poses.cols(); ++k)
    if (all.volumes(poses.col(k)).minCoeff() < NeoHookean::kLeastVolume) bad.push_back(k);
  return poses(Eigen::all, bad);
}

}  // namespace

TrainedCubature train_cubature(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const MatX& K_r, const CubatureOptions& options) {
  constexpr int kRounds = 2;
  std::mt19937 random(20260101);
  const std::vector<MaterialPoint> points = choose_points(mesh, options.candidates, random);
  const double share = double(material_points(mesh).size()) / double(points.size());
  const ElasticCubature sample = sampled_energy(mesh, material, basis, points,
                                                VecX::Constant(Eigen::Index(points.size()), share));
  const VecX reach = amplitudes(mesh, sample, basis, K_r, options.largest_strain);
  const MatX loads = training_loads(reach, strain_coordinates(sample), K_r, options, random);
  MatX poses = balanced_poses(sample, loads);

  const Training training(mesh, material, basis, K_r, sample);
  TrainedCubature result;
  for (int round = 0; round < kRounds; ++round) {
    const Equations e = training.equations(poses);
    const VecX factor = sparse_nonnegative_fit(e.A, e.b, options.tolerance,
                                               options.points_per_vector * basis.cols());
    result.energy = kept_points(sample, factor);
    result.error = (e.A * factor - e.b).norm() / e.b.norm();
    const MatX more = inverted(sample, balanced_poses(result.energy, loads));
    if (more.cols() == 0) break;
    MatX both(poses.rows(), poses.cols() + more.cols());
    both << poses, more;
    poses = both;
  }
  return result;
}

}  // namespace archetide
