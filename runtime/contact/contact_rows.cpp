#include "runtime/contact/contact_rows.h"

namespace archetide {
namespace {

/// Two unit vectors across n; for a wall's normal they are coordinate axes.
Eigen::Matrix<double, 2, 3> tangents(const Vec3& n) {
  int largest = 0;
  n.cwiseAbs().maxCoeff(&largest);
  const Vec3 t = n.cross(Vec3::Unit((largest + 1) % 3)).normalized();
  Eigen::Matrix<double, 2, 3> out;
  out << t.transpose(), n.cross(t).transpose();
  return out;
}

}  // namespace

// Eq. K1.
MatX contact_rows(const ReducedBody& body, const ConfigurationTerms& terms,
                  const std::vector<ContactPoint>& points) {
  MatX rows(points.size(), body.dofs());
  for (std::size_t k = 0; k < points.size(); ++k)
    rows.row(k) = points[k].normal.transpose() * point_jacobian(body, terms, points[k].vertex);
  return rows;
}

MatX tangent_rows(const ReducedBody& body, const ConfigurationTerms& terms,
                  const std::vector<ContactPoint>& points) {
  MatX rows(2 * points.size(), body.dofs());
  for (std::size_t k = 0; k < points.size(); ++k)
    rows.middleRows<2>(2 * k) =
        tangents(points[k].normal) * point_jacobian(body, terms, points[k].vertex);
  return rows;
}

}  // namespace archetide
