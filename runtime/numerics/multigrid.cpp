#include "runtime/numerics/multigrid.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "runtime/numerics/multigrid_level.h"
#include "runtime/numerics/parallel.h"
#include "runtime/numerics/v_cycle.h"

namespace archetide {
namespace {

// A level with at most so many unknowns is solved directly.
constexpr std::size_t kDirectUnknowns = 128;

// Direct solve on the coarsest level. A component without Dirichlet value is singular by a
// constant: the constant is given a stiffness of its own, so that the matrix is definite and a
// compatible right-hand side still gets the solution of zero mean.
class DirectSolver {
 public:
  void setup(const MultigridLevel& l) {
    cells_.clear();
    std::vector<int> number(l.x.size(), -1);
    std::vector<std::array<float, 4>> coefficients;  // low faces along x, y, z, and the diagonal
    for (int k = 0; k < l.nz; ++k)
      for (const Segment& s : l.rows.plane(k))
        for (int i = s.begin; i < s.end; ++i) {
          const std::size_t cell = l.index(i, s.j, k);
          number[cell] = static_cast<int>(cells_.size());
          cells_.push_back(cell);
          float one;
          std::array<float, 4>& own = coefficients.emplace_back();
          for (int axis = 0; axis < 3; ++axis) own[axis] = *l.faces(axis, i, s.j, k, 1, &one);
          own[3] = *l.diagonal(i, s.j, k, 1, &one);
        }
    const int n = static_cast<int>(cells_.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
    std::vector<int> component(n);
    std::iota(component.begin(), component.end(), 0);
    for (int m = 0; m < n; ++m) {
      a(m, m) = coefficients[m][3];
      const auto link = [&](std::size_t neighbour, float w) {
        if (number[neighbour] < 0 || !(w > 0.0f)) return;
        a(m, number[neighbour]) = a(number[neighbour], m) = -static_cast<double>(w);
        const int from = component[number[neighbour]], to = component[m];
        std::replace(component.begin(), component.end(), from, to);
      };
      link(cells_[m] - 1, coefficients[m][0]);
      link(cells_[m] - l.sy, coefficients[m][1]);
      link(cells_[m] - l.sz, coefficients[m][2]);
    }
    stiffen_constants(component, a);
    factor_.compute(a);
    rhs_.resize(n);
  }

  void solve(MultigridLevel& l) {
    for (std::size_t m = 0; m < cells_.size(); ++m) rhs_[m] = l.b[cells_[m]];
    factor_.solveInPlace(rhs_);
    for (std::size_t m = 0; m < cells_.size(); ++m) l.x[cells_[m]] = static_cast<float>(rhs_[m]);
  }

 private:
  // A component whose rows sum to the rounding of the fp32 coefficients has no Dirichlet value.
  static constexpr double kClosed = 1e-5;

  void stiffen_constants(const std::vector<int>& component, Eigen::MatrixXd& a) const {
    const int n = static_cast<int>(component.size());
    for (int root = 0; root < n; ++root) {
      Eigen::VectorXd one = Eigen::VectorXd::Zero(n);
      for (int m = 0; m < n; ++m) one[m] = component[m] == root ? 1.0 : 0.0;
      if (one.sum() == 0.0) continue;
      const double trace = one.dot(a.diagonal()), energy = one.dot(a * one);
      if (energy > kClosed * trace) continue;
      const double stiffness = trace > 0.0 ? trace : 1.0;
      a += (stiffness / (one.sum() * one.sum())) * one * one.transpose();
    }
  }

  std::vector<std::size_t> cells_;  // padded indices of the unknowns
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd rhs_;
};

}  // namespace

struct Multigrid::Impl {
  const PoissonOperator* op = nullptr;
  const ClosedComponents* closed = nullptr;
  std::vector<MultigridLevel> levels;  // finest first; more than `used` only from earlier setups
  int used = 0;
  DirectSolver direct;
  std::vector<double> projected;  // r without constants
  PaddedLayout layout;            // of the finest level
  std::vector<double> plane_sum;

  double cycle_in_place();
  void go_down(int l);
  void cycle(int l);

