#include "ray_recorder.h"

#include <dlfcn.h>

namespace vitrine {
namespace {

bool is_recording = false;
std::vector<RecordedRay> list;

using Intersect = void (*)(RTCScene, RTCIntersectContext*, RTCRayHit*);
using Occluded = void (*)(RTCScene, RTCIntersectContext*, RTCRay*);
const auto embree_intersect = reinterpret_cast<Intersect>(dlsym(RTLD_NEXT, "rtcIntersect1"));
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

ReplaySums replay(const std::vector<RecordedRay>& rays) {
    ReplaySums sums;
    RTCRayHit hit;
    for (const RecordedRay& recorded : rays) {
        RTCIntersectContext context = recorded.context;
        if (recorded.is_occlusion) {
            RTCRay ray = recorded.ray;
            embree_occluded(recorded.scene, &context, &ray);
            sums.hits += ray.tfar < 0 ? 1 : 0;
            continue;
        }
        hit.ray = recorded.ray;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        embree_intersect(recorded.scene, &context, &hit);
        if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
        ++sums.hits;
        sums.distance += hit.ray.tfar;
    }
    return sums;
}

}  // namespace vitrine

extern "C" void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* hit) {
    if (vitrine::is_recording) vitrine::list.push_back({hit->ray, scene, *context, false});
    vitrine::embree_intersect(scene, context, hit);
}

extern "C" void rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
    if (vitrine::is_recording) vitrine::list.push_back({*ray, scene, *context, true});
    vitrine::embree_occluded(scene, context, ray);
}
