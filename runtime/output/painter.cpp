#include "runtime/output/painter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/base/exception_carrier.h"
#include "runtime/output/optics.h"
#include "runtime/output/palette.h"
#include "runtime/output/tank_edges.h"

namespace archetide {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kMaxBounces = 4;       // inside the water
constexpr int kSkyRays = 2;          // per sample of a pixel
constexpr float kSunRadius = 0.05f;  // radians, wider than the real one for soft shadows
const Vec3f kToSun = Vec3f(-0.45f, -0.55f, 0.95f).normalized();
const Vec3f kSunLight(2.35f, 2.2f, 1.95f);
const Vec3f kZenith(0.50f, 0.64f, 0.86f), kHorizon(0.93f, 0.95f, 0.97f);
const Vec3f kGroundLight(0.42f, 0.41f, 0.40f);    // what the ground sends upwards
const Vec3f kWaterScatter(0.020f, 0.17f, 0.27f);  // light that the water sends back
const Vec3f kObstacleColour(0.45f, 0.42f, 0.39f), kEdgeColour(0.10f, 0.11f, 0.13f),
    kMarkerColour(0.95f, 0.90f, 0.70f), kSprayColour(0.80f, 0.90f, 0.95f);

// Meshes of the opaque scene.
enum { kBodies, kObstacles, kMarkers, kSpray };

Vec3f sky(const Vec3f& direction) {
  const float up = std::max(0.0f, direction[2]);
  return kHorizon + (kZenith - kHorizon) * std::pow(up, 0.55f);
}

Vec3f smooth_normal(const SurfaceMesh& mesh, const RayHit& hit) {
  const Vec3i& t = mesh.triangles[hit.triangle];
  const Vec3f n = (1.0f - hit.u - hit.v) * mesh.normals[t[0]].cast<float>() +
                  hit.u * mesh.normals[t[1]].cast<float>() +
                  hit.v * mesh.normals[t[2]].cast<float>();
  const float length = n.norm();
  return length > 0.0f ? Vec3f(n / length) : hit.flat_normal;
}

// An octahedron about every point.
SurfaceMesh dots(const std::vector<Vec3>& points, double radius) {
  SurfaceMesh mesh;
  for (const Vec3& x : points) {
    const Vec3i first = Vec3i::Constant(static_cast<int>(mesh.vertices.size()));
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        mesh.normals.emplace_back(side * Vec3::Unit(axis));
        mesh.vertices.emplace_back(x + radius * mesh.normals.back());
      }
    for (int octant = 0; octant < 8; ++octant) {  // corners -x +x -y +y -z +z are 0 .. 5
      Vec3i t(octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2));
      if (std::popcount(static_cast<unsigned>(octant)) % 2 == 0) std::swap(t[0], t[1]);
      mesh.triangles.push_back(first + t);
    }
  }
  return mesh;
}

Vec3f palette_colour(int b) {
  const auto c = body_palette_in_light(b);
  return Vec3f(c[0], c[1], c[2]);
}

int body_of(const SurfaceMesh& bodies, int vertex) {
  return bodies.body.empty() ? 0 : bodies.body[static_cast<std::size_t>(vertex)];
}

std::map<int, Eigen::AlignedBox3d> rest_boxes(const SurfaceMesh& bodies) {
  std::map<int, Eigen::AlignedBox3d> boxes;
  for (std::size_t v = 0; v < bodies.rest.size(); ++v)
    boxes[body_of(bodies, static_cast<int>(v))].extend(bodies.rest[v]);
  return boxes;
}

}  // namespace

Painter::Painter(const PaintedScene& scene)
    : scene_(scene),
      rest_(rest_boxes(scene.bodies)),
      edges_(scene.has_tank
                 ? box_edges(scene.low, scene.high, 0.0015 * (scene.high - scene.low).norm())
                 : SurfaceMesh()),
      dots_(dots(scene.markers, 0.0018 * (scene.high - scene.low).norm())),
      drops_(dots(scene.spray, 0.0012 * (scene.high - scene.low).norm())),
      opaque_({&scene.bodies, &scene.obstacles, &dots_, &drops_}),
      edge_scene_({&edges_}),
      water_({&scene.water}),
      low_(scene.low.cast<float>()),
      high_(scene.high.cast<float>()) {
  const Vec3f extent = high_ - low_;
  size_ = extent.norm();
  near_ = 1e-5f * size_;
  ground_ = low_[2] - 0.004f * size_;
  tile_ = std::max(extent[0], extent[1]) / 8.0f;
  // The same picture at every scale: a path through the middle of the tank keeps some of every
  // colour.
  absorption_ = Vec3f(3.4f, 1.05f, 0.62f) / std::cbrt(extent.prod());
}

