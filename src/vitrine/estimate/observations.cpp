#include "estimate/observations.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"
#include "math/statistics.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace vitrine {

namespace {

constexpr double kBorderPx = 2.0;
constexpr float kMinViewCos = 0.15f;       // flatter views mix neighbouring surfaces in one pixel
constexpr float kMaxViewSpread = 0.25f;    // relative; more: a highlight, a wrong surface, an edge
constexpr double kPlaneTolerance = 0.012;  // metres: noise of a fused depth map and its bow
constexpr double kPlaneCos = 0.9;
constexpr int kMinClusterSize = 25;  // fewer points do not fix an albedo against outliers

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Rgb median_rgb(const std::vector<Rgb>& values) {
    Rgb result;
    std::vector<float> channel(values.size());
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < values.size(); ++i) channel[i] = values[i][c];
        const std::size_t half = channel.size() / 2;
        std::nth_element(channel.begin(), channel.begin() + static_cast<long>(half), channel.end());
        float m = channel[half];
        if (channel.size() % 2 == 0)
            m = 0.5f *
                (m + *std::max_element(channel.begin(), channel.begin() + static_cast<long>(half)));
        result[c] = m;
    }
    return result;
}

/// Variance per axis of what a pixel's value averages on the surface: the square of the pixel and
/// the linear interpolation between four of them, 1/12 + 1/6 square pixels, drawn out by slant.
float footprint_squared(const Camera& camera, const Vec3f& centre, const SurfacePoint& point) {
    constexpr float kSquarePixels = 0.25f;
    const Vec3f offset = centre - point.position;
    const float distance = offset.norm();
    const float cos = std::max(point.normal.dot(offset) / distance, kMinViewCos);
    const float pixel_m = distance / static_cast<float>(camera.fx);
    return kSquarePixels * pixel_m * pixel_m * 0.5f * (1.0f + 1.0f / (cos * cos));
}

}  // namespace

FrameLookup::FrameLookup(const EstimationScene& scene, const std::vector<Camera>& cameras,
                         std::span<const RgbdFrame> frames, double saturation_level)
    : scene_(scene), cameras_(cameras), frames_(frames), saturation_level_(saturation_level) {
    VITRINE_CHECK_EQ(cameras.size(), frames.size());
    for (const Camera& camera : cameras) centres_.push_back(camera.centre_in_world().cast<float>());
}

std::optional<Rgb> FrameLookup::sample(const SurfacePoint& point, std::size_t f) const {
    const Vec3f to_camera = centres_[f] - point.position;
    if (point.normal.dot(to_camera) < kMinViewCos * to_camera.norm()) return std::nullopt;
    const Vec3 in_camera = cameras_[f].cam_from_world * point.position.cast<double>();
    if (in_camera.z() <= 0.0) return std::nullopt;
    const Vec2 pixel = cameras_[f].project_camera(in_camera);
    if (!cameras_[f].sees(pixel, kBorderPx)) return std::nullopt;
    const Vec3f origin = point.position + scene_.offset_m() * point.normal;
    if (scene_.accel().is_occluded({origin, centres_[f] - origin, 0.0f, 1.0f, kAllMask}))
        return std::nullopt;
    return bilinear(frames_[f].colour, pixel.x(), pixel.y());
}

FrameLookup::Seen FrameLookup::observe(const SurfacePoint& point) const {
    Seen seen;
    std::vector<Rgb> values;
    float footprint2 = 0.0f;
    for (std::size_t f = 0; f < frames_.size(); ++f) {
        const std::optional<Rgb> value = sample(point, f);
        if (!value) continue;
        if (is_clipped(*value)) {
            ++seen.saturated;
        } else {
            values.push_back(*value);
            footprint2 += footprint_squared(cameras_[f], centres_[f], point);
        }
    }
    seen.views = static_cast<int>(values.size());
    if (values.empty()) return seen;
    seen.radiance = median_rgb(values);
    seen.footprint_m = std::sqrt(footprint2 / static_cast<float>(values.size()));
    return seen;
}

