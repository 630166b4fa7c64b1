// benchmarks/runtime/ray_recorder.h: the rays that the renderer sends to Embree, as a list.
//
// Linking this file in puts its own `rtcIntersect1`, `rtcIntersect1M`, `rtcOccluded1` and
// `rtcOccluded1M` before
// Embree's: each passes its call on, and keeps the rays while a recording is on. So the list holds
// exactly what was asked, in its order, with its flags; nothing in the product knows of it. One
// thread only.
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
    std::size_t stream;  ///< rays of the call that this one begins; 0: it belongs to one before
};

/// Starts with an empty list.
void start_recording();
std::vector<RecordedRay> stop_recording();

struct ReplaySums {
    double distance = 0;  ///< of the hits: keeps the work from being left out
    std::size_t hits = 0;
};
/// Sends the rays of the list again, by the same calls.
ReplaySums replay(const std::vector<RecordedRay>& rays);
/// Sends all one by one, those of streams too.
ReplaySums replay_apart(const std::vector<RecordedRay>& rays);

}  // namespace vitrine
