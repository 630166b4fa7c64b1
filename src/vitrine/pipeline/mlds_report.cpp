#include "pipeline/mlds_report.h"

#include "pipeline/report.h"
#include "pipeline/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

constexpr const char* kInk = "#2a7fb8";
constexpr const char* kOther = "#b3541e";
constexpr double kSameIndex = 1e-6;

std::string number(double v, int digits = 4) {
    return std::isfinite(v) ? fmt::format("{:.{}g}", v, digits) : "none";
}

std::string interval(const Interval& i, int digits = 3) {
    return fmt::format("{} to {}", number(i.low, digits),
                       std::isfinite(i.high) ? number(i.high, digits) : "unbounded");
}

PlotRange padded(double low, double high) {
    const double pad = 0.05 * (high - low);
    return {low - pad, high + pad};
}

std::vector<PlotPoint> over(const std::vector<double>& x, const std::vector<double>& y) {
    std::vector<PlotPoint> points;
    for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) points.push_back({x[i], y[i]});
    return points;
}

std::string x_label(const StudyAnalysis& study) {
    return study.stimuli_are_ior ? "refractive index" : "stimulus (rank)";
}

/// Standard scales: every observer thin, the mean thick.
std::string psi_plot(const StudyAnalysis& study) {
    double low = 0, high = 1;
    const auto grow = [&](const ScaleAnalysis& a) {
        if (!a.scale.is_usable()) return;
        low = std::min(low, *std::min_element(a.scale.psi.begin(), a.scale.psi.end()));
        high = std::max(high, *std::max_element(a.scale.psi.begin(), a.scale.psi.end()));
    };
    grow(study.pooled);
    for (const ScaleAnalysis& o : study.observers) grow(o);
    SvgPlot plot(x_label(study), "difference scale (first 0, last 1)",
                 padded(study.stimuli.front(), study.stimuli.back()), padded(low, high));
    for (const ScaleAnalysis& o : study.observers) {
        if (!o.scale.is_usable()) continue;
        plot.line(over(study.stimuli, o.scale.psi), "stroke=\"#888\" stroke-opacity=\".6\"");
        plot.dots(over(study.stimuli, o.scale.psi), 2, "fill=\"#888\" fill-opacity=\".6\"");
    }
    const auto& main = study.mean_psi.empty() ? study.pooled.scale.psi : study.mean_psi;
    plot.line(over(study.stimuli, main), fmt::format("stroke=\"{}\" stroke-width=\"2.5\"", kInk));
    plot.dots(over(study.stimuli, main), 3.5, fmt::format("fill=\"{}\"", kInk));
    return plot.svg("Difference scales of the observers and their mean");
}

/// Scale in units of the decision noise, with intervals and the smooth curve lambda comes from.
std::string beta_plot(const StudyAnalysis& study) {
    const ScaleAnalysis& a = study.pooled;
    double low = 0, high = 1;
    for (std::size_t i = 0; i < a.scale.beta.size(); ++i) {
        low = std::min(low, a.scale.beta[i]);
        high = std::max(high, a.scale.beta[i]);
        if (i < a.beta_ci95.size()) {
            low = std::min(low, a.beta_ci95[i].low);
            high = std::max(high, a.beta_ci95[i].high);
        }
    }
    SvgPlot plot(x_label(study), "beta (decision noise = 1)",
                 padded(study.stimuli.front(), study.stimuli.back()), padded(low, high));
    for (std::size_t i = 0; i < a.beta_ci95.size(); ++i) {
        plot.whisker(study.stimuli[i], a.beta_ci95[i].low, a.beta_ci95[i].high,
                     fmt::format("stroke=\"{}\"", kInk));
    }
    plot.line(a.smooth_curve, fmt::format("stroke=\"{}\" stroke-width=\"2\"", kOther));
    plot.dots(over(study.stimuli, a.scale.beta), 3.5, fmt::format("fill=\"{}\"", kInk));
    return plot.svg("Unnormalised scale with 95 % intervals and the smooth scale");
}

