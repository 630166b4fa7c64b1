#include "render/render_image.h"

#include "base/parallel.h"

namespace vitrine {

Geometry render_geometry(const RenderScene& scene, const Camera& camera, std::uint32_t view) {
    Geometry geometry{ImageF(camera.width, camera.height), ImageRgb(camera.width, camera.height),
                      ImageRgb(camera.width, camera.height),
                      Image<int>(camera.width, camera.height, -1)};
    const Vec3f origin = camera.centre_in_world().cast<float>();
    const Vec3f forward = camera.cam_from_world.rotation.row(2).transpose().cast<float>();
    parallel_for(static_cast<std::size_t>(camera.height), 4, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < camera.width; ++x) {
            const Vec3f direction = camera.ray_in_world(x, y).cast<float>();
            const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, view});
            if (!hit.is_hit()) continue;
            const ShadingPoint point = scene.surface(hit, direction);
            geometry.z_m(x, y) = hit.distance * direction.dot(forward);
            geometry.normal(x, y) = point.shading_normal.array();
            geometry.albedo(x, y) = scene.diffuse_albedo(hit.part, hit);
            geometry.part(x, y) = hit.part;
        }
    });
    return geometry;
}

double pixel_radius(const RenderScene& scene, const Camera& camera) {
    const Vec3 target = scene.bounding_sphere().centre.cast<double>();
    double distance = (camera.centre_in_world() - target).norm();
    // The parts that bend light say better where caustics are than the whole room does.
    double sum = 0;
    int count = 0;
    for (const Part& part : scene.scene().parts) {
        if (std::holds_alternative<Diffuse>(part.material) || part.mesh->empty()) continue;
        sum += (camera.centre_in_world() - bounds(*part.mesh).centre()).norm();
        ++count;
    }
    if (count > 0) distance = sum / count;
    return 0.5 * distance / std::max(camera.fx, camera.fy);
}

RenderedImage render_image(const RenderScene& scene, const Camera& camera,
                           const CausticMaps* caustics, const FinalOptions& options,
                           const Progress& progress) {
    RenderedImage image{ImageRgb(camera.width, camera.height), ImageF(camera.width, camera.height)};
    TranslucentLightOptions translucent_options;
    translucent_options.seed = options.seed;
    const TranslucentLight translucent =
        light_translucent_bodies(scene, caustics, options.paths, translucent_options);
    const PathTracer tracer(scene, caustics, options.paths, &translucent);
    const Vec3f origin = camera.centre_in_world().cast<float>();
    const int n = options.samples_per_pixel;
    constexpr int kBand = 16;  // rows between two progress reports
    for (int band = 0; band < camera.height; band += kBand) {
        const int rows = std::min(kBand, camera.height - band);
        parallel_for(static_cast<std::size_t>(rows), 1, [&](std::size_t row) {
            const int y = band + static_cast<int>(row);
            for (int x = 0; x < camera.width; ++x) {
                Rgbd sum = Rgbd::Zero();
                double square = 0;
                for (int s = 0; s < n; ++s) {
                    const PathSampler sampler(stream_key(options.seed, unsigned(x), unsigned(y)),
                                              static_cast<std::uint32_t>(s));
                    const Vec2f jitter = sampler.pair(0, 0);
                    const Vec3f direction =
                        camera.ray_in_world(x + jitter.x() - 0.5, y + jitter.y() - 0.5)
                            .cast<float>();
                    const Rgb value = tracer.trace(origin, direction, sampler, kAllParts).total();
                    sum += value.cast<double>();
                    square += static_cast<double>(luminance(value)) * luminance(value);
                }
                const Rgbd mean = sum / n;
                image.radiance(x, y) = mean.cast<float>();
                const double l = luminance(mean);
                image.variance(x, y) =
                    n > 1 ? static_cast<float>(std::max(0.0, square / n - l * l) / (n - 1)) : 0.0f;
            }
        });
        progress.update(static_cast<double>(band + rows) / camera.height, "render");
    }
    return image;
}

RenderedImage render_image(const RenderScene& scene, const Camera& camera,
                           const FinalOptions& options, const Progress& progress) {
    if (!options.use_photons) return render_image(scene, camera, nullptr, options, progress);
    CausticOptions caustic_options = options.caustics;
    if (caustic_options.gather_radius_m <= 0) {
        caustic_options.gather_radius_m = pixel_radius(scene, camera);
    }
    const CausticPhotons photons = trace_caustics(scene, caustic_options, progress.part(0.0, 0.15));
    const CausticMaps maps = build_caustic_maps(photons.photons, caustic_options.gather_radius_m);
    return render_image(scene, camera, &maps, options, progress.part(0.15, 1.0));
}

}  // namespace vitrine