Image Painter::paint(const Camera& camera, int width, int height, int samples) const {
  Image image(width, height);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic, 4)
  for (int y = 0; y < height; ++y)
    carrier.run([&] {
      for (int x = 0; x < width; ++x) {
        Vec3f sum = Vec3f::Zero();
        for (int s = 0; s < samples * samples; ++s) {
          Dice dice(x, y, s);
          const double sub_x = (s % samples + 0.5) / samples, sub_y = (s / samples + 0.5) / samples;
          sum += air_light(camera.ray(x + sub_x, y + sub_y), 0, dice);
        }
        sum /= static_cast<float>(samples * samples);
        for (int c = 0; c < 3; ++c)
          image.rgb[3 * (static_cast<std::size_t>(y) * width + x) + c] = encoded(sum[c]);
      }
    });
  carrier.rethrow();
  return image;
}

// What arrives at the start of a ray in air.
Vec3f Painter::air_light(const Ray& ray, int depth, Dice& dice) const {
  Surface surface;
  float t = ray.far;
  const bool hit_opaque = opaque_surface(ray, surface, t);
  Ray until = ray;
  until.far = t;
  if (const RayHit water = water_.closest(until)) {
    if (water.flat_normal.dot(ray.direction) < 0.0f)
      return water_surface_light(ray, water, depth, dice);
    return light_through_water(ray, depth, dice);
  }
  return hit_opaque ? shade(surface, -ray.direction, dice) : sky(ray.direction);
}

// A ray from the air meets the water's surface: mirror image and what lies in the water.
Vec3f Painter::water_surface_light(const Ray& ray, const RayHit& hit, int depth, Dice& dice) const {
  const Vec3f position = ray.at(hit.t);
  Vec3f normal = smooth_normal(scene_.water, hit);
  const bool side = is_tank_side(position, hit.flat_normal);
  if (side || normal.dot(ray.direction) > -0.02f) normal = hit.flat_normal;

  const float mirror = fresnel(std::clamp(-normal.dot(ray.direction), 0.0f, 1.0f));
  Ray inside{position, ray.direction, near_};
  if (!side) refract(ray.direction, normal, 1.0f / kWaterIndex, inside.direction);
  if (depth > 1) return mix(kWaterScatter, sky(reflected(ray.direction, normal)), mirror);
  const Vec3f below = light_through_water(inside, depth + 1, dice);
  if (mirror < 0.03f) return mix(below, sky(reflected(ray.direction, normal)), mirror);
  Ray outside{position, reflected(ray.direction, normal), near_};
  return mix(below, air_light(outside, depth + 2, dice), mirror);
}

