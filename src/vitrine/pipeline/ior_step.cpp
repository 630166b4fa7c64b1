#include "pipeline/ior_step.h"

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "perception/scale_json.h"

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

constexpr double kSmallestStep = 1e-4;  // 8,000 renders from 1.2 to 2
constexpr double kLargestStep = 0.5;

bool is_step(double value) { return value >= kSmallestStep && value <= kLargestStep; }

}  // namespace

double IorStep::at(double ior) const {
    if (local.empty()) return value;
    if (ior <= local.front()[0]) return local.front()[1];
    for (std::size_t i = 1; i < local.size(); ++i) {
        if (ior > local[i][0]) continue;
        const double t = (ior - local[i - 1][0]) / (local[i][0] - local[i - 1][0]);
        return (1 - t) * local[i - 1][1] + t * local[i][1];
    }
    return local.back()[1];
}

IorStep read_ior_step(const std::string& text) {
    IorStep step;
    if (parse_double(text, step.value)) {
        if (!is_step(step.value)) {
            throw InputError({"--ior-step",
                              fmt::format("a step from {} to {}", kSmallestStep, kLargestStep),
                              text, "the paper's is 0.01"});
        }
        return step;
    }
    const StudyAnalysis study = study_from_json(read_text_file(text), text);
    const ScaleAnalysis& pooled = study.pooled;
    if (!study.stimuli_are_ior) {
        throw InputError({text, "a scale over refractive indices", "a scale over ranks",
                          "fit again with --stimuli stimuli.json"});
    }
    if (!pooled.scale.is_usable() || !is_step(pooled.lambda.value)) {
        throw InputError({text, "a measured lambda",
                          pooled.scale.reason.empty() ? "none" : pooled.scale.reason, ""});
    }
    step.value = pooled.lambda.value;
    if (pooled.smooth_degrees_of_freedom == 1) return step;
    for (const auto& [n, lambda] : pooled.lambda.local) {
        // Where the scale is flat nothing is seen to change: the largest step will do.
        step.local.push_back({n, std::isfinite(lambda)
                                     ? std::clamp(lambda, kSmallestStep, kLargestStep)
                                     : kLargestStep});
    }
    return step;
}

std::vector<double> ior_samples(const IorStep& step, double low, double high) {
    VITRINE_CHECK_LT(low, high);
    std::vector<double> samples = {low};
    // Counted, not summed, while the step is constant: 1.2, 1.21 .. as they are written.
    constexpr double kSlack = 1e-9;
    if (step.local.empty()) {
        for (int i = 1; low + i * step.value < high - kSlack; ++i) {
            samples.push_back(low + i * step.value);
        }
    } else {
        while (samples.back() + step.at(samples.back()) < high - kSlack) {
            samples.push_back(samples.back() + step.at(samples.back()));
        }
    }
    samples.push_back(high);
    return samples;
}

}  // namespace vitrine
