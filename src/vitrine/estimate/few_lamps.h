// estimate/few_lamps.h: few lamps and what is beneath the surface, fitted to all channels at once.
#pragma once

#include "estimate/light_fields.h"
#include "optics/radial_profile.h"

#include <array>
#include <optional>
#include <vector>

namespace vitrine {

struct FewLampsOptions {
    double shortest_px = 1, longest_px = 100;  ///< lengths that a kernel may be made of
    int length_count = 9;
    double lamp_price = 0.006;    ///< quadratic price of a lamp not seen; from behind up to 4 times
    double ambient_price = 0.07;  ///< of light from everywhere
    double ground_price = 0.04;   ///< of light from below
    double first_step_deg = 8;    ///< of the search for better directions; 0: none
    double held_reach_deg = 0;    ///< how far shading may move a lamp from where highlights show it
    double looks = 50;            ///< independent looks at the object that the misfit counts for
    double lamp_cost = 0.5;       ///< log-likelihood that a lamp must win to stay
    double join_deg = 0;          ///< lamps closer than this may be one
    double false_votes = 0.4;     ///< share of votes that no lamp cast
    bool use_curved_body = true;  ///< optics/curved_body.h
};

/// Where highlights show a lamp: it is there, for nothing, and within `held_reach_deg`.
using SeenAt = std::optional<Vec3>;

/// A highlight says where a lamp is, as well as the normal there is known.
struct LampVote {
    Vec3 direction = Vec3(0, 0, 1);
    double weight = 1;         ///< at most 1
    double concentration = 1;  ///< about its lamp (von Mises and Fisher)
};

/// Directions to begin with.
struct LampStart {
    std::vector<Vec3> directions;
    std::vector<SeenAt> seen_at;  ///< of each
};

/// Lamps and kernels that explain the picture together. Light is white but for the ground's.
struct FewLamps {
    std::vector<Vec3> directions;
    std::vector<SeenAt> seen_at;  ///< of each
    Eigen::VectorXd intensity;    ///< of the directions, then from everywhere, then from below
    std::array<TwoExponentials, 3> kernel;  ///< with the albedos, up to the common factor
    Rgbd ball_albedo = Rgbd::Zero();        ///< by which balls light each other
    double misfit = 1e300;                  ///< sum of squares, weighted, prices included
    double relative_residual = 0;           ///< rms
};

/// Minimises over directions, intensities and one kernel of two exponentials per channel
///   sum_c sum_p w_cp (sum_l x_l g_lc (K_c e_l)_p - y_cp)^2 + prices,  x >= 0,  Huber weights,
/// y the exitance of each channel over its mean, e_l the fields of unit lamps, g the ground's
/// colour. With one channel a narrow kernel under spread light looks like a wide one under a lamp;
/// the same few white lamps must explain channels that scatter differently, which tells them apart.
/// Kernels are found by variable projection (as in profile_fit.h) in turn with the intensities
/// (non-negative least squares), from every length as a start; directions by pattern search.
/// Directions and the number of lamps minimise
///   looks / 2 ln(misfit) - sum_b weight_b ln p(vote_b | directions) + lamp_cost (lamps):
/// shading and highlights together. Residuals come from errors of the shape, which are few and wide
/// and which every lamp more explains a little: hence `looks`, not pixels. Of several starts the
/// likeliest, kernels and intensities fitted, is followed.
/// @param exitance observations x 3; a channel of zeros takes no part
/// @param starts at least one
FewLamps fit_few_lamps(const LitRelief& object, const Eigen::MatrixXd& exitance,
                       const Rgbd& ground_colour, const std::vector<LampStart>& starts,
                       const std::vector<LampVote>& votes, const FewLampsOptions& options);

}  // namespace vitrine
