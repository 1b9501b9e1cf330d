#include "runtime/solid/nodal_space.h"

#include <Eigen/LU>
#include <algorithm>

#include "common/archetype/matched_moments.h"
#include "common/base/axial.h"
#include "common/base/check.h"
#include "common/base/exception_carrier.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {
namespace {

/// Rigid motions of the rest shape about the origin, 3 n x 6.
MatX motions_of_rest(const std::vector<Vec3>& nodes) {
  MatX J(3 * static_cast<long>(nodes.size()), 6);
  for (std::size_t p = 0; p < nodes.size(); ++p) {
    const auto row = 3 * static_cast<long>(p);
    J.block<3, 3>(row, 0).setIdentity();
    for (int axis = 0; axis < 3; ++axis)
      J.block<3, 1>(row, 3 + axis) = Vec3::Unit(axis).cross(nodes[p]);
  }
  return J;
}

}  // namespace

Mat3 outer_sum(const VecX& a, const VecX& b) {
  const Eigen::Map<const Eigen::Matrix3Xd> A(a.data(), 3, a.size() / 3),
      B(b.data(), 3, b.size() / 3);
  return A * B.transpose();
}

NodalSpace::NodalSpace(std::shared_ptr<const Archetype> archetype)
    : archetype_(std::move(archetype)) {
  const Archetype& a = *archetype_;
  ARCHETIDE_CHECK(!a.matrices.empty() && !a.tets.nodes.empty());
  rest_.resize(3 * static_cast<long>(a.tets.nodes.size()));
  for (std::size_t p = 0; p < a.tets.nodes.size(); ++p)
    rest_.segment<3>(3 * static_cast<long>(p)) = a.tets.nodes[p];
  pattern_ = std::make_shared<const FactorPattern>(a.matrices);
  rigid_ = motions_of_rest(a.tets.nodes);
  rigid_momentum_.resize(rigid_.rows(), 6);
  for (int k = 0; k < 6; ++k) rigid_momentum_.col(k) = product(1.0, 0.0, rigid_.col(k));
  rigid_momentum_ = (rigid_momentum_ * (rigid_.transpose() * rigid_momentum_).inverse()).eval();
  rest_moments_ = product(1.0, 0.0, rest_);
  if (a.mass_kind == "lumped") match_inertia();
  mode_moments_.resize(rest_.size(), a.r());
  for (int k = 0; k < a.r(); ++k) mode_moments_.col(k) = product(1.0, 0.0, a.node_modes.col(k));
  if (a.r() > 0) mode_moments_ = (mode_moments_ * a.M_r.inverse()).eval();
  if (!a.nonlinear()) {
    if (a.r() == 0 || !a.linear.empty()) linear_shape_ = archetide::linear_shape(a.surface);
    return;
  }
  elasticity_ = std::make_unique<TetElasticity>(a.tets, a.matrices.lambda, a.matrices.mu);
  places_ = elasticity_->places_in(a.matrices);
}

void NodalSpace::match_inertia() {
  const Mat3& Sxx = archetype_->integrals.Sxx;
  const Mat3 stretch = matching_stretch(outer_sum(rest_moments_, rest_), Sxx);
  const long n = rest_.size() / 3;
  rest_.reshaped(3, n) = (stretch * rest_.reshaped(3, n)).eval();
  rest_moments_ = product(1.0, 0.0, rest_);
  spin_.resize(3, rest_.size());
  rotations_.resize(rest_.size(), 3);
  const Mat3 to_spin = (Sxx.trace() * Mat3::Identity() - Sxx).inverse();
  for (long p = 0; p < rest_.size(); p += 3) {
    spin_.middleCols<3>(p) = to_spin * skew(rest_moments_.segment<3>(p));
    rotations_.middleRows<3>(p) = -skew(rest_.segment<3>(p));
  }
}

VecX NodalSpace::of_mass(const VecX& u) const {
  if (spin_.size() == 0) return u;
  return u - rotations_ * (spin_ * u).eval();
}

MatX NodalSpace::from_mass(const MatX& f) const {
  if (spin_.size() == 0) return f;
  return f - spin_.transpose() * (rotations_.transpose() * f).eval();
}

MatX NodalSpace::reduced_velocity(const MatX& y) const {
  MatX reduced(reduced_dofs(), y.cols());
  reduced.topRows<6>() = y.topRows<6>();
  reduced.bottomRows(mode_moments_.cols()).noalias() =
      mode_moments_.transpose() * y.bottomRows(size());
  return reduced;
}

MatX NodalSpace::from_reduced_force(const MatX& f) const {
  MatX all(6 + size(), f.cols());
  all.topRows<6>() = f.topRows<6>();
  all.bottomRows(size()).noalias() = mode_moments_ * f.bottomRows(mode_moments_.cols());
  return all;
}

