// estimate/specular.h: Ward reflectance of a candidate under known light.
//
// For a fixed roughness the model is linear in (rho_d, rho_s): what is left is a search in one
// variable (grid and golden section; 55 of 56 fits have one minimum).
#pragma once

#include "estimate/estimate.h"
#include "estimate/object_pixels.h"
#include "scene/light.h"
#include "scene/material.h"

#include <vector>

namespace vitrine {

struct SpecularOptions {
    double sigma_min = 0.01;  ///< 0 is singular
    double sigma_max = 0.6;   ///< wider lobes pass for diffuse
    int sigma_grid = 18;      ///< logarithmic
    int lobe_samples = 12;    ///< rays per pixel and roughness into the reflected surroundings
    int disc_samples = 24;    ///< of each lamp: its size widens the highlight
    double normal_noise_rad = 0.0;  ///< of the hull; widens the lobe: s_fit^2 = s^2 + 2 noise^2
};

/// Lamps and ambient as the specular model takes them.
struct KnownLight {
    std::vector<DiscLight> lights;
    Rgb ambient = Rgb::Zero();
    std::uint32_t opaque_mask = kScanMask;  ///< what shadows the object, itself included
};

struct WardFit {
    Ward ward;  ///< isotropic
    Estimate<double> sigma;
    Rgb stddev_rho_d = Rgb::Zero(), stddev_rho_s = Rgb::Zero();
    double cost = 1.0;                 ///< mean of min(|residual| / bright level, 0.25)
    double cost_diffuse = 1.0;         ///< of the best fit without a lobe
    Rgb albedo = Rgb::Constant(0.5f);  ///< of that fit
    double lobe_share = 0.0;           ///< share of the light explained by the lobe
    int pixel_count = 0;
};

/// What a Ward surface shows in each pixel, per unit rho_d and rho_s.
struct SpecularColumns {
    std::vector<Rgb> diffuse, lobe;
};

/// Light that does not depend on roughness, computed once per object.
class SpecularModel {
  public:
    SpecularModel(const EstimationScene& scene, const std::vector<ObjectPixel>& pixels,
                  const KnownLight& light, const SpecularOptions& options);
    SpecularColumns columns(double sigma, WardForm form) const;
    const std::vector<ObjectPixel>& pixels() const { return pixels_; }

  private:
    const EstimationScene& scene_;
    const std::vector<ObjectPixel>& pixels_;
    KnownLight light_;
    SpecularOptions options_;
    std::vector<Rgb> irradiance_;
    std::vector<std::vector<float>> visibility_;  // [light][pixel]
};

/// Fits one cluster: both normalisations of the lobe are tried and the better one kept.
/// Costs about 1 s for 3,500 pixels on two cores.
WardFit fit_ward(const SpecularModel& model, double bright, const SpecularOptions& options);

/// The picture the fit predicts, pixel by pixel.
std::vector<Rgb> predict_ward(const SpecularModel& model, const Ward& ward);

}  // namespace vitrine
