#include "perception/scale_diagnostics.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "perception/observer_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace vitrine {
namespace {

constexpr std::uint64_t kStream = 0x6469616721;

/// What both tests want to know of one set of answers and its refitted scale.
struct Reading {
    std::vector<double> sorted_residuals;
    int runs = 0;
    double six_point_log_likelihood = 0;
};

Reading read(const QuestionCells& cells, const std::vector<int>& response,
             const Eigen::VectorXd& beta, double lapse,
             const std::vector<std::array<int, 3>>& conditions) {
    const Eigen::VectorXd eta = cells.data.design * beta;
    std::vector<AnswerProbability> of_cell;
    for (const double e : eta) of_cell.push_back(answer_probability(e, lapse));
    const std::size_t count = response.size();
    std::vector<double> log_likelihood(count), residual(count);
    for (std::size_t t = 0; t < count; ++t) {
        const auto& a = of_cell[static_cast<std::size_t>(cells.cell_of_trial[t])];
        log_likelihood[t] = response[t] ? a.log_p : a.log_q;
        residual[t] = (response[t] ? 1 : -1) * std::sqrt(-2 * log_likelihood[t]);
    }
    Reading reading;
    for (const auto& triple : conditions) {
        for (const int t : triple) {
            reading.six_point_log_likelihood += log_likelihood[static_cast<std::size_t>(t)];
        }
    }
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
        return eta[cells.cell_of_trial[i]] < eta[cells.cell_of_trial[j]];
    });
    for (std::size_t k = 1; k < count; ++k) {
        reading.runs += (residual[order[k]] > 0) != (residual[order[k - 1]] > 0);
    }
    std::sort(residual.begin(), residual.end());
    reading.sorted_residuals = std::move(residual);
    return reading;
}

Reading simulate(const QuestionCells& cells, const std::vector<double>& p,
                 const Eigen::VectorXd& start, double lapse,
                 const std::vector<std::array<int, 3>>& conditions, Rng rng) {
    std::vector<int> response(cells.response.size());
    BinomialData data = cells.data;
    data.ones.setZero();
    for (std::size_t t = 0; t < response.size(); ++t) {
        const int cell = cells.cell_of_trial[t];
        response[t] = rng.next_double() < p[static_cast<std::size_t>(cell)];
        data.ones[cell] += response[t];
    }
    // The ridge is far below the information of one answer; it only stops a separated simulation.
    const ProbitFit fit = fit_probit(
        data, {.lapse = lapse, .ridge = 1e-4, .max_iterations = 40, .tolerance = 1e-8}, &start);
    return read(cells, response, fit.beta, lapse, conditions);
}

int count_violations(const QuestionCells& cells, const std::vector<std::array<int, 3>>& all) {
    int violations = 0;
    for (const auto& t : all) {
        const int a = cells.response[static_cast<std::size_t>(t[0])];
        const int b = cells.response[static_cast<std::size_t>(t[1])];
        const int both = cells.response[static_cast<std::size_t>(t[2])];
        violations += a == b && both != a;
    }
    return violations;
}

}  // namespace

std::vector<std::array<int, 3>> six_point_conditions(const QuestionCells& cells,
                                                     std::span<const int> sessions) {
    VITRINE_CHECK_EQ(sessions.size(), cells.response.size());
    std::map<int, std::map<Quadruple, std::vector<int>>> by_session;
    for (std::size_t t = 0; t < cells.response.size(); ++t) {
        by_session[sessions[t]][cells.rank[static_cast<std::size_t>(cells.cell_of_trial[t])]]
            .push_back(static_cast<int>(t));
    }
    std::vector<std::array<int, 3>> conditions;
    for (const auto& [session, asked] : by_session) {
        // (a, b; a', b') and (b, c; b', c') give (a, c; a', c').
        for (const auto& [first, first_trials] : asked) {
            for (int c = first[1] + 1; c < first[2]; ++c) {
                for (int c2 = first[3] + 1; c2 <= cells.stimulus_count; ++c2) {
                    const auto second = asked.find({first[1], c, first[3], c2});
                    const auto sum = asked.find({first[0], c, first[2], c2});
                    if (second == asked.end() || sum == asked.end()) continue;
                    const std::size_t times =
                        std::min({first_trials.size(), second->second.size(), sum->second.size()});
                    for (std::size_t k = 0; k < times; ++k) {
                        conditions.push_back({first_trials[k], second->second[k], sum->second[k]});
                    }
                }
            }
        }
    }
    return conditions;
}

ScaleDiagnostics diagnose_scale(const QuestionCells& cells, const DifferenceScale& scale,
                                std::span<const int> sessions, const DiagnosticsOptions& options,
                                const Progress& progress) {
    const auto conditions = six_point_conditions(cells, sessions);
    const Eigen::VectorXd beta = Eigen::Map<const Eigen::VectorXd>(
        scale.beta.data() + 1, static_cast<Eigen::Index>(scale.beta.size()) - 1);
    const Reading observed = read(cells, cells.response, beta, scale.lapse, conditions);
    std::vector<double> p;
    for (const Quadruple& q : cells.rank) {
        p.push_back(probability_of_one(decision_variable(scale.beta, q), scale.lapse));
    }
    progress.update(0.0, "diagnostics");
    std::vector<Reading> simulated(static_cast<std::size_t>(options.simulations));
    parallel_for(simulated.size(), 8, [&](std::size_t i) {
        simulated[i] = simulate(cells, p, beta, scale.lapse, conditions,
                                Rng(stream_key(options.seed, kStream, i)));
    });

    ScaleDiagnostics out;
    out.lapses = test_for_lapses(cells);
    const double count = options.simulations;
    int less_likely = 0, fewer_runs = 0;
    for (const Reading& r : simulated) {
        less_likely += r.six_point_log_likelihood <= observed.six_point_log_likelihood;
        fewer_runs += r.runs <= observed.runs;
    }
    SixPointTest& six = out.six_point;
    six.conditions = static_cast<int>(conditions.size());
    six.violations = count_violations(cells, conditions);
    six.log_likelihood = observed.six_point_log_likelihood;
    six.simulations = options.simulations;
    if (six.conditions > 0) six.p_value = less_likely / count;

    ResidualDiagnostics& residuals = out.residuals;
    residuals.simulations = options.simulations;
    residuals.sorted = observed.sorted_residuals;
    residuals.runs = observed.runs;
    residuals.runs_p_value = fewer_runs / count;
    std::vector<double> column(simulated.size());
    int inside = 0;
    for (std::size_t k = 0; k < residuals.sorted.size(); ++k) {
        for (std::size_t i = 0; i < simulated.size(); ++i) {
            column[i] = simulated[i].sorted_residuals[k];
        }
        std::sort(column.begin(), column.end());
        const auto at = [&](double q) {
            return column[static_cast<std::size_t>(q * static_cast<double>(column.size() - 1))];
        };
        residuals.low.push_back(at(0.025));
        residuals.high.push_back(at(0.975));
        inside += residuals.sorted[k] >= residuals.low.back() &&
                  residuals.sorted[k] <= residuals.high.back();
    }
    residuals.share_inside =
        residuals.sorted.empty() ? 1.0 : inside / static_cast<double>(residuals.sorted.size());
    return out;
}

}  // namespace vitrine
