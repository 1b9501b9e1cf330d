#include "common/mesh/closest_point.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/mesh/mesh_sdf.h"

namespace archetide {
namespace {

constexpr int kLeaf = 4;  // triangles

double distance_to_box(const Vec3& x, const Vec3& low, const Vec3& high) {
  return (x - x.cwiseMax(low).cwiseMin(high)).norm();
}

}  // namespace

ClosestPoint::ClosestPoint(const TriMesh& surface)
    : surface_(surface), order_(surface.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vec3> centres;
  for (const Vec3i& t : surface.triangles)
    centres.push_back((surface.vertices[t[0]] + surface.vertices[t[1]] + surface.vertices[t[2]]) /
                      3.0);
  if (!order_.empty()) build(0, int(order_.size()), centres);
}

int ClosestPoint::build(int first, int count, const std::vector<Vec3>& centres) {
  const int index = int(boxes_.size());
  Box box;
  box.low = box.high = surface_.vertices[surface_.triangles[order_[first]][0]];
  for (int k = first; k < first + count; ++k)
    for (const int v : surface_.triangles[order_[k]]) {
      box.low = box.low.cwiseMin(surface_.vertices[v]);
      box.high = box.high.cwiseMax(surface_.vertices[v]);
    }
  boxes_.push_back(box);
  if (count <= kLeaf) {
    boxes_[index].first = first, boxes_[index].count = count;
    return index;
  }
  int axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count,
                   [&](int a, int b) { return centres[a][axis] < centres[b][axis]; });
  build(first, count / 2, centres);
  const int right = build(first + count / 2, count - count / 2, centres);
  boxes_[index].right = right;
  return index;
}

void ClosestPoint::search(int index, const Vec3& x, Hit& best) const {
  const Box& box = boxes_[index];
  if (distance_to_box(x, box.low, box.high) >= best.distance) return;
  for (int k = box.first; k < box.first + box.count; ++k) {
    const Vec3i& t = surface_.triangles[order_[k]];
    const Vec3 p = closest_point_on_triangle(x, surface_.vertices[t[0]], surface_.vertices[t[1]],
                                             surface_.vertices[t[2]]);
    if (const double d = (x - p).norm(); d < best.distance) best = {p, order_[k], d};
  }
  if (box.count > 0) return;
  // The nearer child first.
  int near = index + 1, far = box.right;
  if (distance_to_box(x, boxes_[far].low, boxes_[far].high) <
      distance_to_box(x, boxes_[near].low, boxes_[near].high))
    std::swap(near, far);
  search(near, x, best);
  search(far, x, best);
}

ClosestPoint::Hit ClosestPoint::find(const Vec3& x, double reach) const {
  Hit best;
  best.distance = reach;
  if (!boxes_.empty()) search(0, x, best);
  return best;
}

Vec3 ClosestPoint::weights(const Hit& hit) const {
  const Vec3i& t = surface_.triangles[hit.triangle];
  const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
             &c = surface_.vertices[t[2]], &x = hit.point;
  const Vec3 normal = (b - a).cross(c - a);
  const double area = normal.squaredNorm();
  if (!(area > 0.0)) return Vec3::UnitX();
  const double u = (b - x).cross(c - x).dot(normal) / area,
               v = (c - x).cross(a - x).dot(normal) / area;
  return Vec3(u, v, 1.0 - u - v);
}

}  // namespace archetide