std::optional<Rgb> FrameLookup::background(const SurfacePoint& point, int excluded,
                                           int max_views) const {
    std::vector<std::pair<float, std::size_t>> order;
    for (std::size_t f = 0; f < frames_.size(); ++f) {
        if (static_cast<int>(f) == excluded) continue;
        const Vec3f to_camera = centres_[f] - point.position;
        const float d2 = to_camera.squaredNorm();
        order.emplace_back(-point.normal.dot(to_camera) / (d2 * std::sqrt(d2)), f);
    }
    std::sort(order.begin(), order.end());
    std::vector<Rgb> values;
    for (const auto& [merit, f] : order) {
        if (merit >= 0.0f || static_cast<int>(values.size()) == max_views) break;
        const std::optional<Rgb> value = sample(point, f);
        if (value && !is_clipped(*value)) values.push_back(*value);
    }
    if (values.empty()) return std::nullopt;
    return median_rgb(values);
}

namespace {

struct Picked {
    SurfacePoint point;
    Rgb radiance = Rgb::Zero();
    bool is_good = false, is_saturated = false;
};

/// A pixel of a frame: sample `i` of a sequence that covers all pictures evenly.
struct Place {
    std::size_t frame;
    double u, v;
};
Place place_of(const FrameLookup& lookup, std::size_t i, const Vec2f& shift) {
    const std::size_t frame_count = lookup.frames().size();
    const Vec2f uv = r2_point(i / frame_count, shift);
    const Camera& camera = lookup.cameras()[i % frame_count];
    return {i % frame_count, std::floor(uv.x() * static_cast<float>(camera.width)),
            std::floor(uv.y() * static_cast<float>(camera.height))};
}

/// Where the scan is met first; nothing on a candidate, from behind, or past everything.
std::optional<Hit> scan_hit(const EstimationScene& scene, const Camera& camera, double u,
                            double v) {
    const Vec3f direction = camera.ray_in_world(u, v).cast<float>();
    const Hit hit = scene.accel().closest(
        {camera.centre_in_world().cast<float>(), direction, 0.0f, 1e30f, kAllMask});
    if (!hit.is_hit() || scene.object_of_part(hit.part) >= 0) return std::nullopt;
    if (hit.normal.dot(direction) >= 0.0f) return std::nullopt;
    return hit;
}

/// True when the four neighbours at `step` pixels meet about the same surface.
bool is_smooth_around(const EstimationScene& scene, const Camera& camera, double u, double v,
                      const Hit& hit, double depth) {
    constexpr double kStep = 3.0;
    const Vec3f origin = camera.centre_in_world().cast<float>();
    for (const Vec2& d : {Vec2(kStep, 0), Vec2(-kStep, 0), Vec2(0, kStep), Vec2(0, -kStep)}) {
        const Vec3f direction = camera.ray_in_world(u + d.x(), v + d.y()).cast<float>();
        const Hit near = scene.accel().closest({origin, direction, 0.0f, 1e30f, kAllMask});
        if (near.part != hit.part) return false;
        // A plane seen at 80 degrees changes depth by 6 % over 3 px at f = 500; an edge by more.
        if (std::abs(near.distance - depth) > 0.04 * depth) return false;
    }
    return true;
}

Picked pick(const EstimationScene& scene, const FrameLookup& lookup, const Place& place) {
    Picked picked;
    const auto [frame, u, v] = place;
    const Camera& camera = lookup.cameras()[frame];
    const std::optional<Hit> found = scan_hit(scene, camera, u, v);
    if (!found) return picked;
    const Hit& hit = *found;
    if (!is_smooth_around(scene, camera, u, v, hit, hit.distance)) return picked;
    const Mesh& mesh = scene.mesh(hit.part);
    picked.point = {hit_point(mesh, hit), shading_normal(mesh, hit)};
    const FrameLookup::Seen seen = lookup.observe(picked.point);
    if (seen.saturated > seen.views) {
        picked.is_saturated = true;
        return picked;
    }
    if (seen.views < 1) return picked;
    picked.radiance = seen.radiance;
    picked.point.footprint_m = seen.footprint_m;
    const Rgb here = bilinear(lookup.frames()[frame].colour, u, v);
    const float scale = luminance(seen.radiance) + 0.01f * luminance(here);
    picked.is_good = scale > 0.0f &&
                     std::abs(luminance(here) - luminance(seen.radiance)) < kMaxViewSpread * scale;
    return picked;
}

/// Dominant plane by RANSAC over point + normal (one sample is one hypothesis), then refined.
SupportPlane find_plane(const std::vector<SurfacePoint>& points,
                        const std::vector<Camera>& cameras) {
    SupportPlane best;
    std::size_t best_count = 0;
    const std::size_t stride = std::max<std::size_t>(1, points.size() / 400);
    for (std::size_t i = 0; i < points.size(); i += stride) {
        const Vec3 n = points[i].normal.cast<double>();
        const double offset = n.dot(points[i].position.cast<double>());
        std::size_t count = 0;
        for (const SurfacePoint& p : points)
            count += std::abs(n.dot(p.position.cast<double>()) - offset) < kPlaneTolerance;
        if (count > best_count) {
            best_count = count;
            best = {n, offset};
        }
    }
    for (int round = 0; round < 3 && best_count >= 3; ++round) {
        Vec3 mean = Vec3::Zero();
        double count = 0;
        for (const SurfacePoint& p : points)
            if (std::abs(best.normal.dot(p.position.cast<double>()) - best.offset) <
                kPlaneTolerance) {
                mean += p.position.cast<double>();
                count += 1;
            }
        mean /= std::max(count, 1.0);
        Mat3 scatter = Mat3::Zero();
        for (const SurfacePoint& p : points) {
            const Vec3 d = p.position.cast<double>() - mean;
            if (std::abs(best.normal.dot(d)) < kPlaneTolerance) scatter += d * d.transpose();
        }
        const Eigen::SelfAdjointEigenSolver<Mat3> solver(scatter);
        Vec3 n = solver.eigenvectors().col(0);
        if (n.dot(best.normal) < 0) n = -n;
        best = {n, n.dot(mean)};
    }
    Vec3 eye = Vec3::Zero();
    for (const Camera& camera : cameras) eye += camera.centre_in_world();
    eye /= std::max<double>(1.0, static_cast<double>(cameras.size()));
    if (best.normal.dot(eye) < best.offset) best = {-best.normal, -best.offset};
    return best;
}

int root_of(std::vector<int>& parent, int i) {
    while (parent[at(i)] != i) {
        parent[at(i)] = parent[at(parent[at(i)])];
        i = parent[at(i)];
    }
    return i;
}

/// Plane = cluster 0; the rest: neighbours in space of like chromaticity are one surface.
void find_clusters(ScanSamples& samples) {
    constexpr float kNeighbour = 0.04f;  // metres: sample spacing of 4000 points, a few times over
    constexpr float kChroma = 0.25f;     // log chromaticity: shading leaves it, paint changes it
    const int n = static_cast<int>(samples.points.size());
    samples.cluster.assign(at(n), -1);
    std::vector<int> parent(at(n));
    std::iota(parent.begin(), parent.end(), 0);
    std::vector<Vec2f> chroma(at(n));
    std::vector<int> off_plane;
    for (int i = 0; i < n; ++i) {
        const SurfacePoint& p = samples.points[at(i)];
        const Rgb l = samples.radiance[at(i)] + 1e-4f;
        chroma[at(i)] = {std::log(l[0] / l[1]), std::log(l[2] / l[1])};
        const bool is_on_plane = std::abs(samples.plane.normal.dot(p.position.cast<double>()) -
                                          samples.plane.offset) < kPlaneTolerance &&
                                 samples.plane.normal.dot(p.normal.cast<double>()) > kPlaneCos;
        if (is_on_plane) {
            samples.cluster[at(i)] = 0;
        } else {
            off_plane.push_back(i);
        }
    }
    for (std::size_t a = 0; a < off_plane.size(); ++a) {
        for (std::size_t b = a + 1; b < off_plane.size(); ++b) {
            const int i = off_plane[a], j = off_plane[b];
            if ((samples.points[at(i)].position - samples.points[at(j)].position).squaredNorm() >
                kNeighbour * kNeighbour)
                continue;
            if ((chroma[at(i)] - chroma[at(j)]).cwiseAbs().maxCoeff() > kChroma) continue;
            const int ri = root_of(parent, i), rj = root_of(parent, j);
            parent[at(std::max(ri, rj))] = std::min(ri, rj);
        }
    }
    std::map<int, int> size, name;
    for (const int i : off_plane) ++size[root_of(parent, i)];
    samples.cluster_count = 1;
    for (const auto& [root, count] : size)
        if (count >= kMinClusterSize) name[root] = samples.cluster_count++;
    for (const int i : off_plane) {
        const auto found = name.find(root_of(parent, i));
        if (found != name.end()) samples.cluster[at(i)] = found->second;
    }
}

void find_extent(ScanSamples& samples) {
    std::vector<double> x, y, z, r;
    for (const SurfacePoint& p : samples.points) {
        x.push_back(p.position.x());
        y.push_back(p.position.y());
        z.push_back(p.position.z());
    }
    if (x.empty()) return;
    Vec3 centre(median(x), median(y), median(z));
    const Vec3& n = samples.plane.normal;
    centre -= (n.dot(centre) - samples.plane.offset) * n;
    for (const SurfacePoint& p : samples.points)
        r.push_back((p.position.cast<double>() - centre).norm());
    samples.reference_point = centre;
    samples.scene_radius_m = std::max(0.05, quantile(r, 0.9));
}

}  // namespace

