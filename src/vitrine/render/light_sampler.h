// render/light_sampler.h: the lights of a scene, prepared for sampling from both ends: from a
// surface point towards a light, and from a light towards a part that will bend its rays.
#pragma once

#include "math/rigid3.h"
#include "math/sampling.h"
#include "scene/light.h"

#include <memory>
#include <optional>
#include <vector>

namespace vitrine {

struct LightSample {
    Vec3f direction = Vec3f::Zero();  ///< unit, from the point to the light
    float distance = 0.0f;            ///< up to which a shadow ray must be free; 1e30 at infinity
    Rgb radiance_over_pdf = Rgb::Zero();  ///< for lights without size: irradiance facing the light
    float pdf = 0.0f;  ///< per solid angle; 0 for lights without size, which no ray can hit
};

struct EmittedRay {
    Vec3f origin = Vec3f::Zero();
    Vec3f direction = Vec3f::Zero();
    Rgb power = Rgb::Zero();  ///< W carried when a single ray stands for the whole beam
};

struct Sphere {
    Vec3f centre = Vec3f::Zero();
    float radius = 0.0f;
};

class LightSampler {
  public:
    LightSampler() = default;
    LightSampler(std::vector<Light> lights, const Rgb& ambient_radiance);

    std::size_t count() const { return lights_.size(); }
    const Light& light(std::size_t index) const { return lights_[index]; }

    /// Empty when the light sends nothing to the point.
    std::optional<LightSample> sample(std::size_t light, const Vec3f& point, const Vec2f& u) const;
    /// Density with which `sample` of that light picks the direction of a ray that hit it at
    /// `distance` (ignored for environments).
    float pdf(std::size_t light, const Vec3f& point, const Vec3f& direction, float distance) const;

    struct Hit {
        std::size_t light = 0;
        float distance = 0.0f;
        Rgb radiance = Rgb::Zero();
    };
    /// The discs that a ray meets before `max_distance`, on their bright side, one call per light.
    std::optional<Hit> hit(std::size_t light, const Vec3f& origin, const Vec3f& direction,
                           float max_distance) const {
        const auto& disc = discs_[light];
        if (!disc) return std::nullopt;
        const Vec3f& normal = disc->frame.normal;
        const float slope = direction.dot(normal);
        if (slope >= 0) return std::nullopt;
        const Vec3f to_centre = disc->position - origin;
        const float t = to_centre.dot(normal) / slope;
        if (t <= 0 || t >= max_distance) return std::nullopt;
        if ((t * direction - to_centre).squaredNorm() > disc->radius * disc->radius) {
            return std::nullopt;
        }
        return Hit{light, t, disc->radiance};
    }
    /// Whether `sample` and `emit` use their position: lights with size and environment maps.
    bool needs_position(std::size_t light) const {
        return discs_[light].has_value() || tables_[light];
    }
    bool can_be_hit(std::size_t light) const { return discs_[light].has_value(); }
    /// Those for which `can_be_hit`.
    const std::vector<std::size_t>& lamps() const { return lamps_; }

    /// Uniform environment beside the maps.
    const Rgb& ambient() const { return ambient_; }
    /// Index of the environment maps.
    const std::vector<std::size_t>& environments() const { return environments_; }
    Rgb environment_radiance(std::size_t light, const Vec3f& direction) const;

    /// A ray from the light into the cone, cylinder or set of directions around `target`. The rays
    /// of all u together carry exactly what the light sends into that region.
    /// @param u_direction, u_position  the position is used by lights with size
    /// @param scene bounds all parts: rays from infinity start outside of it
    EmittedRay emit(std::size_t light, const Sphere& target, const Vec2f& u_direction,
                    const Vec2f& u_position, const Sphere& scene) const;

  private:
    struct EnvironmentTable {
        DiscreteDistribution rows;
        std::vector<DiscreteDistribution> columns;
    };
    /// A disc lamp as rays need it.
    struct Disc {
        explicit Disc(const DiscLight& light);
        Vec3f point(const Vec2f& u) const;
        Vec3f position;
        Frame frame;  // normal: the side that emits
        float radius, area;
        Rgb intensity, radiance;
    };
    Vec3f sample_environment(std::size_t light, Vec2f u, float& pdf) const;
    float environment_pdf(std::size_t light, const Vec3f& direction) const;

    std::vector<Light> lights_;
    std::vector<std::optional<Disc>> discs_;  // per light, empty if no disc
    std::vector<std::size_t> lamps_, environments_;
    std::vector<std::shared_ptr<const EnvironmentTable>> tables_;  // per light, null if no map
    Rgb ambient_ = Rgb::Zero();
};

}  // namespace vitrine