// What arrives at the start of a ray in water: bodies behind the absorbing path, or the light that
// enters where the ray leaves the water.
Vec3f Painter::light_through_water(Ray ray, int depth, Dice& dice) const {
  Vec3f light = Vec3f::Zero(), weight = Vec3f::Ones();
  for (int bounce = 0; bounce < kMaxBounces; ++bounce) {
    Surface surface;
    float t = ray.far;
    const bool hit_opaque = opaque_surface(ray, surface, t);
    Ray until = ray;
    until.far = t;
    const RayHit exit = water_.closest(until);
    const float length = exit ? exit.t : hit_opaque ? t : 0.0f;
    const Vec3f passed = transmittance(length);
    light += (weight.array() * (1.0f - passed.array()) * kWaterScatter.array()).matrix();
    weight = weight.cwiseProduct(passed);
    if (!exit) {
      const Vec3f behind = hit_opaque ? shade(surface, -ray.direction, dice) : sky(ray.direction);
      return light + weight.cwiseProduct(behind);
    }

    const Vec3f position = ray.at(exit.t);
    Ray outside{position, ray.direction, near_};
    if (is_tank_side(position, exit.flat_normal))
      return light + weight.cwiseProduct(air_light(outside, depth + 1, dice));
    Vec3f normal = -smooth_normal(scene_.water, exit);  // against the ray, into the water
    if (normal.dot(ray.direction) > -0.02f) normal = -exit.flat_normal;
    if (normal.dot(ray.direction) > 0.0f) normal = -normal;
    if (refract(ray.direction, normal, kWaterIndex, outside.direction)) {
      const float mirror = fresnel(std::clamp(-normal.dot(outside.direction), 0.0f, 1.0f));
      const Vec3f above = depth > 2 ? sky(outside.direction) : air_light(outside, depth + 1, dice);
      return light + weight.cwiseProduct(mix(above, 2.0f * kWaterScatter, mirror));
    }
    ray = Ray{position, reflected(ray.direction, normal), near_};
  }
  return light + weight.cwiseProduct(kWaterScatter);
}

Vec3f Painter::shade(const Surface& s, const Vec3f& to_eye, Dice& dice) const {
  const float facing = s.normal.dot(kToSun);
  Vec3f sun = Vec3f::Zero();
  if (facing > 0.0f) sun = kSunLight.cwiseProduct(sun_visibility(s.position, dice));
  const Vec3f ambient =
      mix(kGroundLight, 0.9f * kZenith + 0.1f * kHorizon, 0.5f + 0.5f * s.normal[2]) *
      sky_visibility(s, dice);
  Vec3f light = s.colour.cwiseProduct(std::max(0.0f, facing) / 1.8f * sun + 0.75f * ambient);
  if (s.gloss > 0.0f) {
    // A clear coat: the sun's highlight (Blinn, Phong) and a little of the sky at grazing angles.
    const float highlight =
        std::pow(std::max(0.0f, s.normal.dot((kToSun + to_eye).normalized())), 60.0f);
    const float coat = fresnel(std::clamp(s.normal.dot(to_eye), 0.0f, 1.0f));
    light += s.gloss * (0.35f * highlight * sun + 0.5f * coat * ambient);
  }
  return light;
}

// Share of the sun's light that arrives, by colour: none behind bodies, part of it through water.
Vec3f Painter::sun_visibility(const Vec3f& position, Dice& dice) const {
  float u, v;
  dice.next(u, v);
  Vec3f a, b;
  tangents(kToSun, a, b);
  const float radius = kSunRadius * std::sqrt(u), angle = 2.0f * kPi * v;
  Ray ray{position, kToSun + radius * (std::cos(angle) * a + std::sin(angle) * b), near_ * 20.0f};
  ray.direction.normalize();
  if (opaque_.blocked(ray)) return Vec3f::Zero();
  float length = 0.0f, from = 0.0f;
  for (int crossing = 0; crossing < kMaxBounces; ++crossing) {
    const RayHit hit = water_.closest(ray);
    if (!hit) break;
    if (hit.flat_normal.dot(ray.direction) > 0.0f) length += hit.t - from;
    from = hit.t;
    ray.near = hit.t + near_;
  }
  return transmittance(0.7f * length);
}

// Share of the sky above a surface that nothing close by covers.
float Painter::sky_visibility(const Surface& s, Dice& dice) const {
  Vec3f a, b;
  tangents(s.normal, a, b);
  float open = 0.0f;
  for (int n = 0; n < kSkyRays; ++n) {
    float u, v;
    dice.next(u, v, n, kSkyRays);
    const float radius = std::sqrt(u), angle = 2.0f * kPi * v;
    Ray ray{s.position,
            radius * (std::cos(angle) * a + std::sin(angle) * b) +
                std::sqrt(std::max(0.0f, 1.0f - u)) * s.normal,
            near_ * 20.0f, 0.4f * size_};
    const bool covered =
        opaque_.blocked(ray) ||
        (ray.direction[2] < 0.0f && s.position[2] + 0.4f * size_ * ray.direction[2] < ground_);
    open += covered ? 0.0f : 1.0f;
  }
  return 0.25f + 0.75f * open / kSkyRays;
}

