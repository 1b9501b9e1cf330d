#include "runtime/contact/contact_shape.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include "common/base/exception_carrier.h"
#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_sdf.h"

namespace archetide {
namespace {

constexpr int kSamplesAcross = 12;  // samples along a bounding radius, at least
constexpr int kClusterSize = 32;    // samples
constexpr int kLatticeCells = 20;   // along the longest side
constexpr int kNeighbours = 16;     // vertices of a lattice node's fit
constexpr int kCoverCells = 96;     // of a cover's distances, along its longest side ..
constexpr int kWeightCells = 32;    // .. and of its weights
constexpr double kFarthestFit =
    2.5;  // lattice cells that a linear fit is trusted beyond its points

void add_edge_samples(const TriMesh& mesh, const Vec3i& t, double spacing,
                      std::vector<SurfaceSample>& samples) {
  for (int c = 0; c < 3; ++c) {
    const int a = t[c], b = t[(c + 1) % 3];
    if (a > b) continue;  // every edge once
    const int parts =
        static_cast<int>(std::ceil((mesh.vertices[a] - mesh.vertices[b]).norm() / spacing - 1e-9));
    for (int i = 1; i < parts; ++i) {
      const double s = static_cast<double>(i) / parts;
      samples.push_back({Vec3i(a, b, b), Vec3(1.0 - s, s, 0.0), Vec3::Zero(), 0});
    }
  }
}

void add_face_samples(const TriMesh& mesh, const Vec3i& t, double spacing,
                      std::vector<SurfaceSample>& samples) {
  double longest = 0.0;
  for (int c = 0; c < 3; ++c)
    longest = std::max(longest, (mesh.vertices[t[c]] - mesh.vertices[t[(c + 1) % 3]]).norm());
  const int parts = static_cast<int>(std::ceil(longest / spacing - 1e-9));
  for (int i = 1; i < parts; ++i)
    for (int j = 1; i + j < parts; ++j) {
      const double s = static_cast<double>(i) / parts, u = static_cast<double>(j) / parts;
      samples.push_back({t, Vec3(1.0 - s - u, s, u), Vec3::Zero(), 0});
    }
}

/// Splits samples [begin, end) at the median of their longest extent until clusters are small.
void cluster(const TriMesh& mesh, std::vector<SurfaceSample>& samples, int begin, int end,
             std::vector<SampleCluster>& clusters) {
  if (end - begin <= kClusterSize) {
    if (end > begin) clusters.push_back({begin, end});
    return;
  }
  Vec3 low = rest_place(mesh, samples[begin]), high = low;
  for (int s = begin; s < end; ++s) {
    const Vec3 x = rest_place(mesh, samples[s]);
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::stable_sort(samples.begin() + begin, samples.begin() + end,
                   [&](const SurfaceSample& p, const SurfaceSample& q) {
                     return rest_place(mesh, p)[axis] < rest_place(mesh, q)[axis];
                   });
  cluster(mesh, samples, begin, middle, clusters);
  cluster(mesh, samples, middle, end, clusters);
}

/// The nearest vertices to x, nearest first.
std::vector<int> nearest_vertices(const std::vector<Vec3>& vertices, const Vec3& x, int count) {
  std::vector<std::pair<double, int>> order(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    order[v] = {(vertices[v] - x).squaredNorm(), static_cast<int>(v)};
  const std::size_t kept = std::min<std::size_t>(count, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<long>(kept), order.end());
  std::vector<int> nearest(kept);
  for (std::size_t n = 0; n < kept; ++n) nearest[n] = order[n].second;
  return nearest;
}

/// Weights of the vertices' values in the value at x: linear least squares about their weighted
/// centre with a ridge, so that a direction in which the vertices do not spread counts as constant.
VecX fit_weights(const std::vector<Vec3>& vertices, const std::vector<int>& nearest, const Vec3& x,
                 double spacing) {
  const auto n = static_cast<long>(nearest.size());
  VecX w(n);
  Vec3 centre = Vec3::Zero();
  for (long k = 0; k < n; ++k) {
    w[k] = 1.0 / ((vertices[nearest[k]] - x).squaredNorm() + 0.01 * spacing * spacing);
    centre += w[k] * vertices[nearest[k]];
  }
  centre /= w.sum();
  w /= w.sum();
  Mat3 spread = Mat3::Zero();
  for (long k = 0; k < n; ++k) {
    const Vec3 d = vertices[nearest[k]] - centre;
    spread += w[k] * d * d.transpose();
  }
  spread += (1e-2 * spread.trace() + 1e-12 * spacing * spacing) * Mat3::Identity();
  Vec3 step = x - centre;
  if (step.norm() > kFarthestFit * spacing) step *= kFarthestFit * spacing / step.norm();
  const Vec3 along = spread.ldlt().solve(step);
  VecX out(n);
  for (long k = 0; k < n; ++k) out[k] = w[k] * (1.0 + along.dot(vertices[nearest[k]] - centre));
  return out;
}

}  // namespace

Vec3 rest_place(const TriMesh& mesh, const SurfaceSample& s) {
  return s.weights[0] * mesh.vertices[s.vertices[0]] + s.weights[1] * mesh.vertices[s.vertices[1]] +
         s.weights[2] * mesh.vertices[s.vertices[2]];
}

std::vector<SurfaceSample> surface_samples(const TriMesh& surface, double spacing) {
  std::vector<SurfaceSample> samples;
  for (int v = 0; v < static_cast<int>(surface.vertices.size()); ++v)
    samples.push_back({Vec3i(v, v, v), Vec3::UnitX(), Vec3::Zero(), 0});
  for (const Vec3i& t : surface.triangles) add_edge_samples(surface, t, spacing, samples);
  for (const Vec3i& t : surface.triangles) add_face_samples(surface, t, spacing, samples);

  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(surface, normals, areas);
  for (SurfaceSample& s : samples) {
    Vec3 n = Vec3::Zero();
    for (int c = 0; c < 3; ++c) n += s.weights[c] * normals[s.vertices[c]];
    s.normal = n.normalized();
    s.order = static_cast<int>(&s - samples.data());
  }
  return samples;
}

BoxLattice lattice_around(const TriMesh& surface, int cells) {
  Vec3 low = surface.vertices[0], high = low;
  for (const Vec3& x : surface.vertices) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  BoxLattice lattice;
  lattice.spacing = (high - low).maxCoeff() / cells;
  lattice.origin = low - 2.0 * lattice.spacing * Vec3::Ones();
  lattice.nodes =
      ((high - low) / lattice.spacing + Vec3::Constant(5.0 - 1e-9)).array().ceil().cast<int>();
  return lattice;
}

ModeLattice mode_lattice(const Archetype& archetype, int cells, bool nodes) {
  const std::vector<Vec3>& vertices = archetype.surface.vertices;
  ModeLattice lattice{lattice_around(archetype.surface, cells), {}};
  const long r = archetype.r();
  if (nodes) {
    lattice.shares_each = std::min(kNeighbours, static_cast<int>(vertices.size()));
    lattice.shares.resize(static_cast<std::size_t>(lattice.shares_each) * lattice.nodes.prod());
  } else {
    lattice.modes.resize(3L * lattice.nodes.prod(), r);
  }
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < lattice.nodes[2]; ++k)
    carrier.run([&] {
      for (int j = 0; j < lattice.nodes[1]; ++j)
        for (int i = 0; i < lattice.nodes[0]; ++i) {
          const Vec3 x = lattice.place(i, j, k);
          const std::vector<int> nearest = nearest_vertices(vertices, x, kNeighbours);
          const VecX w = fit_weights(vertices, nearest, x, lattice.spacing);
          if (nodes) {
            VertexShare* shares = &lattice.shares[lattice.shares_each * lattice.index(i, j, k)];
            for (long m = 0; m < w.size(); ++m) shares[m] = {nearest[m], w[m]};
            continue;
          }
          MatX sum = MatX::Zero(3, r);
          for (long m = 0; m < w.size(); ++m)
            sum += w[m] * archetype.surface_modes.middleRows<3>(3L * nearest[m]);
          lattice.modes.middleRows<3>(3 * lattice.index(i, j, k)) = sum;
        }
    });
  carrier.rethrow();
  return lattice;
}

VecX ModeLattice::displacements(const VecX& surface) const {
  VecX u = VecX::Zero(3L * nodes.prod());
  auto share = shares.begin();
  for (long n = 0; n < u.size(); n += 3)
    for (int m = 0; m < shares_each; ++m, ++share)
      u.segment<3>(n) += share->weight * surface.segment<3>(3L * share->vertex);
  return u;
}

BoxLattice::Stencil BoxLattice::stencil(const Vec3& x) const {
  int base[3];
  double s[3], rate[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double at = (x[axis] - origin[axis]) / spacing;
    const double clamped = std::clamp(at, 0.0, nodes[axis] - 1.0);
    base[axis] = std::min(static_cast<int>(clamped), nodes[axis] - 2);
    s[axis] = clamped - base[axis];
    rate[axis] = at == clamped ? 1.0 / spacing : 0.0;
  }
  Stencil out;
  for (int c = 0; c < 8; ++c) {
    const int d[3] = {c & 1, c >> 1 & 1, c >> 2};
    double w[3], g[3];
    for (int axis = 0; axis < 3; ++axis) {
      w[axis] = d[axis] ? s[axis] : 1.0 - s[axis];
      g[axis] = d[axis] ? rate[axis] : -rate[axis];
    }
    out.node[c] = base[0] + d[0] + nodes[0] * (base[1] + d[1] + nodes[1] * (base[2] + d[2]));
    out.weight[c] = w[0] * w[1] * w[2];
    out.slope[c] = Vec3(g[0] * w[1] * w[2], w[0] * g[1] * w[2], w[0] * w[1] * g[2]);
  }
  return out;
}

std::shared_ptr<const ContactShape> contact_shape(std::shared_ptr<const Archetype> archetype,
                                                  const SurfaceRung* rung, bool nodes) {
  auto shape = std::make_shared<ContactShape>();
  shape->archetype = archetype;
  shape->rung = rung;
  const TriMesh& surface = shape->surface();
  shape->reach = body_reach(*archetype);
  shape->spacing = shape->reach.rest / kSamplesAcross;
  shape->samples = surface_samples(surface, shape->spacing);
  cluster(surface, shape->samples, 0, static_cast<int>(shape->samples.size()), shape->clusters);
  if (archetype->sdf.values.empty()) shape->sampled = sample_distance(archetype->surface);
  if (archetype->r() > 0 || nodes) shape->lattice = mode_lattice(*archetype, kLatticeCells, nodes);
  return shape;
}

namespace {

/// The body that moves a sample of a cover most.
std::size_t mover(const SurfaceSample& s, const MatX& weights) {
  VecX share = VecX::Zero(weights.cols());
  for (int c = 0; c < 3; ++c) share += s.weights[c] * weights.row(s.vertices[c]).transpose();
  Eigen::Index most = 0;
  share.maxCoeff(&most);
  return static_cast<std::size_t>(most);
}

/// Weights of the cover's nearest point at the nodes of a lattice, bodies x nodes.
MatX weights_around(const TriMesh& cover, const MatX& weights, const BoxLattice& lattice) {
  const ClosestPoint nearest(cover);
  MatX out(weights.cols(), lattice.nodes.prod());
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < lattice.nodes[2]; ++k)
    carrier.run([&] {
      for (int j = 0; j < lattice.nodes[1]; ++j)
        for (int i = 0; i < lattice.nodes[0]; ++i) {
          const ClosestPoint::Hit hit = nearest.find(lattice.place(i, j, k), INFINITY);
          const Vec3i& t = cover.triangles[hit.triangle];
          const Vec3 w = nearest.weights(hit);
          out.col(lattice.index(i, j, k)) =
              (w[0] * weights.row(t[0]) + w[1] * weights.row(t[1]) + w[2] * weights.row(t[2]))
                  .transpose();
        }
    });
  carrier.rethrow();
  return out;
}

/// A body with these samples of its cover, whose surface is `cover`.
std::shared_ptr<const ContactShape> covered_shape(std::shared_ptr<const Archetype> archetype,
                                                  const TriMesh& cover,
                                                  std::vector<SurfaceSample> samples,
                                                  double spacing) {
  auto shape = std::make_shared<ContactShape>(*contact_shape(archetype));
  const TriMesh& surface = archetype->surface;
  const ClosestPoint nearest(surface);
  shape->spacing = spacing;
  for (SurfaceSample& s : samples) {
    const Vec3 x = rest_place(cover, s) - archetype->centre;
    const ClosestPoint::Hit hit = nearest.find(x, INFINITY);
    s.order = static_cast<int>(shape->places.size());
    shape->places.push_back({s.vertices, s.weights, x - hit.point});
    s.vertices = surface.triangles[hit.triangle], s.weights = nearest.weights(hit);
    shape->reach.rest = std::max(shape->reach.rest, x.norm());
  }
  shape->samples = std::move(samples);
  shape->clusters.clear();
  cluster(surface, shape->samples, 0, static_cast<int>(shape->samples.size()), shape->clusters);
  return shape;
}

}  // namespace

std::shared_ptr<const CoverShape> cover_shape(
    const TriMesh& surface, const MatX& weights,
    const std::vector<std::shared_ptr<const Archetype>>& bodies) {
  auto cover = std::make_shared<CoverShape>();
  cover->distance = sample_distance(surface, {.cells = kCoverCells});
  cover->lattice = lattice_around(surface, kWeightCells);
  cover->weights = weights_around(surface, weights, cover->lattice);
  double spacing = INFINITY;
  for (const auto& body : bodies)
    spacing = std::min(spacing, body_reach(*body).rest / kSamplesAcross);
  std::vector<std::vector<SurfaceSample>> samples(bodies.size());
  for (const SurfaceSample& s : surface_samples(surface, spacing))
    samples[mover(s, weights)].push_back(s);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    cover->centres.push_back(bodies[b]->centre);
    // a body that moves nothing most is met as it is
    cover->shapes.push_back(samples[b].empty()
                                ? contact_shape(bodies[b])
                                : covered_shape(bodies[b], surface, samples[b], spacing));
  }
  return cover;
}

VecX CoverShape::weights_at(const Vec3& x) const {
  const BoxLattice::Stencil s = lattice.stencil(x);
  VecX w = VecX::Zero(weights.rows());
  for (int c = 0; c < 8; ++c) w += s.weight[c] * weights.col(s.node[c]);
  return w;
}

}  // namespace archetide
