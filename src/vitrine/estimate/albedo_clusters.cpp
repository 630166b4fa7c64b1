#include "estimate/albedo_clusters.h"

#include "base/rng.h"
#include "image/colour.h"
#include "math/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace vitrine {

namespace {

constexpr double kDiffuseQuantile = 0.2;  // of S / a over the views: below every highlight
constexpr std::size_t kMinPixels = 3;     // of a cell
constexpr double kMaxSpread = 1.6;        // 60 over 10 %: more, and the cell lies on a border
constexpr float kMinIrradiance = 0.05f;   // of the brightest: darker cells say little of colour
constexpr int kAttempts = 5;
constexpr double kSilhouettePerPaint = 0.05;

struct Cells {
    std::vector<Vec3f> place;
    std::vector<Vec3f> colour;  // (L / 2, a, b)
    std::vector<double> weight;
};

Cells gather_cells(const std::vector<ObjectPixel>& pixels, const std::vector<Rgb>& irradiance,
                   const AlbedoClusterOptions& options) {
    Box3 box;
    for (const ObjectPixel& p : pixels) box.extend(p.surface.position.cast<double>());
    const double edge = std::max(1e-6, box.size().maxCoeff() / options.cells_across);
    float brightest = 0.0f;
    for (const Rgb& e : irradiance) brightest = std::max(brightest, luminance(e));
    std::map<std::array<int, 3>, std::vector<std::size_t>> members;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (pixels[i].is_clipped || luminance(irradiance[i]) < kMinIrradiance * brightest) continue;
        const Vec3 c = (pixels[i].surface.position.cast<double>() - box.min) / edge;
        members[{static_cast<int>(c.x()), static_cast<int>(c.y()), static_cast<int>(c.z())}]
            .push_back(i);
    }
    Cells cells;
    for (const auto& [key, list] : members) {
        if (list.size() < kMinPixels) continue;
        Rgb albedo;
        bool is_pure = true;
        Vec3f place = Vec3f::Zero();
        for (const std::size_t i : list)
            place += pixels[i].surface.position / static_cast<float>(list.size());
        for (int c = 0; c < 3; ++c) {
            std::vector<double> ratio;
            for (const std::size_t i : list)
                ratio.push_back(kPif * pixels[i].radiance[c] / std::max(irradiance[i][c], 1e-9f));
            is_pure &= quantile(ratio, 0.6) < kMaxSpread * quantile(ratio, 0.1) + 0.02;
            albedo[c] = static_cast<float>(std::clamp(quantile(ratio, kDiffuseQuantile), 0.0, 1.0));
        }
        if (!is_pure) continue;
        Vec3f lab = lab_from_linear(albedo);
        lab.x() *= 0.5f;
        cells.place.push_back(place);
        cells.colour.push_back(lab);
        cells.weight.push_back(static_cast<double>(list.size()));
    }
    return cells;
}

struct Partition {
    std::vector<Vec3f> centre;
    std::vector<int> label;
    double inertia = 1e300;
};

std::size_t nearest(const std::vector<Vec3f>& centres, const Vec3f& x) {
    std::size_t best = 0;
    for (std::size_t k = 1; k < centres.size(); ++k)
        if ((centres[k] - x).squaredNorm() < (centres[best] - x).squaredNorm()) best = k;
    return best;
}

/// Lloyd's rounds from a k-means++ start (Arthur and Vassilvitskii 2007).
Partition k_means(const Cells& cells, int k, Rng& rng) {
    const std::size_t n = cells.colour.size();
    Partition p;
    p.centre.push_back(cells.colour[rng.next_index(static_cast<std::uint32_t>(n))]);
    while (static_cast<int>(p.centre.size()) < k) {
        std::vector<double> running;
        double sum = 0.0;
        for (const Vec3f& x : cells.colour)
            running.push_back(sum += (p.centre[nearest(p.centre, x)] - x).squaredNorm());
        const double u = rng.next_double() * sum;
        const auto chosen = std::upper_bound(running.begin(), running.end(), u) - running.begin();
        p.centre.push_back(
            cells.colour[std::min<std::size_t>(n - 1, static_cast<std::size_t>(chosen))]);
    }
    for (int round = 0; round < 30; ++round) {
        std::vector<int> label;
        std::vector<Vec3f> sum(p.centre.size(), Vec3f::Zero());
        std::vector<double> weight(p.centre.size(), 0.0);
        p.inertia = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            const std::size_t c = nearest(p.centre, cells.colour[i]);
            label.push_back(static_cast<int>(c));
            sum[c] += static_cast<float>(cells.weight[i]) * cells.colour[i];
            weight[c] += cells.weight[i];
            p.inertia += cells.weight[i] * (p.centre[c] - cells.colour[i]).squaredNorm();
        }
        for (std::size_t c = 0; c < p.centre.size(); ++c)
            if (weight[c] > 0.0) p.centre[c] = sum[c] / static_cast<float>(weight[c]);
        if (label == p.label) break;
        p.label = std::move(label);
    }
    return p;
}

