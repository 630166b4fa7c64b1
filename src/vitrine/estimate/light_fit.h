// estimate/light_fit.h: how well trial lights explain the scan when every surface's albedo is free.
//
// Model of sample i on cluster c:  L_i = (rho_c / pi) I (D_i + b A_i + g G_i),
//   D direct irradiance per W/sr (sum over lights with relative weights), A openness, b = ambient
//   radiance / I, G bounced irradiance as gathered from the pictures, g = 1 / I.
// Residuals are logarithms, so the unknown rho_c I is one shift per cluster and texture is equal
// noise everywhere; the loss saturates (Geman and McClure 1987), so shadows decide by their area.
#pragma once

#include "estimate/observations.h"

#include <span>
#include <vector>

namespace vitrine {

constexpr int kLuminance = 3;  ///< channel index that means luminance

/// Sample that fixes the scale: its albedo is known.
struct ReferenceSample {
    SurfacePoint point;
    Rgb radiance = Rgb::Zero();
    Rgb albedo = Rgb::Constant(0.5f);
};

struct LightScore {
    double cost = 1.0;             ///< mean robust loss in [0, 1]
    double ambient_ratio = 0.0;    ///< b: ambient radiance per W/sr of the summed lights
    double intensity = 1.0;        ///< I in W/sr
    std::vector<double> log_gain;  ///< per cluster: log(rho_c I / pi)
    double residual_rms = 0.0;     ///< of the inliers, relative
};

/// Weighted sum of light columns, ready to be scored.
struct LightColumns {
    std::vector<float> clear, through;
    LightColumns& add(const DirectColumn& column, double weight);
};

/// Holds references to scene and samples. Const after construction; safe from all threads.
class LightFit {
  public:
    LightFit(const EstimationScene& scene, const ScanSamples& samples,
             const std::optional<ReferenceSample>& reference, std::uint32_t opaque_mask,
             std::uint32_t see_through_mask, std::uint64_t seed);

    /// From here on the columns' weights are the lights' true intensities: the scale is not fitted.
    void know_intensity() { is_intensity_known_ = true; }

    /// Irradiance of one light of 1 W/sr at every `stride`-th sample (and the reference).
    DirectColumn column(const TrialLight& light, int disc_samples, int stride) const;

    /// Projects albedos out, searches b, fixes I. @param channel 0..2 or kLuminance
    LightScore score(const LightColumns& columns, int stride, int channel) const;
    /// One channel of a light whose luminance has the ambient ratio `b`: its own lies within a
    /// factor of three. A colour of the light decides more than that; a wrong minimum elsewhere may
    /// not.
    LightScore score_near(const LightColumns& columns, int stride, int channel, double b) const;
    /// The same with b given.
    LightScore score_at(const LightColumns& columns, int stride, int channel,
                        double ambient_ratio) const;
    /// Loss and weight of every sample under a score, for the sandwich of block sums.
    void losses(const LightColumns& columns, int stride, int channel, const LightScore& score,
                std::vector<double>& loss, std::vector<double>& weight) const;

    const ScanSamples& samples() const { return samples_; }
    std::size_t count(int stride) const;
    bool has_reference() const { return reference_.has_value(); }

  private:
    double max_ambient_ratio(const LightColumns& columns, int stride) const;
    double irradiance(const LightColumns& columns, std::size_t row, std::size_t sample, int channel,
                      double b, double g) const;

    const EstimationScene& scene_;
    const ScanSamples& samples_;
    std::optional<ReferenceSample> reference_;
    std::uint32_t opaque_mask_, see_through_mask_;
    std::vector<std::vector<float>> log_radiance_;  // [channel][sample]
    std::vector<float> weight_;
    GatheredLight at_reference_;
    bool is_intensity_known_ = false;
};

}  // namespace vitrine
