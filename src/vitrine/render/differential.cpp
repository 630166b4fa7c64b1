#include "render/differential.h"

#include "base/parallel.h"
#include "render/sample_plan.h"

namespace vitrine {
namespace {

/// Sums over the samples of one pixel.
struct PixelSums {
    Rgbd with = Rgbd::Zero(), without = Rgbd::Zero(), object = Rgbd::Zero();
    std::array<Rgbd, kLayerCount> delta;
    double change = 0, change_square = 0;  // luminance of what the composite gets
    int count = 0, covered = 0;
    PixelSums() { delta.fill(Rgbd::Zero()); }

    /// Variance of the mean change.
    double variance() const {
        if (count < 2) return 0;
        const double mean = change / count;
        return std::max(0.0, change_square / count - mean * mean) / (count - 1);
    }
};

RenderScene combine(Scene real, std::vector<Part> virtual_parts) {
    for (Part& part : virtual_parts) {
        part.is_virtual = true;
        real.parts.push_back(std::move(part));
    }
    return RenderScene(std::move(real));
}

class FrameRenderer {
  public:
    /// @param maps of the progressive passes: the samples of a pixel take turns
    FrameRenderer(const RenderScene& scene, const std::vector<CausticMaps>& maps,
                  const TranslucentLight& translucent, const Camera& camera,
                  const DifferentialOptions& options)
        : scene_(scene),
          camera_(camera),
          origin_(camera.centre_in_world().cast<float>()),
          seed_(options.seed) {
        for (const CausticMaps& m : maps) {
            tracers_.emplace_back(scene, m.empty() ? nullptr : &m, options.paths, &translucent);
        }
    }

    void add_samples(int x, int y, int target, PixelSums& sums) const {
        for (; sums.count < target; ++sums.count) {
            const auto [sampler, direction] = camera_sample(camera_, seed_, x, y, sums.count);
            const PathTracer& tracer =
                tracers_[static_cast<std::size_t>(sums.count) % tracers_.size()];
            const PathResult with = tracer.trace(origin_, direction, sampler, kAllParts);
            const Rgb with_total = with.total();
            sums.with += with_total.cast<double>();
            if (!with.is_touched) {
                sums.without += with_total.cast<double>();
                continue;
            }
            const PathResult without = tracer.trace(origin_, direction, sampler, kRealParts);
            const Rgb without_total = without.total();
            sums.without += without_total.cast<double>();
            double change = 0;
            if (with.first_part >= 0 && scene_.is_virtual(with.first_part)) {
                ++sums.covered;
                sums.object += with_total.cast<double>();
                change = luminance(with_total) - luminance(without_total);
            } else {
                for (std::size_t k = 0; k < kLayerCount; ++k) {
                    sums.delta[k] += (with.layers[k] - without.layers[k]).cast<double>();
                }
                change = luminance(Rgb(with_total - without_total));
            }
            sums.change += change;
            sums.change_square += change * change;
        }
    }

  private:
    const RenderScene& scene_;
    std::vector<PathTracer> tracers_;
    const Camera& camera_;
    Vec3f origin_;
    std::uint64_t seed_;
};

/// Samples each pixel should get so that its standard error falls below `target`.
Image<int> plan_change(const Image<PixelSums>& sums, double target, int max_samples,
                       int map_count) {
    ImageF variance(sums.width(), sums.height());
    Image<int> count(sums.width(), sums.height());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        variance[i] = static_cast<float>(sums[i].variance());
        count[i] = sums[i].count;
    }
    const ImageF wanted(sums.width(), sums.height(), static_cast<float>(target * target));
    return plan_samples(variance, count, wanted, max_samples, map_count);
}

}  // namespace

DifferentialOptions preview_options() {
    DifferentialOptions options;
    options.min_samples = 1;
    options.max_samples = 4;
    options.noise_target = 0.03;
    options.photon_count = 150'000;
    options.photon_passes = 1;
    options.paths.max_diffuse_bounces = 1;
    options.paths.split_depth = 2;
    return options;
}

ImageRgb DifferentialImage::delta() const {
    ImageRgb sum(with.width(), with.height());
    for (std::size_t i = 0; i < sum.size(); ++i) {
        sum[i] = shadow[i] + caustics[i] + reflection[i] + refraction[i] + diffuse[i];
    }
    return sum;
}

DifferentialRenderer::DifferentialRenderer(Scene real, std::vector<Part> virtual_parts,
                                           std::span<const Camera> cameras,
                                           const DifferentialOptions& options,
                                           const Progress& progress)
    : scene_(combine(std::move(real), std::move(virtual_parts))), options_(options) {
    trace_photons(cameras, progress);
}

