#include "perception/scale_json.h"

#include "base/error.h"
#include "base/json_reader.h"

#include <cmath>

namespace vitrine {
namespace {

Json number_or_null(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }
Json to_json(const Interval& i) {
    return Json::array({number_or_null(i.low), number_or_null(i.high)});
}
Json to_json(const std::vector<Interval>& list) {
    Json out = Json::array();
    for (const Interval& i : list) out.push_back(to_json(i));
    return out;
}
Json to_json(const std::vector<std::array<double, 2>>& list) {
    Json out = Json::array();
    for (const auto& [a, b] : list) out.push_back(Json::array({a, number_or_null(b)}));
    return out;
}

Json to_json(const ScaleDiagnostics& d) {
    const SixPointTest& six = d.six_point;
    const ResidualDiagnostics& r = d.residuals;
    return {{"six_point",
             {{"conditions", six.conditions},
              {"violations", six.violations},
              {"log_likelihood", six.log_likelihood},
              {"p_value", six.p_value},
              {"simulations", six.simulations}}},
            {"residuals",
             {{"runs", r.runs},
              {"runs_p_value", r.runs_p_value},
              {"share_inside", r.share_inside},
              {"simulations", r.simulations},
              {"sorted", r.sorted},
              {"low", r.low},
              {"high", r.high}}},
            {"lapses",
             {{"lapse", d.lapses.lapse},
              {"likelihood_ratio", d.lapses.likelihood_ratio},
              {"p_value", d.lapses.p_value}}}};
}

void add_analysis(Json& out, const ScaleAnalysis& a) {
    const DifferenceScale& s = a.scale;
    out["name"] = a.name;
    out["trials"] = s.trial_count;
    out["psi"] = s.psi;
    out["beta"] = s.beta;
    out["se_beta"] = s.se_beta;
    out["sigma"] = s.sigma;
    out["lapse"] = s.lapse;
    out["log_likelihood"] = s.log_likelihood;
    out["aic"] = s.aic;
    out["deviance"] = s.deviance;
    out["outcome"] = outcome_name(s.outcome);
    out["reason"] = s.reason;
    out["warnings"] = s.warnings;
    out["ci95"] = to_json(a.psi_ci95);
    out["beta_ci95"] = to_json(a.beta_ci95);
    out["sigma_ci95"] = to_json(a.sigma_ci95);
    out["lambda"] = {{"value", number_or_null(a.lambda.value)},
                     {"ci95", to_json(a.lambda_ci95)},
                     {"local", to_json(a.lambda.local)},
                     {"local_ci95", to_json(a.local_ci95)}};
    out["smooth"] = {{"degrees_of_freedom", a.smooth_degrees_of_freedom},
                     {"curve", to_json(a.smooth_curve)}};
    out["direct"] = {{"log_likelihood", a.direct_log_likelihood},
                     {"psi_difference", a.direct_psi_difference}};
    out["bootstrap"] = {{"method", "parametric, BCa"},
                        {"replicates", a.bootstrap_replicates},
                        {"separated", a.separated_replicates}};
    out["diagnostics"] = to_json(a.diagnostics);
    out["catch_trials"] = {{"asked", a.catch_count}, {"missed", a.catch_failed}};
}

double finite_or_infinite(const Json& value, const JsonObject& object, const std::string& key) {
    if (value.is_null()) return kNoThreshold;
    if (!value.is_number()) object.fail(key, "a number or null", value.type_name());
    return value.get<double>();
}

std::vector<std::array<double, 2>> read_pairs(const JsonObject& object, const std::string& key) {
    const Json& list = object.raw(key);
    if (!list.is_array()) object.fail(key, "a list of pairs", list.type_name());
    std::vector<std::array<double, 2>> out;
    for (const Json& pair : list) {
        if (!pair.is_array() || pair.size() != 2) object.fail(key, "pairs", pair.dump());
        out.push_back(
            {finite_or_infinite(pair[0], object, key), finite_or_infinite(pair[1], object, key)});
    }
    return out;
}

std::vector<Interval> read_intervals(const JsonObject& object, const std::string& key) {
    std::vector<Interval> out;
    for (const auto& [low, high] : read_pairs(object, key)) out.push_back({low, high});
    return out;
}

Interval read_interval(const JsonObject& object, const std::string& key) {
    const Json& pair = object.raw(key);
    if (!pair.is_array() || pair.size() != 2) object.fail(key, "a pair", pair.dump());
    return {finite_or_infinite(pair[0], object, key), finite_or_infinite(pair[1], object, key)};
}

ScaleDiagnostics read_diagnostics(const JsonObject& object) {
    ScaleDiagnostics d;
    const JsonObject six = object.object("six_point");
    d.six_point.conditions = static_cast<int>(six.integer("conditions"));
    d.six_point.violations = static_cast<int>(six.integer("violations"));
    d.six_point.log_likelihood = six.number("log_likelihood");
    d.six_point.p_value = six.number("p_value");
    d.six_point.simulations = static_cast<int>(six.integer("simulations"));
    six.finish();
    const JsonObject r = object.object("residuals");
    d.residuals.runs = static_cast<int>(r.integer("runs"));
    d.residuals.runs_p_value = r.number("runs_p_value");
    d.residuals.share_inside = r.number("share_inside");
    d.residuals.simulations = static_cast<int>(r.integer("simulations"));
    d.residuals.sorted = r.numbers("sorted");
    d.residuals.low = r.numbers("low");
    d.residuals.high = r.numbers("high");
    r.finish();
    const JsonObject lapses = object.object("lapses");
    d.lapses.lapse = lapses.number("lapse");
    d.lapses.likelihood_ratio = lapses.number("likelihood_ratio");
    d.lapses.p_value = lapses.number("p_value");
    lapses.finish();
    object.finish();
    return d;
}

FitOutcome read_outcome(const JsonObject& object) {
    const std::string word =
        object.choice("outcome", {"converged", "at_bound", "not_identifiable"});
    if (word == "converged") return FitOutcome::Converged;
    return word == "at_bound" ? FitOutcome::AtBound : FitOutcome::NotIdentifiable;
}

ScaleAnalysis read_analysis(const JsonObject& object, std::size_t count) {
    ScaleAnalysis a;
    DifferenceScale& s = a.scale;
    a.name = object.text("name");
    s.stimulus_count = static_cast<int>(count);
    s.trial_count = static_cast<int>(object.integer("trials"));
    s.psi = object.numbers("psi", count);
    s.beta = object.numbers("beta", count);
    s.se_beta = object.numbers("se_beta", count);
    s.sigma = object.number("sigma");
    s.lapse = object.number("lapse");
    s.log_likelihood = object.number("log_likelihood");
    s.aic = object.number("aic");
    s.deviance = object.number("deviance");
    s.outcome = read_outcome(object);
    s.reason = object.text("reason");
    s.warnings = object.texts("warnings");
    a.psi_ci95 = read_intervals(object, "ci95");
    a.beta_ci95 = read_intervals(object, "beta_ci95");
    a.sigma_ci95 = read_interval(object, "sigma_ci95");
    const JsonObject lambda = object.object("lambda");
    a.lambda.value = finite_or_infinite(lambda.raw("value"), lambda, "value");
    a.lambda_ci95 = read_interval(lambda, "ci95");
    a.lambda.local = read_pairs(lambda, "local");
    a.local_ci95 = read_intervals(lambda, "local_ci95");
    lambda.finish();
    const JsonObject smooth = object.object("smooth");
    a.smooth_degrees_of_freedom = static_cast<int>(smooth.integer("degrees_of_freedom"));
    a.smooth_curve = read_pairs(smooth, "curve");
    smooth.finish();
    const JsonObject direct = object.object("direct");
    a.direct_log_likelihood = direct.number("log_likelihood");
    a.direct_psi_difference = direct.number("psi_difference");
    direct.finish();
    const JsonObject bootstrap = object.object("bootstrap");
    bootstrap.ignore("method");
    a.bootstrap_replicates = static_cast<int>(bootstrap.integer("replicates"));
    a.separated_replicates = static_cast<int>(bootstrap.integer("separated"));
    bootstrap.finish();
    a.diagnostics = read_diagnostics(object.object("diagnostics"));
    const JsonObject catches = object.object("catch_trials");
    a.catch_count = static_cast<int>(catches.integer("asked"));
    a.catch_failed = static_cast<int>(catches.integer("missed"));
    catches.finish();
    const bool has_intervals = !a.psi_ci95.empty();
    if (has_intervals && a.psi_ci95.size() != count) {
        object.fail("ci95", std::to_string(count) + " intervals",
                    std::to_string(a.psi_ci95.size()));
    }
    return a;
}

}  // namespace

std::string study_to_json(const StudyAnalysis& study) {
    Json root;
    root["schema"] = "vitrine.mlds/1";
    root["stimuli"] = study.stimuli;
    root["unit"] = study.stimuli_are_ior ? "ior" : "rank";
    add_analysis(root, study.pooled);
    Json observers = Json::array();
    for (const ScaleAnalysis& o : study.observers) {
        Json entry;
        add_analysis(entry, o);
        observers.push_back(entry);
    }
    root["observers"] = observers;
    root["mean_psi"] = study.mean_psi;
    root["between_observers"] = {
        {"lambda_geometric_mean", number_or_null(study.lambda_geometric_mean)},
        {"lambda_log_sd", study.lambda_log_sd},
        {"likelihood_ratio", study.heterogeneity.likelihood_ratio},
        {"degrees_of_freedom", study.heterogeneity.degrees_of_freedom},
        {"p_value", study.heterogeneity.p_value}};
    return root.dump(1) + "\n";
}

StudyAnalysis study_from_json(const std::string& text, const std::string& name) {
    const JsonObject root = read_json_text(text, name);
    root.choice("schema", {"vitrine.mlds/1"});
    StudyAnalysis study;
    study.stimuli = root.numbers("stimuli");
    study.stimuli_are_ior = root.choice("unit", {"ior", "rank"}) == "ior";
    study.pooled = read_analysis(root, study.stimuli.size());
    for (const JsonObject& entry : root.objects("observers")) {
        study.observers.push_back(read_analysis(entry, study.stimuli.size()));
        entry.finish();
    }
    study.mean_psi = root.numbers("mean_psi");
    const JsonObject between = root.object("between_observers");
    study.lambda_geometric_mean =
        finite_or_infinite(between.raw("lambda_geometric_mean"), between, "lambda_geometric_mean");
    study.lambda_log_sd = between.number("lambda_log_sd");
    study.heterogeneity.likelihood_ratio = between.number("likelihood_ratio");
    study.heterogeneity.degrees_of_freedom =
        static_cast<int>(between.integer("degrees_of_freedom"));
    study.heterogeneity.p_value = between.number("p_value");
    between.finish();
    root.finish();
    return study;
}

std::string series_to_json(const StimulusSeries& series) {
    Json root;
    root["schema"] = "vitrine.mlds_stimuli/1";
    root["title"] = series.title;
    root["ior"] = series.ior;
    root["images"] = series.images;
    root["linear"] = series.linear;
    root["integrator"] = series.integrator;
    root["exposure"] = series.exposure;
    root["noise_delta_l"] = {{"picture", series.noise.picture},
                             {"picture_seen", series.noise.picture_seen},
                             {"difference", series.noise.difference},
                             {"difference_seen", series.noise.difference_seen}};
    return root.dump(2) + "\n";
}

StimulusSeries series_from_json(const std::string& text, const std::string& name) {
    const JsonObject root = read_json_text(text, name);
    root.choice("schema", {"vitrine.mlds_stimuli/1"});
    StimulusSeries series;
    series.title = root.text_or("title", "");
    series.ior = root.numbers("ior");
    if (series.ior.size() < 4 || series.ior.size() > 40) {
        root.fail("ior", "4 to 40 refractive indices", std::to_string(series.ior.size()));
    }
    for (std::size_t i = 1; i < series.ior.size(); ++i) {
        if (!(series.ior[i] > series.ior[i - 1])) {
            root.fail("ior", "rising values",
                      fmt::format("{} after {}", series.ior[i], series.ior[i - 1]));
        }
    }
    if (root.has("images")) series.images = root.texts("images");
    if (root.has("linear")) series.linear = root.texts("linear");
    for (const char* key : {"images", "linear"}) {
        const auto& files = key == std::string("images") ? series.images : series.linear;
        if (!files.empty() && files.size() != series.ior.size()) {
            root.fail(key, fmt::format("{} files", series.ior.size()),
                      std::to_string(files.size()));
        }
    }
    series.integrator = root.text_or("integrator", "");
    series.exposure = root.number_or("exposure", 1.0);
    if (root.has("noise_delta_l")) {
        const JsonObject noise = root.object("noise_delta_l");
        series.noise = {noise.number("picture"), noise.number("picture_seen"),
                        noise.number("difference"), noise.number("difference_seen")};
        noise.finish();
    }
    root.finish();
    return series;
}

std::vector<double> equal_steps(double begin, double end, int count) {
    std::vector<double> steps;
    for (int i = 0; i < count; ++i) {
        steps.push_back(std::round((begin + (end - begin) * i / (count - 1)) * 1e9) / 1e9);
    }
    return steps;
}

}  // namespace vitrine
