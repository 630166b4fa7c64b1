#include "render/render_image.h"

#include "base/error.h"
#include "base/parallel.h"
#include "render/path_group.h"
#include "render/pixel_samples.h"
#include "render/sample_plan.h"

namespace vitrine {

FinalOptions picture_options() {
    FinalOptions options;
    options.samples_per_pixel = 16;
    options.max_samples_per_pixel = 256;
    options.noise_target = 0.02;
    options.soft_samples_per_pixel = 8;
    options.caustics.gather_radius_m = 0;
    return options;
}

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
            const Hit hit = scene.closest({origin, direction, 0.0f, 1e30f, view});
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

namespace {

/// A pixel darker than this share of the picture's mean need not be known better than that is.
constexpr double kDarkShare = 0.1;

/// Rows that a thread takes at once.
constexpr std::size_t kRows = 2;

/// Fewer paths in a pass would say nothing of their spread.
constexpr int kMinPassSamples = 4;

/// Sums over the samples of one pixel.
struct PixelSum {
    Rgbd sum = Rgbd::Zero();
    double square = 0;  // of the luminance
    int count = 0;

    void add(const PathResult& path) {
        ++count;
        if (path.is_dark()) return;
        const Rgb value = path.sharp();
        const double level = luminance(value);
        sum += value.cast<double>();
        square += level * level;
    }
    Rgbd mean() const { return sum / count; }
    /// Of the mean's luminance.
    double variance(const Rgbd& its_mean) const {
        if (count < 2) return 0;
        const double l = luminance(its_mean);
        return std::max(0.0, square / count - l * l) / (count - 1);
    }
};

/// Soft light of one pixel.
struct SoftSum {
    SoftSums sums;
    int count = 0;  // samples that were asked for it
};

/// Sums over the samples of a picture.
struct PictureSums {
    PictureSums(const Camera& camera, bool is_averaged)
        : pixels(camera.width, camera.height, PixelSum{}), is_soft_apart(is_averaged) {
        if (is_averaged) soft = Image<SoftSum>(camera.width, camera.height, SoftSum{});
    }
    Image<PixelSum> pixels;
    bool is_soft_apart;   // else soft light is a part of the pixels' sums
    Image<SoftSum> soft;  // empty where it is
};

/// Paths each pixel should get in every pass, after what the first ones showed.
Image<int> plan_pass(const Image<PixelSum>& sums, const FinalOptions& options, int pass_count) {
    double mean = 0;
    for (const PixelSum& s : sums) mean += luminance(s.mean()) / static_cast<double>(sums.size());
    ImageF variance(sums.width(), sums.height()), target(sums.width(), sums.height());
    Image<int> count(sums.width(), sums.height());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const Rgbd pixel_mean = sums[i].mean();
        const double level = std::hypot(luminance(pixel_mean), kDarkShare * mean);
        const double error = std::max(1e-12, options.noise_target * level);
        variance[i] = static_cast<float>(sums[i].variance(pixel_mean));
        target[i] = static_cast<float>(error * error * pass_count);
        count[i] = sums[i].count;
    }
    return plan_samples(variance, count, target, options.max_samples_per_pixel / pass_count);
}

class ImageSampler {
  public:
    ImageSampler(const RenderScene& scene, const CausticMaps* caustics, const Camera& camera,
                 const TranslucentLight& translucent, const FinalOptions& options)
        : tracer_(scene, caustics, path_options(options), &translucent),
          rays_(camera),
          seed_(options.seed) {}

    /// Brings the pixels of some rows to `target(x, y)` samples, and those with soft light, where
    /// it is apart, to `soft_target(x, y)`.
    template <typename Target, typename SoftTarget>
    void add_samples(int begin_row, int end_row, const Target& target,
                     const SoftTarget& soft_target, PictureSums& sums) const {
        const auto group = groups_.lend(
            [&] { return std::make_unique<PathGroup>(std::span(&tracer_, 1), rays_); });
        for (int y = begin_row; y < end_row; ++y) {
            PixelSum* const pixels = &sums.pixels(0, y);
            const auto use = [&](int x, const PathWish& wish, const PathPair& pair) {
                pixels[x].add(pair.with());
                if (!sums.is_soft_apart) return;
                SoftSum& soft = sums.soft(x, y);
                soft.sums.add(pair.with(), wish.finds_soft);
                soft.count += wish.finds_soft ? 1 : 0;
            };
            PathRow row(*group, y, use);
            for (int x = 0; x < sums.pixels.width(); ++x) {
                const int begin = sums.pixels(x, y).count, end = target(x, y);
                const PathSampler sampler(stream_key(seed_, unsigned(x), unsigned(y)), 0);
                int soft_count = end - begin;
                if (sums.is_soft_apart) soft_count = soft_target(x, y) - sums.soft(x, y).count;
                row.add(x, sampler, begin, end, soft_count);
            }
            row.finish();
        }
    }

  private:
    static PathOptions path_options(const FinalOptions& options) {
        PathOptions paths = options.paths;
        paths.keeps_soft_apart = options.soft_samples_per_pixel > 0;
        return paths;
    }

