// reconstruct/appearance.h: the colour of a surface as most of its views see it.
#pragma once

#include "capture/capture.h"
#include "trace/accel.h"

#include <span>
#include <vector>

namespace vitrine {

/// Measured depth and colour agree about a point only if nothing stands before it.
struct ViewOfScene {
    const RgbdFrame* frame = nullptr;
    const Camera* camera = nullptr;
    const ImageF* model_depth_m = nullptr;  ///< depth of the scene's surface in this view
    const Mask* excluded = nullptr;         ///< pixels that show something else; may be null
};

/// Median linear radiance over the views that see a point within 75 degrees of its normal, each
/// channel by itself: a highlight or a saturated pixel in a minority of the views has no say.
/// @return false when fewer than `min_views` see it.
bool median_colour(const Vec3& point, const Vec3& normal, std::span<const ViewOfScene> views,
                   std::size_t min_views, Rgb& colour);

/// Gives vertices with `known` = 0 the mean colour of their neighbours, ring by ring from outside
/// in.
void spread_colours(const Mesh& mesh, std::vector<Rgb>& colours, std::vector<std::uint8_t> known);

/// Vertex colours by `median_colour`; vertices seen by no view take the mean of their neighbours.
/// Cost: about 0.2 us a vertex and view.
std::vector<Rgb> vertex_colours(const Mesh& mesh, std::span<const ViewOfScene> views);

}  // namespace vitrine
