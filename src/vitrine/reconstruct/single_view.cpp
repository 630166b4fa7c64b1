#include "reconstruct/single_view.h"

#include "image/filter.h"
#include "math/statistics.h"
#include "reconstruct/figures.h"
#include "reconstruct/mask_regions.h"
#include "reconstruct/support_readings.h"

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kPlaneTolerance_m = 0.02;  // one reading of one view, on glossy tables
constexpr double kRimWidth_m = 0.015;
constexpr double kSolidMargin_m = 0.005;  // colours of a thing reach beyond its depth
constexpr double kMinEvidence = 0.12;     // of a figure: clear things read the table through them
constexpr double kMaxSolidRim = 0.4;      // a hole within a thing that has depth is no thing
constexpr double kCutSlack_m = 0.008;
constexpr double kCutSmoothness = 6.0;  // one view: edges say more than histograms
constexpr double kCutMargin_m = 0.03;
constexpr int kMaxCuts = 3;

/// Lengths on things, in pixels of the picture.
class Ruler {
  public:
    explicit Ruler(double pixels_per_m) : pixels_per_m_(pixels_per_m) {}
    int px(double m) const { return std::max(1, static_cast<int>(std::lround(m * pixels_per_m_))); }
    double area(double side_m) const { return std::pow(side_m * pixels_per_m_, 2); }

  private:
    double pixels_per_m_;
};

Mask opened(const Mask& mask, int radius_px) { return dilate(erode(mask, radius_px), radius_px); }
Mask closed(const Mask& mask, int radius_px) { return erode(dilate(mask, radius_px), radius_px); }

double overlap(const Mask& a, const Mask& b) {
    return static_cast<double>(count_inside(mask_and(a, b)));
}

Mask figures_without_depth(const ImageRgb& colour, const SupportReadings& readings,
                           const Mask& solid, const Ruler& ruler) {
    const Mask where = mask_minus(erode(readings.surface, ruler.px(0.006)), solid);
    const Mask things =
        mask_or(dilate(readings.missing, ruler.px(0.02)), dilate(solid, ruler.px(0.005)));
    const FigureOptions options{.blur_px = std::max(1.2, 0.002 * ruler.px(1.0)),
                                .closing_px = ruler.px(0.005),
                                .opening_px = ruler.px(0.009),
                                .min_pixels = ruler.area(0.02)};
    Mask kept(colour.width(), colour.height());
    const Mask bare = mask_minus(readings.on_plane, things);
    for (const Region& figure : regions_of(find_figures(colour, where, bare, options), 1)) {
        const double evidence = overlap(figure.mask, readings.missing);
        if (evidence > std::max(kMinEvidence * figure.pixels, ruler.area(0.015))) {
            kept = mask_or(kept, figure.mask);
        }
    }
    return kept;
}

/// Missing depth that no figure explains, without the shadows that the sensor sees beside figures.
Mask beside_figures(const SupportReadings& readings, const Camera& camera, const Mask& figures) {
    Mask rest = mask_minus(readings.missing, figures);
    constexpr int kGap_px = 5;
    for (const Region& figure : regions_of(figures, 1)) {
        const PixelBox box = PixelBox::of(figure.mask);
        const double base_depth_m = readings.plane_depth_m((box.x0 + box.x1) / 2, box.y1 - 1);
        for (int y = box.y0; y < box.y1; ++y) {
            for (int x = 0; x < rest.width();) {
                if (!is_inside(rest, x, y)) {
                    ++x;
                    continue;
                }
                const int begin = x;
                while (x < rest.width() && is_inside(rest, x, y)) ++x;
                bool touches = false;
                for (int d = 0; d < kGap_px && !touches; ++d) {
                    touches = is_inside(figure.mask, begin - 1 - d, y) ||
                              is_inside(figure.mask, x + d, y);
                }
                const double width =
                    shadow_width_px(camera, base_depth_m, readings.plane_depth_m(begin, y));
                if (!touches || x - begin > width) continue;
                for (int i = begin; i < x; ++i) rest(i, y) = 0;
            }
        }
    }
    return rest;
}

/// What the readings around a region say.
struct Rim {
    double depth_m = 0.0;
    double on_plane = 0.0;  ///< share of the lower half's readings
};