/// Mean of (b - a) / max(a, b): a the mean distance to the own paint, b to the nearest other.
double silhouette(const Cells& cells, const Partition& p) {
    double total = 0.0;
    const std::size_t n = cells.colour.size();
    for (std::size_t i = 0; i < n; ++i) {
        std::vector<double> sum(p.centre.size(), 0.0), count(p.centre.size(), 0.0);
        for (std::size_t j = 0; j < n; ++j) {
            if (j == i) continue;
            const auto c = static_cast<std::size_t>(p.label[j]);
            sum[c] += (cells.colour[i] - cells.colour[j]).norm();
            count[c] += 1.0;
        }
        const auto own = static_cast<std::size_t>(p.label[i]);
        if (count[own] == 0.0) continue;
        const double a = sum[own] / count[own];
        double b = 1e300;
        for (std::size_t c = 0; c < sum.size(); ++c)
            if (c != own && count[c] > 0.0) b = std::min(b, sum[c] / count[c]);
        if (b < 1e300) total += (b - a) / std::max({a, b, 1e-12});
    }
    return total / static_cast<double>(n);
}

double least_distance(const std::vector<Vec3f>& centres) {
    double least = 1e300;
    for (std::size_t a = 0; a < centres.size(); ++a)
        for (std::size_t b = a + 1; b < centres.size(); ++b) {
            Vec3f d = centres[a] - centres[b];
            d.x() *= 2.0f;
            least = std::min<double>(least, d.norm());
        }
    return least;
}

}  // namespace

int AlbedoClusters::at(const Vec3f& point) const {
    if (place.empty()) return 0;
    return of_place[nearest(place, point)];
}

AlbedoClusters find_albedo_clusters(const std::vector<ObjectPixel>& pixels,
                                    const std::vector<Rgb>& irradiance,
                                    const AlbedoClusterOptions& options) {
    AlbedoClusters result;
    result.of_pixel.assign(pixels.size(), 0);
    result.share = {1.0};
    const Cells cells = gather_cells(pixels, irradiance, options);
    if (static_cast<int>(cells.colour.size()) < 4 * options.max_clusters) return result;
    double all = 0.0;
    for (const double w : cells.weight) all += w;

    Rng rng(stream_key(options.seed, 0xc105u));
    Partition best;
    double widest = options.min_silhouette;
    for (int k = 2; k <= options.max_clusters; ++k) {
        Partition tightest;
        for (int attempt = 0; attempt < kAttempts; ++attempt) {
            const Partition p = k_means(cells, k, rng);
            if (p.inertia < tightest.inertia) tightest = p;
        }
        std::vector<double> share(tightest.centre.size(), 0.0);
        for (std::size_t i = 0; i < cells.weight.size(); ++i)
            share[static_cast<std::size_t>(tightest.label[i])] += cells.weight[i] / all;
        if (*std::min_element(share.begin(), share.end()) < options.min_share ||
            least_distance(tightest.centre) < options.min_distance)
            continue;
        // Cells on a border mix two paints: one more cluster must pay for itself.
        const double width = silhouette(cells, tightest);
        if (width <= widest + (result.count > 1 ? kSilhouettePerPaint : 0.0)) continue;
        widest = width;
        best = tightest;
        result.count = k;
        result.share = share;
    }
    if (result.count == 1) return result;
    result.place = cells.place;
    result.of_place = best.label;
    for (std::size_t i = 0; i < pixels.size(); ++i)
        result.of_pixel[i] = result.at(pixels[i].surface.position);
    return result;
}

}  // namespace vitrine
