// estimate/test_table.h: scenes of tests: cameras in a ring around a table, and what they see.
#pragma once

#include "capture/capture.h"
#include "render/estimation_scene.h"
#include "scene/scene.h"

#include <cmath>
#include <string>
#include <vector>

namespace vitrine {

/// `count` cameras 0.6 m around and 0.5 m above the origin, all looking at it.
inline std::vector<Camera> cameras_around_table(int count, int width, int height, double focal_px) {
    std::vector<Camera> cameras;
    for (int k = 0; k < count; ++k) {
        const double angle = 2.0 * kPi * k / count;
        Camera camera;
        camera.width = width;
        camera.height = height;
        camera.fx = camera.fy = focal_px;
        camera.cx = 0.5 * (width - 1);
        camera.cy = 0.5 * (height - 1);
        camera.cam_from_world = look_at(Vec3(0.6 * std::cos(angle), 0.6 * std::sin(angle), 0.5),
                                        Vec3::Zero(), Vec3(0, 0, 1))
                                    .inverse();
        cameras.push_back(camera);
    }
    return cameras;
}

/// One frame per camera. `shade(points, hits)` gives the radiance of all pixels of a frame that
/// meet the scan; the others stay black.
template <typename Shade>
std::vector<RgbdFrame> shaded_frames(const Scene& scene, const Shade& shade) {
    const EstimationScene world(scene);
    std::vector<RgbdFrame> frames;
    for (const Camera& camera : scene.cameras) {
        RgbdFrame frame;
        frame.id = std::to_string(frames.size());
        frame.camera = camera;
        frame.colour = ImageRgb(camera.width, camera.height);
        std::vector<SurfacePoint> points;
        std::vector<Hit> hits;
        std::vector<std::size_t> pixels;
        const Vec3f eye = camera.centre_in_world().cast<float>();
        for (int v = 0; v < camera.height; ++v)
            for (int u = 0; u < camera.width; ++u) {
                const Hit hit = world.accel().closest(
                    {eye, camera.ray_in_world(u, v).cast<float>(), 0.0f, 1e30f, kAllMask});
                if (!hit.is_hit()) continue;
                points.push_back({hit_point(world.mesh(hit.part), hit), hit.normal});
                hits.push_back(hit);
                pixels.push_back(static_cast<std::size_t>(v * camera.width + u));
            }
        const std::vector<Rgb> radiance = shade(world, points, hits);
        for (std::size_t i = 0; i < pixels.size(); ++i) frame.colour[pixels[i]] = radiance[i];
        frames.push_back(std::move(frame));
    }
    return frames;
}

}  // namespace vitrine
