#include "reconstruct/silhouette_cut.h"

#include "base/parallel.h"
#include "image/filter.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

#include <array>

namespace vitrine {
namespace {

constexpr int kClassBins = 6;
constexpr int kDifferenceBins = 13;   // the last one: no background known
constexpr int kColourBins = 10;       // per channel
constexpr float kMaxEvidence = 4.0f;  // of one cue: none may outvote all others alone

/// Counts inside and outside the current silhouettes, turned into log likelihood ratios.
template <std::size_t kBins>
class LikelihoodRatio {
  public:
    void add(std::size_t bin, bool is_inside, float weight = 1.0f) {
        (is_inside ? inside_ : outside_)[bin] += weight;
    }
    /// @param prior pseudo-counts per bin: rare values say little
    void finish(float prior) {
        float in = 0, out = 0;
        for (std::size_t b = 0; b < kBins; ++b) in += inside_[b], out += outside_[b];
        const float bins = static_cast<float>(kBins);
        for (std::size_t b = 0; b < kBins; ++b) {
            const float p = (inside_[b] + prior) / (in + prior * bins);
            const float q = (outside_[b] + prior) / (out + prior * bins);
            ratio_[b] = std::clamp(std::log(p / q), -kMaxEvidence, kMaxEvidence);
        }
    }
    void set_neutral(std::size_t bin) { ratio_[bin] = 0.0f; }
    float operator[](std::size_t bin) const { return ratio_[bin]; }

  private:
    std::array<float, kBins> inside_{}, outside_{}, ratio_{};
};

struct Cues {
    LikelihoodRatio<kClassBins> depth;
    LikelihoodRatio<kDifferenceBins> difference;
    LikelihoodRatio<kColourBins * kColourBins * kColourBins> colour;
};

/// Square-root encoding: equal steps are about equally visible and equally noisy.
Rgb encoded(const Rgb& c) { return c.max(0.0f).sqrt(); }

std::size_t difference_bin(const SilhouetteView& view, int x, int y) {
    if (view.has_background(x, y) < 128) return kDifferenceBins - 1;
    const float d =
        (encoded((*view.colour)(x, y)) - encoded(view.background(x, y))).abs().maxCoeff();
    // Logarithmic from 0.008 (below noise) to 0.5.
    const float position = std::log(std::max(d, 1e-4f) / 0.008f) / std::log(0.5f / 0.008f);
    return static_cast<std::size_t>(
        std::clamp(static_cast<int>(position * (kDifferenceBins - 1)), 0, kDifferenceBins - 2));
}

std::size_t colour_bin(const Rgb& linear, double saturation_level) {
    const float scale = 1.0f / std::sqrt(static_cast<float>(std::min(saturation_level, 1e3)));
    std::size_t bin = 0;
    for (int k = 0; k < 3; ++k) {
        const int b = static_cast<int>(encoded(linear)[k] * scale * kColourBins);
        bin = bin * kColourBins + static_cast<std::size_t>(std::clamp(b, 0, kColourBins - 1));
    }
    return bin;
}

bool is_other(const SilhouetteView& view, int x, int y) {
    return is_inside(view.other, x, y) && !is_inside(view.expected, x, y);
}

Cues learn(std::span<const SilhouetteView> views, double saturation_level) {
    Cues cues;
    for (const SilhouetteView& view : views) {
        if (view.expected.empty()) continue;
        for (int y = view.box.y0; y < view.box.y1; ++y) {
            for (int x = view.box.x0; x < view.box.x1; ++x) {
                if (is_inside(view.hidden, x, y) || is_other(view, x, y)) continue;
                const bool inside = is_inside(view.expected, x, y);
                cues.depth.add(static_cast<std::size_t>((*view.classes)(x, y)), inside);
                cues.difference.add(difference_bin(view, x, y), inside);
                cues.colour.add(colour_bin((*view.colour)(x, y), saturation_level), inside);
            }
        }
    }
    cues.depth.finish(30.0f);
    cues.difference.finish(30.0f);
    // What no other view shows lies mostly under objects, but that says nothing about this pixel.
    cues.difference.set_neutral(kDifferenceBins - 1);
    cues.colour.finish(4.0f);
    return cues;
}

/// Mean squared colour step between neighbours in the box: the scale of the contrast term.
double mean_step(const SilhouetteView& view) {
    double sum = 0, count = 0;
    for (int y = view.box.y0; y < view.box.y1; ++y) {
        for (int x = view.box.x0; x + 1 < view.box.x1; ++x) {
            sum +=
                (encoded((*view.colour)(x, y)) - encoded((*view.colour)(x + 1, y))).square().sum();
            count += 1;
        }
    }
    return count > 0 ? std::max(sum / count, 1e-6) : 1.0;
}

Mask cut_one(const SilhouetteView& view, const Cues& cues, double saturation_level,
             const SilhouetteOptions& options) {
    const int width = view.box.x1 - view.box.x0, height = view.box.y1 - view.box.y0;
    const ImageF outline = signed_distance(view.expected);
    const double step_scale = mean_step(view);
    cv::detail::GCGraph<double> graph;
    graph.create(width * height, 4 * width * height);
    for (int i = 0; i < width * height; ++i) graph.addVtx();
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const int px = view.box.x0 + x, py = view.box.y0 + y, node = y * width + x;
            const Rgb here = encoded((*view.colour)(px, py));
            double evidence = 0;
            if (!is_inside(view.hidden, px, py)) {
                evidence = 0.5 * cues.colour[colour_bin((*view.colour)(px, py), saturation_level)];
                if (!is_other(view, px, py)) {
                    evidence += cues.depth[static_cast<std::size_t>((*view.classes)(px, py))] +
                                cues.difference[difference_bin(view, px, py)];
                }
            }
            // Near the expected outline the pixels decide; far outside the expectation does. Deep
            // inside two strong cues together still dig a hole: a ring has one.
            const double away = outline(px, py) / options.outline_slack_px;
            evidence -= std::clamp(away * std::abs(away), -1.0, 3.0) * 3.0;
            graph.addTermWeights(node, std::max(evidence, 0.0), std::max(-evidence, 0.0));
            const auto link = [&](int dx, int dy, double length) {
                if (x + dx < 0 || x + dx >= width || y + dy >= height) return;
                const Rgb there = encoded((*view.colour)(px + dx, py + dy));
                const double step = double((here - there).square().sum()) / step_scale;
                const double w =
                    options.smoothness / length * (0.15 + 0.85 * std::exp(-0.5 * step));
                graph.addEdges(node, node + dy * width + dx, w, w);
            };
            link(1, 0, 1.0);
            link(0, 1, 1.0);
            link(1, 1, 1.4142);
            link(-1, 1, 1.4142);
        }
    }
    graph.maxFlow();
    Mask mask(view.colour->width(), view.colour->height());
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const int px = view.box.x0 + x, py = view.box.y0 + y;
            if (graph.inSourceSegment(y * width + x) && !is_inside(view.hidden, px, py)) {
                mask(px, py) = 255;
            }
        }
    }
    return mask;
}

}  // namespace

std::vector<Mask> cut_silhouettes(std::span<const SilhouetteView> views, double saturation_level,
                                  const SilhouetteOptions& options) {
    const Cues cues = learn(views, saturation_level);
    std::vector<Mask> masks(views.size());
    parallel_for(views.size(), 1, [&](std::size_t i) {
        const SilhouetteView& view = views[i];
        if (view.expected.empty() || view.box.is_empty()) return;
        masks[i] = view.is_fixed ? view.expected : cut_one(view, cues, saturation_level, options);
    });
    return masks;
}

}  // namespace vitrine
