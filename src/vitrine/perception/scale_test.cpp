#include "base/error.h"
#include "base/file.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "math/statistics.h"
#include "perception/design.h"
#include "perception/direct_likelihood.h"
#include "perception/observer_model.h"
#include "perception/scale_bootstrap.h"
#include "perception/scale_diagnostics.h"
#include "perception/scale_json.h"
#include "perception/study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

namespace vitrine {
namespace {

const std::vector<double> kStimuli = equal_steps(1.400, 1.465, 10);

std::vector<Trial> answers(const std::vector<double>& beta, std::uint64_t seed, double lapse = 0,
                           int repeats = 1) {
    const auto all = all_quadruples(static_cast<int>(beta.size()));
    std::vector<Quadruple> questions;
    for (int r = 0; r < repeats; ++r) questions.insert(questions.end(), all.begin(), all.end());
    return simulate_answers({beta, lapse}, questions, seed);
}

Eigen::VectorXd free_part(const std::vector<double>& beta) {
    return Eigen::Map<const Eigen::VectorXd>(beta.data() + 1,
                                             static_cast<Eigen::Index>(beta.size()) - 1);
}

// --- the regression ---------------------------------------------------------------------------

TEST(Probit, RecoversTheScaleFromExactProportions) {
    // Cells whose share of ones is the true probability: the maximum is the truth itself.
    const std::vector<double> beta = {0, 0.3, 0.9, 1.1, 2.0, 3.2};
    auto cells = group_trials(answers(beta, 1), 6);
    for (std::size_t i = 0; i < cells.rank.size(); ++i) {
        const auto row = static_cast<Eigen::Index>(i);
        cells.data.answers[row] = 1000;
        cells.data.ones[row] = 1000 * probability_of_one(decision_variable(beta, cells.rank[i]));
    }
    const ProbitFit fit = fit_probit(cells.data);
    EXPECT_TRUE(fit.has_converged);
    EXPECT_LT((fit.beta - free_part(beta)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(Probit, GradientVanishesAndCovarianceIsInverseInformation) {
    const auto cells = group_trials(answers(scale_with_threshold(kStimuli, 0.01), 3), 10);
    for (const double lapse : {0.0, 0.05}) {
        const ProbitFit fit = fit_probit(cells.data, {.lapse = lapse});
        ASSERT_TRUE(fit.has_converged);
        for (Eigen::Index k = 0; k < fit.beta.size(); ++k) {
            Eigen::VectorXd up = fit.beta, down = fit.beta;
            up[k] += 1e-5;
            down[k] -= 1e-5;
            const double slope = (probit_log_likelihood(cells.data, up, lapse) -
                                  probit_log_likelihood(cells.data, down, lapse)) /
                                 2e-5;
            EXPECT_NEAR(slope, 0.0, 1e-6);
        }
        EXPECT_GT(fit.covariance.diagonal().minCoeff(), 0.0);
    }
}

TEST(Probit, SwappedPairsGiveTheSameScale) {
    const auto trials = answers(scale_with_threshold(kStimuli, 0.01), 4);
    std::vector<Trial> swapped = trials;
    for (std::size_t i = 0; i < swapped.size(); i += 2) {
        std::swap(swapped[i].rank[0], swapped[i].rank[2]);
        std::swap(swapped[i].rank[1], swapped[i].rank[3]);
        swapped[i].response = 1 - swapped[i].response;
    }
    EXPECT_EQ(fit_scale(trials).beta, fit_scale(swapped).beta);
}

TEST(Direct, AgreesWithTheRegression) {
    for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
        const auto cells = group_trials(answers(scale_with_threshold(kStimuli, 0.012), seed), 10);
        const auto scale = fit_scale(cells);
        const auto direct = fit_direct(cells.data);
        ASSERT_TRUE(scale.is_usable() && direct.has_converged);
        EXPECT_NEAR(direct.log_likelihood, scale.log_likelihood, 1e-9);
        EXPECT_NEAR(direct.sigma, scale.sigma, 1e-7);
        for (std::size_t i = 0; i < direct.psi.size(); ++i) {
            EXPECT_NEAR(direct.psi[i], scale.psi[i], 1e-7);
        }
    }
}

// --- guards -----------------------------------------------------------------------------------

TEST(Guards, SeesCompleteSeparation) {
    // A noiseless observer answers every question by the sign of its difference.
    const std::vector<double> beta = {0, 1, 2.1, 3.3, 4.7, 6.4};
    auto trials = answers(beta, 1);
    for (Trial& t : trials) t.response = decision_variable(beta, t.rank) > 0;
    const auto scale = fit_scale(trials);
    EXPECT_EQ(scale.outcome, FitOutcome::AtBound);
    EXPECT_NE(scale.reason.find("separated"), std::string::npos);
    for (const double b : scale.beta) EXPECT_TRUE(std::isfinite(b));
}

TEST(Guards, SeesSeparationOfOneStimulusOnly) {
    // Plenty of noise among the first five; the sixth is always seen as far away.
    const std::vector<double> beta = {0, 0.2, 0.5, 0.7, 1.0, 60};
    const auto cells = group_trials(answers(beta, 2, 0, 5), 6);
    Eigen::VectorXd direction;
    EXPECT_TRUE(is_separated(cells.data, &direction));
    EXPECT_GT(std::abs(direction[4]), 0.5);
    EXPECT_EQ(fit_scale(cells).outcome, FitOutcome::AtBound);
}

TEST(Guards, OverlappingAnswersAreNotSeparated) {
    for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
        const auto cells = group_trials(answers(scale_with_threshold(kStimuli, 0.01), seed), 10);
        EXPECT_FALSE(is_separated(cells.data));
    }
}

TEST(Guards, SeparationTestAgreesWithTheRunawayOfTheFit) {
    int separated = 0;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        // 35 trials on a steep scale: about half of the sets are separated.
        const std::vector<double> beta = {0, 1.2, 2.6, 3.9, 5.5, 6.4, 8};
        const auto cells = group_trials(answers(beta, seed), 7);
        const bool found = is_separated(cells.data);
        const ProbitFit fit = fit_probit(cells.data, {.max_iterations = 30, .tolerance = 1e-7});
        const bool ran_away = !fit.has_converged || fit.covariance.diagonal().maxCoeff() > 1e3;
        EXPECT_EQ(found, ran_away) << seed;
        separated += found;
    }
    EXPECT_GT(separated, 5);
    EXPECT_LT(separated, 55);
}

TEST(Guards, NamesTheStimulusThatWasNeverShown) {
    auto trials = answers(scale_with_threshold(kStimuli, 0.01), 1);
    std::erase_if(trials, [](const Trial& t) {
        return std::find(t.rank.begin(), t.rank.end(), 7) != t.rank.end();
    });
    const auto scale = fit_scale(trials, {.stimulus_count = 10});
    EXPECT_EQ(scale.outcome, FitOutcome::NotIdentifiable);
    EXPECT_NE(scale.reason.find("stimulus 7"), std::string::npos);
}

TEST(Guards, SeesReversedAnswers) {
    auto trials = answers(scale_with_threshold(kStimuli, 0.01), 1);
    for (Trial& t : trials) t.response = 1 - t.response;
    const auto scale = fit_scale(trials);
    EXPECT_EQ(scale.outcome, FitOutcome::NotIdentifiable);
    EXPECT_NE(scale.reason.find("reversed"), std::string::npos);
    StudyOptions options;
    options.is_reversed = true;
    options.bootstrap.replicates = 50;
    options.diagnostic_simulations = 20;
    EXPECT_TRUE(analyse_study({{"x", trials}}, kStimuli, options).pooled.scale.is_usable());
}

TEST(Guards, SaysNoToRandomAnswers) {
    const auto scale = fit_scale(answers(std::vector<double>(10, 0.0), 12));
    EXPECT_EQ(scale.outcome, FitOutcome::NotIdentifiable);
}

TEST(Guards, SaysNoToTooFewTrialsAndWarnsOfFew) {
    const auto trials = answers(scale_with_threshold(kStimuli, 0.01), 1);
    EXPECT_EQ(fit_scale(std::span(trials).first(6), {.stimulus_count = 10}).outcome,
              FitOutcome::NotIdentifiable);
    const auto few = fit_scale(std::span(trials).last(80), {.stimulus_count = 10});
    EXPECT_FALSE(few.is_usable() && few.warnings.empty());
}

TEST(Guards, FindsLapsesAndTakesThemOut) {
    const auto beta = scale_with_threshold(kStimuli, 0.006);
    const auto cells = group_trials(answers(beta, 8, 0.08, 10), 10);
    const LapseTest test = test_for_lapses(cells);
    EXPECT_LT(test.p_value, 1e-3);
    EXPECT_NEAR(test.lapse, 0.08, 0.03);
    const auto plain = fit_scale(cells);
    const auto corrected = fit_scale(cells, {.estimate_lapse = true});
    EXPECT_LT(plain.beta.back(), 0.85 * beta.back());
    EXPECT_NEAR(corrected.beta.back(), beta.back(), 0.1 * beta.back());
    const auto clean = group_trials(answers(beta, 9, 0.0, 10), 10);
    EXPECT_GT(test_for_lapses(clean).p_value, 0.02);
}

// --- lambda -----------------------------------------------------------------------------------

TEST(Lambda, OfAStraightScaleIsHalfOverTheSlope) {
    SmoothScale line(1.4, 1.465, 1);
    line.coefficients[0] = 3.25;  // beta over the whole span
    const Threshold t = threshold_of(line, kStimuli);
    EXPECT_NEAR(t.value, 0.5 / (3.25 / 0.065), 1e-15);
    for (const auto& [n, local] : t.local) EXPECT_NEAR(local, 0.010, 1e-15);
}

TEST(Lambda, BasisIsStraightBeyondTheEnds) {
    const SmoothScale scale(0.0, 1.0, 4);
    const auto second = [&](double t) {
        const double h = 1e-3;
        return ((scale.basis(t + h) - 2 * scale.basis(t) + scale.basis(t - h)) / (h * h)).eval();
    };
    for (const double outside : {-0.5, -0.1, 1.1, 1.7}) {
        EXPECT_LT(second(outside).cwiseAbs().maxCoeff(), 1e-6);
    }
    EXPECT_GT(second(0.5).cwiseAbs().maxCoeff(), 1.0);
    SmoothScale any = scale;
    any.coefficients << 1.0, -2.0, 0.7, 3.0;
    for (const double t : {-0.3, 0.1, 0.6, 0.99, 1.4}) {
        EXPECT_NEAR(any.beta(t), any.basis(t).dot(any.coefficients), 1e-12);
    }
}

TEST(Lambda, IsRecoveredFromExactProportions) {
    for (const double power : {1.0, 1.5, 2.0}) {
        const auto beta = scale_with_threshold(kStimuli, 0.010, power);
        auto cells = group_trials(answers(beta, 1), 10);
        for (std::size_t i = 0; i < cells.rank.size(); ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            cells.data.answers[row] = 400;
            cells.data.ones[row] = 400 * probability_of_one(decision_variable(beta, cells.rank[i]));
        }
        const SmoothFitter fitter(cells, kStimuli);
        const SmoothScale smooth = fitter.fit(cells.data.ones);
        EXPECT_EQ(smooth.degrees_of_freedom() == 1, power == 1.0);
        const double expected = power == 1.0 ? 0.010 : 0.0100;
        EXPECT_NEAR(threshold_of(smooth, kStimuli).value, expected, power == 1.0 ? 1e-8 : 0.0006);
    }
}

TEST(Lambda, DoesNotExistOnAFlatScale) {
    SmoothScale flat(1.4, 1.465, 1);
    flat.coefficients[0] = 0.01;
    EXPECT_EQ(threshold_of(flat, kStimuli).value, kNoThreshold);
    SmoothScale falling(1.4, 1.465, 2);
    falling.coefficients << -2.0, 0.0;
    EXPECT_EQ(threshold_of(falling, kStimuli).value, kNoThreshold);
}

TEST(Lambda, NeitherScaleNorLambdaDependsOnUnits) {
    const auto cells = group_trials(answers(scale_with_threshold(kStimuli, 0.01, 2.0), 5), 10);
    const SmoothFitter fitter(cells, kStimuli);
    std::vector<double> thousandfold;
    for (const double n : kStimuli) thousandfold.push_back(1000 * (n - 1));
    const SmoothFitter scaled(cells, thousandfold);
    const double a = threshold_of(fitter.fit(cells.data.ones), kStimuli).value;
    const double b = threshold_of(scaled.fit(cells.data.ones), thousandfold).value;
    EXPECT_NEAR(b / a, 1000, 1e-3);
}

// --- intervals --------------------------------------------------------------------------------

TEST(Bca, EqualsThePercentilesWithoutBiasAndSkewness) {
    std::vector<double> replicates;
    for (int i = 1; i < 2000; ++i) replicates.push_back(normal_quantile(i / 2000.0));
    const Interval i = bca_interval(0.0, replicates, 0.0, 0.95);
    EXPECT_NEAR(i.low, -1.959964, 0.005);
    EXPECT_NEAR(i.high, 1.959964, 0.005);
}

TEST(Bca, IsInvariantUnderMonotoneMaps) {
    std::vector<double> a, b;
    for (int i = 1; i < 999; ++i) {
        a.push_back(0.3 + normal_quantile(i / 999.0));
        b.push_back(std::exp(a.back()));
    }
    const Interval ia = bca_interval(0.1, a, 0.05, 0.95),
                   ib = bca_interval(std::exp(0.1), b, 0.05, 0.95);
    EXPECT_NEAR(std::exp(ia.low), ib.low, 2e-3 * ib.low);
    EXPECT_NEAR(std::exp(ia.high), ib.high, 1e-2 * ib.high);
}

TEST(Bca, CarriesUnboundedReplicates) {
    std::vector<double> replicates(100, kNoThreshold);
    for (int i = 0; i < 80; ++i) replicates[static_cast<std::size_t>(i)] = 1 + 0.01 * i;
    const Interval i = bca_interval(1.5, replicates, 0.0, 0.95);
    EXPECT_TRUE(std::isfinite(i.low));
    EXPECT_EQ(i.high, kNoThreshold);
}

TEST(Bootstrap, IsTheSameOnAnyNumberOfThreads) {
    const auto cells = group_trials(answers(scale_with_threshold(kStimuli, 0.01), 21), 10);
    const auto scale = fit_scale(cells);
    const SmoothFitter fitter(cells, kStimuli);
    const auto smooth = fitter.fit(cells.data.ones);
    std::vector<ScaleBootstrap> runs;
    for (const int threads : {1, 2, 5}) {
        set_thread_count(threads);
        runs.push_back(bootstrap_scale(cells, scale, fitter, smooth, kStimuli,
                                       {.replicates = 300, .seed = 9}));
    }
    set_thread_count(0);
    for (const auto& run : runs) {
        EXPECT_EQ(run.lambda.low, runs[0].lambda.low);
        EXPECT_EQ(run.lambda.high, runs[0].lambda.high);
        for (std::size_t i = 0; i < 10; ++i) {
            EXPECT_EQ(run.psi[i].low, runs[0].psi[i].low);
            EXPECT_EQ(run.beta[i].high, runs[0].beta[i].high);
        }
    }
    EXPECT_LT(runs[0].lambda.low, threshold_of(smooth, kStimuli).value);
    EXPECT_GT(runs[0].lambda.high, threshold_of(smooth, kStimuli).value);
}

// --- diagnostics ------------------------------------------------------------------------------

TEST(Diagnostics, FindsAllSixPointConditions) {
    // Six of ten stimuli: C(10, 6) = 210 per session; C(11, 6) = 462.
    const auto ten = group_trials(answers(scale_with_threshold(kStimuli, 0.01), 1), 10);
    EXPECT_EQ(six_point_conditions(ten, std::vector<int>(210, 0)).size(), 210u);
    const auto twice = group_trials(answers(scale_with_threshold(kStimuli, 0.01), 1, 0, 2), 10);
    EXPECT_EQ(six_point_conditions(twice, std::vector<int>(420, 0)).size(), 420u);
    std::vector<int> sessions(420, 0);
    std::fill(sessions.begin() + 210, sessions.end(), 1);
    EXPECT_EQ(six_point_conditions(twice, sessions).size(), 420u);
}

TEST(Diagnostics, AcceptAnObserverThatFollowsTheModel) {
    const auto cells = group_trials(answers(scale_with_threshold(kStimuli, 0.01), 31), 10);
    const auto d = diagnose_scale(cells, fit_scale(cells), std::vector<int>(210, 0),
                                  {.simulations = 200, .seed = 1});
    EXPECT_EQ(d.six_point.conditions, 210);
    EXPECT_GT(d.six_point.p_value, 0.02);
    EXPECT_GT(d.residuals.runs_p_value, 0.02);
    EXPECT_GT(d.residuals.share_inside, 0.8);
    EXPECT_EQ(d.residuals.sorted.size(), 210u);
}

TEST(Diagnostics, NoticeAnObserverThatDoesNot) {
    // Compares only the outer members of the pairs (S1 against S4), not the differences.
    auto trials = answers(std::vector<double>(10, 0.0), 5, 0, 3);
    Rng rng(77);
    for (Trial& t : trials) {
        t.response = rng.next_double() < probability_of_one(0.9 * (t.rank[3] + t.rank[0] - 10.5));
    }
    const auto cells = group_trials(trials, 10);
    const auto d = diagnose_scale(cells, fit_scale(cells), std::vector<int>(trials.size(), 0),
                                  {.simulations = 200});
    EXPECT_LT(std::min(d.six_point.p_value, d.residuals.runs_p_value), 0.05);
}

// --- the whole study --------------------------------------------------------------------------

TEST(Study, PoolsObserversAndSurvivesTheFile) {
    std::vector<Observations> all;
    for (int o = 0; o < 3; ++o) {
        all.push_back({"observer " + std::to_string(o + 1),
                       answers(scale_with_threshold(kStimuli, 0.01), 40 + o)});
    }
    all.push_back({"asleep", answers(std::vector<double>(10, 0.0), 99), 6, 3});
    StudyOptions options;
    options.bootstrap.replicates = 200;
    options.observer_replicates = 60;
    options.diagnostic_simulations = 40;
    const StudyAnalysis study = analyse_study(all, kStimuli, options);
    ASSERT_EQ(study.observers.size(), 4u);
    EXPECT_EQ(study.pooled.scale.trial_count, 840);
    EXPECT_EQ(study.observers[3].scale.outcome, FitOutcome::NotIdentifiable);
    EXPECT_NEAR(study.lambda_geometric_mean, 0.010, 0.002);
    EXPECT_DOUBLE_EQ(study.mean_psi.back(), 1.0);
    EXPECT_EQ(study.pooled.catch_failed, 3);
    const auto& warnings = study.observers[3].scale.warnings;
    EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) {
        return w.find("missed 3 of 6 catch trials") != std::string::npos;
    }));
    const std::string text = study_to_json(study);
    EXPECT_EQ(study_to_json(study_from_json(text, "scale.json")), text);
}

