// benchmarks/quality/differential_options.h: the options of an insertion that programs share.
#pragma once

#include "render/differential.h"

#include <CLI/CLI.hpp>

namespace vitrine {

inline void add_differential_options(CLI::App& app, DifferentialOptions& options) {
    app.add_option("--max-samples", options.max_samples, "See DifferentialOptions");
    app.add_option("--noise-target", options.noise_target, "See DifferentialOptions");
    app.add_option("--photon-count", options.photon_count, "Photons shot");
}

}  // namespace vitrine
