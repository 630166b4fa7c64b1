#include "render/photon_targets.h"

#include "render/sampler.h"

namespace vitrine {
namespace {

float bending_weight(const Material& material) {
    if (std::holds_alternative<Dielectric>(material)) return 1.0f;
    if (const auto* mirror = std::get_if<Mirror>(&material)) {
        return mirror->reflectance.maxCoeff() > 0 ? 1.0f : 0.0f;
    }
    // A glossy lobe blurs: half the photons do.
    if (const auto* ward = std::get_if<Ward>(&material)) {
        return ward->rho_s.maxCoeff() > 0 ? 0.5f : 0.0f;
    }
    if (const auto* translucent = std::get_if<Translucent>(&material)) {
        return translucent->sigma > 0 ? 0.1f : 0.0f;  // its interface reflects 3 to 5 %
    }
    return 0.0f;
}

/// Sphere around the vertices: centre of the box, farthest vertex.
Sphere sphere_around(const Mesh& mesh) {
    Sphere sphere;
    sphere.centre = bounds(mesh).centre().cast<float>();
    for (const Vec3f& v : mesh.vertices) {
        sphere.radius = std::max(sphere.radius, (v - sphere.centre).norm());
    }
    sphere.radius *= 1.0001f;  // rays along the outline belong to it
    return sphere;
}

}  // namespace

std::vector<PhotonTarget> find_targets(const RenderScene& scene, const CausticOptions& options) {
    std::vector<PhotonTarget> targets;
    std::vector<double> weights;
    double sum = 0;
    for (std::size_t light = 0; light < scene.lights().count(); ++light) {
        for (std::size_t p = 0; p < scene.scene().parts.size(); ++p) {
            const Part& part = scene.scene().parts[p];
            const float bending = bending_weight(part.material);
            if (bending <= 0 || part.mesh->empty()) continue;
            PhotonTarget target{light, static_cast<int>(p), sphere_around(*part.mesh), 0,
                                stream_key(options.seed, light, p, 0xca05u)};
            // Power towards the part, by a few rays: shares photons among the lights fairly.
            double power = 0;
            constexpr std::uint32_t kPilotRays = 64;
            for (std::uint32_t i = 0; i < kPilotRays; ++i) {
                const PathSampler sampler(target.key ^ 1u, i);
                power += scene.lights()
                             .emit(light, target.sphere, sampler.pair(0, 0), sampler.pair(0, 1),
                                   scene.bounding_sphere())
                             .power.sum();
            }
            if (!(power > 0)) continue;
            weights.push_back(power * bending);
            sum += weights.back();
            targets.push_back(target);
        }
    }
    for (std::size_t i = 0; i < targets.size(); ++i) {
        targets[i].count = static_cast<std::uint64_t>(
            std::ceil(static_cast<double>(options.photon_count) * weights[i] / sum));
    }
    return targets;
}

}  // namespace vitrine
