#include "runtime/solid/shape_correction.h"

#include <cmath>
#include <utility>

#include "common/archetype/elastic_volume.h"
#include "common/mesh/enclosed_moments.h"
#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {
namespace {

struct LogVolume {
  double value, slope;  // ln v, and its derivative
};

// v = f(e): e^e where the strain compresses, 1 + e + e^2 / 2 where it swells. Convex, never negative.
LogVolume volume_of_strain(double e) {
  if (e <= 0.0) return {e, 1.0};
  const double v = 1.0 + e + 0.5 * e * e;
  return {std::log(v), (1.0 + e) / v};
}

// Of what the modes enclose; goes on to zero, smoothly, where they have turned the body inside out.
LogVolume enclosed_log_volume(double v) {
  constexpr double kLeast = 0.1;  // as the inversion guard leaves it (S10)
  if (v >= kLeast) return {std::log(v), 1.0 / v};
  const double rest = 2.0 * kLeast - v;
  return {std::log(kLeast * kLeast / rest), 1.0 / rest};
}

// s and d that make of a surface which encloses `now` what the linear strain tells (S2). q: what
// linear.rates are per unit of, as are `rates`, x 4, of now.
ShapeCorrection make_linear(const LinearShape& linear, const VecX& q, const EnclosedMoments& now,
                            const MatX& rates) {
  const auto strain = linear.rates.topRows(q.size());
  const LogVolume wanted = volume_of_strain(strain.col(0).dot(q)),
                  has = enclosed_log_volume(now.volume / linear.volume);
  const VecX log_rate = has.slope / linear.volume * rates.col(0);
  ShapeCorrection out;
  out.s = std::exp((wanted.value - has.value) / 3.0);
  out.slope = (wanted.slope * strain.col(0) - log_rate) / 3.0;
  const double volume = std::exp(has.value) * linear.volume;
  const Vec3 centroid = now.first / volume;
  out.shift = linear.centroid + strain.rightCols<3>().transpose() * q - out.s * centroid;
  // d' = b - s c' - s' c, less d s'/s
  const MatX drift = rates.rightCols<3>() / volume - log_rate * centroid.transpose();
  out.shift_rate = (strain.rightCols<3>() - out.s * drift -
                    out.slope * (out.s * centroid + out.shift).transpose())
                       .transpose();
  return out;
}

const LinearShape& linear_shape_of(const ReducedBody& body) {
  return body.rung ? body.rung->linear : body.archetype->linear;
}

ShapeCorrection none(Eigen::Index r) {
  return {1.0, VecX::Zero(r), Vec3::Zero(), MatX::Zero(3, r)};
}

ShapeCorrection of_nodes(const NodalSpace& nodes, const VecX& u) {
  const LinearShape& linear = nodes.linear_shape();
  if (linear.empty() || u.isZero(0.0)) return none(u.size());
  const VecX u_s = nodes.at_surface(u);
  const EnclosedMoments now = displaced_moments(nodes.archetype().surface, u_s);
  ShapeCorrection out = make_linear(linear, u_s, now, now.rates);
  out.slope = nodes.from_surface(out.slope);
  const MatX of_surface = std::move(out.shift_rate);
  out.shift_rate.resize(3, u.size());
  for (int k = 0; k < 3; ++k)
    out.shift_rate.row(k) = nodes.from_surface(of_surface.row(k).transpose()).transpose();
  return out;
}

ShapeCorrection of_linear_modes(const TriMesh& surface, const MatX& all_modes,
                                const LinearShape& linear, const VecX& q) {
  const auto modes = all_modes.leftCols(q.size());
  const EnclosedMoments now = displaced_moments(surface, modes * q);
  MatX rates(q.size(), 4);
  for (int k = 0; k < 4; ++k) rates.col(k).noalias() = modes.transpose() * now.rates.col(k);
  return make_linear(linear, q, now, rates);
}

// What the strain of nonlinear modes makes of the volume: at rest as the surface has it, beyond as the
// points of the elastic energy, which resists (P7a).
struct ElasticTarget {
  double log_volume = 0.0;  // ln of the volume over that at rest
  VecX rate;                // r, its derivative
  VecX strained;            // r, of that what the points make
  double slope = 0.0;       // d log_volume / d (volume of the points), 1/m^3
};

ElasticTarget elastic_target(const ElasticCubature& elastic, const LinearShape& linear,
                             const VecX& q) {
  const ElasticVolume rest = elastic_volume(elastic, VecX::Zero(q.size())),
                      now = elastic_volume(elastic, q);
  const LogVolume strained = enclosed_log_volume(now.value / rest.value);
  const VecX more = linear.rates.col(0).head(q.size()) - rest.rate / rest.value;
  const double slope = strained.slope / rest.value;
  return {strained.value + more.dot(q), slope * now.rate + more, slope * now.rate, slope};
}

ShapeCorrection of_nonlinear_modes(const ElasticCubature& elastic, const TriMesh& surface,
                                   const MatX& all_modes, const LinearShape& linear,
                                   const VecX& q) {
  const auto modes = all_modes.leftCols(q.size());
  const EnclosedMoments now = displaced_moments(surface, modes * q);
  const LogVolume has = enclosed_log_volume(now.volume / linear.volume);
  const ElasticTarget wanted = elastic_target(elastic, linear, q);
  ShapeCorrection out = none(q.size());
  out.s = std::exp((wanted.log_volume - has.value) / 3.0);
  const VecX enclosed = modes.transpose() * now.rates.col(0);
  out.slope = (wanted.rate - has.slope / linear.volume * enclosed) / 3.0;
  return out;
}

// The centroid of a rung as that of the body's own surface, to second order [D81]: d = -c w with c_k =
// q^T C_k q and w = 1 / sqrt(1 + e^2), e = q^T E q.
void shift_as_own_surface(const Swelling& swelling, const VecX& q, ShapeCorrection& out) {
  const auto r = q.size();
  const VecX Eq = swelling.volume.topLeftCorner(r, r) * q;
  const double e = q.dot(Eq), w = 1.0 / std::sqrt(1.0 + e * e);
  for (int k = 0; k < 3; ++k) {
    const VecX Cq = swelling.centroid[k].topLeftCorner(r, r) * q;
    const double c = q.dot(Cq);
    out.shift[k] = -w * c;
    out.shift_rate.row(k) = -2.0 * w * Cq + 2.0 * e * w * w * w * c * Eq;
  }
  out.shift_rate -= out.shift * out.slope.transpose();
}

ShapeCorrection computed(const ReducedBody& body, const VecX& q) {
  if (body.nodes) return of_nodes(*body.nodes, q);
  const LinearShape& linear = linear_shape_of(body);
  if (body.r == 0 || linear.empty()) return none(body.r);
  const Archetype& a = *body.archetype;
  const TriMesh& surface = body.rung ? body.rung->surface : a.surface;
  const MatX& modes = wet_modes(body);
  if (!a.nonlinear()) return of_linear_modes(surface, modes, linear, q);
  ShapeCorrection out = of_nonlinear_modes(a.elastic, surface, modes, linear, q);
  if (body.rung) shift_as_own_surface(body.rung->swelling, q, out);
  return out;
}

}  // namespace

