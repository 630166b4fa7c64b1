// reconstruct/candidate_views.h: what every view knows before and while outlines are drawn: the
// scene without the candidates, what it hides, and how it would look behind them.
#pragma once

#include "reconstruct/appearance.h"
#include "reconstruct/candidates.h"
#include "reconstruct/depth_classes.h"
#include "reconstruct/silhouette_cut.h"
#include "reconstruct/support_surface.h"
#include "trace/accel.h"

#include <memory>

namespace vitrine {

/// The capture's frames with everything that does not change while outlines are refined.
struct SceneViews {
    const Capture* capture = nullptr;
    const Scan* scan = nullptr;
    SupportSurface support;
    Accel background;                        ///< scan without the candidates, plane closed
    std::vector<ImageF> background_depth_m;  ///< of it, per frame
    std::vector<DepthClasses> classes;       ///< of the measured depth against it, per frame
    std::size_t count() const { return background_depth_m.size(); }
};

/// Leaves out what the scan holds inside `bodies` (world boxes of the candidates, already grown)
/// above the plane.
SceneViews make_scene_views(const Capture& capture, const Scan& scan,
                            const std::vector<Box3>& bodies, double max_depth_m);

/// Renders a body into all views: where it is expected, where nearer things hide it.
struct BodyImage {
    ImageF depth_m;  ///< front of the body; 0 beside it
    Mask expected;   ///< empty when fewer than 30 pixels see it
    Mask hidden;     ///< a little wider than the body: its outline cannot be told from there
};
std::vector<BodyImage> render_body(const SceneViews& views, const Mesh& body, const Mesh& grown);

/// Colours that the other views predict behind an object, inside `box` of view `index`.
/// @param occupied per view: pixels that show any candidate, to be left out as evidence
void predict_background(const SceneViews& views, const std::vector<Mask>& occupied,
                        std::size_t index, const PixelBox& box, ImageRgb& colour, Mask& known);

}  // namespace vitrine