Rim look_around(const RgbdFrame& frame, const Camera& camera, const Plane& support,
                const Mask& region, int width_px) {
    const Mask ring = mask_minus(dilate(region, width_px), region);
    const PixelBox box = PixelBox::of(region);
    std::vector<double> depths;
    double low = 0, on_plane = 0;
    for (int y = box.y0 - width_px; y < box.y1 + width_px; ++y) {
        for (int x = box.x0 - width_px; x < box.x1 + width_px; ++x) {
            if (!is_inside(ring, x, y)) continue;
            const double z = frame.depth_m(x, y);
            if (z <= 0) continue;
            depths.push_back(z);
            if (2 * y < box.y0 + box.y1) continue;
            low += 1;
            const double height = support.height(camera.unproject(x, y, z));
            on_plane += std::abs(height) < kPlaneTolerance_m ? 1 : 0;
        }
    }
    if (depths.empty() || low == 0) return {};
    return {median(std::move(depths)), on_plane / low};
}

/// Draws the outlines where colour and depth change; all regions teach what they look like.
Mask cut_outlines(const RgbdFrame& frame, const SupportReadings& readings, const Mask& solid,
                  const std::vector<Region>& regions, double saturation_level, const Ruler& ruler) {
    const int width = frame.colour.width(), height = frame.colour.height();
    std::vector<SilhouetteView> views(regions.size());
    for (std::size_t i = 0; i < regions.size(); ++i) {
        SilhouetteView& view = views[i];
        view.colour = &frame.colour;
        view.classes = &readings.classes;
        view.background = ImageRgb(width, height);
        view.has_background = Mask(width, height);
        view.hidden = solid;
        view.expected = regions[i].mask;
        view.box = PixelBox::of(view.expected).grown(ruler.px(kCutMargin_m), width, height);
    }
    const SilhouetteOptions options{.outline_slack_px = double(ruler.px(kCutSlack_m)),
                                    .smoothness = kCutSmoothness};
    Mask drawn(width, height);
    for (const Mask& mask : cut_silhouettes(views, saturation_level, options)) {
        drawn = mask_or(drawn, mask);
    }
    // Highlights and clear middles leave gaps; glasses and bottles have none in one view.
    return opened(fill_holes(drawn), ruler.px(0.006));
}

std::vector<Region> cut_at_waists(std::vector<Region> regions) {
    const std::size_t most = kMaxCuts * regions.size();
    for (std::size_t i = 0, cuts = 0; i < regions.size() && cuts < most;) {
        std::vector<Region> parts = cut_at_waist(regions[i]);
        if (parts.empty()) {
            ++i;
            continue;
        }
        ++cuts;
        regions[i] = std::move(parts[0]);
        regions.push_back(std::move(parts[1]));
    }
    return regions;
}

}  // namespace

std::vector<Outline> find_outlines(const RgbdFrame& frame, const Camera& camera,
                                   const Plane& support, double saturation_level,
                                   const OutlineOptions& options) {
    std::vector<Outline> outlines;
    const SupportReadings readings =
        read_support(frame.depth_m, camera, support, options.min_thickness_m, options.max_island_m);
    if (readings.pixels_per_m <= 0) return outlines;
    const Ruler ruler(readings.pixels_per_m);
    const double smallest = ruler.area(options.min_size_m);
    const Mask solid = dilate(readings.solid, ruler.px(kSolidMargin_m));
    const Mask figures = figures_without_depth(frame.colour, readings, solid, ruler);
    const Mask rest = opened(beside_figures(readings, camera, figures), ruler.px(0.01));
    const Mask all = mask_or(figures, without_small_regions(rest, smallest));
    std::vector<Region> regions = regions_of(fill_holes(closed(all, ruler.px(0.004))), smallest);
    std::erase_if(regions, [&](const Region& region) {
        const Mask ring = mask_minus(dilate(region.mask, ruler.px(0.006)), region.mask);
        return region.touches_border ||
               overlap(ring, solid) > kMaxSolidRim * double(count_inside(ring));
    });
    const Mask drawn = cut_outlines(frame, readings, solid, regions, saturation_level, ruler);
    for (const Region& region : cut_at_waists(regions_of(drawn, smallest))) {
        const Rim rim =
            look_around(frame, camera, support, region.mask, std::max(3, ruler.px(kRimWidth_m)));
        const double size = std::sqrt(region.pixels) * rim.depth_m / camera.fx;
        if (size < options.min_size_m || size > options.max_size_m) continue;
        if (rim.on_plane < options.min_rim_on_plane) continue;
        const double evidence = overlap(region.mask, readings.missing) / region.pixels;
        if (evidence < kMinEvidence) continue;
        outlines.push_back({frame.id, region.mask, PixelBox::of(region.mask),
                            fmt::format("{:.0f} cm2 on the support plane, {:.0f} % without depth "
                                        "of their own: glass, metal, or something dark; one view "
                                        "cannot tell",
                                        1e4 * size * size, 100 * evidence)});
    }
    return outlines;
}

}  // namespace vitrine
