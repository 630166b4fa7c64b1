// reconstruct/tiny_world.h: a small table-top world of known truth, for the tests of this floor.
#pragma once

#include "capture/capture.h"
#include "geometry/mesh.h"
#include "reconstruct/scan.h"

#include <memory>
#include <vector>

namespace vitrine {

struct TinyWorldOptions {
    int views = 10;
    double arc_deg = 300;
    double nod_deg = 12;   ///< elevations lie around 35 degrees, up and down from view to view
    bool has_liar = true;  ///< a ball of 4 cm radius whose depth has holes and lies
    double depth_noise_m = 3e-4;
    int width = 240, height = 160;
};

struct TinyWorld {
    Capture capture;
    Mesh liar;                     ///< the ball, standing on the plane z = 0
    std::vector<Mask> liar_masks;  ///< its visible pixels per frame
};

/// A textured table at z = 0, two diffuse boxes and perhaps the liar, seen from around by exact
/// poses. Shading is a texture fixed to the surfaces; the liar shows a pattern that turns with the
/// view.
TinyWorld make_tiny_world(const TinyWorldOptions& options = {});

/// Six coarse views: enough for what does not ask for accuracy.
inline TinyWorldOptions small_tiny_world() {
    TinyWorldOptions options;
    options.views = 6;
    options.width = 160;
    options.height = 120;
    return options;
}

/// The world's poses are exact.
inline ScanOptions kept_poses() {
    ScanOptions options;
    options.poses = PoseMode::Keep;
    return options;
}

}  // namespace vitrine