// The nearest body, obstacle, edge or ground.
bool Painter::opaque_surface(const Ray& ray, Surface& surface, float& t) const {
  const RayHit hit = opaque_.closest(ray);
  t = hit.t;
  Ray until = ray;
  until.far = t;
  if (const RayHit edge = edge_scene_.closest(until)) {
    t = edge.t;
    surface = {ray.at(t), edge.flat_normal, kEdgeColour, 0.0f};
    return true;
  }
  const float to_ground = (ground_ - ray.origin[2]) / ray.direction[2];
  if (ray.direction[2] < 0.0f && to_ground > ray.near && to_ground < t) {
    t = to_ground;
    const Vec3f position = ray.at(t);
    surface = {position, Vec3f(0, 0, 1), ground_colour(position), 0.0f};
    return true;
  }
  if (!hit) return false;
  const SurfaceMesh& bodies = scene_.bodies;
  surface.position = ray.at(t);
  if (hit.mesh == kBodies) {
    surface.normal = smooth_normal(bodies, hit);
    surface.colour = body_colour(hit);
    surface.gloss = 1.0f;
  } else {
    const bool marker = hit.mesh == kMarkers, drop = hit.mesh == kSpray;
    surface.normal = smooth_normal(marker ? dots_ : drop ? drops_ : scene_.obstacles, hit);
    surface.colour = marker ? kMarkerColour : drop ? kSprayColour : kObstacleColour;
    surface.gloss = 0.0f;
  }
  if (surface.normal.dot(ray.direction) > 0.0f) surface.normal = -surface.normal;
  return true;
}

bool Painter::is_tank_side(const Vec3f& position, const Vec3f& normal) const {
  int axis;
  if (normal.cwiseAbs().maxCoeff(&axis) < 0.9999f) return false;
  const float wall = normal[axis] > 0.0f ? high_[axis] : low_[axis];
  // The lid is a surface like any other.
  return std::abs(position[axis] - wall) < 1e-4f * size_ && !(axis == 2 && normal[2] > 0.0f);
}

// Two tones in cubes that are painted on the undeformed body: they show how it turns and bends.
Vec3f Painter::body_colour(const RayHit& hit) const {
  constexpr double kCubes = 6.0;  // along the longest side
  const SurfaceMesh& bodies = scene_.bodies;
  const Vec3i& t = bodies.triangles[hit.triangle];
  const int body = body_of(bodies, t[0]);
  const Vec3f colour = palette_colour(body);
  if (bodies.rest.empty()) return colour;
  const Vec3 rest = (1.0 - hit.u - hit.v) * bodies.rest[t[0]] + hit.u * bodies.rest[t[1]] +
                    hit.v * bodies.rest[t[2]];
  const Eigen::AlignedBox3d& box = rest_.at(body);
  const Vec3 cube = kCubes / box.sizes().maxCoeff() * (rest - box.center());
  long sum = 0;  // the middle lies in a cube
  for (int a = 0; a < 3; ++a) sum += std::lround(cube[a]);
  if ((sum & 1) == 0) return colour;
  return colour.mean() > 0.5f ? Vec3f(0.5f * colour) : mix(colour, Vec3f::Constant(0.9f), 0.45f);
}

// Soft tiles with thin lines, fading into the horizon's colour far away.
Vec3f Painter::ground_colour(const Vec3f& position) const {
  const float x = (position[0] - low_[0]) / tile_, y = (position[1] - low_[1]) / tile_;
  const bool odd = (static_cast<long>(std::floor(x)) + static_cast<long>(std::floor(y))) & 1;
  const Vec3f tiles = odd ? Vec3f(0.265f, 0.27f, 0.28f) : Vec3f(0.345f, 0.35f, 0.36f);
  const Vec3f middle = 0.5f * (low_ + high_);
  const float away = (position - middle).head<2>().norm() / (2.5f * size_);
  return mix(tiles, Vec3f(0.62f, 0.64f, 0.67f), std::min(1.0f, away * away));
}

Vec3f Painter::transmittance(float length) const { return (-length * absorption_).array().exp(); }

}  // namespace archetide
