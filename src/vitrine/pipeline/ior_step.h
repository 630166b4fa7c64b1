// pipeline/ior_step.h: the step of the search for a refractive index, as `--ior-step` gives it: a
// number, or a scale.json measured with people (floor `perception`).
#pragma once

#include <array>
#include <string>
#include <vector>

namespace vitrine {

struct IorStep {
    double value = 0.01;                       ///< lambda; the paper's 0.01 when nothing is given
    std::vector<std::array<double, 2>> local;  ///< (n, lambda at n), rising n; empty: constant

    /// The step at an index: linear between the entries, the nearest entry beyond them.
    double at(double ior) const;
};

/// `text` is a number above 0 or the name of a file "vitrine.mlds/1".
/// @throws InputError for a step outside [1e-4, 0.5], a scale that did not converge, one without
/// refractive indices (only ranks), or a prediction in place of a measurement.
IorStep read_ior_step(const std::string& text);

/// Indices from `low` to `high`, both included, each next one a step further: constant steps, or
/// the local ones when there are any.
std::vector<double> ior_samples(const IorStep& step, double low, double high);

}  // namespace vitrine
