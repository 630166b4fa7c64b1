// reconstruct/balls.h: clusters of round bodies (grapes, cherries, tomatoes) in one photograph.
#pragma once

#include "scene/relief.h"

namespace vitrine {

struct BallOptions {
    double min_radius = 0.30;  ///< of a ball, in inradii of the whole mask
    double max_radius = 1.10;
    double min_support = 0.60;  ///< share of a circle that must follow an edge of the picture
    double min_cover = 0.65;    ///< share of the mask that the balls must cover to be a cluster
    int min_count = 4;
};

/// Circles whose outline the picture shows (Hough, then refined on the edge points), best first;
/// empty unless they make up the object: one round body, a head or a bust is no cluster.
///
/// Heights: where two circles overlap, the one whose outline shows there is in front, and the
/// balls touch; the differences of height are solved by least squares. Lengths in pixels.
std::vector<Ball> find_balls(const ImageRgb& picture, const Mask& mask,
                             const BallOptions& options = {});

/// Depth, normals and the ball seen at each pixel. Pixels of the mask that no ball covers keep the
/// nearest ball's normal and belong to none.
Relief relief_of_balls(const Mask& mask, std::vector<Ball> balls);

}  // namespace vitrine