VecX NodalSpace::at_surface(const VecX& u) const {
  const std::vector<int>& node = archetype_->surface_to_node;
  VecX out(3 * static_cast<long>(node.size()));
  for (std::size_t v = 0; v < node.size(); ++v)
    out.segment<3>(3 * static_cast<long>(v)) = u.segment<3>(3L * node[v]);
  return out;
}

VecX NodalSpace::from_surface(const VecX& f) const {
  const std::vector<int>& node = archetype_->surface_to_node;
  VecX out = VecX::Zero(size());
  for (std::size_t v = 0; v < node.size(); ++v)
    out.segment<3>(3L * node[v]) += f.segment<3>(3 * static_cast<long>(v));
  return out;
}

VecX NodalSpace::product(double a, double b, const VecX& u) const {
  const TetMatrices& m = archetype_->matrices;
  VecX out = VecX::Zero(u.size());
  for (int p = 0; p < static_cast<int>(m.row_ends.size()); ++p) {
    const Vec3 u_p = u.segment<3>(3L * p);
    Vec3 sum = Vec3::Zero();
    const int diagonal = m.row_end(p) - 1;
    for (int e = m.row_begin(p); e < diagonal; ++e) {
      const int q = m.column[e];
      Mat3 block = b * m.stiffness[e];
      block.diagonal().array() += a * m.mass[e];
      sum += block * u.segment<3>(3L * q);
      out.segment<3>(3L * q) += block.transpose() * u_p;
    }
    out.segment<3>(3L * p) +=
        sum + (a * m.mass[diagonal]) * u_p + b * (m.stiffness[diagonal] * u_p);
  }
  return out;
}

VecX NodalSpace::product(const std::vector<Mat3>& blocks, const VecX& u) const {
  const TetMatrices& m = archetype_->matrices;
  VecX out = VecX::Zero(u.size());
  for (int p = 0; p < static_cast<int>(m.row_ends.size()); ++p) {
    const Vec3 u_p = u.segment<3>(3L * p);
    const int diagonal = m.row_end(p) - 1;
    Vec3 sum = blocks[diagonal] * u_p;
    for (int e = m.row_begin(p); e < diagonal; ++e) {
      const int q = m.column[e];
      sum += blocks[e] * u.segment<3>(3L * q);
      out.segment<3>(3L * q) += blocks[e].transpose() * u_p;
    }
    out.segment<3>(3L * p) += sum;
  }
  return out;
}

double NodalSpace::elastic_energy(const VecX& u) const {
  return elasticity_ ? elasticity_->energy(u) : 0.5 * u.dot(product(0.0, 1.0, u));
}

VecX NodalSpace::elastic_force(const VecX& u) const {
  if (!elasticity_) return product(0.0, 1.0, u);
  MatX f = elasticity_->force(u);
  take_rigid_force(f);
  return f;
}

void NodalSpace::add_stiffness(const VecX& u, double factor, std::vector<Mat3>& blocks) const {
  ARCHETIDE_CHECK(elasticity_ && blocks.size() == this->blocks());
  elasticity_->add_stiffness(u, factor, places_, blocks);
}

void NodalSpace::take_rigid_motion(MatX& u) const {
  u -= rigid_ * (rigid_momentum_.transpose() * u).eval();
}

void NodalSpace::take_rigid_force(MatX& f) const {
  f -= rigid_momentum_ * (rigid_.transpose() * f).eval();
}

NodalSpace::Kept& NodalSpace::kept(double ratio) const {
  const auto found = std::find_if(factors_.begin(), factors_.end(),
                                  [&](const Kept& one) { return one.ratio == ratio; });
  if (found != factors_.end()) {
    std::rotate(found, found + 1, factors_.end());
    return factors_.back();
  }
  if (factors_.size() == kKeptFactors) factors_.erase(factors_.begin());
  factors_.push_back(
      {ratio, std::make_shared<const BlockCholesky>(pattern_, archetype_->matrices, ratio), {}});
  return factors_.back();
}

std::shared_ptr<const BlockCholesky> NodalSpace::factor(double ratio) const {
  const std::lock_guard guard(lock_);
  return kept(ratio).factor;
}

std::shared_ptr<const BlockCholesky> NodalSpace::factor(const std::vector<Mat3>& blocks,
                                                        double ratio) const {
  return BlockCholesky::if_definite(pattern_, archetype_->matrices, blocks, ratio);
}

std::shared_ptr<const MatX> NodalSpace::answers_of_modes(double ratio) const {
  const std::lock_guard guard(lock_);
  Kept& at = kept(ratio);
  if (!at.of_modes) {
    MatX u = mode_moments_;
    take_rigid_force(u);
    at.factor->solve(u);
    take_rigid_motion(u);
    at.of_modes = std::make_shared<const MatX>(std::move(u));
  }
  return at.of_modes;
}

