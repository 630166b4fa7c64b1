// estimate/lights.h: where the light comes from, how far, how large, how strong.
// Stands on render/estimation_*. Knows no files.
#pragma once

#include "capture/capture.h"
#include "estimate/estimate.h"
#include "estimate/observations.h"
#include "scene/scene.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vitrine {

struct LightOptions {
    int candidate_count = 36;  ///< trial lights on the hemisphere, as in the paper
    int max_lights = 2;        ///< more are not told apart from texture by a handheld capture
    SampleOptions samples;
    std::optional<ReferenceAlbedo> reference_albedo;  ///< fixes the scale; else mean albedo 0.5
    std::vector<ObjectClass> object_classes;  ///< what is known of each candidate; empty: nothing
    std::vector<Light> known_lights;          ///< from the user: all there are, taken as they are
    std::optional<std::vector<DiscLight>> start;  ///< refine from here instead of searching
    bool keep_start =
        false;  ///< lights of `start` stay where they are: only their strength is fitted
    std::uint64_t seed = 0;
};

struct FittedLight {
    DiscLight light;  ///< aimed at the reference point
    double stddev_direction_deg = 0.0;
    double stddev_distance_m = 0.0;
    double stddev_radius_m = 0.0;
    double stddev_intensity_ratio = 0.0;         ///< of the intensity, relative
    double stddev_irradiance_ratio = 0.0;        ///< of intensity over distance squared
    Outcome outcome = Outcome::NotIdentifiable;  ///< of the direction
    std::string reason;
    bool is_distant = false;  ///< its distance is not identifiable: only the direction counts
};

struct LightEstimate {
    Vec3 reference_point_m = Vec3::Zero();
    double scene_radius_m = 0.5;
    SupportPlane plane;
    std::vector<FittedLight> lights;
    Rgb ambient_radiance = Rgb::Zero();
    std::string albedo_anchor;   ///< "reference_albedo", "mean_albedo" or "known_lights"
    double error_initial = 0.0;  ///< robust photometric cost of the best grid light, in [0, 1]
    double error_refined = 0.0;
    double residual_rms = 0.0;            ///< relative, of the inliers
    Vec3 grid_direction = Vec3(0, 0, 1);  ///< best of the grid lights, for comparison
    std::string rival;  ///< other lights that explain the scan about as well; empty: none
    Outcome outcome = Outcome::NotIdentifiable;
    std::string reason;
};

/// Lights that converged are ambiguous all the same when others explain the scan as well.
void doubt_by_rival(LightEstimate& estimate, const std::string& rival);

/// Fits lights and ambient to the scan: hemisphere of candidates, albedos projected out, then
/// continuous refinement of direction, distance and disc radius; a second light by evidence.
///
/// `scene` holds the scan (vertex colours = observed radiance) and the candidates "object_k";
/// `scene.cameras` pair with `frames`. Candidates count as opaque when known specular or diffuse,
/// and as unknown see-through bodies otherwise: what lies in their shadow then says nothing.
/// Costs about 6 s for 14 frames on two cores.
/// @throws InputError when a known light is a spot or an environment
LightEstimate estimate_lights(const Scene& scene, std::span<const RgbdFrame> frames,
                              double saturation_level, const LightOptions& options = {},
                              const Progress& progress = {});

/// Elevation of a light above the support plane seen from the reference point, degrees.
double elevation_deg(const LightEstimate& estimate, const Vec3& light_position_m);

/// Distance from which a lamp lights the scene as the sun does, in radii of the scene.
constexpr double kDistantPerRadius = 30.0;
/// A distant light by what it is: a direction and an irradiance.
DirectionalLight as_directional(const FittedLight& light, const Vec3& reference_point_m);

/// The estimate's lights as the renderer takes them.
std::vector<Light> to_lights(const LightEstimate& estimate);

}  // namespace vitrine