    PathTracer tracer_;
    CameraRays rays_;
    std::uint64_t seed_;
    mutable Pool<PathGroup> groups_;
};

/// Adds the soft light of each pixel's surface with that of its neighbours.
void add_soft(const PictureSums& sums, const Camera& camera, ImageRgb& radiance) {
    Image<SoftPixel> pixels(camera.width, camera.height, SoftPixel{});
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = sums.soft[i].sums.mean();
    average_soft_light(pixels, camera);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const auto n = static_cast<float>(sums.pixels[i].count);
        radiance[i] += sums.soft[i].sums.albedo / n * pixels[i].value.with;
    }
}

/// Paths with soft light that a pixel gets of `per_pixel` on average: neighbours take turns.
int soft_share(double per_pixel, int x, int y) {
    constexpr double kTurn[2][2] = {{0.125, 0.625}, {0.875, 0.375}};
    return static_cast<int>(per_pixel + kTurn[y & 1][x & 1]);
}

/// The mean over passes; `maps_of(pass, progress)` gives the photons of each (null: none).
template <typename MapsOf>
RenderedImage render_passes(const RenderScene& scene, const Camera& camera,
                            const FinalOptions& options, int pass_count, const MapsOf& maps_of,
                            const Progress& progress) {
    const bool is_averaged = options.soft_samples_per_pixel > 0;
    PictureSums sums(camera, is_averaged);
    // The same in all passes, so that the mean over samples is that over passes.
    const auto share_of = [&](int samples) {
        return std::max(1, (samples + pass_count - 1) / pass_count);
    };
    Image<int> plan(camera.width, camera.height, share_of(options.samples_per_pixel));
    if (options.samples) {
        VITRINE_CHECK(plan.same_size(*options.samples));
        for (std::size_t i = 0; i < plan.size(); ++i) plan[i] = share_of((*options.samples)[i]);
    }
    const double soft_per_pass = options.soft_samples_per_pixel / pass_count;
    TranslucentLight translucent;
    for (int pass = 0; pass < pass_count; ++pass) {
        const double start = double(pass) / pass_count, share = 1.0 / pass_count;
        const CausticMaps* maps = maps_of(pass, progress.part(start, start + 0.15 * share));
        if (pass == 0) {
            TranslucentLightOptions translucent_options;
            translucent_options.seed = options.seed;
            translucent = light_translucent_bodies(scene, maps, options.paths, translucent_options);
        }
        const ImageSampler sampler(scene, maps, camera, translucent, options);
        const auto run = [&](double from, double to) {
            parallel_for_blocks(
                static_cast<std::size_t>(camera.height), kRows,
                progress.part(start + from * share, start + to * share), "render",
                [&](std::size_t begin_row, std::size_t end_row) {
                    sampler.add_samples(
                        static_cast<int>(begin_row), static_cast<int>(end_row),
                        [&](int x, int y) { return plan(x, y) * (pass + 1); },
                        [&](int x, int y) { return soft_share(soft_per_pass * (pass + 1), x, y); },
                        sums);
                });
        };
        const bool is_planned = pass > 0 || options.samples || options.max_samples_per_pixel <= 0;
        run(0.15, is_planned ? 1.0 : 0.4);
        if (!is_planned) {
            plan = plan_pass(sums.pixels, options, pass_count);
            run(0.4, 1.0);
        }
    }
    RenderedImage image{ImageRgb(camera.width, camera.height), ImageF(camera.width, camera.height)};
    parallel_for(sums.pixels.size(), 4096, [&](std::size_t i) {
        const Rgbd mean = sums.pixels[i].mean();
        image.radiance[i] = mean.cast<float>();
        image.variance[i] = static_cast<float>(sums.pixels[i].variance(mean));
    });
    if (is_averaged) add_soft(sums, camera, image.radiance);
    return image;
}

}  // namespace

RenderedImage render_image(const RenderScene& scene, const Camera& camera,
                           const CausticMaps* caustics, const FinalOptions& options,
                           const Progress& progress) {
    return render_passes(
        scene, camera, options, 1, [&](int, const Progress&) { return caustics; }, progress);
}

RenderedImage render_image(const RenderScene& scene, const Camera& camera,
                           const FinalOptions& options, const Progress& progress) {
    if (!options.use_photons) return render_image(scene, camera, nullptr, options, progress);
    CausticOptions pass_options = options.caustics;
    if (pass_options.gather_radius_m <= 0) {
        pass_options.gather_radius_m = pixel_radius(scene, camera);
    }
    const double first_radius_m = pass_options.gather_radius_m;
    const auto pass_count = static_cast<int>(std::clamp<std::uint64_t>(
        options.caustics.photon_count / options.pass_photon_count, 1,
        static_cast<std::uint64_t>(std::max(1, options.samples_per_pixel / kMinPassSamples))));
    pass_options.photon_count = options.caustics.photon_count / std::uint64_t(pass_count);
    CausticMaps maps;
    const auto maps_of = [&](int pass, const Progress& step) {
        pass_options.pass = pass;
        pass_options.gather_radius_m = progressive_radius(first_radius_m, pass);
        maps = {};  // one pass in memory at a time
        const CausticPhotons photons = trace_caustics(scene, pass_options, step);
        maps = build_caustic_maps(photons.photons, pass_options.gather_radius_m);
        return &maps;
    };
    return render_passes(scene, camera, options, pass_count, maps_of, progress);
}

}  // namespace vitrine
