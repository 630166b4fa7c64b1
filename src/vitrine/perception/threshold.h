// perception/threshold.h: lambda, the smallest change of the refractive index that is seen.
//
// Two stimuli are told apart with d' = 1 when their scale values differ by 0.5 in beta: the noise
// of a decision over four stimuli has sigma_Delta^2 = 4 sigma_s^2, so one stimulus has half of it
// and d'(x, y) = |psi_x - psi_y| / sigma_s = 2 |beta_x - beta_y| (Devinck and Knoblauch 2012;
// Aguilar, Wichmann and Maertens 2017). The paper reads its lambda off a figure.
#pragma once

#include "perception/difference_scale.h"

#include <array>
#include <limits>
#include <span>
#include <vector>

namespace vitrine {

/// Change of beta with d' = 1.
constexpr double kBetaPerThreshold = 0.5;

/// A smooth scale over the physical variable: a polynomial with few degrees of freedom (1 = a
/// straight line) that is 0 at the first stimulus, fitted to the answers themselves and not to
/// fitted points. A natural spline's ends are straight, which takes a tenth off the slope of a
/// quadratic scale where it is steepest.
class SmoothScale {
  public:
    SmoothScale(double begin, double end, int degree);
    int degrees_of_freedom() const { return static_cast<int>(coefficients.size()); }
    double begin() const { return begin_; }
    double end() const { return end_; }
    /// Values of the basis at n; linear beyond the ends. The constant is left out: differences
    /// alone matter.
    Eigen::VectorXd basis(double n) const;
    double beta(double n) const;

    Eigen::VectorXd coefficients;
    double log_likelihood = 0;
    double bic = std::numeric_limits<double>::infinity();
    bool has_converged = false;

  private:
    double begin_, end_;
};

struct SmoothOptions {
    int max_degrees_of_freedom = 5;
    double lapse = 0.0;
};

/// Everything about the candidates that does not depend on the answers, for repeated fits.
class SmoothFitter {
  public:
    /// @param stimuli rising physical values, one per rank
    SmoothFitter(const QuestionCells& cells, std::span<const double> stimuli,
                 const SmoothOptions& options = {});
    /// The candidate with the least Bayesian information criterion (Schwarz 1978).
    SmoothScale fit(const Eigen::VectorXd& ones) const;
    /// Later fits start from what fits these answers: for replicates of one data set.
    void start_from(const Eigen::VectorXd& ones);
    /// P(1) per cell.
    std::vector<double> probabilities(const SmoothScale& scale) const;
    const Eigen::MatrixXd& design(const SmoothScale& scale) const;

  private:
    SmoothScale fit_candidate(std::size_t index, const Eigen::VectorXd& ones) const;

    std::vector<SmoothScale> candidates_;   ///< their coefficients are where fits start
    std::vector<Eigen::MatrixXd> designs_;  ///< cells x degrees of freedom
    Eigen::VectorXd answers_;
    double answer_count_ = 0;
    double lapse_;
};

constexpr double kNoThreshold = std::numeric_limits<double>::infinity();

/// Width of the interval around n over which beta rises by 0.5, the scale continued straight
/// beyond its ends; `kNoThreshold` when four times the range is not enough.
double local_threshold(const SmoothScale& scale, double n);

struct Threshold {
    double value = kNoThreshold;               ///< the smallest of the local ones
    std::vector<std::array<double, 2>> local;  ///< (n, lambda at n) at each stimulus
};
Threshold threshold_of(const SmoothScale& scale, std::span<const double> stimuli);

}  // namespace vitrine