std::shared_ptr<const ShapeCorrection> shape_correction(const ReducedBody& body, const VecX& q) {
  std::shared_ptr<const KeptShapes::Entry> entry = body.kept_shapes.find(body, q);
  if (!entry) {
    entry = std::make_shared<const KeptShapes::Entry>(
        KeptShapes::Entry{body.archetype, body.rung, q, computed(body, q)});
    body.kept_shapes.keep(entry);
  }
  return {entry, &entry->shape};
}

// V (H + g gᵀ), g and H of ln V.
MatX volume_curvature(const ReducedBody& body) {
  const LinearShape& linear = linear_shape_of(body);
  const ElasticCubature& elastic = body.archetype->elastic;
  const ElasticTarget at = elastic_target(elastic, linear, body.q);
  return linear.volume * std::exp(at.log_volume) *
         (at.slope * elastic_volume_curvature(elastic, body.q) -
          at.strained * at.strained.transpose() + at.rate * at.rate.transpose());
}

KeptShapes::KeptShapes(const KeptShapes& other) noexcept {
  const std::lock_guard<std::mutex> guard(other.lock_);
  last_ = other.last_, before_ = other.before_;
}

KeptShapes& KeptShapes::operator=(const KeptShapes& other) noexcept {
  KeptShapes copy(other);
  const std::lock_guard<std::mutex> guard(lock_);
  last_ = std::move(copy.last_), before_ = std::move(copy.before_);
  return *this;
}

std::shared_ptr<const KeptShapes::Entry> KeptShapes::find(const ReducedBody& body,
                                                          const VecX& q) const {
  const std::lock_guard<std::mutex> guard(lock_);
  for (const auto& entry : {last_, before_})
    if (entry && entry->archetype == body.archetype && entry->rung == body.rung &&
        entry->q.size() == q.size() && entry->q == q)
      return entry;
  return nullptr;
}

void KeptShapes::keep(std::shared_ptr<const Entry> entry) const {
  const std::lock_guard<std::mutex> guard(lock_);
  before_ = std::move(last_);
  last_ = std::move(entry);
}

}  // namespace archetide
