#include "runtime/output/ray_scene.h"

#ifdef ARCHETIDE_WITH_EMBREE
#include <embree3/rtcore.h>
#endif

#include "common/base/input_error.h"

namespace archetide {

#ifdef ARCHETIDE_WITH_EMBREE

namespace {

RTCDevice device() {
  static const RTCDevice the_device = rtcNewDevice(nullptr);
  if (!the_device) throw MachineError("embree finds no device to run on");
  return the_device;
}

RTCRay embree_ray(const Ray& ray) {
  RTCRay r{};
  r.org_x = ray.origin[0], r.org_y = ray.origin[1], r.org_z = ray.origin[2];
  r.dir_x = ray.direction[0], r.dir_y = ray.direction[1], r.dir_z = ray.direction[2];
  r.tnear = ray.near, r.tfar = ray.far;
  r.mask = ~0u;
  return r;
}

void attach(RTCScene scene, unsigned number, const SurfaceMesh& mesh) {
  if (mesh.triangles.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                             RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                             mesh.vertices.size()));
  auto* corners = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), mesh.triangles.size()));
  if (!points || !corners) throw MachineError("embree: no memory for a mesh");
  for (const Vec3& x : mesh.vertices)
    for (int a = 0; a < 3; ++a) *points++ = static_cast<float>(x[a]);
  for (const Vec3i& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) *corners++ = static_cast<unsigned>(t[c]);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, number);
  rtcReleaseGeometry(geometry);
}

}  // namespace

struct RayScene::Impl {
  RTCScene scene = rtcNewScene(device());
  ~Impl() { rtcReleaseScene(scene); }
};

RayScene::RayScene(const std::vector<const SurfaceMesh*>& meshes)
    : impl_(std::make_unique<Impl>()) {
  for (std::size_t m = 0; m < meshes.size(); ++m)
    attach(impl_->scene, static_cast<unsigned>(m), *meshes[m]);
  rtcCommitScene(impl_->scene);
}

bool RayScene::available() { return true; }

RayHit RayScene::closest(const Ray& ray) const {
  RTCRayHit query{};
  query.ray = embree_ray(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->scene, &context, &query);
  RayHit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.t = query.ray.tfar;
  hit.mesh = static_cast<int>(query.hit.geomID), hit.triangle = static_cast<int>(query.hit.primID);
  hit.u = query.hit.u, hit.v = query.hit.v;
  hit.flat_normal = Vec3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  return hit;
}

bool RayScene::blocked(const Ray& ray) const {
  RTCRay query = embree_ray(ray);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene, &context, &query);
  return query.tfar < 0.0f;
}

#else

struct RayScene::Impl {};

RayScene::RayScene(const std::vector<const SurfaceMesh*>&) {
  throw MachineError("this build cannot render: install libembree-dev and libpng-dev, build again");
}

bool RayScene::available() { return false; }
RayHit RayScene::closest(const Ray&) const { return {}; }
bool RayScene::blocked(const Ray&) const { return false; }

#endif

RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;

}  // namespace archetide
