#include "render/translucent_light.h"

#include "base/parallel.h"
#include "optics/fresnel.h"
#include "render/path_tracer.h"

namespace vitrine {
namespace {

/// Irradiance that enters at the samples of one body, W/m2.
struct Entered {
    std::vector<Rgb> with, without;
    bool is_touched = false;
};

class BodyGatherer {
  public:
    BodyGatherer(const RenderScene& scene, int part, const TranslucentLightOptions& options)
        : scene_(scene),
          part_(part),
          body_(*scene.body(part)),
          eta_(static_cast<float>(std::get<Translucent>(scene.material(part)).eta)),
          options_(options),
          needs_both_(scene.has_virtual() && !scene.is_virtual(part)) {
        buried_with_ = buried(kAllParts);
        buried_without_ = needs_both_ ? buried(kRealParts) : buried_with_;
    }

    Entered gather(const PathTracer& tracer) const {
        const std::size_t count = body_.samples().size();
        Entered entered{std::vector<Rgb>(count, Rgb::Zero()), std::vector<Rgb>(count, Rgb::Zero()),
                        false};
        std::vector<std::uint8_t> touched(count, 0);
        parallel_for(count, 16, [&](std::size_t i) {
            const ShadingPoint point = surface_at(i);
            Rgbd with = Rgbd::Zero(), without = Rgbd::Zero();
            const std::uint32_t free =
                (buried_with_[i] ? 0u : kVirtualParts) | (buried_without_[i] ? 0u : kRealParts);
            std::vector<PathTask> tasks;
            const std::uint64_t stream = stream_key(options_.seed, 0x7a15u, unsigned(part_), i);
            for (int s = 0; s < options_.paths_per_sample; ++s) {
                tasks.push_back({PathSampler(stream, std::uint32_t(s)), {}});
            }
            std::vector<PathPair> pairs(tasks.size());
            tracer.entering(point, eta_, tasks, free, pairs);
            for (const PathPair& pair : pairs) {
                with += pair.with().total().cast<double>();
                without += pair.without().total().cast<double>();
                if (needs_both_ && pair.is_touched()) touched[i] = 1;
            }
            const double scale = kPi / options_.paths_per_sample;
            entered.with[i] = (with * scale).cast<float>();
            entered.without[i] = (without * scale).cast<float>();
        });
        entered.is_touched = std::any_of(touched.begin(), touched.end(), [](auto t) { return t; });
        return entered;
    }

    /// Adds the photons that landed on the body.
    void add_photons(const std::vector<Photon>& photons, Entered& entered) const {
        const Box3 box = bounds(*scene_.scene().parts[static_cast<std::size_t>(part_)].mesh);
        const float reach = 4 * scene_.epsilon();
        std::vector<std::int32_t> owner(photons.size(), -1);
        parallel_for(photons.size(), 1024, [&](std::size_t i) {
            const Photon& photon = photons[i];
            if (!photon.keeps_direction) return;  // landed on paint
            const Vec3 p = photon.position.cast<double>();
            if (((p - box.min).array() < -reach).any() || ((box.max - p).array() < -reach).any()) {
                return;
            }
            if (scene_.nearest(photon.position, reach).part != part_) return;
            owner[i] = body_.nearest_sample(photon.position, photon.normal.unpack());
        });
        for (std::size_t i = 0; i < photons.size(); ++i) {
            if (owner[i] < 0) continue;
            const auto k = static_cast<std::size_t>(owner[i]);
            const Photon& photon = photons[i];
            const float cosine = photon.to_light.unpack().dot(photon.normal.unpack());
            const Rgb irradiance =
                photon.power * (fresnel_transmittance(cosine, eta_) / body_.samples().area_m2[k]);
            if (photon.views & kVirtualParts) entered.with[k] += irradiance;
            if (photon.views & kRealParts) entered.without[k] += irradiance;
            entered.is_touched |= needs_both_ && photon.views != kAllParts;
        }
    }

    TranslucentLight::Body leave(const Entered& entered) const {
        TranslucentLight::Body body;
        body.with = body_.exitance(entered.with);
        body.is_touched = entered.is_touched;
        if (entered.is_touched) body.without = body_.exitance(entered.without);
        return body;
    }