namespace {

/// What stands on the support plane and may throw a shadow: points of it and their heights.
std::vector<std::pair<Vec3f, float>> standing_points(const EstimationScene& scene,
                                                     const ScanSamples& samples) {
    constexpr std::size_t kPerCandidate = 100;
    const Vec3f normal = samples.plane.normal.cast<float>();
    const auto offset = static_cast<float>(samples.plane.offset);
    std::vector<std::pair<Vec3f, float>> standing;
    const auto add = [&](const Vec3f& p) {
        const float height = normal.dot(p) - offset;
        if (height > static_cast<float>(kPlaneTolerance))
            standing.emplace_back(p - height * normal, height);
    };
    for (const SurfacePoint& p : samples.points) add(p.position);
    for (int k = 0; k < scene.object_count(); ++k) {
        const std::vector<Vec3f>& vertices = scene.mesh(scene.part_of_object(k)).vertices;
        const std::size_t step = std::max<std::size_t>(1, vertices.size() / kPerCandidate);
        for (std::size_t i = 0; i < vertices.size(); i += step) add(vertices[i]);
    }
    return standing;
}

/// The first `count` places past the first pass that show something standing, or the plane within
/// the reach of its shadow. An empty table shows little but its texture, however often it is asked.
std::vector<Place> places_near_shadows(const EstimationScene& scene, const FrameLookup& lookup,
                                       const ScanSamples& samples, std::size_t count,
                                       const Vec2f& shift) {
    constexpr float kReach = 1.5f;             // of the height: lights down to 34 degrees
    constexpr std::size_t kTriesPerPlace = 8;  // where little stands there are fewer places
    const std::vector<std::pair<Vec3f, float>> standing = standing_points(scene, samples);
    const Vec3f normal = samples.plane.normal.cast<float>();
    const auto offset = static_cast<float>(samples.plane.offset);
    std::vector<char> is_near(kTriesPerPlace * count, 0);
    parallel_for(is_near.size(), 256, [&](std::size_t i) {
        const Place place = place_of(lookup, count + i, shift);
        const auto hit = scan_hit(scene, lookup.cameras()[place.frame], place.u, place.v);
        if (!hit) return;
        const Vec3f p = hit_point(scene.mesh(hit->part), *hit);
        const float height = normal.dot(p) - offset;
        is_near[i] = std::abs(height) > static_cast<float>(kPlaneTolerance) ||
                     std::any_of(standing.begin(), standing.end(), [&](const auto& s) {
                         const float reach = kReach * s.second;
                         return (p - height * normal - s.first).squaredNorm() < reach * reach;
                     });
    });
    std::vector<Place> places;
    for (std::size_t i = 0; i < is_near.size() && places.size() < count; ++i)
        if (is_near[i]) places.push_back(place_of(lookup, count + i, shift));
    return places;
}

void add_samples(const EstimationScene& scene, const FrameLookup& lookup,
                 const std::vector<Place>& places, ScanSamples& samples) {
    std::vector<Picked> picked(places.size());
    parallel_for(picked.size(), 32,
                 [&](std::size_t i) { picked[i] = pick(scene, lookup, places[i]); });
    samples.tried_count += static_cast<int>(places.size());
    for (const Picked& p : picked) {
        samples.saturated_count += p.is_saturated;
        if (!p.is_good) continue;
        samples.points.push_back(p.point);
        samples.radiance.push_back(p.radiance);
    }
}

}  // namespace

