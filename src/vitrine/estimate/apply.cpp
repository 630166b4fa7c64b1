#include "base/parallel.h"
#include "estimate/scene_estimate.h"
#include "estimate/vessel.h"
#include "render/estimation_caustic.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr int kGatherRays = 24;  // noisy one by one; neighbours share after smoothing
constexpr int kSmoothRounds = 3;
constexpr int kDiscSamples = 24;
constexpr int kPhotons = 400'000;
constexpr int kRelaxationRounds = 250;
constexpr float kOverRelaxation = 1.85f;
constexpr float kCertainWeight = 100.0f;  // doubt below about 10 %
constexpr float kMaxAlbedo = 0.97f, kMinAlbedo = 0.005f;

// Relative doubt of each part of the irradiance, by comparison with made scenes.
constexpr float kDirectDoubt = 0.03f;
constexpr float kPenumbraDoubt = 0.35f;  // of the unshadowed direct light, at half shadow
constexpr float kCausticDoubt = 0.5f;    // caustics are sharper than a hull can tell
constexpr float kThroughDoubt = 0.3f;    // of the light that a clear object redirects
constexpr float kBouncedDoubt = 0.25f;
constexpr float kWildDoubt = 0.15f;
constexpr float kSmoothness = 10.0f;  // pull of neighbours, in units of 1 / doubt^2

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Neighbours of each vertex along edges, flat.
struct Rings {
    std::vector<int> start, neighbour;
};

Rings rings_of(const Mesh& mesh) {
    std::vector<std::pair<int, int>> edges;
    edges.reserve(mesh.triangles.size() * 6);
    for (const Triangle& t : mesh.triangles)
        for (int e = 0; e < 3; ++e) {
            edges.emplace_back(t[e], t[(e + 1) % 3]);
            edges.emplace_back(t[(e + 1) % 3], t[e]);
        }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    Rings rings;
    rings.start.assign(mesh.vertices.size() + 1, 0);
    for (const auto& [a, b] : edges) {
        ++rings.start[at(a) + 1];
        rings.neighbour.push_back(b);
    }
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) rings.start[i + 1] += rings.start[i];
    return rings;
}

/// Mean over the one-ring, for quantities that are smooth but noisy. Edges over creases count less.
template <typename T>
void smooth(const Mesh& mesh, const Rings& rings, std::vector<T>& values, int rounds) {
    std::vector<T> next(values.size());
    for (int round = 0; round < rounds; ++round) {
        parallel_for(values.size(), 2048, [&](std::size_t i) {
            T sum = values[i];
            float weight = 1.0f;
            for (int k = rings.start[i]; k < rings.start[i + 1]; ++k) {
                const std::size_t j = at(rings.neighbour[at(k)]);
                const float w = std::max(0.0f, mesh.normals[i].dot(mesh.normals[j]));
                sum += w * values[j];
                weight += w;
            }
            next[i] = sum / weight;
        });
        values.swap(next);
    }
}

struct Irradiance {
    std::vector<Rgb> value;
    std::vector<float> doubt;  ///< relative standard deviation
};

