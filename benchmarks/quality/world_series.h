// benchmarks/quality/world_series.h: the made worlds that estimators are measured on, by seed.
#pragma once

#include "synthetic/world.h"

namespace vitrine {

/// Random kinds, shapes, lights and materials; errors of geometry and poses as reconstruction
/// leaves them (docs/results.md), noise of a good phone.
WorldOptions series_world(std::uint64_t seed);

}  // namespace vitrine