  void setup();
  void load_plane(const double* r, double scale, int k);
  void store_plane(double scale, int k, double* z) const;
  void apply(const double* r, double* z);
};

Multigrid::Multigrid() : impl_(std::make_unique<Impl>()) {}
Multigrid::~Multigrid() = default;
Multigrid::Multigrid(Multigrid&&) noexcept = default;
Multigrid& Multigrid::operator=(Multigrid&&) noexcept = default;

void Multigrid::setup(const PoissonOperator& op, const ClosedComponents* closed) {
  impl_->op = &op;
  impl_->closed = closed;
  impl_->setup();
}

void Multigrid::Impl::setup() {
  used = 0;
  if (op->unknowns() == 0) return;
  const auto next = [&]() -> MultigridLevel& {
    if (static_cast<int>(levels.size()) == used) levels.emplace_back();
    return levels[used++];
  };
  levels.reserve(32);  // references to levels stay valid
  next().load(*op);
  while (levels[used - 1].unknowns > kDirectUnknowns) {
    const MultigridLevel& fine = levels[used - 1];
    next().coarsen(fine);
  }
  direct.setup(levels[used - 1]);
  const MultigridLevel& fine = levels[0];
  const int cells[3] = {fine.nx, fine.ny, fine.nz};
  layout = PaddedLayout(fine.low, cells);
}

double Multigrid::Impl::cycle_in_place() {
  if (used == 0) return 0.0;
  MultigridLevel& fine = levels[0];
  // Strips of a plane come in ascending order, and their limits do not depend on threads.
  plane_sum.assign(fine.nz, 0.0);
  const auto add = [&](const MultigridLevel::Rows& r) { plane_sum[r.k] += fine.work(r); };
  if (used == 1) {
    direct.solve(fine);
    for (int k = 0; k < fine.nz; ++k) add(fine.plane(k));
  } else {
    go_down(0);
    cycle(1);
    ascend(fine, levels[1], add);
  }
  return std::accumulate(plane_sum.begin(), plane_sum.end(), 0.0);
}

void Multigrid::Impl::go_down(int l) {
  MultigridLevel &level = levels[l], &coarse = levels[l + 1];
  descend(level, coarse, [&](const MultigridLevel::Rows& r) {
    if (r.first == 0 && r.k % 2 == 0) coarse.clear_rhs(r.k / 2);
    level.start(r);
  });
}

// x = V b on level l, from x = 0
void Multigrid::Impl::cycle(int l) {
  if (l + 1 == used) return direct.solve(levels[l]);
  go_down(l);
  cycle(l + 1);
  ascend(levels[l], levels[l + 1], [](const MultigridLevel::Rows&) {});
}

void Multigrid::Impl::load_plane(const double* r, double scale, int k) {
  MultigridLevel& fine = levels[0];
  const PoissonMatrix& a = op->matrix();
  for (const Segment& s : fine.rows.plane(k)) {
    const double* from =
        r + a.kind.index(fine.low[0] + s.begin, fine.low[1] + s.j, fine.low[2] + k);
    float* to = fine.b.data() + fine.index(s.begin, s.j, k);
#pragma omp simd
    for (int i = 0; i < s.end - s.begin; ++i) to[i] = static_cast<float>(scale * from[i]);
  }
}

// Cells between the segments get 0, as everywhere in op->blocks().
void Multigrid::Impl::store_plane(double scale, int k, double* z) const {
  const MultigridLevel& fine = levels[0];
  const PoissonMatrix& a = op->matrix();
  const auto& plane = fine.rows.plane(k);
  if (plane.empty()) return;
  const auto index = [&](const Segment& s) {
    return a.kind.index(fine.low[0] + s.begin, fine.low[1] + s.j, fine.low[2] + k);
  };
  std::size_t done = index(plane.front());
  for (const Segment& s : plane) {
    const std::size_t begin = index(s), n = s.end - s.begin;
    std::fill(z + done, z + begin, 0.0);
    const float* from = fine.x.data() + fine.index(s.begin, s.j, k);
#pragma omp simd
    for (std::size_t i = 0; i < n; ++i) z[begin + i] = scale * static_cast<double>(from[i]);
    done = begin + n;
  }
}

void Multigrid::Impl::apply(const double* r, double* z) {
  if (used == 0) return;
  const Blocks& blocks = op->blocks();
  if (closed && !closed->empty()) {
    projected.resize(op->size());
    copy(blocks, r, projected.data());
    closed->project(projected.data());
    r = projected.data();
  }

  // The cycle is linear: a power of two brings r to the middle of the fp32 range, exactly.
  const double largest = max_abs(blocks, r);
  if (largest == 0.0) return fill(blocks, 0.0, z);
  const int exponent = std::isfinite(largest) ? std::ilogb(largest) : 0;
  const double scale = std::ldexp(1.0, -exponent), unscale = std::ldexp(1.0, exponent);

  MultigridLevel& fine = levels[0];
  for_each_index(fine.nz, fine.parallel, [&](int k) { load_plane(r, scale, k); });
  cycle_in_place();
  for_each_index(fine.nz, fine.parallel, [&](int k) { store_plane(unscale, k, z); });
  if (closed) closed->project(z);
}

void Multigrid::apply(const double* r, double* z) { impl_->apply(r, z); }

double Multigrid::cycle() { return impl_->cycle_in_place(); }
const PaddedLayout& Multigrid::layout() const { return impl_->layout; }
float* Multigrid::rhs() { return impl_->levels[0].b.data(); }
float* Multigrid::iterate() { return impl_->levels[0].x.data(); }

int Multigrid::levels() const { return impl_->used; }
const MultigridLevel& Multigrid::level(int l) const { return impl_->levels[l]; }

std::size_t Multigrid::bytes() const {
  std::size_t total = impl_->projected.capacity() * sizeof(double);
  for (const MultigridLevel& level : impl_->levels) total += level.bytes();
  return total;
}

}  // namespace archetide
