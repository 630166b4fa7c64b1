#include "perception/observer_model.h"

#include "base/error.h"
#include "base/rng.h"
#include "math/statistics.h"
#include "math/vector.h"
#include "perception/threshold.h"

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

/// Phi(-x) / phi(x) for x >= 6 by its continued fraction (Abramowitz and Stegun 26.2.14), where
/// erfc nears underflow. 80 levels give full double precision at 6.
double upper_mills_ratio(double x) {
    double tail = x;
    for (int level = 80; level >= 1; --level) tail = x + level / tail;
    return 1.0 / tail;
}

constexpr double kTailBegins = 6.0;
const double kLogSqrt2Pi = 0.5 * std::log(2.0 * kPi);

}  // namespace

AnswerProbability answer_probability(double eta, double lapse) {
    const double x = std::abs(eta);
    const double phi = normal_pdf(x);
    AnswerProbability a;
    if (lapse > 0) {
        const double tail = 0.5 * std::erfc(x * M_SQRT1_2);
        const double small = lapse / 2 + (1 - lapse) * tail;  // of the less likely answer
        const double large = 1 - small;
        a.log_p = std::log(large);
        a.log_q = std::log(small);
        a.score_p = (1 - lapse) * phi / large;
        a.score_q = (1 - lapse) * phi / small;
    } else if (x < kTailBegins) {
        const double tail = 0.5 * std::erfc(x * M_SQRT1_2);
        a.log_p = std::log1p(-tail);
        a.log_q = std::log(tail);
        a.score_p = phi / (1 - tail);
        a.score_q = phi / tail;
    } else {
        const double ratio = upper_mills_ratio(x);
        const double tail = phi * ratio;
        a.log_p = std::log1p(-tail);
        a.log_q = -0.5 * x * x - kLogSqrt2Pi + std::log(ratio);
        a.score_p = phi / (1 - tail);
        a.score_q = 1 / ratio;
    }
    if (eta < 0) {
        std::swap(a.log_p, a.log_q);
        std::swap(a.score_p, a.score_q);
    }
    return a;
}

double probability_of_one(double eta, double lapse) {
    return lapse / 2 + (1 - lapse) * normal_cdf(eta);
}

double decision_variable(std::span<const double> beta, const Quadruple& rank) {
    const auto at = [&](int i) {
        const int r = rank[static_cast<std::size_t>(i)];
        VITRINE_CHECK_LE(static_cast<std::size_t>(r), beta.size());
        return beta[static_cast<std::size_t>(r - 1)];
    };
    return (at(3) - at(2)) - (at(1) - at(0));
}

std::vector<Trial> simulate_answers(const SimulatedObserver& observer,
                                    std::span<const Quadruple> questions, std::uint64_t seed) {
    std::vector<Trial> trials;
    trials.reserve(questions.size());
    Rng rng(stream_key(seed, 0x6d6c6473));
    for (const Quadruple& q : questions) {
        const double p = probability_of_one(decision_variable(observer.beta, q), observer.lapse);
        trials.push_back({rng.next_double() < p ? 1 : 0, q});
    }
    return trials;
}

std::vector<double> scale_with_threshold(std::span<const double> stimuli, double lambda,
                                         double power) {
    VITRINE_CHECK_GE(stimuli.size(), std::size_t{2});
    const double span = stimuli.back() - stimuli.front();
    // t^power rises with slope up to `power` for power >= 1 (at the far end).
    const double steepest = std::max(1.0, power) / span;
    const double height = kBetaPerThreshold / (lambda * steepest);
    std::vector<double> beta;
    for (const double n : stimuli) {
        beta.push_back(height * std::pow((n - stimuli.front()) / span, power));
    }
    return beta;
}

}  // namespace vitrine
