#include "render/differential.h"

#include "base/parallel.h"
#include "image/filter.h"
#include "render/pixel_samples.h"
#include "render/sample_plan.h"
#include "render/soft_light.h"

namespace vitrine {
namespace {

/// Shadow rays to a lamp with size, where the change is noisy: penumbras are the noise, and a
/// camera ray costs more than they do.
constexpr int kLightSamples = 4;

RenderScene combine(Scene real, std::vector<Part> virtual_parts) {
    for (Part& part : virtual_parts) {
        part.is_virtual = true;
        real.parts.push_back(std::move(part));
    }
    return RenderScene(std::move(real));
}

/// The soft light of each pixel's real surface, or of its virtual one, with that of its neighbours.
Image<SoftPixel> average_soft(const Image<PixelSums>& sums, SoftSums PixelSums::*of,
                              const Camera& camera) {
    Image<SoftPixel> pixels(sums.width(), sums.height(), SoftPixel{});
    for (std::size_t i = 0; i < sums.size(); ++i) pixels[i] = (sums[i].*of).mean();
    average_soft_light(pixels, camera);
    return pixels;
}

struct SoftImages {
    Image<SoftPixel> real, virtual_parts;
};

SoftImages average_soft(const Image<PixelSums>& sums, const Camera& camera) {
    return {average_soft(sums, &PixelSums::soft_real, camera),
            average_soft(sums, &PixelSums::soft_virtual, camera)};
}

/// Samples each pixel should get, and how many of them with soft light.
struct Plan {
    Image<int> sharp, soft;
};

/// Of a picture's width. Less would make the number of paths depend on whether the first of them
/// met something bright, and the mean darker: 2 % of the change at half of this.
constexpr double kSurroundings = 0.025;

/// Of the change of soft light by one path, over the surroundings of each pixel: few paths meet
/// the brightest places, and where none of them has yet the noise is not smaller.
ImageF soft_variance_around(const Image<PixelSums>& sums) {
    ImageF variance(sums.width(), sums.height());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const PixelSums& s = sums[i];
        variance[i] = static_cast<float>(s.soft_count) *
                      variance_of_mean(s.soft_change, s.soft_change_square, s.soft_count);
    }
    return gaussian_blur(variance, std::max(1.0, kSurroundings * sums.width()));
}

/// Variance wanted of each pixel: its standard error is the target's share of the picture's mean
/// or of its own level, whichever is brighter.
ImageF wanted_variance(const Image<PixelSums>& sums, double target) {
    ImageF wanted(sums.width(), sums.height());
    double mean = 0;
    for (const PixelSums& s : sums) mean += luminance(s.without) / static_cast<float>(s.count);
    mean /= static_cast<double>(sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double level = luminance(sums[i].with) / static_cast<float>(sums[i].count);
        const double error = std::max(1e-9, target * std::hypot(mean, level));
        wanted[i] = static_cast<float>(error * error);
    }
    return wanted;
}

Image<int> plan_sharp(const Image<PixelSums>& sums, const DifferentialOptions& options, int limit,
                      int map_count) {
    ImageF variance(sums.width(), sums.height());
    Image<int> count(sums.width(), sums.height());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        variance[i] = sums[i].sharp_variance();
        count[i] = sums[i].count;
    }
    return plan_samples(variance, count, wanted_variance(sums, options.noise_target),
                        std::min(limit, options.max_samples), map_count);
}

/// @param soft whose variance is that of the mean over neighbours, per variance of one path
Image<int> plan_soft(const Image<PixelSums>& sums, const SoftImages& soft,
                     const DifferentialOptions& options) {
    // The errors of soft light lie in patches, which are seen sooner than grain. With half of the
    // target a frame costs a sixth more, and its error is the same within a twentieth.
    constexpr double kSoftShare = 0.7;
    const ImageF wanted = wanted_variance(sums, kSoftShare * options.noise_target);
    const ImageF variance = soft_variance_around(sums);
    Image<int> plan(sums.width(), sums.height());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const float share =
            std::max(soft.real[i].value.variance, soft.virtual_parts[i].value.variance);
        const auto count = static_cast<float>(sums[i].soft_count);
        const float samples = count * variance[i] * share / wanted[i];
        const float most = std::max(static_cast<float>(options.max_samples), count);
        plan[i] = static_cast<int>(std::clamp(samples, count, most));
    }
    return plan;
}