  private:
    ShadingPoint surface_at(std::size_t i) const {
        const EvenSamples& samples = body_.samples();
        Hit hit;
        hit.distance = 0.0f;
        hit.part = part_;
        hit.triangle = samples.triangles[i];
        hit.barycentric = samples.barycentric[i];
        hit.normal = samples.normals[i];
        return scene_.surface(hit, -hit.normal);
    }

    /// Which samples lie on or beneath the surface of another opaque part: the way from within the
    /// body out to them goes through its front and not out again.
    std::vector<std::uint8_t> buried(std::uint32_t view) const {
        const EvenSamples& samples = body_.samples();
        std::vector<std::uint8_t> result(samples.size(), 0);
        parallel_for(samples.size(), 64, [&](std::size_t i) {
            const Vec3f& n = samples.normals[i];
            const float step = scene_.epsilon();
            Ray ray{samples.points[i] - step * n, -n, 0.0f, 1e30f, view};
            const float depth = 0.5f * own_thickness(ray);
            ray.origin = samples.points[i] - depth * n;
            ray.direction = n;
            ray.max_distance = depth + kContactEpsilons * step;
            int crossings = 0;
            for (int k = 0; k < kMaxCrossings; ++k) {
                const Hit hit = scene_.closest(ray);
                if (!hit.is_hit()) break;
                if (hit.part != part_ && !scene_.dielectric(hit.part)) {
                    crossings += hit.normal.dot(n) < 0 ? 1 : -1;
                }
                ray.min_distance = hit.distance + 0.1f * step;
            }
            result[i] = crossings > 0;
        });
        return result;
    }

    float own_thickness(Ray ray) const {
        for (int k = 0; k < kMaxCrossings; ++k) {
            const Hit hit = scene_.closest(ray);
            if (!hit.is_hit()) return 0.0f;
            if (hit.part == part_) return hit.distance;
            ray.min_distance = hit.distance + 0.1f * scene_.epsilon();
        }
        return 0.0f;
    }

    static constexpr int kMaxCrossings = 16;
    static constexpr float kContactEpsilons = 4.0f;  // nearer than this is touching

    const RenderScene& scene_;
    int part_;
    const TranslucentBody& body_;
    float eta_;
    TranslucentLightOptions options_;
    bool needs_both_;
    std::vector<std::uint8_t> buried_with_, buried_without_;
};

}  // namespace

Rgb TranslucentLight::exitance(const RenderScene& scene, const ShadingPoint& point,
                               std::uint32_t view) const {
    const TranslucentBody* body = scene.body(point.part);
    if (!body || bodies_.empty()) return Rgb::Zero();
    const Body& light = bodies_[static_cast<std::size_t>(point.part)];
    const bool is_real = view == kRealParts && light.is_touched;
    return body->interpolate(is_real ? light.without : light.with, point.position,
                             point.geometric_normal);
}

TranslucentLight light_translucent_bodies(const RenderScene& scene, const CausticMaps* caustics,
                                          const PathOptions& paths,
                                          const TranslucentLightOptions& options,
                                          const Progress& progress) {
    TranslucentLight light;
    if (!scene.has_bodies()) return light;
    const std::size_t part_count = scene.scene().parts.size();
    std::vector<std::unique_ptr<BodyGatherer>> gatherers(part_count);
    for (std::size_t p = 0; p < part_count; ++p) {
        const int part = static_cast<int>(p);
        if (scene.body(part)) {
            gatherers[p] = std::make_unique<BodyGatherer>(scene, part, options);
        }
    }
    for (int round = 0; round < options.rounds; ++round) {
        const PathTracer tracer(scene, caustics, paths, &light);
        std::vector<TranslucentLight::Body> bodies(part_count);
        for (std::size_t p = 0; p < part_count; ++p) {
            if (!gatherers[p]) continue;
            Entered entered = gatherers[p]->gather(tracer);
            if (caustics) {
                gatherers[p]->add_photons(caustics->sharp.photons(), entered);
                gatherers[p]->add_photons(caustics->soft.photons(), entered);
            }
            bodies[p] = gatherers[p]->leave(entered);
        }
        light = TranslucentLight(std::move(bodies));
        progress.update(static_cast<double>(round + 1) / options.rounds, "translucent bodies");
    }
    return light;
}

}  // namespace vitrine
