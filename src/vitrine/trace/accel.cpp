#include "trace/accel.h"

#include "base/error.h"

#include <embree3/rtcore.h>

#include <array>
#include <cstddef>
#include <limits>

namespace vitrine {

struct Accel::Impl {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    ~Impl() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }
};

namespace {

void throw_on_error(void*, RTCError code, const char* text) {
    // Called while a scene is built; Embree is C, but unwinding through it is only done from commit
    // paths that hold no lock, and the run ends anyway.
    throw MachineError(fmt::format("ray tracing library failed ({}): {}", static_cast<int>(code),
                                   text ? text : ""));
}

static_assert(sizeof(BareRay) == sizeof(RTCRay) && alignof(BareRay) == alignof(RTCRay));
static_assert(offsetof(BareRay, direction) == offsetof(RTCRay, dir_x));
static_assert(offsetof(BareRay, max_distance) == offsetof(RTCRay, tfar));
static_assert(offsetof(BareRay, mask) == offsetof(RTCRay, mask));
static_assert(sizeof(RayAndHit) == sizeof(RTCRayHit) && alignof(RayAndHit) == alignof(RTCRayHit));
static_assert(offsetof(RayAndHit, normal) == offsetof(RTCRayHit, hit.Ng_x));
static_assert(offsetof(RayAndHit, barycentric) == offsetof(RTCRayHit, hit.u));
static_assert(offsetof(RayAndHit, triangle) == offsetof(RTCRayHit, hit.primID));
static_assert(offsetof(RayAndHit, part) == offsetof(RTCRayHit, hit.geomID));
static_assert(offsetof(RayAndHit, instance) == offsetof(RTCRayHit, hit.instID));

RTCRay* to_embree(BareRay* rays) { return reinterpret_cast<RTCRay*>(rays); }
RTCRayHit* to_embree(RayAndHit* rays) { return reinterpret_cast<RTCRayHit*>(rays); }

BareRay bare(const Ray& ray) {
    BareRay result(ray.origin, ray.direction, ray.max_distance, ray.mask);
    result.min_distance = ray.min_distance;
    return result;
}

RayAndHit start_of(const Ray& ray) {
    RayAndHit result;
    result.ray = bare(ray);
    return result;
}

void self_test(RTCDevice device) {
    // Debian's build honours ray masks; a build that does not, or a broken one, shows here.
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3));
    const float corners[9] = {-1, -1, 1, 1, -1, 1, 0, 1, 1};
    std::copy_n(corners, 9, v);
    auto* t = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 1));
    t[0] = 0;
    t[1] = 1;
    t[2] = 2;
    rtcSetGeometryMask(geometry, 2u);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    bool is_right = true;
    for (const std::uint32_t mask : {2u, 4u}) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RayAndHit ray = start_of({Vec3f::Zero(), Vec3f(0, 0, 1), 0.0f, 10.0f, mask});
        rtcIntersect1(scene, &context, to_embree(&ray));
        is_right &= ray.is_hit() == (mask == 2u) &&
                    (!ray.is_hit() || std::abs(ray.distance() - 1.0f) < 1e-5f);
    }
    rtcReleaseScene(scene);
    if (!is_right) {
        throw MachineError("ray tracing self-test failed: install libembree3-3 from Debian 12");
    }
}

}  // namespace

Accel::Accel(std::vector<AccelPart> parts) : parts_(std::move(parts)) {
    auto impl = std::make_shared<Impl>();
    impl->device = rtcNewDevice(nullptr);
    if (!impl->device) throw MachineError("the ray tracing library does not start");
    self_test(impl->device);
    rtcSetDeviceErrorFunction(impl->device, throw_on_error, nullptr);
    impl->scene = rtcNewScene(impl->device);
    rtcSetSceneFlags(impl->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(impl->scene, RTC_BUILD_QUALITY_HIGH);
    for (const AccelPart& part : parts_) {
        RTCGeometry geometry = rtcNewGeometry(impl->device, RTC_GEOMETRY_TYPE_TRIANGLE);
        const Mesh& mesh = *part.mesh;
        auto* vertices = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                    3 * sizeof(float), mesh.vertices.size()));
        auto* triangles = static_cast<unsigned*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    3 * sizeof(unsigned), mesh.triangles.size()));
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
            for (int c = 0; c < 3; ++c)
                vertices[3 * i + static_cast<std::size_t>(c)] = mesh.vertices[i][c];
        }
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            for (int c = 0; c < 3; ++c) {
                triangles[3 * i + static_cast<std::size_t>(c)] =
                    static_cast<unsigned>(mesh.triangles[i][c]);
            }
        }
        rtcSetGeometryMask(geometry, part.mask);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(impl->scene, geometry);  // ids count up from 0 in this order
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(impl->scene);
    impl_ = std::move(impl);
}

Hit Accel::closest(const Ray& ray) const {
    if (!impl_) return {};
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RayAndHit answer = start_of(ray);
    rtcIntersect1(impl_->scene, &context, to_embree(&answer));
    return hit_of(answer);
}

