#include "ray_recorder.h"

#include <dlfcn.h>

namespace vitrine {
namespace {

bool is_recording = false;
std::vector<RecordedRay> list;

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
    list.clear();
    is_recording = true;
}

std::vector<RecordedRay> stop_recording() {
    is_recording = false;
    return std::move(list);
}

namespace {

RTCRayHit start_of(const RecordedRay& recorded) {
    RTCRayHit hit;
    hit.ray = recorded.ray;
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

void send_one(const RecordedRay& recorded, ReplaySums& sums) {
    RTCIntersectContext context = recorded.context;
    if (recorded.is_occlusion) {
        RTCRay ray = recorded.ray;
        embree_occluded(recorded.scene, &context, &ray);
        count(ray, sums);
        return;
    }
    RTCRayHit hit = start_of(recorded);
    embree_intersect(recorded.scene, &context, &hit);
    count(hit, sums);
}

}  // namespace

ReplaySums replay(const std::vector<RecordedRay>& rays) {
    ReplaySums sums;
    std::vector<RTCRayHit> hits;
    std::vector<RTCRay> shadows;
    for (std::size_t i = 0; i < rays.size(); i += rays[i].stream) {
        const RecordedRay& first = rays[i];
        if (first.stream == 1) {
            send_one(first, sums);
            continue;
        }
        RTCIntersectContext context = first.context;
        if (first.is_occlusion) {
            shadows.resize(first.stream);
            for (std::size_t k = 0; k < shadows.size(); ++k) shadows[k] = rays[i + k].ray;
            embree_occluded_stream(first.scene, &context, shadows.data(), first.stream,
                                   sizeof(RTCRay));
            for (const RTCRay& ray : shadows) count(ray, sums);
            continue;
        }
        hits.resize(first.stream);
        for (std::size_t k = 0; k < hits.size(); ++k) hits[k] = start_of(rays[i + k]);
        embree_stream(first.scene, &context, hits.data(), first.stream, sizeof(RTCRayHit));
        for (const RTCRayHit& hit : hits) count(hit, sums);
    }
    return sums;
}

ReplaySums replay_apart(const std::vector<RecordedRay>& rays) {
    ReplaySums sums;
    for (const RecordedRay& ray : rays) send_one(ray, sums);
    return sums;
}

}  // namespace vitrine

extern "C" void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* hit) {
    if (vitrine::is_recording) vitrine::list.push_back({hit->ray, scene, *context, false, 1});
    vitrine::embree_intersect(scene, context, hit);
}

extern "C" void rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
    if (vitrine::is_recording) vitrine::list.push_back({*ray, scene, *context, true, 1});
    vitrine::embree_occluded(scene, context, ray);
}

extern "C" void rtcIntersect1M(RTCScene scene, RTCIntersectContext* context, RTCRayHit* hits,
                               unsigned count, std::size_t stride) {
    for (unsigned i = 0; vitrine::is_recording && i < count; ++i) {
        vitrine::list.push_back({hits[i].ray, scene, *context, false, i == 0 ? count : 0});
    }
    vitrine::embree_stream(scene, context, hits, count, stride);
}

extern "C" void rtcOccluded1M(RTCScene scene, RTCIntersectContext* context, RTCRay* rays,
                              unsigned count, std::size_t stride) {
    for (unsigned i = 0; vitrine::is_recording && i < count; ++i) {
        vitrine::list.push_back({rays[i], scene, *context, true, i == 0 ? count : 0});
    }
    vitrine::embree_occluded_stream(scene, context, rays, count, stride);
}
