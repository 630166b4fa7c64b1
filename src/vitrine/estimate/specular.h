// estimate/specular.h: Ward reflectance of a candidate under known light.
//
// For a fixed roughness the model is linear in (rho_d, rho_s): what is left is a search in one
// variable (grid and golden section; 55 of 56 fits have one minimum), or two when brushed metal
// asks for it. Clipped pixels count as "at least".
#pragma once

#include "estimate/estimate.h"
#include "estimate/object_pixels.h"
#include "estimate/ward_bound.h"
#include "scene/light.h"
#include "scene/material.h"

#include <optional>
#include <vector>

namespace vitrine {

struct SpecularOptions {
    double sigma_min = 0.01;  ///< 0 is singular
    double sigma_max = 0.6;   ///< wider lobes pass for diffuse
    int sigma_grid = 18;      ///< logarithmic
    int lobe_samples = 12;    ///< rays per pixel and roughness into the reflected surroundings
    int disc_samples = 24;    ///< of each lamp: its size widens the highlight
    /// Of the hull, per axis; widens the lobe: s_fit^2 = s^2 + 2 noise^2.
    double normal_noise_rad = 0.0;
    bool is_certified = false;   ///< prove the optimum by branch and bound (ward_bound.h)
    bool may_be_brushed = true;  ///< try two roughnesses, keep them by evidence
};

/// Shape of the lobe; x is the tangent of `Frame(normal)`, as in the renderer.
struct WardLobe {
    double sigma_x = 0.1, sigma_y = 0.1;
    WardForm form = WardForm::Ward;
};

/// Lamps and ambient as the specular model takes them.
struct KnownLight {
    std::vector<DiscLight> lights;
    Rgb ambient = Rgb::Zero();
    std::uint32_t opaque_mask = kScanMask;  ///< what shadows the object, itself included
    /// Of the irradiance all lamps throw on the scene's middle, relative: reflectances share it.
    double stddev_irradiance_ratio = 0.0;
};

struct WardFit {
    Ward ward;
    Estimate<double> sigma;  ///< geometric mean of both when they differ
    Rgb stddev_rho_d = Rgb::Zero(), stddev_rho_s = Rgb::Zero();
    double cost = 1.0;          ///< mean of min(|residual| / bright level, 0.25)
    double cost_diffuse = 1.0;  ///< of the best fit without a lobe
    /// The same two with clipped pixels, which the other models leave out: in both "at least".
    double cost_with_clipped = 1.0, cost_diffuse_with_clipped = 1.0;
    Rgb albedo = Rgb::Constant(0.5f);  ///< of that fit
    double lobe_share = 0.0;           ///< share of the light explained by the lobe
    int pixel_count = 0;
    int censored_count = 0;       ///< of them clipped: "at least"
    double cost_isotropic = 1.0;  ///< of the best fit with one roughness
    std::optional<WardCertificate> certificate;
};

/// What a Ward surface shows in each pixel, per unit rho_d and rho_s.
struct SpecularColumns {
    std::vector<Rgb> diffuse, lobe;
};

/// Light that does not depend on roughness, computed once per object. Keeps references to scene and
/// pixels.
class SpecularModel {
  public:
    SpecularModel(const EstimationScene& scene, const std::vector<ObjectPixel>& pixels,
                  const KnownLight& light, const SpecularOptions& options);
    /// The same surroundings under other lamps.
    SpecularModel with_lamps(const std::vector<DiscLight>& lamps) const;

    SpecularColumns columns(const WardLobe& lobe) const;
    /// The reflected surroundings per unit rho_s, lamps left out: the same for any lamps.
    std::vector<Rgb> surroundings(const WardLobe& lobe) const;
    /// Diffuse columns, and lobes of the lamps added to `surroundings`.
    SpecularColumns with_direct(const WardLobe& lobe, std::vector<Rgb> surroundings) const;

    /// The fit as branch and bound takes it: surroundings held at `lobe`, lamps as point sets.
    /// @param weight of each pixel and channel
    WardProblem problem(const WardLobe& lobe, const std::vector<Rgbd>& weight) const;

    /// Share of the pixels that some lamp reaches.
    double lit_share() const;
    const std::vector<ObjectPixel>& pixels() const { return pixels_; }
    const KnownLight& light() const { return light_; }
    const std::vector<Rgb>& irradiance() const { return irradiance_; }

  private:
    void set_lamps(const std::vector<DiscLight>& lamps);

    const EstimationScene& scene_;
    const std::vector<ObjectPixel>& pixels_;
    KnownLight light_;
    SpecularOptions options_;
    std::vector<Rgb> soft_irradiance_;            // bounced and ambient
    std::vector<Rgb> irradiance_;                 // with the lamps
    std::vector<std::vector<float>> visibility_;  // [lamp][pixel]
};

/// rho_d and rho_s of one lobe shape by a robust fit (towards L1), both non-negative.
struct LobeFit {
    Rgb rho_d = Rgb::Zero(), rho_s = Rgb::Zero();
    double cost = 1.0;       ///< over unclipped pixels: comparable with other models
    double objective = 1.0;  ///< over clipped ones too: what the roughness is chosen by
};
/// @param count how often each pixel counts; empty: once
/// @param weight if given, becomes the final weight of each pixel and channel
LobeFit fit_lobe(const SpecularModel& model, const SpecularColumns& columns, double bright,
                 bool with_lobe, const std::vector<int>& count = {},
                 std::vector<Rgbd>* weight = nullptr);

/// Fits one cluster: both normalisations of the lobe are tried and the better one kept.
/// Costs about 1 s for 3,500 pixels on two cores; 2 s more with a certificate.
WardFit fit_ward(const SpecularModel& model, double bright, const SpecularOptions& options);

/// The picture the fit predicts, pixel by pixel.
std::vector<Rgb> predict_ward(const SpecularModel& model, const Ward& ward);

}  // namespace vitrine