TEST(Study, NoticesObserversThatDiffer) {
    StudyOptions options;
    options.bootstrap.replicates = options.observer_replicates = 40;
    options.diagnostic_simulations = 20;
    const auto study = analyse_study({{"a", answers(scale_with_threshold(kStimuli, 0.006), 1)},
                                      {"b", answers(scale_with_threshold(kStimuli, 0.025), 2)}},
                                     kStimuli, options);
    EXPECT_LT(study.heterogeneity.p_value, 0.01);
    EXPECT_EQ(study.heterogeneity.degrees_of_freedom, 9);
}

TEST(Study, RefusesRanksBeyondTheList) {
    const auto trials = answers(scale_with_threshold(kStimuli, 0.01), 1);
    EXPECT_THROW(analyse_study({{"x", trials}}, {1.4, 1.41, 1.42, 1.43}), InputError);
    EXPECT_THROW(analyse_study({{"x", trials}}, std::vector<double>(10, 1.4)), InputError);
}

TEST(Study, FileMustBeWhatWeWrote) {
    EXPECT_THROW(study_from_json("{}", "s"), InputError);
    EXPECT_THROW(study_from_json(R"({"schema": "vitrine.mlds/2"})", "s"), InputError);
    EXPECT_THROW(series_from_json(
                     R"({"schema": "vitrine.mlds_stimuli/1", "ior": [1.4, 1.3, 1.5, 1.6]})", "s"),
                 InputError);
    StimulusSeries series;
    series.ior = {1.3, 1.4, 1.5, 1.6};
    series.images = {"a", "b", "c", "d"};
    EXPECT_EQ(series_from_json(series_to_json(series), "s").ior, series.ior);
}

