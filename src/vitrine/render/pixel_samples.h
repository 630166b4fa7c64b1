// render/pixel_samples.h: paths of a pixel in the scene with virtual parts and in the one without,
// and what they sum to.
#pragma once

#include "render/path_group.h"
#include "render/soft_light.h"

namespace vitrine {

/// Soft light of the samples of a pixel that see real surfaces, or of those that see virtual ones.
/// Values are sums of radiance over albedo.
struct SoftSums {
    Rgb with = Rgb::Zero(), shadow = Rgb::Zero(), diffuse = Rgb::Zero();
    Rgb albedo = Rgb::Zero();  // of all samples, also those without soft light
    Vec3f position = Vec3f::Zero(), normal = Vec3f::Zero();
    float inverse_square = 0;
    int hits = 0;
    int seen = 0;   // samples that show a plain diffuse surface
    int count = 0;  // and have found its soft light

    /// @param finds_soft whether the path was asked for it
    void add(const PathResult& path, bool finds_soft);
    /// @param distance of what sends soft light; 0: nothing was met
    void add_hit(float distance);
    /// For `average_soft_light`; the variance is that per variance of one path.
    SoftPixel mean() const;
};

/// Sums over the samples of one pixel.
struct PixelSums {
    Rgb with = Rgb::Zero(), without = Rgb::Zero(), object = Rgb::Zero();
    std::array<Rgb, kLayerCount> delta;
    Rgb hidden = Rgb::Zero();  // soft light of real surfaces behind virtual ones
    SoftSums soft_real, soft_virtual;
    // Luminance of what the composite gets: of sharp light by blocks of samples, and of soft light.
    float block = 0, change = 0, block_square = 0, soft_change = 0, soft_change_square = 0;
    int count = 0, soft_count = 0, covered = 0;
    PixelSums() { delta.fill(Rgb::Zero()); }

    /// Of the mean change of sharp light. Samples of a block are stratified: blocks, not samples,
    /// are independent.
    float sharp_variance() const;
};

/// Variance of the mean of `count` values from their sum and the sum of their squares.
float variance_of_mean(float sum, float square_sum, int count);

class PixelSampler {
  public:
    /// @param maps of the progressive passes: the samples of a pixel take turns
    PixelSampler(const RenderScene& scene, const std::vector<CausticMaps>& maps,
                 const TranslucentLight& translucent, const Camera& camera,
                 const PathOptions& paths, std::uint64_t seed);

    /// Brings the pixels of row `y` to `target` samples, and those with soft light to
    /// `soft_target`.
    /// @param light_samples shadow rays per lamp of samples without soft light
    void add_samples(int y, const Image<int>& target, const Image<int>& soft_target,
                     int light_samples, Image<PixelSums>& sums) const;

  private:
    void add(const PathPair& pair, const PathWish& wish, PixelSums& sums) const;

    std::vector<PathTracer> tracers_;
    CameraRays rays_;
    std::uint64_t seed_;
    mutable Pool<PathGroup> groups_;
};

}  // namespace vitrine