std::size_t NodalSpace::bytes() const {
  const TetMatrices& m = archetype_->matrices;
  std::size_t sum = m.column.size() * (sizeof(int) + sizeof(double) + sizeof(Mat3));
  if (elasticity_) sum += elasticity_->bytes() + sizeof(int) * places_.size();
  const auto of_modes = static_cast<std::size_t>(mode_moments_.size());
  sum += kKeptFactors * (factor_bytes() + sizeof(double) * of_modes);
  return sum + sizeof(double) * (static_cast<std::size_t>(rigid_.size() + rigid_momentum_.size() +
                                                          2 * rest_.size()) +
                                 of_modes);
}

namespace {

// Blocks p >= q of a matrix of the nodes onto those of the pattern.
void add_load(const TetMatrices& m, const Eigen::SparseMatrix<double>& load, double factor,
              std::vector<Mat3>& blocks) {
  for (int column = 0; column < load.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator at(load, column); at; ++at) {
      const int p = static_cast<int>(at.row()) / 3, q = column / 3;
      if (p < q) continue;
      const auto begin = m.column.begin() + m.row_begin(p), end = m.column.begin() + m.row_end(p);
      const auto block = std::lower_bound(begin, end, q);
      ARCHETIDE_CHECK(block != end && *block == q);
      blocks[static_cast<std::size_t>(block - m.column.begin())](at.row() % 3, column % 3) +=
          factor * at.value();
    }
}

}  // namespace

NodalMass::NodalMass(std::shared_ptr<const NodalSpace> space, double a, double b)
    : space_(std::move(space)), a_(a), b_(b), factor_(space_->factor(b / a)) {}

NodalMass::NodalMass(std::shared_ptr<const NodalSpace> space, double a, double b,
                     std::vector<Mat3> elastic, const NodalStiffness* load, double unit)
    : space_(std::move(space)), a_(a), b_(b), elastic_(std::move(elastic)) {
  const TetMatrices& m = space_->archetype().matrices;
  const auto add_rest = [&](double share, std::vector<Mat3>& to) {
    for (std::size_t e = 0; e < to.size(); ++e) to[e] += share * m.stiffness[e];
  };
  blocks_ = elastic_;
  add_rest(b, blocks_);
  if (load) add_load(m, load->near, unit, blocks_);
  constexpr int kMostTries = 12;
  double share = 0.5 * unit;
  for (int tries = 0; !(factor_ = space_->factor(blocks_, 1.0 / a)); ++tries, share *= 2.0)
    if (tries < kMostTries) {
      add_rest(share, elastic_);
      add_rest(share, blocks_);
    } else {  // there is no use of it
      elastic_.assign(space_->blocks(), Mat3::Zero());
      add_rest(unit, elastic_);
      blocks_ = elastic_;
      add_rest(b, blocks_);
    }
  const MatX& N = space_->rigid_momentum();
  rigid_answers_ = N;
  factor_->solve(rigid_answers_);
  rigid_block_ = N.transpose() * rigid_answers_;
  rigid_answers_ = (rigid_answers_ * rigid_block_.inverse()).eval();
  if (!load) return;
  MatX U(size(), 6), C = MatX::Zero(6, 6);
  U << load->V, load->W;
  C.topRightCorner<3, 3>() = C.bottomLeftCorner<3, 3>() = unit * Mat3::Identity();
  C.bottomRightCorner<3, 3>() = unit * load->G;
  add(U, C);
}

VecX NodalStiffness::operator*(const VecX& u) const {
  const Vec3 turn = W.transpose() * u;
  return near * u + V * turn + W * (V_of_rows.transpose() * u + G * turn);
}

VecX LoadStiffness::operator*(const VecX& q) const { return nodes ? *nodes * q : modes * q; }

void NodalMass::add(const MatX& U, const MatX& C) {
  Addition added{U, C, solve(U), MatX()};
  const MatX I = MatX::Identity(C.rows(), C.cols());
  const MatX G = C * (I + U.transpose() * added.W * C).inverse();
  added.G = 0.5 * (G + G.transpose());
  additions_.push_back(std::move(added));
}

VecX NodalMass::product(const VecX& u) const {
  VecX f = is_nonlinear() ? VecX(space_->product(a_, 0.0, u) + space_->product(blocks_, u))
                          : space_->product(a_, b_, u);
  for (const Addition& added : additions_) f += added.U * (added.C * (added.U.transpose() * u));
  return f;
}