std::string lambda_plot(const StudyAnalysis& study,
                        const std::optional<PredictedThreshold>& prediction) {
    const ScaleAnalysis& a = study.pooled;
    double high = 0;
    const auto grow = [&](double v) {
        if (std::isfinite(v)) high = std::max(high, v);
    };
    // A flat end has a huge lambda that would squeeze all else: cut at four times the smallest.
    for (const auto& [n, v] : a.lambda.local) grow(std::min(v, 4 * a.lambda.value));
    grow(a.lambda_ci95.high);
    if (prediction) {
        for (const auto& [n, v] : prediction->local) grow(std::min(v, 4 * prediction->value));
    }
    if (high <= 0) return "";
    SvgPlot plot(x_label(study), "lambda (change with d' = 1)",
                 padded(study.stimuli.front(), study.stimuli.back()), {0, 1.1 * high});
    std::vector<PlotPoint> lower, upper;
    for (std::size_t i = 0; i < a.local_ci95.size(); ++i) {
        lower.push_back({study.stimuli[i], a.local_ci95[i].low});
        upper.push_back({study.stimuli[i], std::min(a.local_ci95[i].high, 1.2 * high)});
    }
    plot.band(lower, upper, fmt::format("fill=\"{}\" fill-opacity=\".18\"", kInk));
    plot.line(a.lambda.local, fmt::format("stroke=\"{}\" stroke-width=\"2.5\"", kInk));
    if (prediction) {
        const auto style = fmt::format("stroke=\"{}\" stroke-dasharray=\"6 4\"", kOther);
        plot.line(prediction->local, style + " stroke-width=\"2\"");
        plot.label(study.stimuli.front(), 1.03 * high, "dashed: computed from the pictures",
                   fmt::format("fill=\"{}\"", kOther));
    }
    return plot.svg("Lambda as a function of the refractive index");
}

std::string residual_plot(const ResidualDiagnostics& r) {
    if (r.sorted.empty()) return "";
    const double n = static_cast<double>(r.sorted.size());
    std::vector<PlotPoint> observed, low, high;
    for (std::size_t i = 0; i < r.sorted.size(); ++i) {
        const double share = (static_cast<double>(i) + 0.5) / n;
        observed.push_back({r.sorted[i], share});
        low.push_back({r.low[i], share});
        high.push_back({r.high[i], share});
    }
    const double from = std::min(r.low.front(), r.sorted.front());
    const double to = std::max(r.high.back(), r.sorted.back());
    SvgPlot plot("deviance residual", "cumulative share", padded(from, to), {0, 1});
    plot.band(low, high, "fill=\"#888\" fill-opacity=\".3\"");
    plot.dots(observed, 1.6, fmt::format("fill=\"{}\"", kInk));
    return plot.svg("Distribution of the deviance residuals within its simulated envelope");
}

std::string figure(const std::string& svg, const std::string& caption) {
    if (svg.empty()) return "";
    return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", svg, caption);
}

std::string notes(const ScaleAnalysis& a) {
    std::string text;
    if (!a.scale.reason.empty()) {
        text += fmt::format("<p class=\"note bad\"><b>{}</b> ({}): {}.</p>\n", escape_html(a.name),
                            outcome_name(a.scale.outcome), escape_html(a.scale.reason));
    }
    for (const std::string& warning : a.scale.warnings) {
        text += fmt::format("<p class=\"note\"><b>{}</b>: {}.</p>\n", escape_html(a.name),
                            escape_html(warning));
    }
    return text;
}

