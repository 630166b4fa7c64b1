#include "reconstruct/figures.h"

#include "image/filter.h"
#include "math/statistics.h"
#include "reconstruct/mask_regions.h"

#include <cmath>

namespace vitrine {
namespace {

constexpr double kPatternQuantile = 0.9;
constexpr double kMinContrast = 1.5;  // of an edge to that quantile of the surface's own

/// Largest step of a channel per pixel, of square-root encoded colours.
ImageF edge_strength(const ImageRgb& colour, double blur_px) {
    ImageRgb encoded(colour.width(), colour.height());
    for (std::size_t i = 0; i < colour.size(); ++i) encoded[i] = colour[i].max(0.0f).sqrt();
    const ImageRgb smooth = gaussian_blur(encoded, blur_px);
    ImageF strength(colour.width(), colour.height());
    for (int y = 0; y < colour.height(); ++y) {
        for (int x = 0; x < colour.width(); ++x) {
            const Rgb across = smooth.clamped(x + 1, y) - smooth.clamped(x - 1, y);
            const Rgb down = smooth.clamped(x, y + 1) - smooth.clamped(x, y - 1);
            strength(x, y) = 0.5f * (across.square() + down.square()).sqrt().maxCoeff();
        }
    }
    return strength;
}

}  // namespace

Mask find_figures(const ImageRgb& colour, const Mask& where, const Mask& bare,
                  const FigureOptions& options) {
    const ImageF strength = edge_strength(colour, options.blur_px);
    std::vector<double> own;
    for (std::size_t i = 0; i < bare.size(); i += 3) {
        if (bare[i] > 127) own.push_back(strength[i]);
    }
    Mask figures(colour.width(), colour.height());
    if (own.size() < 100) return figures;
    const double least = kMinContrast * quantile(std::move(own), kPatternQuantile);
    for (std::size_t i = 0; i < figures.size(); ++i) {
        figures[i] = where[i] > 127 && strength[i] > least ? 255 : 0;
    }
    figures = fill_holes(erode(dilate(figures, options.closing_px), options.closing_px));
    figures = dilate(erode(figures, options.opening_px), options.opening_px);
    return without_small_regions(figures, options.min_pixels);
}

}  // namespace vitrine
