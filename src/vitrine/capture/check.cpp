#include "capture/check.h"

#include "capture/exposure_gains.h"
#include "capture/read_capture.h"
#include "image/colour.h"
#include "math/statistics.h"

#include <array>
#include <cmath>

namespace vitrine {
namespace {

constexpr std::size_t kMinViews = 8;  // fewer outlines leave a hull with corners
constexpr int kPixelStep = 7;         // every seventh pixel each way: 4,700 of a 640x360 frame

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

/// Intrinsics written for pictures of another size give themselves away.
bool are_of_another_size(const Camera& camera) {
    const double x = (camera.cx + 0.5) / camera.width, y = (camera.cy + 0.5) / camera.height;
    const double focal = camera.fx / camera.width;  // 0.35: 110 degrees, 4: 14 degrees
    return x < 0.3 || x > 0.7 || y < 0.3 || y > 0.7 || focal < 0.35 || focal > 4;
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
    // Frames of a video differ too little from the next one to contradict it.
    const std::size_t step = std::max<std::size_t>(1, capture.frames.size() / 12);
    for (std::size_t i = 0; i + step < capture.frames.size(); ++i) {
        const RgbdFrame &a = capture.frames[i], &b = capture.frames[i + step];
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

namespace {

using Verdicts = std::vector<Verdict>;

void check_views(const Capture& capture, Verdicts& verdicts) {
    const std::size_t count = capture.frames.size();
    const Camera& camera = capture.frames.front().camera;
    const bool has_enough = count >= kMinViews;
    verdicts.push_back(
        {has_enough ? Severity::Good : Severity::Problem,
         fmt::format("{} frame{} of {} x {} pixels{}", count, count == 1 ? "" : "s", camera.width,
                     camera.height,
                     has_enough ? ""
                                : ": too few for silhouettes of glass, 12 or more around the "
                                  "scene would do")});
    if (are_of_another_size(camera)) {
        verdicts.push_back(
            {Severity::Problem,
             fmt::format("fx = {:g}, cx = {:g}, cy = {:g} are unusual for {} x {} pixels: are the "
                         "intrinsics of pictures of another size? fx, fy, cx and cy scale with it",
                         camera.fx, camera.cx, camera.cy, camera.width, camera.height)});
    }
}

void check_poses(const Capture& capture, Verdicts& verdicts) {
    if (!capture.has_poses) {
        verdicts.push_back({Severity::Note, "no poses: the camera will be tracked"});
        return;
    }
    if (capture.frames.size() < 2) return;  // nothing to compare with
    const double baseline = largest_baseline(capture), depth = median_depth(capture);
    const bool has_parallax = baseline > 0.2 * depth;
    verdicts.push_back(
        {has_parallax ? Severity::Good : Severity::Problem,
         fmt::format("poses given, cameras up to {:.2f} m apart at {:.2f} m distance{}", baseline,
                     depth, has_parallax ? "" : ": too little parallax, walk around the scene")});
    const double agreement = depth_consistency(capture, 1.0);
    const bool agrees = agreement > 0.5;
    verdicts.push_back(
        {agrees ? Severity::Good : Severity::Problem,
         fmt::format("{:.0f} % of the depth agrees between views{}", 100 * agreement,
                     agrees ? ""
                            : ": poses, intrinsics, depth_scale or the pairing of depth and "
                              "colour are wrong")});
}

void check_depth(const Capture& capture, Verdicts& verdicts) {
    std::vector<double> shares;
    for (const RgbdFrame& frame : capture.frames) shares.push_back(valid_share(frame.depth_m));
    const double typical = median(shares);
    verdicts.push_back(
        {typical > 0.3 ? Severity::Good : Severity::Problem,
         fmt::format("{:.0f} % of the depth pixels are valid{}", 100 * typical,
                     typical > 0.3 ? "" : ": too far, too near, too dark or in the sun")});
}

void check_saturation(const Capture& capture, Verdicts& verdicts) {
    double worst = 0;
    for (const RgbdFrame& frame : capture.frames) {
        worst = std::max(worst, saturated_share(frame, capture.saturation_level));
    }
    verdicts.push_back(
        {worst < 0.05 ? Severity::Good : Severity::Problem,
         fmt::format("at most {:.1f} % of a picture is saturated{}", 100 * worst,
                     worst < 0.05 ? "" : ": expose shorter, highlights carry the light")});
}

void check_blur(const Capture& capture, Verdicts& verdicts) {
    std::vector<double> sharp;
    for (const RgbdFrame& frame : capture.frames) sharp.push_back(sharpness(frame.colour));
    const double typical = median(sharp);
    for (std::size_t i = 0; i < sharp.size(); ++i) {
        if (sharp[i] >= 0.25 * typical) continue;
        verdicts.push_back({Severity::Note, fmt::format("frame {} looks blurred (motion?): leave "
                                                        "it out",
                                                        capture.frames[i].id)});
    }
}

/// With poses, by the same points in several views; without, by the whole pictures.
void check_exposure(const Capture& capture, Verdicts& verdicts) {
    std::vector<double> ratio;
    double limit = 1.1;  // sees the same surfaces: shading is not in it
    if (capture.has_poses) {
        ratio = estimate_exposure_gains(capture, cameras_of(capture)).gain;
    } else {
        limit = 1.6;  // other things are in the picture
        for (const RgbdFrame& frame : capture.frames) ratio.push_back(mean_level(frame.colour));
        const double typical = std::max(1e-12, median(ratio));
        for (double& r : ratio) r /= typical;
    }
    for (std::size_t i = 0; i < ratio.size(); ++i) {
        if (ratio[i] < limit && ratio[i] > 1 / limit) continue;
        verdicts.push_back(
            {Severity::Note,
             fmt::format("frame {} is {:.2f}x as bright as the others: lock the exposure, or give "
                         "\"exposure\" in capture.json",
                         capture.frames[i].id, ratio[i])});
    }
}

}  // namespace

std::vector<Verdict> check_capture(const Capture& capture) {
    Verdicts verdicts;
    for (const std::string& warning : capture.warnings) {
        verdicts.push_back({Severity::Note, warning});
    }
    check_views(capture, verdicts);
    check_poses(capture, verdicts);
    check_depth(capture, verdicts);
    check_saturation(capture, verdicts);
    check_blur(capture, verdicts);
    check_exposure(capture, verdicts);
    verdicts.push_back({capture.reference_albedo ? Severity::Good : Severity::Note,
                        capture.reference_albedo
                            ? "a reference albedo fixes the scale of the light"
                            : "no reference albedo: a mean albedo of 0.5 will be assumed"});
    return verdicts;
}

}  // namespace vitrine
