#include "render/light_sampler.h"

#include "base/error.h"

namespace vitrine {
namespace {

constexpr float kFar = 1e30f;

/// Smooth fall-off over the outer 10 % of the half angle.
float spot_factor(const SpotLight& spot, const Vec3f& from_light) {
    const double half = 0.5 * radians(spot.cone_deg);
    const double angle = angle_between(spot.direction, from_light.cast<double>());
    const double t = std::clamp((half - angle) / (0.1 * half), 0.0, 1.0);
    return static_cast<float>(t * t * (3.0 - 2.0 * t));
}

struct Cell {
    int x, y;
};
/// Texel of a direction; row 0 is +z, column 0 starts at azimuth -pi.
Cell environment_cell(const ImageRgb& map, const Vec3f& d) {
    const float theta = std::acos(std::clamp(d.z(), -1.0f, 1.0f));
    const float phi = std::atan2(d.y(), d.x());
    return {
        std::clamp(static_cast<int>((phi + kPif) / (2 * kPif) * map.width()), 0, map.width() - 1),
        std::clamp(static_cast<int>(theta / kPif * map.height()), 0, map.height() - 1)};
}

float row_solid_angle(const ImageRgb& map, int y) {
    const double top = kPi * y / map.height(), bottom = kPi * (y + 1) / map.height();
    return static_cast<float>(2 * kPi / map.width() * (std::cos(top) - std::cos(bottom)));
}

}  // namespace

LightSampler::Disc::Disc(const DiscLight& light)
    : position(light.position_m.cast<float>()),
      frame(light.normal.cast<float>()),
      radius(static_cast<float>(light.radius_m)),
      area(kPif * static_cast<float>(light.radius_m * light.radius_m)),
      intensity(light.intensity_w_per_sr),
      radiance(light.intensity_w_per_sr / area) {}

Vec3f LightSampler::Disc::point(const Vec2f& u) const {
    const Vec2f d = sample_concentric_disc(u) * radius;
    return position + frame.tangent * d.x() + frame.bitangent * d.y();
}

LightSampler::LightSampler(std::vector<Light> lights, const Rgb& ambient_radiance)
    : lights_(std::move(lights)),
      discs_(lights_.size()),
      tables_(lights_.size()),
      ambient_(ambient_radiance) {
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        if (const auto* disc = std::get_if<DiscLight>(&lights_[i])) {
            discs_[i].emplace(*disc);
            lamps_.push_back(i);
        }
        const auto* environment = std::get_if<EnvironmentLight>(&lights_[i]);
        if (!environment) continue;
        environments_.push_back(i);
        const ImageRgb& map = *environment->radiance;
        std::vector<double> row_weights;
        std::vector<DiscreteDistribution> columns;
        for (int y = 0; y < map.height(); ++y) {
            std::vector<double> weights;
            double sum = 0;
            for (int x = 0; x < map.width(); ++x) {
                weights.push_back(std::max(0.0f, luminance(map(x, y))));
                sum += weights.back();
            }
            row_weights.push_back(sum * row_solid_angle(map, y));
            columns.emplace_back(weights);
        }
        tables_[i] = std::make_shared<EnvironmentTable>(
            EnvironmentTable{DiscreteDistribution(row_weights), std::move(columns)});
    }
}

Vec3f LightSampler::sample_environment(std::size_t light, Vec2f u, float& pdf) const {
    const ImageRgb& map = *std::get<EnvironmentLight>(lights_[light]).radiance;
    const EnvironmentTable& table = *tables_[light];
    const auto y = table.rows.sample(u.y());
    const auto x = table.columns[y].sample(u.x());
    const float top = std::cos(kPif * static_cast<float>(y) / static_cast<float>(map.height()));
    const float low = std::cos(kPif * static_cast<float>(y + 1) / static_cast<float>(map.height()));
    const float z = top + (low - top) * u.y();
    const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    const float phi =
        2 * kPif * (static_cast<float>(x) + u.x()) / static_cast<float>(map.width()) - kPif;
    pdf = static_cast<float>(table.rows.probability(y) * table.columns[y].probability(x)) /
          row_solid_angle(map, static_cast<int>(y));
    return {r * std::cos(phi), r * std::sin(phi), z};
}

float LightSampler::environment_pdf(std::size_t light, const Vec3f& direction) const {
    const ImageRgb& map = *std::get<EnvironmentLight>(lights_[light]).radiance;
    const EnvironmentTable& table = *tables_[light];
    const Cell cell = environment_cell(map, direction);
    const auto y = static_cast<std::size_t>(cell.y);
    return static_cast<float>(table.rows.probability(y) *
                              table.columns[y].probability(static_cast<std::size_t>(cell.x))) /
           row_solid_angle(map, cell.y);
}

Rgb LightSampler::environment_radiance(std::size_t light, const Vec3f& direction) const {
    const auto& environment = std::get<EnvironmentLight>(lights_[light]);
    const Cell cell = environment_cell(*environment.radiance, direction);
    return (*environment.radiance)(cell.x, cell.y) * static_cast<float>(environment.scale);
}

