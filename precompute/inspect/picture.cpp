#include "precompute/inspect/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace archetide {
namespace {

constexpr int kSamples = 2;     // along each side of a pixel
constexpr double kFill = 0.92;  // of the picture

/// Colours of 0, 1/4, .. 1, sRGB: dark blue to yellow with rising lightness.
Vec3 colour_of(double value) {
  static const std::array<Vec3, 5> kColours = {Vec3(0.16, 0.24, 0.52), Vec3(0.14, 0.48, 0.60),
                                               Vec3(0.20, 0.68, 0.50), Vec3(0.62, 0.82, 0.28),
                                               Vec3(0.99, 0.86, 0.22)};
  const double x = 4 * std::clamp(value, 0.0, 1.0);
  const int i = std::min(3, static_cast<int>(x));
  return kColours[i] + (x - i) * (kColours[i + 1] - kColours[i]);
}

/// World to picture: x right, y down, z away from the camera; pixels.
struct View {
  Mat3 axes;  // rows: right, down, away
  Vec3 middle;
  double scale;
  double width, height;

  View(const std::vector<Vec3>& frame, double margin, int w, int h) : width(w), height(h) {
    const Vec3 away = Vec3(-0.45, 1.0, -0.5).normalized();
    const Vec3 right = away.cross(Vec3::UnitZ()).normalized();
    axes << right.transpose(), away.cross(right).transpose(), away.transpose();
    Eigen::AlignedBox3d box;  // along the axes
    for (const Vec3& x : frame) box.extend(axes * x);
    middle = axes.transpose() * box.center();
    const Vec3 size = box.sizes() + Vec3::Constant(2 * margin);
    scale = kFill * std::min(width / size[0], height / size[1]);
  }
  Vec3 operator()(const Vec3& x) const {
    return scale * (axes * (x - middle)) + Vec3(width / 2, height / 2, 0);
  }
};

struct Canvas {
  Image image;
  std::vector<double> depth;
};

/// Fills the pixels whose middle lies in the triangle and that nothing nearer has taken.
void draw_triangle(Canvas& canvas, const std::array<Vec3, 3>& at,
                   const std::array<Vec3, 3>& colour) {
  const Image& image = canvas.image;
  const auto edge = [](const Vec3& p, const Vec3& q, double x, double y) {
    return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
  };
  const double area = edge(at[0], at[1], at[2][0], at[2][1]);
  if (area == 0) return;
  const Vec3 low = at[0].cwiseMin(at[1]).cwiseMin(at[2]),
             high = at[0].cwiseMax(at[1]).cwiseMax(at[2]);
  const int x0 = std::max(0, static_cast<int>(low[0])), y0 = std::max(0, static_cast<int>(low[1]));
  const int x1 = std::min(image.width - 1, static_cast<int>(high[0]));
  const int y1 = std::min(image.height - 1, static_cast<int>(high[1]));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const Vec3 w =
          Vec3(edge(at[1], at[2], px, py), edge(at[2], at[0], px, py), edge(at[0], at[1], px, py)) /
          area;
      if (w.minCoeff() < 0) continue;
      const std::size_t pixel = static_cast<std::size_t>(y) * image.width + x;
      const double z = w[0] * at[0][2] + w[1] * at[1][2] + w[2] * at[2][2];
      if (z >= canvas.depth[pixel]) continue;
      canvas.depth[pixel] = z;
      const Vec3 c = w[0] * colour[0] + w[1] * colour[1] + w[2] * colour[2];
      for (int i = 0; i < 3; ++i) {
        canvas.image.rgb[3 * pixel + i] =
            static_cast<std::uint8_t>(std::lround(255 * std::clamp(c[i], 0.0, 1.0)));
      }
    }
  }
}

}  // namespace

Image draw_surface(const TriMesh& surface, const std::vector<double>& value,
                   const std::vector<Vec3>& frame, double margin, int width, int height) {
  const View view(frame, margin, kSamples * width, kSamples * height);
  Canvas canvas{Image(kSamples * width, kSamples * height), {}};
  std::fill(canvas.image.rgb.begin(), canvas.image.rgb.end(), std::uint8_t{255});
  canvas.depth.assign(canvas.image.rgb.size() / 3, std::numeric_limits<double>::infinity());

  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(surface, normals, areas);
  const Vec3 light = view.axes.transpose() * Vec3(-0.4, -0.6, -0.7).normalized();
  for (const Vec3i& t : surface.triangles) {
    std::array<Vec3, 3> at, colour;
    for (int k = 0; k < 3; ++k) {
      at[k] = view(surface.vertices[t[k]]);
      const double shade = 0.35 + 0.65 * std::max(0.0, normals[t[k]].dot(light));
      colour[k] = shade * colour_of(value[t[k]]);
    }
    draw_triangle(canvas, at, colour);
  }
  return shrunk(canvas.image, kSamples);
}

}  // namespace archetide