// --- real answers -----------------------------------------------------------------------------

/// Reference of R's mlds(glm, probit): columns level,stimulus,pscale_unnorm,pscale_std,se.
struct Reference {
    std::vector<double> beta, psi, se;
};
Reference read_reference(const std::string& path) {
    Reference reference;
    std::istringstream lines(read_text_file(path));
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
        double level, stimulus, beta, psi, se;
        if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf", &level, &stimulus, &beta, &psi, &se) ==
            5) {
            reference.beta.push_back(beta);
            reference.psi.push_back(psi);
            reference.se.push_back(se);
        }
    }
    return reference;
}

/// Largest |psi - psi_R|. Our own likelihood at R's scale bounds how far R stopped short of the
/// maximum.
void compare_with_r(const std::string& name, double* psi_error, DifferenceScale* scale,
                    double* log_likelihood_at_reference) {
    const std::string root = std::string(std::getenv("VITRINE_REAL_DATA")) + "/mlds/";
    const std::string csv = name == "kk" ? "kk_swapped" : name;
    const auto trials = parse_trials_csv(read_text_file(root + csv + ".csv"), csv)[0].trials;
    const Reference reference = read_reference(root + name + "_reference_scale.csv");
    const auto cells = group_trials(trials, static_cast<int>(reference.psi.size()));
    *scale = fit_scale(cells);
    *psi_error = 0;
    for (std::size_t i = 0; i < reference.psi.size(); ++i) {
        *psi_error = std::max(*psi_error, std::abs(scale->psi[i] - reference.psi[i]));
        EXPECT_NEAR(scale->se_beta[i], reference.se[i], 1e-5);
    }
    *log_likelihood_at_reference =
        probit_log_likelihood(cells.data, free_part(reference.beta), 0.0);
}

