// reconstruct/visual_hull.h: the largest body that all silhouettes allow.
#pragma once

#include "geometry/camera.h"
#include "geometry/plane.h"
#include "geometry/scalar_grid.h"
#include "image/image.h"

#include <span>

namespace vitrine {

/// One silhouette as a distance: pixels to the outline, positive outside. Hidden pixels count as
/// inside: they say nothing.
struct OutlineView {
    const Camera* camera = nullptr;
    ImageF distance_px;
    bool is_used = true;
};

/// Smoothed over about a pixel, so that the steps between pixels leave no steps on the hull.
OutlineView outline_view(const Camera& camera, const Mask& silhouette, const Mask& hidden);

/// Distance in metres by which the view pushes a point out of the body (positive) or leaves it
/// inside (negative): outline distance times z / f. False when the view does not see the point.
bool outline_distance(const OutlineView& view, const Vec3& point, double& distance_m);

/// phi(x) = largest outline distance over the used views: negative inside, about 1-Lipschitz.
/// Nodes that fewer than two views see stay outside. Cost: about 10 ns a node and view.
ScalarGrid carve(std::span<const OutlineView> views, const Box3& box, double spacing_m);

/// Closed mesh of `phi + offset_m < 0`, smoothed by `sigma_nodes`, cut off just above the support
/// plane; its largest piece only.
Mesh hull_mesh(const ScalarGrid& phi, double offset_m, double sigma_nodes, const Plane& support);

}  // namespace vitrine
