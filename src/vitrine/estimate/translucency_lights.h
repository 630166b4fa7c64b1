// estimate/translucency_lights.h: the lights behind the diffuse shading of a translucent object.
#pragma once

#include "base/progress.h"
#include "estimate/estimate.h"
#include "estimate/highlight_light.h"
#include "optics/radial_profile.h"
#include "scene/relief.h"

#include <span>
#include <string>
#include <vector>

namespace vitrine {

/// Of wax, milk, marble and flesh; C(s) of closed bodies changes little around it.
constexpr double kTypicalAlbedo = 0.6;

struct TranslucencyLightOptions {
    /// Who is soft? 1: the material (kernels of 0.08 to 0.6 inradii, little ambient light), as
    /// suits a material photo; 0: the light (0.02 to 0.1), as suits an object photo. One
    /// photograph cannot tell.
    double softness = 1.0;
    double eta = 1.3;
    int direction_count = 96;         ///< Fibonacci directions with z > -0.97
    int observation_count = 500;      ///< pixels compared
    int samples_per_side = 1600;      ///< of the surface
    double direction_penalty = 0.02;  ///< quadratic price of a light; back lights pay up to 4 times
    double highlight_discount = 0.3;  ///< factor on the price of directions seen as highlights
    double merge_deg = 40.0;          ///< lights closer than this become one
    int max_lights = 3;
    double polish_deg = 8.0;      ///< first step of the search for better directions; 0: none
    bool use_shadows = true;      ///< the object's own cast shadows
    bool use_curved_body = true;  ///< optics/curved_body.h, at the albedo kTypicalAlbedo
    bool use_ground = true;       ///< light thrown back by what the object stands on
    /// Of one body: the likeliest lamps by shading and highlights together. False: the lamps that
    /// explain its shading best on the shape as it is taken for, whose errors they take up.
    bool use_votes = true;
    std::vector<Vec3> known_lamps = {};  ///< another place to begin the search at; may be empty
    std::uint64_t seed = 1;              ///< of the choice of pixels
};

struct ViewLightsEstimate {
    ViewLights lights;                ///< white, strongest first, normalised (scene/relief.h)
    double relative_residual = 0;     ///< rms of (model - picture) / picture, weighted
    double kernel_px = 0;             ///< mean radius of the kernel that explained the picture best
    RgbExponentials kernel;           ///< of each channel, over its mean; 0: too dark to tell
    Rgbd ball_albedo = Rgbd::Zero();  ///< of a cluster (Relief::ball_albedo)
    double ambient_share = 0;         ///< of all light
    Outcome outcome = Outcome::Converged;
    std::string reason;
    std::vector<std::string> warnings;  ///< plain sentences
};

/// Non-negative least squares over a sphere of lights, each imaged through scattering kernels.
///
/// For a fixed kernel the picture is linear in the lights; kernels K = m k(g1) + (1 - m) k(g2),
/// k(g) exponential in r / g, are tried on a grid and the best explained picture wins. Directions
/// are then merged, lights on which several highlights agree are held there, the others move to
/// where they explain most; light from everywhere and from below (with the colour of the ground
/// beside the object) is estimated along with them. Replaces Lopez-Moreno et al. 2010, which
/// assumes Lambertian shading and fails on translucent things: light from behind reads as ambient
/// there. Costs about 0.5 s. `excluded`: highlights.
ViewLightsEstimate estimate_translucency_lights(const ImageRgb& diffuse, const Relief& relief,
                                                const Mask& excluded,
                                                std::span<const HighlightLight> highlight_lights,
                                                const TranslucencyLightOptions& options = {},
                                                const Progress& progress = {});

/// Scales the lights as ViewLights wants them, and says so when most light comes from everywhere.
void normalise_and_warn(ViewLightsEstimate& estimate, const Relief& relief, double eta);

}  // namespace vitrine
