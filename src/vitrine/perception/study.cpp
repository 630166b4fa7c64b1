#include "perception/study.h"

#include "base/error.h"
#include "math/statistics.h"
#include "perception/direct_likelihood.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vitrine {
namespace {

constexpr double kDoubtfulP = 0.05;
constexpr int kCurvePoints = 65;
/// A coin misses half of the catch trials; who looks misses none.
constexpr double kMaxFailedCatches = 0.2;

void add_diagnostic_warnings(ScaleAnalysis& a) {
    auto& warnings = a.scale.warnings;
    const ScaleDiagnostics& d = a.diagnostics;
    if (d.lapses.p_value < kDoubtfulP && a.scale.lapse == 0) {
        warnings.push_back(fmt::format(
            "the answers look better with {:.1f} % of them random (p = {:.3g}): lapses stretch "
            "lambda; --lapse estimate takes them out",
            100 * d.lapses.lapse, d.lapses.p_value));
    }
    if (d.six_point.conditions > 0 && d.six_point.p_value < kDoubtfulP) {
        warnings.push_back(
            fmt::format("the six-point test speaks against a difference scale (p = {:.3g})",
                        d.six_point.p_value));
    }
    if (d.residuals.runs_p_value < kDoubtfulP) {
        warnings.push_back(fmt::format("the residuals keep their sign too long (p = {:.3g})",
                                       d.residuals.runs_p_value));
    }
    if (a.smooth_degrees_of_freedom == 1 && a.scale.beta.back() > 10.0) {
        // Beyond 20 lambda nearly every answer is certain and the noise hardly shows.
        warnings.push_back("the series spans more than 20 lambda: take closer stimuli");
    }
}

void add_direct_check(ScaleAnalysis& a, const QuestionCells& cells) {
    const DirectScale direct = fit_direct(cells.data, a.scale.lapse);
    a.direct_log_likelihood = direct.log_likelihood;
    for (std::size_t i = 0; i < direct.psi.size(); ++i) {
        a.direct_psi_difference =
            std::max(a.direct_psi_difference, std::abs(direct.psi[i] - a.scale.psi[i]));
    }
}

void add_catches(ScaleAnalysis& a, const Observations& observations) {
    a.catch_count += observations.catch_count;
    a.catch_failed += observations.catch_failed;
    if (observations.catch_failed > kMaxFailedCatches * observations.catch_count) {
        a.scale.warnings.push_back(fmt::format(
            "{} missed {} of {} catch trials: these answers may not be about the pictures",
            observations.observer, observations.catch_failed, observations.catch_count));
    }
}

ScaleAnalysis analyse(const std::string& name, const std::vector<Trial>& trials,
                      const std::vector<int>& sessions, const std::vector<double>& stimuli,
                      const StudyOptions& options, int replicates, const Progress& progress) {
    ScaleAnalysis a;
    a.name = name;
    const int count = static_cast<int>(stimuli.size());
    const QuestionCells cells = group_trials(trials, count);
    a.scale = fit_scale(cells, {.lapse = options.lapse, .estimate_lapse = options.estimate_lapse});
    if (a.scale.outcome == FitOutcome::NotIdentifiable) {
        for (const double n : stimuli) a.lambda.local.push_back({n, kNoThreshold});
        a.lambda_ci95 = {0, kNoThreshold};
        return a;
    }
    if (a.scale.is_usable()) add_direct_check(a, cells);

    const SmoothFitter fitter(cells, stimuli, {.lapse = a.scale.lapse});
    const SmoothScale smooth = fitter.fit(cells.data.ones);
    a.lambda = threshold_of(smooth, stimuli);
    a.smooth_degrees_of_freedom = smooth.degrees_of_freedom();
    const double origin = smooth.beta(stimuli.front());
    for (int i = 0; i < kCurvePoints; ++i) {
        const double n =
            stimuli.front() + (stimuli.back() - stimuli.front()) * i / (kCurvePoints - 1.0);
        a.smooth_curve.push_back({n, smooth.beta(n) - origin});
    }
    BootstrapOptions bootstrap = options.bootstrap;
    bootstrap.replicates = replicates;
    const ScaleBootstrap b = bootstrap_scale(cells, a.scale, fitter, smooth, stimuli, bootstrap,
                                             progress.part(0.0, 0.8));
    a.psi_ci95 = b.psi;
    a.beta_ci95 = b.beta;
    a.sigma_ci95 = b.sigma;
    a.lambda_ci95 = b.lambda;
    a.local_ci95 = b.local_lambda;
    a.bootstrap_replicates = b.replicates;
    a.separated_replicates = b.separated_replicates;
    a.diagnostics = diagnose_scale(cells, a.scale, sessions,
                                   {options.diagnostic_simulations, options.bootstrap.seed},
                                   progress.part(0.8, 1.0));
    add_diagnostic_warnings(a);
    return a;
}

void add_summary(StudyAnalysis& study) {
    std::vector<double> logs;
    int usable = 0;
    double separate = 0;
    study.mean_psi.assign(study.stimuli.size(), 0.0);
    bool all_usable = true;
    for (const ScaleAnalysis& o : study.observers) {
        all_usable = all_usable && o.scale.is_usable();
        if (!o.scale.is_usable()) continue;
        ++usable;
        separate += o.scale.log_likelihood;
        for (std::size_t i = 0; i < study.mean_psi.size(); ++i) {
            study.mean_psi[i] += o.scale.psi[i];
        }
        if (std::isfinite(o.lambda.value)) logs.push_back(std::log(o.lambda.value));
    }
    for (double& psi : study.mean_psi) psi /= std::max(1, usable);
    if (usable == 0) study.mean_psi.clear();
    if (!logs.empty()) study.lambda_geometric_mean = std::exp(mean(logs));
    if (logs.size() > 1) study.lambda_log_sd = standard_deviation(logs);
    if (all_usable && usable > 1) {
        HeterogeneityTest& test = study.heterogeneity;
        test.likelihood_ratio = 2 * (separate - study.pooled.scale.log_likelihood);
        test.degrees_of_freedom = (usable - 1) * (static_cast<int>(study.stimuli.size()) - 1);
        test.p_value = 1 - chi_square_cdf(test.likelihood_ratio, test.degrees_of_freedom);
        if (test.p_value < kDoubtfulP) {
            study.pooled.scale.warnings.push_back(fmt::format(
                "the observers differ from each other (p = {:.3g}): the pooled interval says "
                "nothing about the next observer",
                test.p_value));
        }
    }
}

std::vector<double> checked_stimuli(const std::vector<double>& stimuli, int highest) {
    if (stimuli.empty()) {
        std::vector<double> ranks(static_cast<std::size_t>(highest));
        std::iota(ranks.begin(), ranks.end(), 1.0);
        return ranks;
    }
    if (highest > static_cast<int>(stimuli.size())) {
        throw InputError({"trials", fmt::format("ranks up to {}", stimuli.size()),
                          std::to_string(highest), "is this the stimulus list of these trials?"});
    }
    for (std::size_t i = 1; i < stimuli.size(); ++i) {
        if (!(stimuli[i] > stimuli[i - 1])) {
            throw InputError({"stimuli", "rising values",
                              fmt::format("{} after {}", stimuli[i], stimuli[i - 1]), ""});
        }
    }
    return stimuli;
}

}  // namespace

