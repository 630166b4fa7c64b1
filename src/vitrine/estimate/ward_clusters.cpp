#include "estimate/ward_clusters.h"

#include "base/log.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr int kMinHighlightPixels = 200;  // fewer do not fix a lobe (scene of 3,500 pixels)
constexpr double kHighlightWidth = 0.13;  // of a lobe not yet known: 15 degrees on each side
constexpr double kGainPerPaint = 0.15;

/// Pixels whose half vector to some lamp lies within two widths of the lobe.
int highlight_pixels(const std::vector<ObjectPixel>& pixels, const KnownLight& light,
                     double sigma) {
    int count = 0;
    for (const ObjectPixel& p : pixels)
        for (const DiscLight& lamp : light.lights) {
            const Vec3f to_light =
                (lamp.position_m.cast<float>() - p.surface.position).normalized();
            const Vec3f half = (to_light - p.direction).normalized();
            const double cosine = half.dot(p.surface.normal);
            const double tan2 = 1.0 / std::max(cosine * cosine, 1e-9) - 1.0;
            if (cosine > 0.0 && tan2 < 4.0 * sigma * sigma) {
                ++count;
                break;
            }
        }
    return count;
}

/// The lobe of another paint with this one's diffuse albedo.
WardFit with_shared_lobe(const EstimationScene& scene, std::vector<ObjectPixel> pixels,
                         const KnownLight& light, double bright, const SpecularOptions& options,
                         const WardFit& lead) {
    WardFit fit = lead;
    fit.pixel_count = static_cast<int>(pixels.size());
    fit.sigma.reason = "too few of its pixels lie in a highlight: lobe of another paint";
    const WardLobe lobe{lead.ward.sigma_x, lead.ward.sigma_y, lead.ward.form};
    const SpecularModel model(scene, pixels, light, options);
    const SpecularColumns columns = model.columns(lobe);
    const LobeFit diffuse = fit_lobe(model, columns, bright, false);
    fit.cost_diffuse = diffuse.cost;
    fit.cost_diffuse_with_clipped = diffuse.objective;
    for (std::size_t i = 0; i < pixels.size(); ++i)
        pixels[i].radiance -= lead.ward.rho_s * columns.lobe[i];
    const LobeFit rest = fit_lobe(model, columns, bright, false);
    fit.ward.rho_d = rest.rho_d;
    fit.cost = rest.cost;
    fit.cost_with_clipped = rest.objective;
    return fit;
}

double lobe_gain(const std::vector<WardCluster>& clusters) {
    double with = 1e-6, without = 1e-6;
    for (const WardCluster& cluster : clusters) {
        with += cluster.area_fraction * cluster.fit.cost_with_clipped;
        without += cluster.area_fraction * cluster.fit.cost_diffuse_with_clipped;
    }
    return std::log(without / with);
}

}  // namespace

ClusteredWard fit_ward_clusters(const EstimationScene& scene,
                                const std::vector<ObjectPixel>& pixels, const KnownLight& light,
                                double bright, const SpecularOptions& options) {
    ClusteredWard result;
    const SpecularModel model(scene, pixels, light, options);
    result.whole = fit_ward(model, bright, options);
    result.clusters = {{1.0, result.whole}};
    result.cost = result.whole.cost;
    result.cost_diffuse = result.whole.cost_diffuse;
    result.lobe_gain = lobe_gain(result.clusters);
    AlbedoClusters paints = find_albedo_clusters(pixels, model.irradiance());
    if (paints.count == 1) return result;

    std::vector<std::vector<ObjectPixel>> own(static_cast<std::size_t>(paints.count));
    for (std::size_t i = 0; i < pixels.size(); ++i)
        own[static_cast<std::size_t>(paints.of_pixel[i])].push_back(pixels[i]);
    // The paint that shows most of the highlight tells the lobe that the others may have to share:
    // a lobe fitted to all paints at once is worth little.
    std::vector<int> in_highlight;
    for (const std::vector<ObjectPixel>& paint : own)
        in_highlight.push_back(highlight_pixels(paint, light, kHighlightWidth));
    const auto first = static_cast<std::size_t>(
        std::max_element(in_highlight.begin(), in_highlight.end()) - in_highlight.begin());
    const WardFit lead =
        fit_ward(SpecularModel(scene, own[first], light, options), bright, options);
    std::vector<WardCluster> clusters;
    double cost = 0.0, cost_diffuse = 0.0;
    for (std::size_t k = 0; k < own.size(); ++k) {
        WardCluster cluster;
        cluster.area_fraction = paints.share[k];
        if (k == first) {
            cluster.fit = lead;
        } else if (highlight_pixels(own[k], light, lead.sigma.value) >= kMinHighlightPixels) {
            cluster.fit = fit_ward(SpecularModel(scene, own[k], light, options), bright, options);
        } else {
            cluster.fit = with_shared_lobe(scene, own[k], light, bright, options, lead);
        }
        cost += cluster.area_fraction * cluster.fit.cost;
        cost_diffuse += cluster.area_fraction * cluster.fit.cost_diffuse;
        clusters.push_back(std::move(cluster));
    }
    log_debug("{} paints: cost {:.4f} against {:.4f} with one", paints.count, cost,
              result.whole.cost);
    if (cost > std::pow(1.0 - kGainPerPaint, paints.count - 1) * result.whole.cost) return result;
    result.clusters = std::move(clusters);
    result.cost = cost;
    result.cost_diffuse = cost_diffuse;
    result.lobe_gain = lobe_gain(result.clusters);
    result.paints = std::move(paints);
    return result;
}

}  // namespace vitrine
