#pragma once

#include <vector>

#include "runtime/contact/contact_shape.h"

namespace archetide {

/// A place seen from a solid.
struct SolidPoint {
  double gap = 0.0;            // m, negative inside
  Vec3 normal = Vec3::Zero();  // unit, outward, world
  Vec3 rest = Vec3::Zero();    // of a body: the place in its rest shape, m
};

/// What surface samples may touch.
class TouchedSolid {
 public:
  virtual ~TouchedSolid() = default;
  /// At most the gap at x, m, up to the solid's own strain; cheap.
  virtual double least_gap(const Vec3& x) const = 0;
  /// False, at the least cost, if the gap is certainly larger than `within` (m).
  virtual bool locate(const Vec3& x, double within, SolidPoint& at) const = 0;
};

/// A closed side of the tank.
class WallSolid : public TouchedSolid {
 public:
  WallSolid(const Vec3& inward, double offset) : normal_(inward), offset_(offset) {}
  double least_gap(const Vec3& x) const override { return normal_.dot(x) - offset_; }
  bool locate(const Vec3& x, double within, SolidPoint& at) const override {
    at = {least_gap(x), normal_, Vec3::Zero()};
    return at.gap <= within;
  }

 private:
  Vec3 normal_;
  double offset_;  // n . x on the wall, m
};

/// An obstacle: a closed outward surface that stays.
class StaticSolid : public TouchedSolid {
 public:
  /// `spacing`: wanted distance of the nodes of its signed distance, m; 0: a 64th of its length.
  StaticSolid(const TriMesh& surface, double spacing);
  double least_gap(const Vec3& x) const override { return sdf_.value(x); }
  bool locate(const Vec3& x, double within, SolidPoint& at) const override;
  const Vec3& low() const { return low_; }
  const Vec3& high() const { return high_; }

 private:
  GridSdf sdf_;
  Vec3 low_, high_;
};

/// One body at one configuration: its samples in space, and, as a solid, the inverse of its
/// deformation, s (X + u(X)) + d = y on the mode lattice: O(1) a query after O(lattice r) of
/// set-up, and nothing that outlives the search.
class DeformedBody : public TouchedSolid {
 public:
  /// `cover`: where the vertices of the body's cover are, world, m; null without one.
  DeformedBody(const ReducedBody& body, const ContactShape& shape,
               const std::vector<Vec3>* cover = nullptr);

  const ContactShape& shape() const { return *shape_; }
  const Vec3& centre() const { return centre_; }
  const std::vector<Vec3>& samples() const { return samples_; }  // world, m
  Vec3 normal(int sample) const;                                 // of the deformed surface, world
  struct Ball {
    Vec3 centre;
    double radius;
  };
  const std::vector<Ball>& balls() const { return balls_; }  // one per cluster
  const Vec3& low() const { return low_; }                   // of the samples
  const Vec3& high() const { return high_; }

  double least_gap(const Vec3& x) const override;
  bool locate(const Vec3& x, double within, SolidPoint& at) const override;

  /// The place X of the rest shape that is at x, s (1 + du/dX) there turned to the world, and
  /// whether there is one.
  bool to_rest(const Vec3& x, Vec3& rest, Mat3& stretch) const;
  /// How far X can be from where a rigid motion without modes would put it, m.
  double largest_shift() const { return largest_shift_; }
  /// Whether the surface sinks between points that hold it: it deforms [D77].
  bool gives_way() const { return gives_way_; }
  /// How far the cover is from where this body alone would move its samples, m.
  double cover_shift() const { return cover_shift_; }
  double scale() const { return scale_; }

  /// X + u(X) at x: body frame, without the correction of the shape.
  Vec3 unscaled(const Vec3& x) const { return R_.transpose() * (x - middle_) / scale_; }

 private:
  bool undeform(const Vec3& y, Vec3& rest, Mat3& stretch) const;
  Vec3 displacement(const Vec3& rest) const;
  Mat3 displacement_gradient(const Vec3& rest) const;

  const ContactShape* shape_;
  Mat3 R_;
  Vec3 centre_;
  double scale_;  // s
  Vec3 middle_;   // R d beside the centre, m
  std::vector<Vec3> samples_;
  std::vector<Vec3> normals_;  // of the vertices, world; empty under a cover and of rigid bodies
  std::vector<Ball> balls_;
  Vec3 low_, high_;
  VecX lattice_;  // 3 x nodes, displacement in the body frame, m
  bool gives_way_;
  double largest_shift_ = 0.0, cover_shift_ = 0.0;  // m
};

/// One body's share of a cover: the places whose motion is mostly this body's. A place x of space
/// is that place of the whole, X = sum w_b(X) X_b(x), with X_b what body b alone would say.
class CoveredSolid : public TouchedSolid {
 public:
  /// `bodies`: all under the cover; `part`: which of them this is. They must outlive it.
  CoveredSolid(const CoverShape& cover, std::vector<const DeformedBody*> bodies, int part)
      : cover_(cover), bodies_(std::move(bodies)), part_(part) {}
  double least_gap(const Vec3& x) const override;
  bool locate(const Vec3& x, double within, SolidPoint& at) const override;

 private:
  const CoverShape& cover_;
  std::vector<const DeformedBody*> bodies_;
  int part_;
};

/// Modes of the body at a place of its rest shape, 3 x r, body frame; and at a sample.
MatX modes_at_rest_place(const ContactShape& shape, const Vec3& rest, int r);
MatX modes_at_sample(const ContactShape& shape, int sample, int r);
/// Of a body of nodes the vertices that it moves with; and those of a sample.
VertexShares shares_at_rest_place(const ContactShape& shape, const Vec3& rest);
VertexShares shares_of_sample(const ContactShape& shape, int sample);

}  // namespace archetide
