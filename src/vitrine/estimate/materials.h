// estimate/materials.h: what each candidate is, and its numbers.
#pragma once

#include "capture/capture.h"
#include "estimate/lights.h"
#include "estimate/specular.h"
#include "estimate/transparent.h"
#include "estimate/ward_clusters.h"

#include <optional>
#include <string>
#include <vector>

namespace vitrine {

struct MaterialOptions {
    TransparentOptions transparent;
    SpecularOptions specular;
    ObjectPixelOptions pixels;
    double unsure_margin = 0.2;  ///< smaller margins are answered "unsure"
};

/// What the user knows of a candidate is not estimated.
struct ObjectOverride {
    std::string id;
    std::optional<ObjectClass> object_class;
    std::optional<double> ior;
    std::optional<Rgb> sigma_a_per_m;
    bool ignore = false;  ///< not an object: treated as diffuse
};

/// The override of candidate `id`; null when there is none.
const ObjectOverride* find_override(const std::vector<ObjectOverride>& overrides,
                                    const std::string& id);

struct ObjectEstimate {
    std::string id;
    ObjectClass object_class = ObjectClass::Unsure;
    double class_margin = 0.0;  ///< ln(cost as metal / cost as glass); > 0: transparent
    bool is_hollow = false;
    Estimate<double> wall_m;  ///< of a hollow one
    std::string mesh_file;
    Estimate<double> ior;          ///< transparent only
    Estimate<double> ior_through;  ///< of the view through it alone; not in estimate.json
    /// Transparent only.
    Estimate<Rgb> sigma_a_per_m{Rgb::Zero(), Rgb::Zero(), 0.0, Outcome::NotIdentifiable, {}};
    std::vector<WardCluster> clusters;  ///< specular only
    AlbedoClusters paints;              ///< where each cluster lies; not in estimate.json
    Rgb albedo = Rgb::Constant(0.5f);   ///< best single albedo: what a diffuse world makes of it
    double cost_solid = 1.0, cost_shell = 1.0, cost_ward = 1.0, cost_diffuse = 1.0;
    std::string reason;
};

/// Compares, on the same pixels of all views, three fitted models of every candidate: solid glass
/// and thin-walled glass (background bent or not, tinted), Ward (diffuse, highlight, reflected
/// surroundings) and diffuse alone; decides by the logarithm of their robust costs.
/// Costs about 3 s per object on two cores.
std::vector<ObjectEstimate> estimate_materials(const Scene& scene,
                                               std::span<const RgbdFrame> frames,
                                               double saturation_level, const LightEstimate& lights,
                                               const std::vector<ObjectOverride>& overrides = {},
                                               const MaterialOptions& options = {},
                                               const Progress& progress = {});

/// Fits the reflectance of all specular, diffuse and unsure candidates again under another light;
/// classes stay.
void refit_specular(const Scene& scene, std::span<const RgbdFrame> frames, double saturation_level,
                    const LightEstimate& lights, const MaterialOptions& options,
                    std::vector<ObjectEstimate>& objects, const Progress& progress = {});

}  // namespace vitrine
