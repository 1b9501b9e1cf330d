#include "common/archetype/linear_shape.h"

#include <utility>

#include "common/mesh/enclosed_moments.h"

namespace archetide {

LinearShape linear_shape(const TriMesh& surface) {
  const EnclosedMoments rest =
      displaced_moments(surface, VecX::Zero(3 * static_cast<long>(surface.vertices.size())));
  LinearShape out{rest.volume, rest.first / rest.volume, rest.rates / rest.volume};
  out.rates.rightCols<3>() -= out.rates.col(0) * out.centroid.transpose();
  return out;
}

LinearShape linear_shape(const TriMesh& surface, const MatX& modes) {
  LinearShape out = linear_shape(surface);
  MatX rates(modes.cols(), 4);
  for (Eigen::Index i = 0; i < modes.cols(); ++i)  // each as if it were alone, to the last bit
    for (int k = 0; k < 4; ++k) rates(i, k) = modes.col(i).dot(out.rates.col(k));
  out.rates = std::move(rates);
  return out;
}

}  // namespace archetide