ScanSamples sample_scan(const EstimationScene& scene, const FrameLookup& lookup,
                        std::uint32_t see_through_mask, std::span<const Rgb> object_radiance,
                        const SampleOptions& options) {
    ScanSamples samples;
    const Rng start(stream_key(options.seed, 0x5a3bu));
    Rng rng = start;
    const Vec2f shift(rng.next_float(), rng.next_float());
    const std::size_t half = at(options.count) / 2;
    std::vector<Place> places(half);
    for (std::size_t i = 0; i < half; ++i) places[i] = place_of(lookup, i, shift);
    add_samples(scene, lookup, places, samples);
    if (samples.points.empty()) return samples;
    samples.plane = find_plane(samples.points, lookup.cameras());
    find_extent(samples);  // of what is seen evenly
    add_samples(scene, lookup, places_near_shadows(scene, lookup, samples, half, shift), samples);
    find_clusters(samples);
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        // A fused table is rough; its plane is not.
        if (samples.cluster[i] == 0) {
            samples.points[i].normal = samples.plane.normal.cast<float>();
        } else {
            samples.points[i].footprint_m = 0.0f;  // it would reach past the edges of small things
        }
        const Vec3 cell = samples.points[i].position.cast<double>() / options.block_size_m;
        samples.block.push_back(
            static_cast<int>(stream_key(static_cast<std::uint64_t>(std::floor(cell.x()) + 4096),
                                        static_cast<std::uint64_t>(std::floor(cell.y()) + 4096),
                                        static_cast<std::uint64_t>(std::floor(cell.z()) + 4096)) &
                             0x7fffffff));
    }
    samples.gathered = gather_light(scene, samples.points, options.gather_rays, see_through_mask,
                                    object_radiance, options.seed);
    return samples;
}