std::string summary_row(const ScaleAnalysis& a) {
    const DifferenceScale& s = a.scale;
    const SixPointTest& six = a.diagnostics.six_point;
    const bool has_scale = s.outcome != FitOutcome::NotIdentifiable;
    return fmt::format(
        "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>"
        "<td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{:.2f}</td>"
        "<td class=\"number\">{:.2f}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>"
        "<td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"{}\">{}</td></tr>\n",
        escape_html(a.name), s.trial_count, has_scale ? number(a.lambda.value) : "none",
        has_scale ? interval(a.lambda_ci95) : "none", number(s.sigma), s.log_likelihood, s.aic,
        has_scale && six.conditions ? fmt::format("{:.3f}", six.p_value) : "none",
        has_scale ? fmt::format("{:.3f}", a.diagnostics.residuals.runs_p_value) : "none",
        has_scale ? fmt::format("{:.1f} % (p {:.2g})", 100 * a.diagnostics.lapses.lapse,
                                a.diagnostics.lapses.p_value)
                  : "none",
        a.catch_count ? fmt::format("{} of {}", a.catch_failed, a.catch_count) : "none",
        s.is_usable() ? "good" : "bad", outcome_name(s.outcome));
}

std::string scale_table(const StudyAnalysis& study) {
    const ScaleAnalysis& a = study.pooled;
    std::string text =
        "<table><tr><th>stimulus</th><th>value</th><th>psi</th><th>95 %</th><th>beta</th>"
        "<th>se</th><th>95 %</th><th>lambda here</th></tr>\n";
    for (std::size_t i = 0; i < study.stimuli.size(); ++i) {
        const bool has_intervals = i < a.psi_ci95.size();
        text += fmt::format(
            "<tr><td>{}</td><td class=\"number\">{:.6g}</td><td class=\"number\">{:.4f}</td>"
            "<td class=\"number\">{}</td><td class=\"number\">{:.4f}</td>"
            "<td class=\"number\">{:.4f}</td><td class=\"number\">{}</td>"
            "<td class=\"number\">{}</td></tr>\n",
            i + 1, study.stimuli[i], a.scale.psi[i], has_intervals ? interval(a.psi_ci95[i]) : "",
            a.scale.beta[i], a.scale.se_beta[i], has_intervals ? interval(a.beta_ci95[i]) : "",
            number(a.lambda.local[i][1]));
    }
    return text + "</table>\n";
}

/// What people saw beside what was computed from the pictures, at the stimuli.
std::string comparison_section(const StudyAnalysis& study, const PredictedThreshold& prediction) {
    const ScaleAnalysis& a = study.pooled;
    std::string text =
        "<h2>Measured and computed</h2>\n<p class=\"note\">The computed observer looks at the "
        "pictures alone and was not measured with people: it compares two blurred pictures, "
        "people answer about two pairs. A steady ratio says that it can plan a study; the ratio "
        "itself is its criterion.</p>\n<table><tr><th>n</th><th>measured lambda</th><th>95 %</th>"
        "<th>computed</th><th>computed / measured</th></tr>\n";
    std::size_t rows = 0;
    for (std::size_t i = 0; i < a.lambda.local.size(); ++i) {
        const auto [n, measured] = a.lambda.local[i];
        for (const auto& [m, computed] : prediction.local) {
            if (std::abs(n - m) > kSameIndex) continue;
            const double ratio = computed / measured;
            text += fmt::format(
                "<tr><td>{:.6g}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>"
                "<td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n",
                n, number(measured), i < a.local_ci95.size() ? interval(a.local_ci95[i]) : "",
                number(computed), number(ratio, 3));
            ++rows;
        }
    }
    if (rows == 0) {
        return "<p class=\"note\">The computed observer saw other indices than these.</p>\n";
    }
    return text + "</table>\n";
}

std::string headline(const StudyAnalysis& study) {
    const ScaleAnalysis& a = study.pooled;
    if (!a.scale.is_usable() || !std::isfinite(a.lambda.value)) {
        return "<p class=\"note bad\">No lambda can be given; the reasons are below.</p>\n";
    }
    return fmt::format(
        "<p class=\"note\"><b>lambda = {}</b> (95 %: {}): the smallest change of the {} that is "
        "seen with d' = 1. {}</p>\n",
        number(a.lambda.value), interval(a.lambda_ci95),
        study.stimuli_are_ior ? "refractive index" : "stimulus, in ranks",
        a.smooth_degrees_of_freedom == 1
            ? "The scale is straight as far as the answers tell: lambda is the same everywhere."
            : "The scale is curved: this is the smallest of the local values.");
}

