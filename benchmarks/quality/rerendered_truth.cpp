#include "rerendered_truth.h"

#include "image/filter.h"
#include "image/image_io.h"

#include <cstdio>
#include <set>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

/// The blur brings in what is outside of the window, up to here.
constexpr int kMarginPx = 6;

void add(ImageRgb& sum, const ImageRgb& image, float weight) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * image[i];
}

/// Root of the sum of squares, relative to `power`.
double relative(double square, double power) { return std::sqrt(square / std::max(1e-30, power)); }

template <typename Term>
double sum_over(const Mask& region, const Term& term) {
    double sum = 0;
    for (std::size_t i = 0; i < region.size(); ++i) {
        if (region[i] > 127) sum += term(i);
    }
    return sum;
}

double distance(const Mask& region, const ImageRgb& a, const ImageRgb& b) {
    return sum_over(region, [&](std::size_t i) { return (a[i] - b[i]).square().sum(); });
}

double power(const Mask& region, const ImageRgb& a) {
    return sum_over(region, [&](std::size_t i) { return a[i].square().sum(); });
}

Mask both(const Mask& a, const Mask& b) {
    Mask result = a;
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = std::min(a[i], b[i]);
    return result;
}

}  // namespace

std::optional<RerenderedPicture> read_rerendered(const fs::path& folder, const std::string& name,
                                                 const ImageRgb& given) {
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const fs::path file = entry.path() / (name + ".exr");
        if (entry.path().filename().string().starts_with("seed_") && fs::exists(file)) {
            files.insert(file);
        }
    }
    if (files.size() < 2) return std::nullopt;
    const ImageRgb black(given.width(), given.height());
    RerenderedPicture picture{black, black, black, Mask(given.width(), given.height(), 255), 0};
    for (const fs::path& file : files) {
        const ExrImage exr = read_exr(file);
        if (exr.width != given.width() || exr.height != given.height() ||
            !exr.channels.contains("A")) {
            throw InputError({file.string(), "a picture of the frame's size with alpha",
                              fmt::format("{} x {}", exr.width, exr.height),
                              "make it with benchmarks/quality/cycles_truth.py"});
        }
        for (std::size_t i = 0; i < given.size(); ++i) {
            if (!(exr.channels.at("A")[i] > 0.5f)) picture.known[i] = 0;
        }
        add(picture.seeds % 2 == 0 ? picture.even : picture.odd, read_exr_rgb(file), 1.0f);
        ++picture.seeds;
    }
    const auto odd = static_cast<float>(picture.seeds / 2);
    const float even = static_cast<float>(picture.seeds) - odd;
    for (std::size_t i = 0; i < given.size(); ++i) {
        picture.mean[i] = (picture.even[i] + picture.odd[i]) / (even + odd);
        picture.even[i] /= even;
        picture.odd[i] /= odd;
        if (picture.known[i] < 128) {
            picture.mean[i] = picture.even[i] = picture.odd[i] = given[i];
        }
    }
    return picture;
}

void compare_rerendered(const fs::path& folder, const TrueFrame& given, const char* name,
                        const ImageRgb& ours, const ImageRgb* second, float top) {
    const std::string& id = given.camera.id;
    const auto plate = read_rerendered(folder, id, given.plate);
    const auto with = read_rerendered(folder, id + "_with", given.with);
    if (!plate || !with) return;
    const TrueFrame again =
        make_frame(given.camera, plate->mean, with->mean, given.virtual_mask, top);
    const auto half = [&](const ImageRgb& a, const ImageRgb& b) {
        return gaussian_blur(raw_difference(a, b, top), kBlurPx);
    };
    const ImageRgb even = half(with->even, plate->even), odd = half(with->odd, plate->odd);
    const Mask window = erode(both(plate->known, with->known), kMarginPx);
    for (int k = 0; k < 3; ++k) {
        const Mask here = both(given.regions[k], window), region = both(again.regions[k], window);
        if (count_inside(region) == 0) continue;
        const double in_given = power(here, given.d_true), in_again = power(region, again.d_true);
        const double noise = 0.25 * distance(region, even, odd);
        const auto error = [&](const ImageRgb& d) { return distance(region, d, again.d_true); };
        const auto without_noise = [&](const ImageRgb& d) {
            return relative(std::max(0.0, error(d) - noise), in_again);
        };
        std::printf(
            "%s rerendered (%d seeds) %s: window has %.0f %% of the power; against given: %s %.3f, "
            "rerendered %.3f; against rerendered: %s %.3f, given %.3f; noise of rerendered %.3f, "
            "without it %s %.3f, given %.3f",
            id.c_str(), std::min(plate->seeds, with->seeds), kRegionNames[k],
            100 * in_given / power(given.regions[k], given.d_true), name,
            relative(distance(here, ours, given.d_true), in_given),
            relative(distance(here, again.d_true, given.d_true), in_given), name,
            relative(error(ours), in_again), relative(error(given.d_true), in_again),
            relative(noise, in_again), name, without_noise(ours), without_noise(given.d_true));
        if (second) {
            const double own = 0.5 * distance(region, ours, *second);
            std::printf(" (%s noise %.3f, without that %.3f)", name, relative(own, in_again),
                        relative(std::max(0.0, error(ours) - noise - own), in_again));
        }
        const auto change = [&](const ImageRgb& d) {
            return sum_over(region, [&](std::size_t i) { return double(d[i].sum()); });
        };
        // Of the sum of sizes, since changes of both signs may cancel.
        const double all =
            sum_over(region, [&](std::size_t i) { return double(again.d_true[i].abs().sum()); });
        const auto surplus = [&](const ImageRgb& d) {
            return 100 * (change(d) - change(again.d_true)) / all;
        };
        std::printf("; mean change above rerendered's: %s %+.2f", name, surplus(ours));
        if (second) std::printf(" and %+.2f", surplus(*second));
        std::printf(" %%, given %+.2f %%, +- %.2f %%\n", surplus(given.d_true),
                    0.5 * std::abs(surplus(even) - surplus(odd)));
    }
}

}  // namespace vitrine
