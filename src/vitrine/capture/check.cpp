#include "capture/check.h"

#include "image/colour.h"
#include "math/statistics.h"

#include <array>
#include <cmath>

namespace vitrine {
namespace {

constexpr int kPixelStep = 7;  // every seventh pixel each way: 4,700 of a 640x360 frame

double valid_share(const ImageF& depth) {
    std::size_t valid = 0;
    for (const float d : depth) valid += d > 0 ? 1 : 0;
    return static_cast<double>(valid) / static_cast<double>(depth.size());
}

double median_depth(const Capture& capture) {
    std::vector<double> depths;
    for (const RgbdFrame& frame : capture.frames) {
        for (int y = 0; y < frame.depth_m.height(); y += kPixelStep) {
            for (int x = 0; x < frame.depth_m.width(); x += kPixelStep) {
                if (frame.depth_m(x, y) > 0) depths.push_back(frame.depth_m(x, y));
            }
        }
    }
    return depths.empty() ? 0.0 : median(std::move(depths));
}

/// Variance of the Laplacian relative to the mean level: falls with motion blur (Pech-Pacheco
/// 2000).
double sharpness(const ImageRgb& colour) {
    const ImageF y = luminance_image(colour);
    double sum = 0, squares = 0, level = 0;
    double count = 0;
    for (int v = 1; v + 1 < y.height(); v += 2) {
        for (int u = 1; u + 1 < y.width(); u += 2) {
            const double l = 4 * y(u, v) - y(u - 1, v) - y(u + 1, v) - y(u, v - 1) - y(u, v + 1);
            sum += l;
            squares += l * l;
            level += y(u, v);
            ++count;
        }
    }
    const double variance = squares / count - (sum / count) * (sum / count);
    return variance / std::max(1e-12, (level / count) * (level / count));
}

double mean_level(const ImageRgb& colour) {
    double sum = 0;
    for (const Rgb& pixel : colour) sum += luminance(pixel);
    return sum / static_cast<double>(colour.size());
}

double saturated_share(const RgbdFrame& frame, double level) {
    std::size_t count = 0;
    for (const Rgb& pixel : frame.colour) count += is_saturated(pixel, level) ? 1 : 0;
    return static_cast<double>(count) / static_cast<double>(frame.colour.size());
}

double largest_baseline(const Capture& capture) {
    double largest = 0;
    for (const RgbdFrame& a : capture.frames) {
        for (const RgbdFrame& b : capture.frames) {
            largest =
                std::max(largest, (a.camera.centre_in_world() - b.camera.centre_in_world()).norm());
        }
    }
    return largest;
}

}  // namespace

double depth_consistency(const Capture& capture, double factor) {
    if (!capture.has_poses || capture.frames.size() < 2) return 0.0;
    std::size_t agree = 0, seen = 0;
    for (std::size_t i = 0; i + 1 < capture.frames.size(); ++i) {
        const RgbdFrame &a = capture.frames[i], &b = capture.frames[i + 1];
        for (int y = 0; y < a.depth_m.height(); y += kPixelStep) {
            for (int x = 0; x < a.depth_m.width(); x += kPixelStep) {
                const double depth = a.depth_m(x, y) * factor;
                if (depth <= 0) continue;
                const Vec3 p = a.camera.unproject(x, y, depth);
                const double z = b.camera.depth(p);
                if (z <= 0) continue;
                const Vec2 pixel = b.camera.project(p);
                const int u = static_cast<int>(std::lround(pixel.x()));
                const int v = static_cast<int>(std::lround(pixel.y()));
                if (!b.depth_m.contains(u, v) || b.depth_m(u, v) <= 0) continue;
                ++seen;
                agree += std::abs(b.depth_m(u, v) * factor - z) < 0.03 * z ? 1 : 0;
            }
        }
    }
    return seen < 100 ? 0.0 : static_cast<double>(agree) / static_cast<double>(seen);
}

void require_usable(const Capture& capture, const std::filesystem::path& folder,
                    double depth_scale) {
    const std::string where = folder.string();
    if (capture.frames.empty())
        throw InputError({where, "at least one readable frame", "none", ""});
    const double typical = median_depth(capture);
    if (typical <= 0) {
        throw InputError({where, "valid depth in some frame", "zero everywhere",
                          "Is depth/ of this recording? 0 means invalid."});
    }
    if (capture.has_poses && capture.frames.size() > 1 && largest_baseline(capture) < 1e-6) {
        throw InputError({(folder / "groundtruth.txt").string(), "poses that differ",
                          "the same pose for all frames",
                          "Set \"poses\": \"none\" in capture.json to track the camera instead."});
    }
    // A unit is wrong by a factor that is one of these, and the views then contradict each other.
    constexpr std::array<double, 5> kUsualScales = {1.0, 100.0, 1000.0, 5000.0, 10000.0};
    const double given = depth_consistency(capture, 1.0);
    double best = given, best_scale = depth_scale;
    for (const double scale : kUsualScales) {
        const double consistency = depth_consistency(capture, depth_scale / scale);
        if (consistency > best) {
            best = consistency;
            best_scale = scale;
        }
    }
    const std::string hint =
        best_scale != depth_scale
            ? fmt::format(
                  "depth_scale {:g} would make {:.0f} % of the depth agree between views: "
                  "set it in capture.json if that is the unit.",
                  best_scale, 100 * best)
            : "Check depth_scale in capture.json (1000 for millimetres, 5000 for TUM).";
    const bool contradicts = best_scale != depth_scale && given < 0.5 * best && best > 0.3;
    if (contradicts || typical < 0.05 || typical > 30.0) {
        throw InputError({where, "depth in metres after division by depth_scale",
                          fmt::format("a median of {:.3g} m with depth_scale {:g}, {:.0f} % "
                                      "agreement between neighbouring views",
                                      typical, depth_scale, 100 * given),
                          hint});
    }
    if (capture.reference_albedo) {
        const ReferenceAlbedo& reference = *capture.reference_albedo;
        bool found = false;
        for (const RgbdFrame& frame : capture.frames) {
            found |= frame.id == reference.frame && frame.camera.sees(reference.pixel, 2);
        }
        if (!found) {
            throw InputError({(folder / "capture.json").string(),
                              "reference_albedo to name a frame and a pixel within it",
                              fmt::format("\"{}\" ({:g}, {:g})", reference.frame,
                                          reference.pixel.x(), reference.pixel.y()),
                              ""});
        }
    }
}

std::vector<Verdict> check_capture(const Capture& capture) {
    std::vector<Verdict> verdicts;
    const auto say = [&](Severity severity, std::string sentence) {
        verdicts.push_back({severity, std::move(sentence)});
    };
    for (const std::string& warning : capture.warnings) say(Severity::Note, warning);
    const std::size_t count = capture.frames.size();
    const Camera& camera = capture.frames.front().camera;
    say(count >= 8 ? Severity::Good : Severity::Problem,
        fmt::format("{} frames of {} x {} pixels{}", count, camera.width, camera.height,
                    count >= 8 ? ""
                               : ": too few for silhouettes of glass, 12 or more around the "
                                 "scene would do"));
    if (capture.has_poses) {
        const double baseline = largest_baseline(capture), depth = median_depth(capture);
        const bool has_parallax = baseline > 0.2 * depth;
        say(has_parallax ? Severity::Good : Severity::Problem,
            fmt::format("poses given, cameras up to {:.2f} m apart at {:.2f} m distance{}",
                        baseline, depth,
                        has_parallax ? "" : ": too little parallax, walk around the scene"));
        const double agreement = depth_consistency(capture, 1.0);
        say(agreement > 0.5 ? Severity::Good : Severity::Problem,
            fmt::format("{:.0f} % of the depth agrees between neighbouring views",
                        100 * agreement));
    } else {
        say(Severity::Note, "no poses: the camera will be tracked");
    }
    std::vector<double> shares, sharp, levels, saturated;
    for (const RgbdFrame& frame : capture.frames) {
        shares.push_back(valid_share(frame.depth_m));
        sharp.push_back(sharpness(frame.colour));
        levels.push_back(mean_level(frame.colour));
        saturated.push_back(saturated_share(frame, capture.saturation_level));
    }
    say(median(shares) > 0.3 ? Severity::Good : Severity::Problem,
        fmt::format("{:.0f} % of the depth pixels are valid", 100 * median(shares)));
    const double worst = *std::max_element(saturated.begin(), saturated.end());
    say(worst < 0.05 ? Severity::Good : Severity::Problem,
        fmt::format("at most {:.1f} % of a picture is saturated{}", 100 * worst,
                    worst < 0.05 ? "" : ": expose shorter, highlights carry the light"));
    const double typical_sharpness = median(sharp), typical_level = median(levels);
    for (std::size_t i = 0; i < count; ++i) {
        const std::string& id = capture.frames[i].id;
        if (sharp[i] < 0.25 * typical_sharpness) {
            say(Severity::Note, fmt::format("frame {} looks blurred (motion?)", id));
        }
        const double ratio = levels[i] / std::max(1e-12, typical_level);
        if (ratio > 1.6 || ratio < 1 / 1.6) {
            say(Severity::Note,
                fmt::format(
                    "frame {} is {:.1f}x as bright as the others: lock the exposure or give "
                    "\"exposure\" in capture.json",
                    id, ratio));
        }
    }
    say(capture.reference_albedo ? Severity::Good : Severity::Note,
        capture.reference_albedo ? "a reference albedo fixes the scale of the light"
                                 : "no reference albedo: a mean albedo of 0.5 will be assumed");
    return verdicts;
}

}  // namespace vitrine