VecX NodalMass::elastic_product(const VecX& u) const {
  MatX f = space_->product(elastic_, u);
  space_->take_rigid_force(f);
  return f;
}

// A factor that knows its rest shape moves rigidly by rigid forces alone. Else the answer to rigid
// forces is taken that leaves no rigid motion.
void NodalMass::take_rigid_motion(MatX& u) const {
  if (!is_nonlinear()) return space_->take_rigid_motion(u);
  u -= rigid_answers_ * (space_->rigid_momentum().transpose() * u).eval();
}

// From u of a M + b K alone: each addition takes W G U^T u of what was there before.
void NodalMass::take_additions(MatX& u) const {
  for (const Addition& added : additions_)
    u -= added.W * (added.G * (added.U.transpose() * u)).eval();
}

MatX NodalMass::solve(MatX f) const {
  std::vector<MatX> one;
  one.push_back(std::move(f));
  solve({this}, one);
  return std::move(one[0]);
}

void NodalMass::solve(const std::vector<const NodalMass*>& masses, std::vector<MatX>& f) {
  std::vector<std::vector<std::size_t>> alike;  // that share a factor
  for (std::size_t b = 0; b < masses.size(); ++b) {
    const auto same = [&](const std::vector<std::size_t>& group) {
      return masses[group.front()]->factor_ == masses[b]->factor_;
    };
    const auto group = std::find_if(alike.begin(), alike.end(), same);
    if (group == alike.end())
      alike.push_back({b});
    else
      group->push_back(b);
  }
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (alike.size() > 1)
  for (std::size_t k = 0; k < alike.size(); ++k)
    carrier.run([&] { solve_alike(masses, alike[k], f); });
  carrier.rethrow();
}

void NodalMass::solve_alike(const std::vector<const NodalMass*>& masses,
                            const std::vector<std::size_t>& which, std::vector<MatX>& f) {
  const NodalMass& mass = *masses[which.front()];
  Eigen::Index columns = 0, at = 0;
  for (const std::size_t b : which) columns += f[b].cols();
  MatX all(mass.size(), columns);
  for (const std::size_t b : which) {
    all.middleCols(at, f[b].cols()) = f[b];
    at += f[b].cols();
  }
  mass.space_->take_rigid_force(all);
  mass.factor_->solve(all);
  mass.take_rigid_motion(all);
  at = 0;
  for (const std::size_t b : which) {
    f[b] = all.middleCols(at, f[b].cols()) / masses[b]->a_;
    masses[b]->take_additions(f[b]);
    at += f[b].cols();
  }
}

MatX NodalMass::answers_of_modes() const {
  if (is_nonlinear()) return solve(space_->mode_moments());
  MatX u = *space_->answers_of_modes(b_ / a_) / a_;
  take_additions(u);
  return u;
}

// Without rigid motion: Pi A^-1 Pi^T of a factor that knows its rest shape, else A^-1 - Z N^T A^-1.
MatX NodalMass::compliance(const Eigen::SparseMatrix<double>& E) const {
  MatX sum = factor_->compliance(E);
  if (is_nonlinear()) {
    const MatX of_rigid = E.transpose() * rigid_answers_;
    sum -= of_rigid * rigid_block_ * of_rigid.transpose();
  } else {
    const MatX& N = space_->rigid_momentum();
    MatX Y = N;
    factor_->solve(Y);
    const MatX rigid = E.transpose() * space_->rigid_motions(), beside = E.transpose() * Y;
    const MatX both = (beside - 0.5 * rigid * (N.transpose() * Y)) * rigid.transpose();
    sum -= both + both.transpose();
  }
  sum /= a_;
  for (const Addition& added : additions_) {
    const MatX of_added = E.transpose() * added.W;
    sum -= of_added * added.G * of_added.transpose();
  }
  return sum;
}

int reduced_dofs(const ReducedBody& body) {
  return body.nodes ? body.nodes->reduced_dofs() : body.dofs();
}

VecX reduced_velocity(const ReducedBody& body, const VecX& y) {
  return body.nodes ? VecX(body.nodes->reduced_velocity(y)) : y;
}

VecX from_reduced_force(const ReducedBody& body, const VecX& f) {
  return body.nodes ? VecX(body.nodes->from_reduced_force(f)) : f;
}

VecX reduced_amplitudes(const ReducedBody& body) {
  return body.nodes ? body.nodes->amplitudes(body.q) : body.q;
}

void free_nodes(std::shared_ptr<const NodalSpace> nodes, ReducedBody& body) {
  ARCHETIDE_CHECK(&nodes->archetype() == body.archetype.get());
  body.r = nodes->size();
  body.q = body.q_dot = VecX::Zero(body.r);
  body.nodes = std::move(nodes);
}

}  // namespace archetide