std::string observers_section(const StudyAnalysis& study) {
    std::string text =
        "<h2>Observers</h2>\n<table><tr><th>observer</th><th>trials</th><th>lambda</th>"
        "<th>95 %</th><th>sigma</th><th>log-likelihood</th><th>AIC</th><th>six-point p</th>"
        "<th>runs p</th><th>lapses</th><th>catch trials missed</th><th>outcome</th></tr>\n";
    text += summary_row(study.pooled);
    for (const ScaleAnalysis& o : study.observers) text += summary_row(o);
    text += "</table>\n";
    if (study.observers.size() > 1) {
        text += fmt::format(
            "<p>Geometric mean of the observers' lambda {}, standard deviation of its logarithm "
            "{:.2f}. One scale for all: likelihood ratio {:.1f} on {} degrees of freedom, "
            "p = {:.3g}.</p>\n",
            number(study.lambda_geometric_mean), study.lambda_log_sd,
            study.heterogeneity.likelihood_ratio, study.heterogeneity.degrees_of_freedom,
            study.heterogeneity.p_value);
    }
    text += notes(study.pooled);
    for (const ScaleAnalysis& o : study.observers) text += notes(o);
    return text;
}

std::string diagnostics_section(const ScaleAnalysis& a) {
    const ScaleDiagnostics& d = a.diagnostics;
    if (d.residuals.sorted.empty()) return "";
    return "<h2>Does the model hold?</h2>\n" +
           figure(residual_plot(d.residuals),
                  fmt::format("Deviance residuals (dots) within the 95 % envelope of {} simulated "
                              "and refitted data sets; {:.0f} % lie inside. Sign changes along the "
                              "fitted values: {}, p = {:.3f} (small: lack of fit).",
                              d.residuals.simulations, 100 * d.residuals.share_inside,
                              d.residuals.runs, d.residuals.runs_p_value)) +
           fmt::format(
               "<p>Six-point test: {} conditions, {} broken outright, log-likelihood {:.2f}, "
               "p = {:.3f} (share of simulations at most as likely). Lapses: {:.1f} %, p = {:.3g}. "
               "Direct maximisation: log-likelihood {:.6f}, largest difference of psi {:.1e}. "
               "Bootstrap: {} replicates, {} of them separated.</p>\n",
               d.six_point.conditions, d.six_point.violations, d.six_point.log_likelihood,
               d.six_point.p_value, 100 * d.lapses.lapse, d.lapses.p_value, a.direct_log_likelihood,
               a.direct_psi_difference, a.bootstrap_replicates, a.separated_replicates);
}

}  // namespace

std::string mlds_report_html(const MldsReport& report) {
    const StudyAnalysis& study = report.study;
    std::string body = fmt::format("<h1>{}</h1>\n", escape_html(report.title));
    body += headline(study);
    body += "<h2>Scales</h2>\n";
    body += figure(psi_plot(study), study.observers.empty()
                                        ? "Standard difference scale."
                                        : "Standard difference scales: each observer (grey) and "
                                          "the mean of the usable ones.");
    body += figure(beta_plot(study),
                   fmt::format("Unnormalised scale of all answers with 95 % BCa intervals (dots), "
                               "and the smooth scale with {} degree{} of freedom from which lambda "
                               "is read. A rise of 0.5 is d' = 1.",
                               study.pooled.smooth_degrees_of_freedom,
                               study.pooled.smooth_degrees_of_freedom == 1 ? "" : "s"));
    body += figure(lambda_plot(study, report.prediction),
                   "Lambda over the range, with its 95 % interval.");
    if (report.prediction) body += comparison_section(study, *report.prediction);
    body += observers_section(study);
    body += "<h2>Pooled scale</h2>\n" + scale_table(study);
    body += diagnostics_section(study.pooled);
    return html_page(report.title, body);
}

}  // namespace vitrine