std::vector<Rgb> mean_object_radiance(const EstimationScene& scene, const FrameLookup& lookup) {
    constexpr int kStride = 4;  // pixels: a mean needs no more
    std::vector<Rgb> mean(at(scene.object_count()), Rgb::Zero());
    std::vector<float> count(mean.size(), 0.0f);
    for (std::size_t f = 0; f < lookup.frames().size(); ++f) {
        const Camera& camera = lookup.cameras()[f];
        const Vec3f origin = camera.centre_in_world().cast<float>();
        for (int v = 0; v < camera.height; v += kStride) {
            for (int u = 0; u < camera.width; u += kStride) {
                const Hit hit = scene.accel().closest(
                    {origin, camera.ray_in_world(u, v).cast<float>(), 0.0f, 1e30f, kAllMask});
                if (!hit.is_hit() || scene.object_of_part(hit.part) < 0) continue;
                const Rgb value = lookup.frames()[f].colour(u, v);
                if (lookup.is_clipped(value)) continue;
                mean[at(scene.object_of_part(hit.part))] += value;
                count[at(scene.object_of_part(hit.part))] += 1.0f;
            }
        }
    }
    for (std::size_t k = 0; k < mean.size(); ++k)
        if (count[k] > 0) mean[k] /= count[k];
    return mean;
}

}  // namespace vitrine
