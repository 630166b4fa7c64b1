// render/path_tracer.h: radiance along a camera ray.
//
// One estimator serves as the reference (no photons: paths find all light themselves) and as the
// final renderer (caustic photons stand in for light that comes by way of glass or metal). Direct
// light is always found by shadow rays, which glass blocks: what glass lets through is in the
// photons, or found by paths that happen on a light with size.
#pragma once

#include "render/batch.h"
#include "render/caustic_maps.h"
#include "render/plain_lanes.h"
#include "render/render_scene.h"
#include "render/sampler.h"
#include "render/translucent_light.h"

#include <array>
#include <bit>
#include <span>

namespace vitrine {

/// What a contribution is due to; the layers of a difference.
enum class Layer : std::uint8_t {
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
    bool keeps_soft_apart = true;  ///< false: soft light is a part of the layers, for a little less
};

/// What other surfaces and the environment send to a plain diffuse surface that is seen without
/// glass or mirrors in between: varies slowly along it, and is known apart from its albedo.
struct SoftLight {
    Rgb shadow = Rgb::Zero();   ///< reflected radiance, of Layer::Shadow: the environment's
    Rgb diffuse = Rgb::Zero();  ///< of Layer::Diffuse
    Rgb albedo = Rgb::Zero();
    Vec3f position = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();
    float hit_distance = 0;  ///< to the surface that sends the light; 0: none met
};

/// What one path brings. Of those that bring little, little memory is touched.
class PathResult {
  public:
    /// Without any light.
    void clear() {
        filled_ = 0;
        has_soft_ = false;
        sees_virtual_ = false;
    }
    void set_sees_virtual() { sees_virtual_ = true; }
    void set_soft(const SoftLight& soft) {
        has_soft_ = true;
        soft_ = soft;
    }
    void add(Layer layer, const Rgb& radiance) {
        const unsigned bit = 1u << static_cast<unsigned>(layer);
        Rgb& sum = layers_[static_cast<std::size_t>(layer)];
        if (filled_ & bit) {
            sum += radiance;
        } else {
            sum = radiance;
            filled_ = static_cast<std::uint8_t>(filled_ | bit);
        }
    }
    /// Of the surface seen, which `set_soft` was told of.
    void add_soft(Layer layer, const Rgb& radiance) {
        (layer == Layer::Shadow ? soft_.shadow : soft_.diffuse) += radiance;
    }
    /// @param distance to a surface that sends soft light; the first counts
    void meet_soft(float distance) {
        if (soft_.hit_distance == 0) soft_.hit_distance = distance;
    }

    /// The camera's ray itself meets a virtual part.
    bool sees_virtual() const { return sees_virtual_; }
    /// Null where there is none.
    const SoftLight* soft() const { return has_soft_ ? &soft_ : nullptr; }
    Rgb soft_sum() const {
        return has_soft_ ? Rgb(soft_.shadow + soft_.diffuse) : Rgb(Rgb::Zero());
    }
    /// Radiance without the soft light.
    Rgb layer(std::size_t k) const { return filled_ >> k & 1u ? layers_[k] : Rgb(Rgb::Zero()); }
    bool is_dark() const { return filled_ == 0; }
    Rgb sharp() const {
        Rgb sum = Rgb::Zero();
        for (unsigned left = filled_; left != 0; left &= left - 1) {
            sum += layers_[static_cast<std::size_t>(std::countr_zero(left))];
        }
        return sum;
    }
    Rgb total() const { return sharp() + soft_sum(); }

  private:
    std::uint8_t filled_ = 0;  // a bit per layer: the others hold nothing
    bool has_soft_ = false;
    bool sees_virtual_ = false;
    std::array<Rgb, kLayerCount> layers_;
    SoftLight soft_;
};

/// One path in the scene with virtual parts and in the one without.
class alignas(64) PathPair {
  public:
    const PathResult& with() const { return with_; }
    const PathResult& without() const { return is_touched_ ? without_ : with_; }
    /// A virtual part had a say in it; else both are the same, bit by bit.
    bool is_touched() const { return is_touched_; }

  private:
    friend class PathTracer;
    /// As new; the second result is filled where they part.
    void clear() {
        with_.clear();
        is_touched_ = false;
    }
    bool is_touched_ = false;
    PathResult with_, without_;  // the second counts from where they part
};

/// What one path is asked for.
struct PathWish {
    bool finds_soft = true;  ///< false: leaves the soft light out, for a fraction of the cost
    int light_samples = 1;   ///< shadow rays to each lamp with size, from the surface seen
};

/// One path from the camera, beside its ray.
struct PathTask {
    PathSampler sampler;
    PathWish wish;
};

/// The lights that `sample_light` knows: discs and points.
std::vector<std::optional<LaneLight>> lane_lights(const LightSampler& lights);

class PathTracer {
  public:
    /// @param caustics may be null: the reference; kept by reference, as is the scene
    /// @param translucent null: translucent bodies show only their paint
    PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options = {},
               const TranslucentLight* translucent = nullptr);

    /// In the scene with its virtual parts, if it has any.
    PathResult trace(const Vec3f& origin, const Vec3f& direction, const PathTask& task) const;

