#include "ray_recorder.h"

#include <dlfcn.h>

namespace vitrine {
namespace {

bool is_recording = false;
RecordedRays list;

using Intersect = void (*)(RTCScene, RTCIntersectContext*, RTCRayHit*);
using Occluded = void (*)(RTCScene, RTCIntersectContext*, RTCRay*);
const auto embree_intersect = reinterpret_cast<Intersect>(dlsym(RTLD_NEXT, "rtcIntersect1"));
using Stream = void (*)(RTCScene, RTCIntersectContext*, RTCRayHit*, unsigned, std::size_t);
const auto embree_stream = reinterpret_cast<Stream>(dlsym(RTLD_NEXT, "rtcIntersect1M"));
using OccludedStream = void (*)(RTCScene, RTCIntersectContext*, RTCRay*, unsigned, std::size_t);
const auto embree_occluded_stream =
    reinterpret_cast<OccludedStream>(dlsym(RTLD_NEXT, "rtcOccluded1M"));
const auto embree_occluded = reinterpret_cast<Occluded>(dlsym(RTLD_NEXT, "rtcOccluded1"));

}  // namespace

void start_recording() {
    list = {};
    is_recording = true;
}

RecordedRays stop_recording() {
    is_recording = false;
    return std::move(list);
}

/// @param first of the rays, which begin items of `stride` bytes
void record(const RecordedCall& call, const RTCRay* first, std::size_t stride) {
    const auto* at = reinterpret_cast<const std::byte*>(first);
    for (std::size_t i = 0; i < call.count; ++i, at += stride) {
        list.rays.push_back(*reinterpret_cast<const RTCRay*>(at));
    }
    if (!call.is_stream && !list.calls.empty()) {
        RecordedCall& last = list.calls.back();
        if (!last.is_stream && last.scene == call.scene && last.is_occlusion == call.is_occlusion &&
            last.context.flags == call.context.flags) {
            last.count += call.count;
            return;
        }
    }
    list.calls.push_back(call);
}

namespace {

RTCRayHit start_of(const RTCRay& ray) {
    RTCRayHit hit;
    hit.ray = ray;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return hit;
}

void count(const RTCRayHit& hit, ReplaySums& sums) {
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return;
    ++sums.hits;
    sums.distance += hit.ray.tfar;
}

void count(const RTCRay& ray, ReplaySums& sums) { sums.hits += ray.tfar < 0 ? 1 : 0; }

void send_one(const RecordedCall& call, const RTCRay& recorded, ReplaySums& sums) {
    RTCIntersectContext context = call.context;
    if (call.is_occlusion) {
        RTCRay ray = recorded;
        embree_occluded(call.scene, &context, &ray);
        count(ray, sums);
        return;
    }
    RTCRayHit hit = start_of(recorded);
    embree_intersect(call.scene, &context, &hit);
    count(hit, sums);
}

void send_stream(const RecordedCall& call, const RTCRay* rays, std::vector<RTCRayHit>& hits,
                 std::vector<RTCRay>& shadows, ReplaySums& sums) {
    RTCIntersectContext context = call.context;
    const auto number = static_cast<unsigned>(call.count);
    if (call.is_occlusion) {
        shadows.assign(rays, rays + call.count);
        embree_occluded_stream(call.scene, &context, shadows.data(), number, sizeof(RTCRay));
        for (const RTCRay& ray : shadows) count(ray, sums);
        return;
    }
    hits.resize(call.count);
    for (std::size_t k = 0; k < call.count; ++k) hits[k] = start_of(rays[k]);
    embree_stream(call.scene, &context, hits.data(), number, sizeof(RTCRayHit));
    for (const RTCRayHit& hit : hits) count(hit, sums);
}

}  // namespace

ReplaySums replay(const RecordedRays& recorded) {
    ReplaySums sums;
    std::vector<RTCRayHit> hits;
    std::vector<RTCRay> shadows;
    const RTCRay* rays = recorded.rays.data();
    for (const RecordedCall& call : recorded.calls) {
        if (call.is_stream) send_stream(call, rays, hits, shadows, sums);
        for (std::size_t k = 0; !call.is_stream && k < call.count; ++k) {
            send_one(call, rays[k], sums);
        }
        rays += call.count;
    }
    return sums;
}

ReplaySums replay_apart(const RecordedRays& recorded) {
    ReplaySums sums;
    const RTCRay* rays = recorded.rays.data();
    for (const RecordedCall& call : recorded.calls) {
        for (std::size_t k = 0; k < call.count; ++k) send_one(call, *rays++, sums);
    }
    return sums;
}

}  // namespace vitrine

// In a run that is measured these cost a test each.

extern "C" void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* hit) {
    if (vitrine::is_recording) vitrine::record({scene, *context, false, false, 1}, &hit->ray, 0);
    vitrine::embree_intersect(scene, context, hit);
}

extern "C" void rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
    if (vitrine::is_recording) vitrine::record({scene, *context, true, false, 1}, ray, 0);
    vitrine::embree_occluded(scene, context, ray);
}

extern "C" void rtcIntersect1M(RTCScene scene, RTCIntersectContext* context, RTCRayHit* hits,
                               unsigned count, std::size_t stride) {
    if (vitrine::is_recording) {
        vitrine::record({scene, *context, false, true, count}, &hits->ray, stride);
    }
    vitrine::embree_stream(scene, context, hits, count, stride);
}

extern "C" void rtcOccluded1M(RTCScene scene, RTCIntersectContext* context, RTCRay* rays,
                              unsigned count, std::size_t stride) {
    if (vitrine::is_recording) {
        vitrine::record({scene, *context, true, true, count}, rays, stride);
    }
    vitrine::embree_occluded_stream(scene, context, rays, count, stride);
}
