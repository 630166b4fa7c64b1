// benchmarks/runtime/ray_recorder.h: the rays that the renderer sends to Embree, as a list.
//
// Linking this file in puts its own `rtcIntersect1` and `rtcOccluded1` before Embree's: each passes
// its call on, and keeps the ray while a recording is on. So the list holds exactly what was
// asked, in its order, with its flags; nothing in the product knows of it. One thread only.
#pragma once

#include <embree3/rtcore.h>

#include <cstddef>
#include <vector>

namespace vitrine {

struct RecordedRay {
    RTCRay ray;  ///< as it was handed in
    RTCScene scene;
    RTCIntersectContext context;
    bool is_occlusion;
};

/// Starts with an empty list.
void start_recording();
std::vector<RecordedRay> stop_recording();

struct ReplaySums {
    double distance = 0;  ///< of the hits: keeps the work from being left out
    std::size_t hits = 0;
};
/// Sends the rays of the list again, one by one.
ReplaySums replay(const std::vector<RecordedRay>& rays);

}  // namespace vitrine