    /// In the scene with its virtual parts and in the one without. What both have in common is
    /// traced once: they part where a ray meets a virtual part, and go on with the same numbers.
    PathPair trace_both(const Vec3f& origin, const Vec3f& direction, const PathTask& task) const;
    /// Memory of paths under way, which serves many calls; one per thread.
    class Workspace;
    /// Of many paths: a few hundred together cost about half of what they cost one by one.
    /// @param workspace with the paths' rays from the camera, which are gone afterwards
    void trace_both(std::span<const PathTask> tasks, std::span<PathPair> results,
                    Workspace& workspace) const;

    /// Irradiance / pi that enters a translucent body at `point` along each of some paths. Photons
    /// that land on it are left out: they are known one by one.
    /// @param tasks whose random numbers count
    /// @param views scenes in which the point lies free: kVirtualParts the one with these, which
    ///     begins here, kRealParts the one without
    void entering(const ShadingPoint& point, float eta, std::span<const PathTask> tasks,
                  std::uint32_t views, std::span<PathPair> results) const;

  private:
    struct State;
    struct Sink;
    struct ShadowRay;
    struct Wave;
    struct Flight;
    /// Scenes that paths from the camera are followed in.
    std::uint32_t all_views() const { return has_virtual_ ? kAllParts : kVirtualParts; }
    PathPair trace_one(const Vec3f& origin, const Vec3f& direction, const PathTask& task,
                       std::uint32_t views) const;
    void start(std::uint32_t views, Wave& wave) const;
    /// Follows all paths of the wave to their ends.
    /// @param are_alike rays next to each other
    void finish(Wave& wave, bool are_alike) const;
    /// Asks memory for the surfaces that the wave's rays have met.
    void prefetch(const Wave& wave) const;
    /// What the path's ray has met, in one scene or in both.
    void meet(Flight& flight, Wave& wave) const;
    /// What it has met differs between the scenes.
    void part(Flight& flight, Wave& wave) const;
    /// What that brings; what goes on from there is added to the wave's next. Plain surfaces
    /// and glass wait.
    void step(Flight& flight, Wave& wave) const;
    /// At surfaces of other kinds.
    void scatter_alone(State& state, const RayAndHit& ray, Wave& wave) const;
    void pass_mirror(const State& state, const ShadingPoint& point, const RayAndHit& ray,
                     const Rgb& reflectance, Wave& wave) const;
    /// Where paths go on from glass that the wave has met, many side by side.
    void pass_glass(Wave& wave, std::span<Flight* const> hits) const;
    /// @param i lane of the surface; @param beyond medium there
    void branch(const State& state, int i, std::uint32_t beyond, Wave& wave) const;
    /// What plain diffuse surfaces bring that the wave has met, many side by side.
    void shade_plain(Wave& wave, std::span<Flight* const> hits) const;
    void add_direct(Wave& wave, std::span<Flight* const> hits) const;
    /// Where soft light is apart: says what surfaces it is of.
    /// @param is_open lanes that go on; those that are not asked for it do not
    void find_soft(Wave& wave, std::span<Flight* const> hits, Lane<std::uint32_t>& is_open) const;
    void scatter(Wave& wave, std::span<Flight* const> hits,
                 const Lane<std::uint32_t>& is_open) const;
    void add_emission(const State& state, const RayAndHit& ray, Sink sink) const;
    void add_environment(const State& state, const RayAndHit& ray, Sink sink) const;
    void add_direct(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                    const Frame& frame, const Vec3f& wo, int light_samples, Wave& wave) const;
    /// Of the lobes towards a light that was picked with a density (0: a light without size).
    Rgb direct_value(const State& state, const Bsdf& bsdf, const Vec3f& wo, const Vec3f& wi,
                     float light_pdf) const;
    /// @param from start of the ray that met the point
    void add_caustics(const State& state, const ShadingPoint& point, const Vec3f& from,
                      const Bsdf& bsdf, const Frame& frame, const Vec3f& wo, Sink sink) const;
    void add_exitance(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                      const Vec3f& wo, Sink sink) const;
    void add_secondary(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                       Wave& wave) const;
    /// Light of the wave's shadow rays that arrives.
    void add_shadows(Wave& wave) const;
    std::size_t pick_light(const State& state, const PathSampler& sampler) const;
    void scatter(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                 const Frame& frame, const Vec3f& wo, Wave& wave) const;

    const RenderScene& scene_;
    const CausticMaps* caustics_;
    PathOptions options_;
    const TranslucentLight* translucent_;
    bool has_virtual_;
    bool has_lamps_;       // that a ray can meet
    bool varies_light_;    // several lights, or one with places to choose from
    bool has_background_;  // that a ray can meet, behind all parts
    std::vector<std::optional<LaneLight>> lane_lights_;  // discs and points
};

class PathTracer::Workspace {
  public:
    /// For this tracer and others of the same scene.
    explicit Workspace(const PathTracer& tracer);
    ~Workspace();
    /// Takes the next paths' rays from the camera, to be written, as they would see all parts.
    RayList start(std::size_t count);

  private:
    friend class PathTracer;
    std::unique_ptr<Wave> wave_;
};

}  // namespace vitrine
