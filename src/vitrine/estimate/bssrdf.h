// estimate/bssrdf.h: the diffusion profile R_d of a translucent object from one photograph whose
// shape and lights are known.
#pragma once

#include "base/progress.h"
#include "estimate/estimate.h"
#include "optics/dipole.h"
#include "optics/radial_profile.h"
#include "render/relief_light.h"
#include "scene/relief.h"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vitrine {

enum class ProfileSolver {
    Monotone,  ///< profile non-negative and falling by construction; exponentials fitted to the
               ///< image
    Qmr,       ///< as published: QMR on the normal equations, exponentials fitted to the steps
};

enum class ChannelCoupling {
    Free,     ///< each channel on its own
    Ordered,  ///< same scattering, different absorption: the darker channel is the narrower one,
              ///< unless the picture speaks clearly against it
};

/// What the surface lets through. A dielectric's Fresnel transmittance is the physical choice;
/// rough and layered skins, and many renderers, have none to speak of.
enum class Transmittance {
    Auto,     ///< whichever explains the picture with the smaller residual
    Fresnel,  ///< of index `eta`, as in the paper
    None,
};

struct BssrdfOptions {
    ProfileSolver solver = ProfileSolver::Monotone;
    ChannelCoupling coupling = ChannelCoupling::Ordered;
    double eta = 1.3;             ///< relative index, as in the paper
    int samples_per_side = 3000;  ///< of the surface
    int pixel_count = 1500;       ///< compared
    int shell_count = 24;         ///< steps of the piecewise constant profile
    double longest =
        1.0 / 3.0;  ///< bound of 1/|b|, in diameters: shape errors look like infinite tails
    double smoothing = 0.03;      ///< of the picture before the fit, in inradii: removes texture
    double ridge = 1e-4;          ///< Tikhonov weight of the piecewise profile
    bool use_shadows = true;      ///< the object's own cast shadows
    bool use_curved_body = true;  ///< optics/curved_body.h; false: the flat R_d, as published
    /// The light is given in the picture's units, so that albedos are what they are. Else only
    /// their ratios are known, and the brightest is taken for plausible at most (limit_albedo).
    bool is_level_known = false;
    /// Shape and light are trusted: what does not fit is no reason for another profile than random
    /// walks have (profile_fit.h; ordered channels only). With a wrong shape free exponentials are
    /// nearer to the truth.
    bool prefers_random_walk = false;
    Transmittance transmittance = Transmittance::Auto;
    std::uint64_t seed = 1;  ///< of the choice of pixels
};

struct ChannelFit {
    double albedo = 0;  ///< integral of R_d
    double mean_radius_px = 0;
    double relative_residual = 0;  ///< rms misfit over mean
    Outcome outcome = Outcome::Converged;
    std::string reason;
};

/// Lengths in pixels of the photograph. R_d and the light are only known up to a common factor:
/// with lights normalised (scene/relief.h) the albedo is the reflectance seen in the picture.
struct MediumEstimate {
    RgbExponentials fit;      ///< R_d = a e^{b r} + c e^{d r}, the result
    RadialProfile piecewise;  ///< the step profile, for diagnosis
    std::array<ChannelFit, 3> channels;
    std::array<std::optional<DipoleMedium>, 3> dipole;  ///< per pixel; none where it cannot be one
    double eta = 1.3;
    bool is_fresnel = true;  ///< which transmittance explained the picture better
    double inradius_px = 1;
    std::vector<std::string> warnings;

    /// The fit as a table up to where it has died away.
    RadialProfile profile() const;
};

/// Munoz et al. 2011, "BSSRDF estimation from single images", with two repairs: the profile is kept
/// non-negative and falling while it is solved, and the two exponentials are fitted to the image
/// by variable projection over their lengths, not to the steps (which biases the width by -15 %).
/// Costs about 0.3 s. `excluded`: highlights.
///
/// Beyond the paper: a closed body passes more light than the flat R_d says (curved_body.h, found
/// in rounds with the albedo), and the surface's transmittance is chosen by the residual.
MediumEstimate estimate_bssrdf(const ImageRgb& diffuse, const Relief& relief, const Mask& excluded,
                               const ViewLights& lights, const BssrdfOptions& options = {},
                               const Progress& progress = {});

/// Irradiance that enters at points of a relief, through a surface of index eta (1: none).
using EnteringLight =
    std::function<std::vector<Rgb>(const Relief& relief, const SurfacePoints& points, double eta)>;

/// The same under any light, near lamps and bounced light included.
MediumEstimate estimate_bssrdf(const ImageRgb& diffuse, const Relief& relief, const Mask& excluded,
                               const EnteringLight& light, const BssrdfOptions& options = {},
                               const Progress& progress = {});

/// Light and albedo share one unknown factor. Where the brightest channel would reflect more than
/// kPlausibleAlbedo, all channels are scaled down to it (equivalent media follow).
/// @returns the factor by which the light must then be stronger, >= 1
double limit_albedo(MediumEstimate& medium);

/// Marble, milk and wax reflect 0.75 to 0.9 in their brightest channel.
constexpr double kPlausibleAlbedo = 0.8;

}  // namespace vitrine
