// scene/relief.h: the object of one photograph as a height field, and the lights on it.
//
// Viewer frame: x right, y UP, z toward the viewer, the view direction is (0, 0, 1), orthographic.
// Lengths in pixels of the photograph: pixel (column, row) is the point (column, -row).
#pragma once

#include "image/image.h"

#include <cstdint>
#include <string>
#include <vector>

namespace vitrine {

/// One round body of a cluster: a berry, a tomato, an egg in a box.
struct Ball {
    Vec3f centre_px = Vec3f::Zero();  ///< viewer frame: (column, -row, height)
    float radius_px = 0;
    /// Of the outline, for what the picture shows of it: the radius at angle t from x toward y is
    /// radius_px (1 + x cos 2t + y sin 2t). Berries are rarely quite round. Shadows and the light
    /// inside take the ball for round.
    Vec2f oval = Vec2f::Zero();
    bool is_mostly_hidden = false;  ///< by those before it: where it lies is known less well
};

struct Relief {
    Mask mask;                  ///< 255 where there is an object
    ImageF depth_px;            ///< height above the silhouette plane z = 0; 0 outside
    ImageF middle_px;           ///< height about which the back mirrors the front; empty: 0
    Image<Vec3f> normals;       ///< unit, viewer frame; (0, 0, 1) outside
    Image<Vec3f> base_normals;  ///< of the smooth base without shading detail; empty: use `normals`
    double inradius_px = 0;     ///< of the mask: the unit of every length parameter
    /// Heights are known, not guessed from silhouette and shading: where they jump, a nearer part
    /// hides its own side.
    bool is_measured = false;

    /// A cluster: light travels inside each ball, not from one to the next. Empty: one body, its
    /// back the mirror of its front.
    std::vector<Ball> balls;
    /// Behind those: what no pixel shows, a guess. They only cast shadows.
    std::vector<Ball> unseen_balls;
    Image<std::int16_t> ball_of;  ///< which ball a pixel shows; -1: none. Empty without balls
    /// How much of the light on them the balls throw back, on each other too. 0: they do not.
    Rgbd ball_albedo = Rgbd::Zero();

    /// Height of the unseen back.
    float back_px(int x, int y) const {
        return middle_px.empty() ? -depth_px(x, y) : 2 * middle_px(x, y) - depth_px(x, y);
    }
    /// Outward normal of the unseen back: the front's, mirrored, turned by the slope of the middle.
    Vec3f back_normal(int x, int y) const {
        const Vec3f n = normals(x, y);
        if (middle_px.empty()) return {n.x(), n.y(), -n.z()};
        const auto slope = [&](int x0, int y0, int x1, int y1) {
            const float run = static_cast<float>(std::abs(x1 - x0) + std::abs(y1 - y0));
            if (run == 0) return 0.0f;
            return (middle_px(x1, y1) - middle_px(x0, y0)) / run;
        };
        const auto inside = [&](int u, int v) {
            return mask.contains(u, v) && is_inside(mask, u, v);
        };
        const float mx = slope(inside(x - 1, y) ? x - 1 : x, y, inside(x + 1, y) ? x + 1 : x, y);
        const float my = slope(x, inside(x, y + 1) ? y + 1 : y, x, inside(x, y - 1) ? y - 1 : y);
        const float nz = std::max(n.z(), 0.05f);
        return Vec3f(2 * mx + n.x() / nz, 2 * my + n.y() / nz, -1).normalized();
    }
    bool is_cluster() const { return !balls.empty(); }
    Vec3f point(int x, int y) const {
        return {static_cast<float>(x), static_cast<float>(-y), depth_px(x, y)};
    }
};

/// A distant light in the viewer frame. Directions with z < 0 shine from behind.
struct ViewLight {
    Vec3 direction = Vec3(0, 0, 1);  ///< unit, toward the light
    Rgbd intensity = Rgbd::Ones();   ///< irradiance on a surface facing it
};

/// All light on an object: distant lights and a constant from everywhere.
///
/// R_d and light are only known up to a common factor, so intensities are scaled such that the
/// brightest front-facing surface gets irradiance pi: a white Lambertian there shows 1.
struct ViewLights {
    std::vector<ViewLight> lights;
    Rgbd ambient = Rgbd::Zero();  ///< irradiance
    /// Irradiance, on a surface that faces down, of the light that the ground throws back: an even
    /// half-space of light about (0, -1, 0).
    Rgbd from_below = Rgbd::Zero();

    double total() const {
        double sum = luminance(ambient) + 0.5 * luminance(from_below);
        for (const ViewLight& light : lights) sum += luminance(light.intensity);
        return sum;
    }
};

}  // namespace vitrine
