#include "sphere_caustic.h"

#include "base/parallel.h"
#include "optics/fresnel.h"

namespace vitrine {
namespace {

constexpr int kInnerReflections = 2;

struct Ball {
    Vec3 centre;
    double radius, ior;
};

/// Area on the table (z = 0) that a pixel covers.
double footprint(const Camera& camera, int x, int y) {
    const Vec3 eye = camera.centre_in_world();
    const auto corner = [&](double u, double v) -> Vec3 {
        const Vec3 ray = camera.ray_in_world(u, v);
        return eye - ray * (eye.z() / ray.z());
    };
    const Vec3 a = corner(x - 0.5, y - 0.5), b = corner(x + 0.5, y - 0.5);
    const Vec3 c = corner(x + 0.5, y + 0.5), d = corner(x - 0.5, y + 0.5);
    return 0.5 * (c - a).cross(d - b).norm();
}

/// Calls `arrive(place, power)` where light of a ray with power 1 meets the table.
template <typename Arrive>
void follow(const Ball& ball, const Vec3& origin, const Vec3& direction, const Arrive& arrive) {
    const Vec3 to_centre = ball.centre - origin;
    const double along = to_centre.dot(direction);
    const double off2 = to_centre.squaredNorm() - along * along;
    const double half2 = ball.radius * ball.radius - off2;
    if (half2 <= 0) return;
    Vec3 place = origin + (along - std::sqrt(half2)) * direction;
    Vec3 normal = (place - ball.centre) / ball.radius;
    double cos_t = 0;
    const double cos_i = -direction.dot(normal);
    double power = 1 - fresnel_dielectric(cos_i, ball.ior, cos_t);
    Vec3 inside = direction / ball.ior + (cos_i / ball.ior - cos_t) * normal;
    for (int k = 0; k <= kInnerReflections; ++k) {
        // The chord meets the surface at the angle at which it began.
        place += 2 * cos_t * ball.radius * inside;
        normal = (place - ball.centre) / ball.radius;
        double cos_out = 0;
        const double reflected = fresnel_dielectric(cos_t, 1 / ball.ior, cos_out);
        const Vec3 out = inside * ball.ior + (cos_out - ball.ior * cos_t) * normal;
        if (out.z() < 0) arrive(place - out * (place.z() / out.z()), power * (1 - reflected));
        inside -= 2 * inside.dot(normal) * normal;
        power *= reflected;
    }
}

}  // namespace

ImageF sphere_caustic(const ReferenceScene& reference, const Camera& camera, int side) {
    const Part& part = reference.scene.parts.at(reference.sphere);
    const Box3 box = bounds(*part.mesh);
    const Ball ball{box.centre(), 0.5 * box.size().z(), std::get<Dielectric>(part.material).ior};
    const auto& lamp = std::get<PointLight>(reference.scene.lights.front());
    const auto& table = std::get<Diffuse>(reference.scene.parts.at(reference.table).material);
    const Vec3 axis = ball.centre - lamp.position_m;
    const double sine = ball.radius / axis.norm();
    const double height = sine * sine / (1 + std::sqrt(1 - sine * sine));  // 1 - cos
    const Vec3 normal = axis.normalized();
    const Vec3 tangent = normal.unitOrthogonal(), bitangent = normal.cross(tangent);
    const double flux =
        lamp.intensity_w_per_sr.mean() * 2 * kPi * height / (double(side) * double(side));
    using Counts = std::vector<double>;
    const std::size_t pixels = std::size_t(camera.width) * std::size_t(camera.height);
    constexpr std::size_t kParts = 8;
    std::vector<Counts> counts(kParts, Counts(pixels, 0.0));
    parallel_for(kParts, 1, [&](std::size_t p) {
        for (int i = static_cast<int>(p); i < side; i += static_cast<int>(kParts)) {
            const double below = (i + 0.5) / side * height;
            const double r = std::sqrt(below * (2 - below));
            for (int k = 0; k < side; ++k) {
                const double phi = 2 * kPi * (k + 0.5) / side;
                const Vec3 direction = (1 - below) * normal + r * std::cos(phi) * tangent +
                                       r * std::sin(phi) * bitangent;
                follow(ball, lamp.position_m, direction, [&](const Vec3& place, double power) {
                    const Vec2 at = camera.project(place);
                    if (!camera.sees(at)) return;
                    const auto x = static_cast<std::size_t>(std::lround(at.x()));
                    const auto y = static_cast<std::size_t>(std::lround(at.y()));
                    counts[p][y * std::size_t(camera.width) + x] += power * flux;
                });
            }
        }
    });
    ImageF radiance(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const std::size_t i = std::size_t(y) * std::size_t(camera.width) + std::size_t(x);
            double sum = 0;
            for (const Counts& part_of_it : counts) sum += part_of_it[i];
            if (sum <= 0) continue;
            radiance(x, y) =
                static_cast<float>(sum / footprint(camera, x, y) * table.albedo.mean() / kPi);
        }
    }
    return radiance;
}

}  // namespace vitrine
