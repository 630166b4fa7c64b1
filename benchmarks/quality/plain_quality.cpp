#include "plain_quality.h"

#include "base/timer.h"
#include "compose/composite.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "math/statistics.h"
#include "rerendered_truth.h"

#include <cstdio>

namespace vitrine {

namespace fs = std::filesystem;

void write_side_by_side(const fs::path& path, const std::vector<ImageRgb>& images, double scale) {
    int width = 0;
    for (const ImageRgb& image : images) width += image.width();
    ImageRgb all(width, images.front().height());
    int x0 = 0;
    for (const ImageRgb& image : images) {
        for (int y = 0; y < image.height(); ++y) {
            for (int x = 0; x < image.width(); ++x) all(x0 + x, y) = image(x, y);
        }
        x0 += image.width();
    }
    write_composite_png(path, all, scale);
}

namespace {

Mask all_special(const fs::path& folder, const std::string& frame, const Camera& camera) {
    Mask mask(camera.width, camera.height);
    if (!fs::exists(folder / "mask")) return mask;
    for (const auto& entry : fs::directory_iterator(folder / "mask")) {
        if (entry.path().filename().string().starts_with(frame)) {
            mask = mask_or(mask, read_mask(entry.path()));
        }
    }
    return mask;
}

/// How the relative error comes about.
struct RelativeError {
    double mean = 0, median = 0, bias = 0;
    double noise = 0;   ///< mean of what pixel noise alone makes of it, of both pictures
    double even = 0;    ///< root of the mean product of neighbours: what no pixel noise makes
    double ours = 0;    ///< of ours alone, by the spread of its paths (its sharp light)
    double coarse = 0;  ///< of means over 8 x 8 pixels, an eighth of whose noise is left
    std::size_t count = 0;
};

/// Of means over blocks of pixels that all count.
double coarse_error(const ImageRgb& image, const ImageRgb& reference, const Mask& use) {
    constexpr int kBlock = 8;
    double sum = 0;
    std::size_t count = 0;
    for (int y = 0; y + kBlock <= use.height(); y += kBlock) {
        for (int x = 0; x + kBlock <= use.width(); x += kBlock) {
            double ours = 0, truth = 0;
            bool is_whole = true;
            for (int k = 0; k < kBlock * kBlock; ++k) {
                const int u = x + k % kBlock, v = y + k / kBlock;
                is_whole &= use(u, v) > 127;
                ours += double(image(u, v)[1]);
                truth += double(reference(u, v)[1]);
            }
            if (!is_whole) continue;
            sum += std::abs(ours - truth) / truth;
            ++count;
        }
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

/// @param use pixels that count
RelativeError relative_error(const RenderedImage& image, const ImageRgb& reference,
                             const Mask& use) {
    const auto error = [&](int x, int y) {
        return double(image.radiance(x, y)[1]) - double(reference(x, y)[1]);
    };
    RelativeError result;
    std::vector<double> errors;
    std::size_t inner = 0;
    for (int y = 1; y + 1 < use.height(); ++y) {
        for (int x = 1; x + 1 < use.width(); ++x) {
            if (use(x, y) < 128) continue;
            const double level = reference(x, y)[1];
            errors.push_back(std::abs(error(x, y)) / level);
            result.bias += error(x, y) / level;
            // Mean size of a normal variable, by its standard deviation.
            result.ours += std::sqrt(2 / kPi * double(image.variance(x, y))) /
                           std::max(1e-9f, luminance(image.radiance(x, y)));
            if (use(x - 1, y) < 128 || use(x + 1, y) < 128 || use(x, y - 1) < 128 ||
                use(x, y + 1) < 128) {
                continue;
            }
            // What is smooth in the error drops out, the noise of five pixels is left.
            const double around =
                (error(x - 1, y) + error(x + 1, y) + error(x, y - 1) + error(x, y + 1)) / 4;
            const double noise = (error(x, y) - around) / std::sqrt(1.25) / level;
            result.noise += std::abs(noise);
            result.even += error(x, y) * around / (level * level);
            ++inner;
        }
    }
    if (errors.empty()) return result;
    result.coarse = coarse_error(image.radiance, reference, use);
    result.count = errors.size();
    const auto n = static_cast<double>(errors.size());
    for (const double e : errors) result.mean += e / n;
    result.median = median(errors);
    result.bias /= n;
    result.ours /= n;
    result.noise /= std::max(1.0, static_cast<double>(inner));
    result.even = std::sqrt(std::max(0.0, result.even) / std::max(1.0, double(inner)));
    return result;
}

/// Mean relative error over the pixels that count.
double mean_error(const ImageRgb& image, const ImageRgb& reference, const Mask& use) {
    double sum = 0;
    for (std::size_t i = 0; i < use.size(); ++i) {
        if (use[i] > 127) {
            sum += std::abs(double(image[i][1]) - double(reference[i][1])) / reference[i][1];
        }
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, count_inside(use)));
}

/// The same errors where the truth was rendered again: of our picture and of the given one.
/// @param plain pixels that count
void compare_rerendered_plain(const fs::path& folder, const std::string& frame,
                              const RenderedImage& ours, const ImageRgb& given, Mask plain) {
    const auto again = read_rerendered(folder, frame, given);
    if (!again) return;
    for (std::size_t i = 0; i < plain.size(); ++i) plain[i] = std::min(plain[i], again->known[i]);
    const RelativeError e = relative_error(ours, again->mean, plain);
    std::printf(
        "%s rerendered (%d seeds): mean relative error against given: ours %.4f, rerendered %.4f; "
        "against rerendered: ours %.4f (pixel noise alone %.4f, ours alone %.4f; means of 8 x 8 "
        "pixels %.4f), given %.4f (8 x 8 %.4f); noise of rerendered %.4f; bias ours %+.4f (%zu "
        "px)\n",
        frame.c_str(), again->seeds, mean_error(ours.radiance, given, plain),
        mean_error(again->mean, given, plain), e.mean, e.noise, e.ours, e.coarse,
        mean_error(given, again->mean, plain), coarse_error(given, again->mean, plain),
        0.5 * mean_error(again->even, again->odd, plain), e.bias, e.count);
}

}  // namespace

void compare_plain(const RenderQualityOptions& options, const TruthScene& truth,
                   const RenderScene& scene, const CausticMaps& maps) {
    const fs::path folder = fs::path(options.capture) / "truth";
    for (const Camera& camera : truth.scene.cameras) {
        const fs::path file = folder / "linear" / (camera.id + ".exr");
        if (!fs::exists(file) || !options.takes(camera.id)) continue;
        const ImageRgb reference = read_exr_rgb(file);
        FinalOptions final_options = picture_options();
        final_options.samples_per_pixel = options.samples;
        Timer timer;
        const RenderedImage image = render_image(scene, camera, &maps, final_options);
        const double seconds = timer.seconds();
        const Mask special = dilate(all_special(folder, camera.id, camera), 4);
        const double level = truth.direct_level / kPi;  // of a white surface
        Mask plain(reference.width(), reference.height());
        double flux = 0, flux_true = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0;
        std::size_t bright = 0;
        const Geometry geometry = render_geometry(scene, camera);
        for (std::size_t i = 0; i < reference.size(); ++i) {
            if (special[i] > 127) continue;
            const double albedo = std::max(0.02f, geometry.albedo[i][1]);
            const double a = image.radiance[i][1], b = reference[i][1];
            const double direct = level * albedo;
            if (b > 1.5 * direct) {
                ++bright;
                flux += a;
                flux_true += b;
                const double x = std::log1p(a / direct), y = std::log1p(b / direct);
                sx += x;
                sy += y;
                sxx += x * x;
                syy += y * y;
                sxy += x * y;
            } else if (b > 0.05 * direct && b < 1.2 * direct) {
                plain[i] = 255;
            }
        }
        const double n = static_cast<double>(std::max<std::size_t>(1, bright));
        const double correlation =
            (sxy - sx * sy / n) /
            std::sqrt(std::max(1e-30, (sxx - sx * sx / n) * (syy - sy * sy / n)));
        const RelativeError e = relative_error(image, reference, plain);
        std::printf(
            "%s plain: mean relative error %.4f (median %.4f; pixel noise alone %.4f, ours alone "
            "%.4f; rms that neighbours share %.4f; means of 8 x 8 pixels %.4f) bias %+.4f (%zu px) "
            " "
            "caustic flux %.4f correlation "
            "%.4f (%zu px)  %.1f s\n",
            camera.id.c_str(), e.mean, e.median, e.noise, e.ours, e.even, e.coarse, e.bias, e.count,
            flux / std::max(1e-30, flux_true), correlation, bright, seconds);
        if (!options.rerendered.empty()) {
            compare_rerendered_plain(options.rerendered, camera.id, image, reference, plain);
        }
        if (!options.out.empty()) {
            write_side_by_side(fs::path(options.out) / (camera.id + "_plain.png"),
                               {image.radiance, reference}, truth.linear_scale);
            write_exr(fs::path(options.out) / (camera.id + "_plain.exr"), image.radiance);
        }
        std::fflush(stdout);
    }
}

}  // namespace vitrine
