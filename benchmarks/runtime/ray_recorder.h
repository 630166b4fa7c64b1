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

/// Rays sent by one call, or by neighbouring calls of a ray each that are alike.
struct RecordedCall {
    RTCScene scene;
    RTCIntersectContext context;
    bool is_occlusion;
    bool is_stream;     ///< by one call, else one by one
    std::size_t count;  ///< of rays
};

/// Rays lie packed, so that to read them costs next to nothing.
struct RecordedRays {
    std::vector<RTCRay> rays;  ///< as they were handed in
    std::vector<RecordedCall> calls;
};

/// Starts with an empty list.
void start_recording();
RecordedRays stop_recording();

struct ReplaySums {
    double distance = 0;  ///< of the hits: keeps the work from being left out
    std::size_t hits = 0;
};
/// Sends the rays of the list again, by the same calls.
ReplaySums replay(const RecordedRays& recorded);
/// Sends all one by one, those of streams too.
ReplaySums replay_apart(const RecordedRays& recorded);

}  // namespace vitrine