DifferentialRenderer::DifferentialRenderer(const RenderScene& world,
                                           std::vector<Part> virtual_parts,
                                           std::span<const Camera> cameras,
                                           const DifferentialOptions& options,
                                           const Progress& progress)
    : scene_(world, std::move(virtual_parts)), options_(options) {
    trace_photons(cameras, progress);
}

void DifferentialRenderer::trace_photons(std::span<const Camera> cameras,
                                         const Progress& progress) {
    double radius = options_.gather_radius_m;
    if (radius <= 0) {
        for (const Camera& camera : cameras) {
            const double r = pixel_radius(scene_, camera);
            radius = radius > 0 ? std::min(radius, r) : r;
        }
    }
    VITRINE_CHECK_GT(radius, 0.0);
    CausticOptions caustics;
    caustics.gather_radius_m = radius;
    caustics.seed = options_.seed;
    const int passes = std::max(1, options_.photon_passes);
    caustics.photon_count = options_.photon_count / static_cast<std::uint64_t>(passes);
    for (int pass = 0; pass < passes; ++pass) {
        caustics.pass = pass;
        const CausticPhotons photons = trace_caustics(
            scene_, caustics, progress.part(double(pass) / passes, double(pass + 1) / passes));
        balance_ += photons.balance;
        maps_.push_back(build_caustic_maps(photons.photons, progressive_radius(radius, pass)));
    }
    TranslucentLightOptions translucent;
    translucent.seed = options_.seed;
    const CausticMaps* first = maps_.front().empty() ? nullptr : &maps_.front();
    translucent_ = light_translucent_bodies(scene_, first, options_.paths, translucent);
}

DifferentialImage DifferentialRenderer::render(const Camera& camera,
                                               const Progress& progress) const {
    const int width = camera.width, height = camera.height;
    const FrameRenderer renderer(scene_, maps_, translucent_, camera, options_);
    Image<PixelSums> sums(width, height, PixelSums{});
    constexpr int kBand = 16;
    const auto run = [&](const Progress& step, const auto& samples_of) {
        for (int band = 0; band < height; band += kBand) {
            const auto rows = static_cast<std::size_t>(std::min(kBand, height - band));
            parallel_for(rows, 1, [&](std::size_t row) {
                const int y = band + static_cast<int>(row);
                for (int x = 0; x < width; ++x) {
                    renderer.add_samples(x, y, samples_of(x, y), sums(x, y));
                }
            });
            step.update(static_cast<double>(band + static_cast<int>(rows)) / height, "insert");
        }
    };
    run(progress.part(0, 0.3), [&](int, int) { return options_.min_samples; });
    double mean = 0;
    for (const PixelSums& s : sums) mean += luminance(Rgbd(s.without / s.count));
    mean /= static_cast<double>(sums.size());
    const double target = std::max(1e-12, options_.noise_target * mean);
    // Twice: the first answer rests on few samples.
    for (int round = 0; round < 2; ++round) {
        const int limit = round == 0 ? std::min(4 * options_.min_samples, options_.max_samples)
                                     : options_.max_samples;
        const Image<int> plan = plan_change(sums, target, limit, static_cast<int>(maps_.size()));
        run(progress.part(round == 0 ? 0.3 : 0.5, round == 0 ? 0.5 : 1.0),
            [&](int x, int y) { return plan(x, y); });
    }
    DifferentialImage image;
    for (ImageRgb* layer : {&image.with, &image.without, &image.shadow, &image.caustics,
                            &image.reflection, &image.refraction, &image.diffuse, &image.object}) {
        *layer = ImageRgb(width, height);
    }
    image.coverage = ImageF(width, height);
    ImageRgb* layers[kLayerCount] = {&image.shadow, &image.caustics, &image.reflection,
                                     &image.refraction, &image.diffuse};
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const PixelSums& s = sums[i];
        image.with[i] = (s.with / s.count).cast<float>();
        image.without[i] = (s.without / s.count).cast<float>();
        image.object[i] = (s.object / s.count).cast<float>();
        image.coverage[i] = static_cast<float>(s.covered) / static_cast<float>(s.count);
        const int seen = s.count - s.covered;
        for (std::size_t k = 0; k < kLayerCount; ++k) {
            if (seen > 0) (*layers[k])[i] = (s.delta[k] / seen).cast<float>();
        }
    }
    image.geometry = render_geometry(scene_, camera);
    return image;
}

}  // namespace vitrine