/// The pixels' means.
void fill(const Image<PixelSums>& sums, const SoftImages& soft, DifferentialImage& image) {
    const int width = sums.width(), height = sums.height();
    for (ImageRgb* layer : {&image.with, &image.without, &image.shadow, &image.caustics,
                            &image.reflection, &image.refraction, &image.diffuse, &image.object}) {
        *layer = ImageRgb(width, height);
    }
    image.coverage = ImageF(width, height);
    ImageRgb* layers[kLayerCount] = {&image.shadow, &image.caustics, &image.reflection,
                                     &image.refraction, &image.diffuse};
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const PixelSums& s = sums[i];
        const SoftValue &real = soft.real[i].value, &object = soft.virtual_parts[i].value;
        const auto n = static_cast<float>(s.count);
        const auto seen = static_cast<float>(s.count - s.covered);
        const Rgb real_albedo = s.soft_real.albedo / n;
        const Rgb of_object = s.soft_virtual.albedo / n * object.with;
        image.with[i] = s.with / n + real_albedo * real.with + of_object;
        image.without[i] = s.without / n + real_albedo * (real.with - real.shadow - real.diffuse) +
                           s.hidden / static_cast<float>(std::max(1, s.soft_count));
        image.object[i] = s.object / n + of_object;
        image.coverage[i] = static_cast<float>(s.covered) / n;
        if (seen <= 0) continue;
        for (std::size_t k = 0; k < kLayerCount; ++k) (*layers[k])[i] = s.delta[k] / seen;
        image.shadow[i] += real_albedo * real.shadow * (n / seen);
        image.diffuse[i] += real_albedo * real.diffuse * (n / seen);
    }
}

}  // namespace

DifferentialOptions preview_options() {
    DifferentialOptions options;
    options.min_samples = 1;
    options.min_soft_samples = 1;
    options.max_samples = 1;
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
    const PixelSampler renderer(scene_, maps_, translucent_, camera, options_.paths, options_.seed);
    Image<PixelSums> sums(width, height, PixelSums{});
    Plan plan{Image<int>(width, height, options_.min_samples),
              Image<int>(width, height, options_.min_soft_samples)};
    const auto map_count = static_cast<int>(maps_.size());
    const auto run = [&](const Progress& step, int light_samples) {
        parallel_for_blocks(static_cast<std::size_t>(height), 1, step, "insert",
                            [&](std::size_t row, std::size_t) {
                                renderer.add_samples(static_cast<int>(row), plan.sharp, plan.soft,
                                                     light_samples, sums);
                            });
    };
    run(progress.part(0, 0.3), 1);
    // Twice: the first answer rests on few samples.
    const int rounds = options_.max_samples > options_.min_samples ? 2 : 0;
    for (int round = 0; round < rounds; ++round) {
        if (round == 0) {
            plan.soft = plan_soft(sums, average_soft(sums, camera), options_);
            plan.sharp = plan_sharp(sums, options_, 4 * options_.min_samples, map_count);
        } else {
            plan.sharp = plan_sharp(sums, options_, options_.max_samples, map_count);
        }
        run(progress.part(round == 0 ? 0.3 : 0.6, round == 0 ? 0.6 : 0.95), kLightSamples);
    }
    DifferentialImage image;
    fill(sums, average_soft(sums, camera), image);
    image.geometry = render_geometry(scene_, camera);
    return image;
}

}  // namespace vitrine
