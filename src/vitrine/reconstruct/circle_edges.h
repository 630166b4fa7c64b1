// reconstruct/circle_edges.h: edge points and circles as the search for balls sees them, in a
// shrunk picture, rows down. For balls.cpp and ball_stack.cpp.
#pragma once

#include "math/vector.h"
#include "scene/relief.h"

namespace vitrine {

constexpr double kAligned = 0.92;  ///< cosine between an edge's normal and the radius

/// An edge point at working size: where it lies and which way brightness (or the mask) changes.
struct EdgePoint {
    Vec2 at = Vec2::Zero(), normal = Vec2::Zero();
    bool is_used = false;
    bool is_border = false;  ///< of the mask
};

struct Circle {
    Vec2 centre = Vec2::Zero();
    double radius = 0;
    double support = 0;  ///< share of the circumference that follows an edge
};

/// Pixel centres of the picture and of its shrunk copy.
inline double to_small(double full, double shrink) { return (full + 0.5) * shrink - 0.5; }
inline double to_full(double small, double shrink) { return (small + 0.5) / shrink - 0.5; }

/// Centre of a ball in the shrunk picture, rows down.
inline Vec2 small_centre(const Ball& ball, double shrink) {
    return {to_small(ball.centre_px.x(), shrink), to_small(-ball.centre_px.y(), shrink)};
}

inline bool lies_on(const EdgePoint& point, const Circle& circle, double tolerance,
                    double aligned) {
    const Vec2 v = point.at - circle.centre;
    const double distance = v.norm();
    return std::abs(distance - circle.radius) < tolerance && distance > 0 &&
           std::abs(v.dot(point.normal)) > aligned * distance;
}

}  // namespace vitrine
