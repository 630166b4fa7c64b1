// estimate/scene_estimate.h: light and materials of a whole scene, jointly, and the scene they
// make.
#pragma once

#include "estimate/joint_light.h"
#include "estimate/lights.h"
#include "estimate/materials.h"
#include "estimate/paper_method.h"

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace vitrine {

/// What the user knows (overrides file, interfaces.md 2).
struct Overrides {
    std::vector<ObjectOverride> objects;
    std::vector<Light> lights;  ///< all there are, taken as they are
};

enum class EstimateMethod {
    Default,
    Paper,          ///< the published joint optimisation (estimate/paper_method.h)
    Local,          ///< baseline without shadows or bounces, everything diffuse
    InversePhoton,  ///< baseline of inverse photon mapping, everything diffuse
};

/// "default", "paper", "local", "inverse-photon", as on the command line.
std::string method_name(EstimateMethod method);
/// @throws InternalError for another word.
EstimateMethod method_from_name(const std::string& name);

struct EstimateOptions {
    EstimateMethod method = EstimateMethod::Default;
    PaperOptions paper;  ///< of the methods other than the default
    LightOptions lights;
    MaterialOptions materials;
    JointOptions joint;
    Overrides overrides;
    std::optional<LightEstimate> first_light;  ///< go on from here instead of searching
    bool lambertian = false;                   ///< every class forced to diffuse: the baseline
    bool refine_jointly = true;  ///< second round: classes known, highlights pull the light
    std::uint64_t seed = 0;
};

struct SceneEstimate {
    EstimateMethod method = EstimateMethod::Default;
    LightEstimate light;
    std::vector<ObjectEstimate> objects;
    double error_initial = 0.0;  ///< robust photometric cost with the first light
    double error_joint = 0.0;    ///< with the final light and materials
    JointReport joint;           ///< what highlights changed; zeros when they were not asked
    std::vector<std::pair<std::string, double>> seconds;  ///< by part; not written to estimate.json

    /// True when every quantity converged: otherwise the program ends with exit code 4.
    bool is_complete() const;
};

/// The alternation: light from the diffuse scan, class and material of each candidate, light
/// again with the classes known (metal shadows, highlights), materials again.
///
/// `capture.frames` pair with `scene.cameras`. Weak data shows in the outcomes.
/// Costs about 15 s for 14 views of 640x360 on two cores.
SceneEstimate estimate_scene(const Scene& scene, const Capture& capture,
                             const EstimateOptions& options = {}, const Progress& progress = {});

/// Light options with what the capture and the user know filled in.
LightOptions first_light_options(const Capture& capture, const EstimateOptions& options);

/// The light alone, by the method chosen: what `estimate_scene` starts from.
LightEstimate estimate_first_light(const Scene& scene, const Capture& capture,
                                   const EstimateOptions& options, const Progress& progress = {});

/// `estimate_scene` for the methods other than the default.
SceneEstimate estimate_published(const Scene& scene, const Capture& capture,
                                 const EstimateOptions& options, const Progress& progress = {});

/// The scene with lights, ambient and materials set and the scan's vertex colours turned from
/// radiance into albedo: radiance over irradiance, with shadows, bounced light and caustics taken
/// out. Where the irradiance is unsure (penumbra, caustic, unseen) the albedo flows in from around.
/// Hollow vessels become shells of their wall thickness. Costs about 5 s for 200,000 vertices.
Scene apply(const Scene& scene, const SceneEstimate& estimate, const Progress& progress = {});

}  // namespace vitrine
