// render/path_tracer.h: radiance along a camera ray.
//
// One estimator serves as the reference (no photons: paths find all light themselves) and as the
// final renderer (caustic photons stand in for light that comes by way of glass or metal). Direct
// light is always found by shadow rays, which glass blocks: what glass lets through is in the
// photons, or found by paths that happen on a light with size.
#pragma once

#include "render/caustics.h"
#include "render/render_scene.h"
#include "render/sampler.h"
#include "render/translucent_light.h"

#include <array>

namespace vitrine {

/// What a contribution is due to; the layers of a difference.
enum class Layer {
    Shadow,      ///< light and environment straight onto the surface seen: changes by occlusion
    Caustics,    ///< photons on the surface seen
    Reflection,  ///< all that is seen in a mirror, a glossy lobe or a glass surface
    Refraction,  ///< all that is seen through glass
    Diffuse,     ///< light scattered on by other surfaces
};
constexpr std::size_t kLayerCount = 5;

struct PathOptions {
    int max_diffuse_bounces = 5;  ///< beyond the surface seen; the sixth carries < 1 % at albedo .5
    int max_specular_bounces = 24;
    int split_depth = 4;  ///< interfaces at which both branches are followed from the camera
    bool direct_light_only = false;  ///< leave out what other surfaces scatter and the environment
};

struct PathResult {
    std::array<Rgb, kLayerCount> layers;
    bool is_touched = false;  ///< a virtual part had a say in it
    int first_part = -1;      ///< met by the camera ray itself; -1: none
    PathResult() { layers.fill(Rgb::Zero()); }
    Rgb total() const { return layers[0] + layers[1] + layers[2] + layers[3] + layers[4]; }
};

/// Sample `index` of a pixel: a ray through a place in its square, and the path's random numbers.
/// Renderers that share a seed share them.
struct CameraSample {
    PathSampler sampler;
    Vec3f direction;
};
inline CameraSample camera_sample(const Camera& camera, std::uint64_t seed, int x, int y,
                                  int index) {
    const PathSampler sampler(stream_key(seed, unsigned(x), unsigned(y)),
                              static_cast<std::uint32_t>(index));
    const Vec2f jitter = sampler.pair(0, 0);
    const Vec3 ray = camera.ray_in_world(x + jitter.x() - 0.5, y + jitter.y() - 0.5);
    return {sampler, ray.cast<float>()};
}

class PathTracer {
  public:
    /// @param caustics may be null: the reference; kept by reference, as is the scene
    /// @param translucent null: translucent bodies show only their paint
    PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options = {},
               const TranslucentLight* translucent = nullptr);

    /// @param view kAllParts for the scene with its virtual parts, kRealParts for the one without
    PathResult trace(const Vec3f& origin, const Vec3f& direction, const PathSampler& sampler,
                     std::uint32_t view) const;

    /// Irradiance / pi that enters a translucent body at `point` along one path. Photons that land
    /// on it are left out: they are known one by one.
    PathResult entering(const ShadingPoint& point, float eta, const PathSampler& sampler,
                        std::uint32_t view) const;

  private:
    struct State;
    struct Pending;
    void follow(State state, Pending& pending, const PathSampler& sampler, std::uint32_t view,
                PathResult& result) const;
    void add_emission(const State& state, float distance, PathResult& result) const;
    void add_environment(const State& state, PathResult& result) const;
    void add_direct(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                    const Frame& frame, const Vec3f& wo, const PathSampler& sampler,
                    std::uint32_t view, PathResult& result) const;
    void add_caustics(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                      const Frame& frame, const Vec3f& wo, std::uint32_t view,
                      PathResult& result) const;
    void add_exitance(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                      const Vec3f& wo, std::uint32_t view, PathResult& result) const;
    void add_secondary(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                       const PathSampler& sampler, std::uint32_t view, PathResult& result) const;
    void finish(Pending& pending, const PathSampler& sampler, std::uint32_t view,
                PathResult& result) const;
    bool scatter(State& state, const ShadingPoint& point, const Bsdf& bsdf, const Frame& frame,
                 const Vec3f& wo, const PathSampler& sampler) const;
    bool pass_interface(State& state, const ShadingPoint& point, Pending& pending,
                        const PathSampler& sampler) const;
    bool is_hidden(const Ray& ray, std::uint32_t view, PathResult& result) const;

    const RenderScene& scene_;
    const CausticMaps* caustics_;
    PathOptions options_;
    const TranslucentLight* translucent_;
};

}  // namespace vitrine
