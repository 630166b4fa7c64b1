// reconstruct/single_view.h: what one picture alone tells about glass and metal: where something
// stands that gives no depth, and its outline. No shape: that takes views from around.
#pragma once

#include "capture/capture.h"
#include "geometry/plane.h"
#include "reconstruct/silhouette_cut.h"

#include <string>
#include <vector>

namespace vitrine {

/// A thing without depth in one picture.
struct Outline {
    std::string frame;  ///< id
    Mask silhouette;
    PixelBox box;          ///< of the silhouette
    std::string evidence;  ///< one plain sentence
};

struct OutlineOptions {
    double min_thickness_m = 0.016;  ///< thinner streaks without depth are shadows of depth edges
    double max_island_m = 0.08;      ///< readings through an opening, inside the region
    double min_size_m = 0.02;        ///< square root of the region's area
    double max_size_m = 0.35;
    double min_rim_on_plane = 0.4;  ///< share of the lower rim's readings that lie on the plane
};

/// Figures that edges of colour draw on the support plane (figures.h) and that hold missing depth,
/// and missing depth beside them that is no shadow of the sensor; their outlines by minimum cut
/// with colour and depth (silhouette_cut.h); what touches is cut in two where its contour is
/// pinched. Dark or oblique things without depth look the same in one view: each outline says so.
/// Cost: about 2 s for 1280x720.
std::vector<Outline> find_outlines(const RgbdFrame& frame, const Camera& camera,
                                   const Plane& support, double saturation_level,
                                   const OutlineOptions& options = {});

}  // namespace vitrine