TEST(RealAnswers, EqualTheReferenceOfR) {
    if (!std::getenv("VITRINE_REAL_DATA")) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    for (const std::string name : {"kk", "AutumnLab", "kk1", "kk2", "kk3"}) {
        double psi_error = 0, at_reference = 0;
        DifferenceScale scale;
        compare_with_r(name, &psi_error, &scale, &at_reference);
        EXPECT_LT(psi_error, 1e-6) << name;
        EXPECT_NEAR(scale.log_likelihood, at_reference, 1e-5) << name;
        printf("%-10s max |psi - psi_R| %.1e, log-likelihood %.6f (at R's scale %.6f)\n",
               name.c_str(), psi_error, scale.log_likelihood, at_reference);
    }
}

TEST(RealAnswers, EqualThePublishedScaleOfKk) {
    if (!std::getenv("VITRINE_REAL_DATA")) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    // Knoblauch and Maloney 2008, printed to four digits, log-likelihood -306.
    const double published[] = {0,      -.0454, .0439,  -.0863, .5682, 1.4234,
                                2.0695, 2.6661, 3.5527, 4.4297, 5.5739};
    double psi_error = 0, at_reference = 0;
    DifferenceScale scale;
    compare_with_r("kk", &psi_error, &scale, &at_reference);
    for (std::size_t i = 0; i < 11; ++i) EXPECT_NEAR(scale.beta[i], published[i], 5.1e-5);
    EXPECT_EQ(std::lround(scale.log_likelihood), -306);
}

TEST(RealAnswers, SwappingIsNotNeeded) {
    if (!std::getenv("VITRINE_REAL_DATA")) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    const std::string root = std::string(std::getenv("VITRINE_REAL_DATA")) + "/mlds/";
    std::vector<Trial> raw;
    for (const std::string name : {"kk1", "kk2", "kk3"}) {
        const auto part = parse_trials_csv(read_text_file(root + name + ".csv"), name)[0].trials;
        raw.insert(raw.end(), part.begin(), part.end());
    }
    const auto swapped = parse_trials_csv(read_text_file(root + "kk_swapped.csv"), "kk")[0].trials;
    const auto a = fit_scale(raw), b = fit_scale(swapped);
    for (std::size_t i = 0; i < 11; ++i) EXPECT_NEAR(a.psi[i], b.psi[i], 1e-10);
}

}  // namespace
}  // namespace vitrine
