// benchmarks/quality/estimation_bars.h: estimates of a made capture against what they must reach.
#pragma once

#include "estimate/scene_estimate.h"
#include "truth_scene.h"

#include <string>
#include <vector>

namespace vitrine {

struct Bar {
    std::string capture, quantity;
    double value = 0.0;  ///< an error's size, or a share
    double limit = 0.0;
    std::string note;          ///< "within 2 %", the numbers compared
    bool is_at_least = false;  ///< the value must not be below the limit, instead of above
    bool is_met() const { return is_at_least ? value >= limit : value <= limit; }
};

/// What the true meshes allow is stricter than what a reconstruction does.
enum class GeometrySource { True, Reconstructed };

/// Light and photometric scale.
void add_light_bars(const std::string& capture, const TrueScene& truth,
                    const LightEstimate& estimate, std::vector<Bar>& bars);
/// Class and numbers of every true object; false candidates must be diffuse.
void add_object_bars(const std::string& capture, const TrueScene& truth, const Scene& scene,
                     const Capture& pictures, const SceneEstimate& estimate, GeometrySource source,
                     std::vector<Bar>& bars);
/// Over all captures: mean errors and the grid light's.
void add_mean_bars(const std::vector<double>& light_errors_deg,
                   const std::vector<double>& grid_errors_deg, std::vector<Bar>& bars);

/// Of the lights found the one nearest to a true one in direction; null when none was found.
const FittedLight* nearest_found(const TrueScene& truth, const DiscLight& light,
                                 const LightEstimate& estimate);
double light_error_deg(const TrueScene& truth, const DiscLight& light,
                       const LightEstimate& estimate);
double grid_error_deg(const TrueScene& truth, const LightEstimate& estimate);
/// The true object a candidate stands for; null when nothing is there.
const TrueObject* object_at(const TrueScene& truth, const Mesh& hull);

void print_bars(const std::vector<Bar>& bars);

}  // namespace vitrine
