#include "reconstruct/tiny_world.h"

#include "base/rng.h"
#include "geometry/primitives.h"
#include "trace/depth_map.h"

#include <cmath>

namespace vitrine {
namespace {

constexpr int kLiar = 3;

Rgb texture(const Vec3& p) {
    const auto wave = [&](double fx, double fy, double fz, double phase) {
        return std::sin(fx * p.x() + fy * p.y() + fz * p.z() + phase);
    };
    const double a = wave(61, 37, 53, 0.3) * wave(-29, 71, 31, 1.1);
    const double b = wave(17, -23, 41, 2.0) * wave(43, 11, -67, 0.7);
    // Blotches of random brightness give corners to hold on to.
    const auto cell = [](double v) { return static_cast<std::int64_t>(std::floor(v / 0.017)); };
    const std::uint64_t key = stream_key(3, cell(p.x() + 0.3 * p.y()), cell(p.y()), cell(p.z()));
    const float blotch = 0.75f + 0.5f * Rng(key).next_float();
    return blotch * Rgb(static_cast<float>(0.4 + 0.2 * a), static_cast<float>(0.4 + 0.2 * b),
                        static_cast<float>(0.35 + 0.1 * (a + b)));
}

/// Holes over about half of the liar, different in every view.
bool is_hole(int view, int x, int y) {
    return std::sin(0.55 * x + 1.3 * view) * std::sin(0.49 * y + 2.1 * view) > 0.0;
}

void add_view(const Accel& accel, const Camera& camera, int index, double noise_m,
              TinyWorld& world) {
    RgbdFrame frame;
    frame.id = camera.id;
    frame.timestamp_s = index;
    frame.camera = camera;
    frame.colour = ImageRgb(camera.width, camera.height);
    frame.depth_m = ImageF(camera.width, camera.height);
    Mask mask(camera.width, camera.height);
    Rng rng(stream_key(5, index));
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const Hit hit = accel.closest(camera_ray(camera, x, y));
            const auto noise = static_cast<float>(noise_m * (2 * rng.next_double() - 1) * 1.7);
            if (!hit.is_hit()) continue;
            const auto part = static_cast<std::size_t>(hit.part);
            const Vec3 p = hit_point(*accel.parts()[part].mesh, hit).cast<double>();
            if (hit.part == kLiar) {
                mask(x, y) = 255;
                const Vec3 n = hit.normal.cast<double>();
                frame.colour(x, y) = texture(0.3 * n + Vec3(0.1 * index, 0, 0)) + 0.15f;
                frame.depth_m(x, y) = is_hole(index, x, y) ? 0.0f : hit.distance + 0.05f;
            } else {
                frame.colour(x, y) = texture(p);
                frame.depth_m(x, y) = hit.distance + noise;
            }
        }
    }
    world.capture.frames.push_back(std::move(frame));
    world.liar_masks.push_back(std::move(mask));
}

}  // namespace

TinyWorld make_tiny_world(const TinyWorldOptions& options) {
    TinyWorld world;
    world.capture.name = "tiny world";
    world.capture.has_poses = true;
    world.liar = make_sphere(0.04, Vec3(0, 0, 0.0405), 32);
    const auto shared = [](Mesh mesh) { return std::make_shared<const Mesh>(std::move(mesh)); };
    std::vector<AccelPart> parts = {
        {shared(make_plane(1.0, 0, 4))},
        {shared(make_box(Vec3(0.08, 0.06, 0.1), Vec3(0.17, 0.05, 0.05)))},
        {shared(make_box(Vec3(0.1, 0.1, 0.05), Vec3(-0.12, -0.16, 0.025)))}};
    if (options.has_liar) parts.push_back({shared(world.liar)});
    const Accel accel(parts);
    for (int i = 0; i < options.views; ++i) {
        const double azimuth = radians(options.arc_deg) * i / std::max(1, options.views - 1);
        const double elevation = radians(35 + options.nod_deg * std::sin(1.7 * i));
        const Vec3 eye = 0.6 * Vec3(std::cos(azimuth) * std::cos(elevation),
                                    std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
        Camera camera;
        camera.id = fmt::format("{:06d}", i);
        camera.width = options.width;
        camera.height = options.height;
        camera.fx = camera.fy = 0.85 * options.width;
        camera.cx = 0.5 * (options.width - 1);
        camera.cy = 0.5 * (options.height - 1);
        camera.cam_from_world = look_at(eye, Vec3(0, 0, 0.02), Vec3::UnitZ()).inverse();
        add_view(accel, camera, i, options.depth_noise_m, world);
    }
    return world;
}

}  // namespace vitrine