std::optional<LightSample> LightSampler::sample(std::size_t light, const Vec3f& point,
                                                const Vec2f& u) const {
    LightSample s;
    const auto towards = [&](const Vec3f& position) {
        const Vec3f d = position - point;
        s.distance = d.norm();
        s.direction = d / s.distance;
        return s.distance > 0;
    };
    if (const auto& disc = discs_[light]) {
        if (!towards(disc->point(u))) return std::nullopt;
        const float cos_light = -s.direction.dot(disc->frame.normal);
        if (cos_light <= 0) return std::nullopt;
        s.pdf = s.distance * s.distance / (cos_light * disc->area);
        s.radiance_over_pdf = disc->intensity * (cos_light / (s.distance * s.distance));
    } else if (const auto* l = std::get_if<PointLight>(&lights_[light])) {
        if (!towards(l->position_m.cast<float>())) return std::nullopt;
        s.radiance_over_pdf = l->intensity_w_per_sr / (s.distance * s.distance);
    } else if (const auto* spot = std::get_if<SpotLight>(&lights_[light])) {
        if (!towards(spot->position_m.cast<float>())) return std::nullopt;
        const float factor = spot_factor(*spot, -s.direction);
        if (factor <= 0) return std::nullopt;
        s.radiance_over_pdf = spot->intensity_w_per_sr * (factor / (s.distance * s.distance));
    } else if (const auto* sun = std::get_if<DirectionalLight>(&lights_[light])) {
        s.direction = -sun->direction.cast<float>();
        s.distance = kFar;
        s.radiance_over_pdf = sun->irradiance_w_per_m2;
    } else {
        s.direction = sample_environment(light, u, s.pdf);
        if (!(s.pdf > 0)) return std::nullopt;
        s.distance = kFar;
        s.radiance_over_pdf = environment_radiance(light, s.direction) / s.pdf;
    }
    return s;
}

float LightSampler::pdf(std::size_t light, const Vec3f&, const Vec3f& direction,
                        float distance) const {
    if (const auto& disc = discs_[light]) {
        const float cos_light = -direction.dot(disc->frame.normal);
        return cos_light > 0 ? distance * distance / (cos_light * disc->area) : 0.0f;
    }
    if (tables_[light]) return environment_pdf(light, direction);
    return 0.0f;
}

EmittedRay LightSampler::emit(std::size_t light, const Sphere& target, const Vec2f& u_direction,
                              const Vec2f& u_position, const Sphere& scene) const {
    EmittedRay ray;
    // Rays from one point into the cone around the target; returns its solid angle.
    const auto aim_from = [&](const Vec3f& origin) {
        ray.origin = origin;
        const Vec3f axis = target.centre - origin;
        const float distance = axis.norm();
        if (distance <= target.radius) {  // the light is within the target's sphere
            ray.direction = sample_uniform_sphere(u_direction);
            return 4 * kPif;
        }
        const float sin2 = target.radius * target.radius / (distance * distance);
        const float one_minus_cos = sin2 / (1.0f + std::sqrt(1.0f - sin2));
        ray.direction =
            Frame(axis / distance).to_world(sample_uniform_cone(u_direction, 1 - one_minus_cos));
        return 2 * kPif * one_minus_cos;
    };
    // Parallel rays through the target's cross-section; returns its area.
    const auto aim_along = [&](const Vec3f& direction, const Vec2f& u) {
        const Vec2f d = sample_concentric_disc(u) * target.radius;
        const Frame frame(direction);
        const float back = (target.centre - scene.centre).norm() + 2 * scene.radius + target.radius;
        ray.origin =
            target.centre + frame.tangent * d.x() + frame.bitangent * d.y() - direction * back;
        ray.direction = direction;
        return kPif * target.radius * target.radius;
    };
    if (const auto* point = std::get_if<PointLight>(&lights_[light])) {
        ray.power = aim_from(point->position_m.cast<float>()) * point->intensity_w_per_sr;
    } else if (const auto* spot = std::get_if<SpotLight>(&lights_[light])) {
        const float solid_angle = aim_from(spot->position_m.cast<float>());
        ray.power = spot->intensity_w_per_sr * (solid_angle * spot_factor(*spot, ray.direction));
    } else if (const auto& disc = discs_[light]) {
        const float solid_angle = aim_from(disc->point(u_position));
        const float cos_light = ray.direction.dot(disc->frame.normal);
        ray.power = disc->intensity * (std::max(0.0f, cos_light) * solid_angle);
    } else if (const auto* sun = std::get_if<DirectionalLight>(&lights_[light])) {
        ray.power = sun->irradiance_w_per_m2 * aim_along(sun->direction.cast<float>(), u_direction);
    } else {
        float density = 0;
        const Vec3f to_light = sample_environment(light, u_position, density);
        const float area = aim_along(-to_light, u_direction);
        if (density > 0) ray.power = environment_radiance(light, to_light) * (area / density);
    }
    return ray;
}

}  // namespace vitrine