StudyAnalysis analyse_study(const std::vector<Observations>& observations,
                            const std::vector<double>& stimuli, const StudyOptions& options,
                            const Progress& progress) {
    std::vector<Trial> all;
    std::vector<int> sessions;
    std::vector<std::vector<Trial>> by_observer;
    for (std::size_t o = 0; o < observations.size(); ++o) {
        by_observer.push_back(observations[o].trials);
        for (Trial& t : by_observer.back()) {
            if (options.is_reversed) t.response = 1 - t.response;
            all.push_back(t);
            sessions.push_back(static_cast<int>(o));
        }
    }
    if (all.empty()) throw InputError({"trials", "at least one main trial", "none", ""});
    StudyAnalysis study;
    study.stimuli = checked_stimuli(stimuli, highest_rank(all));
    study.stimuli_are_ior = !stimuli.empty();
    if (study.stimuli.size() < 4) {
        throw InputError({"trials", "four stimuli or more", std::to_string(study.stimuli.size()),
                          "two pairs of different stimuli need four"});
    }
    const bool is_single = observations.size() == 1;
    const double share = is_single ? 1.0 : 0.5;
    study.pooled =
        analyse(is_single ? observations[0].observer : "pooled", all, sessions, study.stimuli,
                options, options.bootstrap.replicates, progress.part(0.0, share));
    for (const Observations& o : observations) add_catches(study.pooled, o);
    if (is_single) return study;
    for (std::size_t o = 0; o < observations.size(); ++o) {
        const double at = share + (1 - share) * static_cast<double>(o) / by_observer.size();
        study.observers.push_back(analyse(
            observations[o].observer, by_observer[o], std::vector<int>(by_observer[o].size(), 0),
            study.stimuli, options, options.observer_replicates,
            progress.part(at, at + (1 - share) / by_observer.size())));
        add_catches(study.observers.back(), observations[o]);
    }
    add_summary(study);
    return study;
}

}  // namespace vitrine