void Accel::closest(std::span<const Ray> rays, std::span<Hit> hits) const {
    VITRINE_CHECK_EQ(rays.size(), hits.size());
    constexpr std::size_t kStream = 64;  // rays that Embree sorts into packets at once
    std::array<RayAndHit, kStream> stream;
    for (std::size_t begin = 0; begin < rays.size(); begin += kStream) {
        const std::size_t count = std::min(kStream, rays.size() - begin);
        for (std::size_t i = 0; i < count; ++i) stream[i] = start_of(rays[begin + i]);
        closest(RayList(std::span(stream).first(count)), true);
        for (std::size_t i = 0; i < count; ++i) hits[begin + i] = hit_of(stream[i]);
    }
}

void Accel::closest(const RayList& rays, bool are_alike) const {
    if (!impl_ || rays.size() == 0) return;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (are_alike) {
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        rtcIntersect1M(impl_->scene, &context, to_embree(rays.data()),
                       static_cast<unsigned>(rays.size()), rays.stride_bytes());
        return;
    }
    for (std::size_t i = 0; i < rays.size(); ++i) {
        rtcIntersect1(impl_->scene, &context, to_embree(&rays[i]));
    }
}

bool Accel::is_occluded(const Ray& ray) const {
    if (!impl_) return false;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    BareRay answer = bare(ray);
    rtcOccluded1(impl_->scene, &context, to_embree(&answer));
    return answer.is_hidden();
}

void Accel::occluded(std::span<BareRay> rays) const {
    if (!impl_ || rays.empty()) return;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1M(impl_->scene, &context, to_embree(rays.data()),
                  static_cast<unsigned>(rays.size()), sizeof(BareRay));
}

namespace {

/// Barycentric weights (of vertices 1 and 2) of the point of a triangle nearest to p
/// (Ericson, Real-Time Collision Detection, 5.1.5).
Vec2f nearest_on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3f ab = b - a, ac = c - a, ap = p - a;
    const float d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return {0, 0};
    const Vec3f bp = p - b;
    const float d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return {1, 0};
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d1 / (d1 - d3), 0};
    const Vec3f cp = p - c;
    const float d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return {0, 1};
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return {0, d2 / (d2 - d6)};
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {1 - w, w};
    }
    const float sum = va + vb + vc;
    return {vb / sum, vc / sum};
}

struct NearestQuery {
    const std::vector<AccelPart>* parts;
    Vec3f point;
    Hit best;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
    auto& query = *static_cast<NearestQuery*>(arguments->userPtr);
    const Mesh& mesh = *(*query.parts)[arguments->geomID].mesh;
    const Triangle& t = mesh.triangles[arguments->primID];
    const Vec3f& a = mesh.vertices[static_cast<std::size_t>(t[0])];
    const Vec3f& b = mesh.vertices[static_cast<std::size_t>(t[1])];
    const Vec3f& c = mesh.vertices[static_cast<std::size_t>(t[2])];
    const Vec2f weights = nearest_on_triangle(query.point, a, b, c);
    const Vec3f q = a + weights.x() * (b - a) + weights.y() * (c - a);
    const float distance = (q - query.point).norm();
    if (!(distance < arguments->query->radius)) return false;
    arguments->query->radius = distance;
    query.best.distance = distance;
    query.best.part = static_cast<int>(arguments->geomID);
    query.best.triangle = static_cast<int>(arguments->primID);
    query.best.barycentric = weights;
    return true;
}

template <typename T>
T interpolate(const std::vector<T>& values, const Triangle& t, const Vec2f& b) {
    return values[static_cast<std::size_t>(t[0])] * (1.0f - b.x() - b.y()) +
           values[static_cast<std::size_t>(t[1])] * b.x() +
           values[static_cast<std::size_t>(t[2])] * b.y();
}

const Triangle& triangle_of(const Mesh& mesh, const Hit& hit) {
    return mesh.triangles[static_cast<std::size_t>(hit.triangle)];
}

}  // namespace

Hit Accel::nearest(const Vec3f& point, float max_distance) const {
    if (!impl_) return {};
    RTCPointQuery query;
    query.x = point.x();
    query.y = point.y();
    query.z = point.z();
    query.radius = max_distance;
    query.time = 0.0f;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    NearestQuery state{&parts_, point, {}};
    rtcPointQuery(impl_->scene, &query, &context, visit_triangle, &state);
    if (state.best.is_hit()) {
        state.best.normal = triangle_normal(*parts_[static_cast<std::size_t>(state.best.part)].mesh,
                                            static_cast<std::size_t>(state.best.triangle));
    }
    return state.best;
}

Vec3f hit_point(const Mesh& mesh, const Hit& hit) {
    return interpolate(mesh.vertices, triangle_of(mesh, hit), hit.barycentric);
}

Vec3f shading_normal(const Mesh& mesh, const Hit& hit) {
    if (mesh.normals.empty()) return hit.normal;
    const Vec3f n = interpolate(mesh.normals, triangle_of(mesh, hit), hit.barycentric).normalized();
    if (!n.allFinite()) return hit.normal;
    return n.dot(hit.normal) < 0.0f ? Vec3f(-n) : n;
}

Rgb interpolate_colour(const Mesh& mesh, const Hit& hit) {
    return interpolate(mesh.colours, triangle_of(mesh, hit), hit.barycentric);
}

Vec2f interpolate_uv(const Mesh& mesh, const Hit& hit) {
    return interpolate(mesh.uv, triangle_of(mesh, hit), hit.barycentric);
}

}  // namespace vitrine
