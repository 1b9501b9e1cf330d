#include "common/archetype/swelling.h"

namespace archetide {
namespace {

MatX symmetric(const MatX& m) { return 0.5 * (m + m.transpose()); }

}  // namespace

// With D = y_a . (y_b x y_c) and s = y_a + y_b + y_c of each triangle, 6 V = sum D and 24 V c = sum
// s D. Of y = x + u, D has the parts D_1 = sum over turns of u_a . (x_b x x_c) and D_2 = sum over
// turns of u_b . (u_c x x_a) (P7).
Swelling second_order_swelling(const TriMesh& surface, const MatX& modes) {
  const long r = modes.cols(), rows = modes.rows();
  const std::vector<Vec3>& x = surface.vertices;
  // Vertex fields g, h and for each axis g_k, h_k, p_k: D_1 = g . u, D_2 = u . h u, and the same
  // with s_k of the rest shape as weight; p_k = D_1(u) where s_k(u) reads its corner
  VecX g = VecX::Zero(rows);
  MatX h = MatX::Zero(rows, r);
  std::array<VecX, 3> g_k, n_k;
  std::array<MatX, 3> h_k;
  for (int k = 0; k < 3; ++k) g_k[k] = n_k[k] = VecX::Zero(rows), h_k[k] = MatX::Zero(rows, r);
  Vec3 first = Vec3::Zero();  // sum s D at rest
  for (const Vec3i& t : surface.triangles) {
    const Vec3 s = x[t[0]] + x[t[1]] + x[t[2]];
    const double D = x[t[0]].dot(x[t[1]].cross(x[t[2]]));
    first += D * s;
    VecX D_1 = VecX::Zero(r);
    for (int turn = 0; turn < 3; ++turn) {
      const int a = t[turn], b = t[(turn + 1) % 3], c = t[(turn + 2) % 3];
      const Vec3 normal = x[b].cross(x[c]);
      g.segment<3>(3L * a) += normal;
      D_1.noalias() += modes.middleRows<3>(3L * a).transpose() * normal;
      for (int k = 0; k < 3; ++k) {
        g_k[k].segment<3>(3L * a) += s[k] * normal;
        n_k[k][3L * a + k] += D;
      }
      for (long i = 0; i < r; ++i) {
        const Vec3 turned = modes.col(i).segment<3>(3L * c).cross(x[a]);
        h.col(i).segment<3>(3L * b) += turned;
        for (int k = 0; k < 3; ++k) h_k[k].col(i).segment<3>(3L * b) += s[k] * turned;
      }
    }
    for (int corner = 0; corner < 3; ++corner)
      for (int k = 0; k < 3; ++k) h_k[k].row(3L * t[corner] + k) += D_1.transpose();
  }
  const double volume = enclosed_volume(surface);
  const VecX rate = modes.transpose() * g / (6.0 * volume);
  const MatX second = symmetric(modes.transpose() * h) / (6.0 * volume);
  Swelling out{second - 0.5 * rate * rate.transpose(), {}};
  for (int k = 0; k < 3; ++k) {
    // c = m / v with m = m_0 + m_1 + m_2 and v = 1 + v_1 + v_2, all over V(0)
    const double m_0 = first[k] / (24.0 * volume);
    const VecX m_1 = modes.transpose() * (g_k[k] + n_k[k]) / (24.0 * volume);
    const MatX m_2 = symmetric(modes.transpose() * h_k[k]) / (24.0 * volume);
    out.centroid[k] = m_2 - symmetric(m_1 * rate.transpose()) +
                      m_0 * (rate * rate.transpose() - second - out.volume / 3.0);
  }
  return out;
}

}  // namespace archetide