Irradiance irradiance_of(const EstimationScene& world, const Mesh& mesh, const Rings& rings,
                         const std::vector<SurfacePoint>& points, const SceneEstimate& estimate) {
    const std::size_t n = points.size();
    std::uint32_t opaque = kScanMask, clear = 0;
    for (int k = 0; k < world.object_count(); ++k) {
        const bool is_clear = at(k) < estimate.objects.size() &&
                              estimate.objects[at(k)].object_class == ObjectClass::Transparent;
        (is_clear ? clear : opaque) |= object_mask(k);
    }
    // Metal sends on what it gets: about its albedo times what the scan around it shows.
    Rgb mean_radiance = Rgb::Zero();
    for (const Rgb& c : mesh.colours) mean_radiance += c / static_cast<float>(mesh.colours.size());
    std::vector<Rgb> object_radiance(at(world.object_count()), Rgb::Zero());
    for (std::size_t k = 0; k < std::min(object_radiance.size(), estimate.objects.size()); ++k)
        if (!estimate.objects[k].clusters.empty()) {
            const Ward& ward = estimate.objects[k].clusters.front().fit.ward;
            object_radiance[k] = (ward.rho_d + ward.rho_s).min(1.0f) * mean_radiance;
        }
    GatheredLight gathered = gather_light(world, points, kGatherRays, clear, object_radiance, 11);
    smooth(mesh, rings, gathered.bounced, kSmoothRounds);
    smooth(mesh, rings, gathered.openness, kSmoothRounds);

    Irradiance result;
    result.value.assign(n, Rgb::Zero());
    result.doubt.assign(n, 0.0f);
    std::vector<float> variance(n, 0.0f);
    for (std::size_t i = 0; i < n; ++i) {
        const Rgb soft =
            gathered.bounced[i] + gathered.openness[i] * estimate.light.ambient_radiance;
        result.value[i] = soft;
        variance[i] = std::pow(kBouncedDoubt * luminance(soft), 2.0f);
    }
    for (const FittedLight& fitted : estimate.light.lights) {
        const DiscLight& lamp = fitted.light;
        const TrialLight trial{lamp.position_m, lamp.normal, lamp.radius_m};
        const float strength = luminance(lamp.intensity_w_per_sr);
        const DirectColumn lit = direct_column(world, points, trial, kDiscSamples, opaque, clear);
        const DirectColumn open =
            direct_column(world, points, {trial.position_m, trial.normal, 0.0}, 1, 0, 0);
        for (std::size_t i = 0; i < n; ++i) {
            result.value[i] += lit.clear[i] * lamp.intensity_w_per_sr;
            const float full = open.clear[i];
            const float share = full > 0 ? std::min(1.0f, lit.clear[i] / full) : 0.0f;
            const float penumbra = 4.0f * share * (1.0f - share);
            variance[i] += std::pow(kDirectDoubt * strength * lit.clear[i], 2.0f) +
                           std::pow(kPenumbraDoubt * penumbra * strength * full, 2.0f);
        }
        for (int k = 0; k < world.object_count(); ++k) {
            if ((object_mask(k) & clear) == 0) continue;
            const ObjectEstimate& object = estimate.objects[at(k)];
            TrialCaustic options;
            options.ior = object.ior.value;
            options.sigma_a_per_m = object.sigma_a_per_m.value;
            options.is_shell = object.is_hollow;
            options.wall_m = object.wall_m.value;
            options.photon_count = kPhotons;
            const std::vector<Rgb> caustic =
                caustic_irradiance(world, k, trial, points, opaque & ~object_mask(k), options);
            for (std::size_t i = 0; i < n; ++i) {
                const Rgb e = caustic[i] * lamp.intensity_w_per_sr;
                result.value[i] += e;
                // In the object's shadow what arrives is the caustic, and its model's doubt.
                variance[i] += std::pow(kCausticDoubt * luminance(e), 2.0f) +
                               std::pow(kThroughDoubt * strength * lit.through[i], 2.0f);
            }
        }
    }
    for (std::size_t i = 0; i < n; ++i)
        result.doubt[i] = std::sqrt(variance[i]) / std::max(luminance(result.value[i]), 1e-6f);
    return result;
}

/// Some camera looks at the point and nothing is in the way.
std::vector<char> seen_by_cameras(const EstimationScene& world, const std::vector<Camera>& cameras,
                                  const std::vector<SurfacePoint>& points) {
    std::vector<Vec3f> eyes;
    for (const Camera& camera : cameras) eyes.push_back(camera.centre_in_world().cast<float>());
    std::vector<char> seen(points.size(), 0);
    parallel_for(points.size(), 512, [&](std::size_t i) {
        const SurfacePoint& p = points[i];
        for (std::size_t f = 0; f < eyes.size() && !seen[i]; ++f) {
            const Vec3f to_eye = eyes[f] - p.position;
            if (p.normal.dot(to_eye) < 0.1f * to_eye.norm()) continue;
            const Vec3 in_camera = cameras[f].cam_from_world * p.position.cast<double>();
            if (in_camera.z() <= 0 || !cameras[f].sees(cameras[f].project_camera(in_camera)))
                continue;
            const Vec3f origin = p.position + world.offset_m() * p.normal;
            seen[i] = !world.accel().is_occluded({origin, eyes[f] - origin, 0.0f, 1.0f, kAllMask});
        }
    });
    return seen;
}

/// Minimises sum w (log a - log a0)^2 + sum_edges (log a_i - log a_j)^2 over the vertices that are
/// not certain, by successive over-relaxation: certain ones keep what was observed.
void diffuse_albedo(const Rings& rings, const std::vector<float>& weight,
                    std::vector<Rgb>& log_albedo) {
    const std::vector<Rgb> observed = log_albedo;
    std::vector<std::size_t> active;
    for (std::size_t i = 0; i < weight.size(); ++i)
        if (weight[i] < kCertainWeight) active.push_back(i);
    for (int round = 0; round < kRelaxationRounds; ++round) {
        for (const std::size_t i : active) {
            Rgb sum = weight[i] * observed[i];
            float total = weight[i];
            for (int k = rings.start[i]; k < rings.start[i + 1]; ++k) {
                sum += kSmoothness * log_albedo[at(rings.neighbour[at(k)])];
                total += kSmoothness;
            }
            if (total > 0.0f) log_albedo[i] += kOverRelaxation * (sum / total - log_albedo[i]);
        }
    }
}

