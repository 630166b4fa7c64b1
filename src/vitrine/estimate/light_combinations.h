// estimate/light_combinations.h: all ways to choose one of several places for each light, scored
// through Gram matrices (paper Table 1 without its cost).
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

namespace vitrine {

/// What a Ward surface shows in each pixel when light l stands at its place p, for unit intensity
/// and unit reflectance: column l * place_count + p.
struct CombinationColumns {
    int light_count = 1;
    int place_count = 9;                ///< g + 1
    Eigen::VectorXd observed;           ///< one per pixel
    Eigen::MatrixXd diffuse;            ///< pixels x (light_count * place_count)
    std::vector<Eigen::MatrixXd> lobe;  ///< the same for each trial roughness
};

struct Combination {
    std::vector<int> place;  ///< of each light
    std::size_t roughness = 0;
    double rho_d = 0.0, rho_s = 0.0;
    double squared_error = 0.0;
};

/// For each of place_count^light_count combinations, first light slowest: the roughness and the
/// rho_d, rho_s >= 0 with the least squared error (paper Eq. 12; exact for each roughness).
///
/// A combination is a sum over light_count^2 entries of the Gram matrices: its cost does not depend
/// on the number of pixels. 6561 combinations of 48 roughnesses take 0.3 s.
/// @param intensities of the lights, kept at every place
std::vector<Combination> score_combinations(const CombinationColumns& columns,
                                            std::span<const double> intensities);

/// Least squares of S = d a + s w over d, s >= 0 from the sums of products.
struct TwoColumnFit {
    double d = 0.0, s = 0.0, squared_error = 0.0;
};
TwoColumnFit fit_two_columns(double aa, double aw, double ww, double as, double ws, double ss);

}  // namespace vitrine