Mesh with_albedo(const EstimationScene& world, const Scene& scene, const Mesh& radiance_mesh,
                 const SceneEstimate& estimate) {
    Mesh mesh = radiance_mesh;
    if (mesh.normals.empty()) mesh.normals = vertex_normals(mesh);
    std::vector<SurfacePoint> points(mesh.vertices.size());
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = {mesh.vertices[i], mesh.normals[i]};
    const Rings rings = rings_of(mesh);
    const Irradiance irradiance = irradiance_of(world, mesh, rings, points, estimate);
    const std::vector<char> seen = seen_by_cameras(world, scene.cameras, points);
    std::vector<Rgb> log_albedo(points.size());
    std::vector<float> weight(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Rgb albedo = (kPif * mesh.colours[i] / irradiance.value[i].max(1e-6f))
                               .max(kMinAlbedo)
                               .min(kMaxAlbedo);
        log_albedo[i] = albedo.log();
        const float doubt = irradiance.doubt[i];
        weight[i] = seen[i] ? 1.0f / (0.0009f + doubt * doubt) : 0.0f;
        if (doubt > kWildDoubt) weight[i] *= 0.02f;  // a wrong model, not noise: leave it to others
    }
    // What no camera saw starts from the mean: a piece without a seen neighbour keeps it.
    Rgb sum = Rgb::Zero();
    float total = 0.0f;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (weight[i] >= kCertainWeight) {
            sum += log_albedo[i];
            total += 1.0f;
        }
    for (std::size_t i = 0; i < points.size(); ++i)
        if (weight[i] == 0.0f && total > 0.0f) log_albedo[i] = sum / total;
    diffuse_albedo(rings, weight, log_albedo);
    for (std::size_t i = 0; i < points.size(); ++i)
        mesh.colours[i] = log_albedo[i].exp().max(kMinAlbedo).min(kMaxAlbedo);
    return mesh;
}

/// Leaves part `p` with the first paint and appends a part for each of the others.
void split_paints(Scene& scene, std::size_t p, const ObjectEstimate& object) {
    Mesh mesh = *scene.parts[p].mesh;
    if (mesh.normals.empty()) mesh.normals = vertex_normals(mesh);
    std::vector<int> paint;
    for (const Triangle& t : mesh.triangles)
        paint.push_back(object.paints.at(
            (mesh.vertices[at(t[0])] + mesh.vertices[at(t[1])] + mesh.vertices[at(t[2])]) / 3.0f));
    for (std::size_t k = 0; k < object.clusters.size(); ++k) {
        std::vector<bool> is_own;
        for (const int label : paint) is_own.push_back(label == static_cast<int>(k));
        Mesh piece = with_triangles(mesh, is_own);
        if (k > 0 && piece.empty()) continue;
        Part part = scene.parts[p];
        part.mesh = std::make_shared<const Mesh>(std::move(piece));
        part.material = object.clusters[k].fit.ward;
        if (k == 0) {
            scene.parts[p] = part;
        } else {
            part.name += "_paint_" + std::to_string(k);
            part.mesh_file.clear();
            scene.parts.push_back(part);
        }
    }
}

}  // namespace

Scene apply(const Scene& scene, const SceneEstimate& estimate, const Progress& progress) {
    Scene result = scene;
    result.lights = to_lights(estimate.light);
    result.ambient_radiance = estimate.light.ambient_radiance;
    const EstimationScene world(scene);
    for (std::size_t p = 0; p < scene.parts.size(); ++p) {
        progress.update(static_cast<double>(p) / static_cast<double>(scene.parts.size()),
                        "albedo of the scan");
        Part& part = result.parts[p];  // gone once paints are split
        const int k = world.object_of_part(static_cast<int>(p));
        if (k < 0) {
            if (part.mesh->colours.empty() || estimate.light.lights.empty()) continue;
            part.mesh =
                std::make_shared<const Mesh>(with_albedo(world, scene, *part.mesh, estimate));
            continue;
        }
        if (at(k) >= estimate.objects.size()) continue;
        const ObjectEstimate& object = estimate.objects[at(k)];
        ObjectClass c = object.object_class;
        if (c == ObjectClass::Unsure)
            c = object.class_margin > 0.0 ? ObjectClass::Transparent : ObjectClass::Specular;
        if (c == ObjectClass::Transparent) {
            part.material = Dielectric{object.ior.value, object.sigma_a_per_m.value};
            if (object.is_hollow && object.wall_m.value > 0.0)
                part.mesh = std::make_shared<const Mesh>(shell_of(*part.mesh, object.wall_m.value));
        } else if (c == ObjectClass::Specular && !object.clusters.empty()) {
            part.material = object.clusters.front().fit.ward;
            if (object.clusters.size() > 1) split_paints(result, p, object);
        } else {
            Diffuse diffuse;
            diffuse.albedo = object.albedo;
            part.material = diffuse;
        }
    }
    progress.update(1.0);
    return result;
}

}  // namespace vitrine
