#include "render/render_scene.h"

#include "base/error.h"
#include "base/parallel.h"

#include <numeric>

namespace vitrine {
namespace {

/// Ray epsilons between glass and what it stands on.
constexpr float kContactGapEpsilons = 4.0f;

Accel build_accel(std::span<const Part> parts) {
    std::vector<AccelPart> items;
    for (const Part& part : parts) {
        items.push_back({part.mesh, part.is_virtual ? kVirtualParts : kRealParts});
    }
    return items.empty() ? Accel() : Accel(std::move(items));
}

/// Moves the vertices of dielectric parts that coincide with an opaque surface inward by the gap.
/// Returns true when a mesh was replaced.
/// @param first of the scene's parts to look at; the rays meet all
/// @param closest of a ray in the scene
template <typename Closest>
bool open_contact_gaps(Scene& scene, std::size_t first, const Closest& closest, float epsilon) {
    const float gap = kContactGapEpsilons * epsilon;
    bool is_changed = false;
    for (std::size_t p = first; p < scene.parts.size(); ++p) {
        Part& part = scene.parts[p];
        if (!std::holds_alternative<Dielectric>(part.material)) continue;
        const Mesh& mesh = *part.mesh;
        std::vector<Vec3f> moved = mesh.vertices;
        // Flat normals: a rim belongs to the wall and to the base, and both may touch.
        std::vector<std::vector<Vec3f>> faces(mesh.vertices.size());
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const Vec3f n = triangle_normal(mesh, t);
            if (!n.allFinite()) continue;
            for (int k = 0; k < 3; ++k) {
                auto& list = faces[static_cast<std::size_t>(mesh.triangles[t][k])];
                const bool is_known = std::any_of(list.begin(), list.end(),
                                                  [&](const Vec3f& m) { return m.dot(n) > 0.99f; });
                if (!is_known && list.size() < 6) list.push_back(n);
            }
        }
        parallel_for(mesh.vertices.size(), 1024, [&](std::size_t i) {
            for (const Vec3f& n : faces[i]) {
                Ray ray;
                ray.origin = mesh.vertices[i] - 2 * gap * n;
                ray.direction = n;
                for (int tries = 0; tries < 4; ++tries) {  // past the glass itself
                    ray.max_distance = gap - (ray.origin - mesh.vertices[i]).dot(n);
                    const Hit hit = closest(ray);
                    if (!hit.is_hit()) break;
                    const Part& other = scene.parts[static_cast<std::size_t>(hit.part)];
                    const Vec3f place = ray.origin + hit.distance * n;
                    if (!std::holds_alternative<Dielectric>(other.material)) {
                        const float clearance = (place - moved[i]).dot(n);
                        if (clearance < gap) moved[i] -= (gap - clearance) * n;
                        break;
                    }
                    ray.origin = place + 0.25f * epsilon * n;
                }
            }
        });
        if (moved == mesh.vertices) continue;
        auto copy = std::make_shared<Mesh>(mesh);
        copy->vertices = std::move(moved);
        part.mesh = copy;
        is_changed = true;
    }
    return is_changed;
}

}  // namespace

bool Media::contains(int part) const {
    return std::find(parts_, parts_ + count_, part) != parts_ + count_;
}

void Media::enter(int part, const std::vector<int>& rank) {
    if (count_ == kCapacity || contains(part)) return;
    int slot = count_++;
    const auto rank_of = [&](int p) { return rank[static_cast<std::size_t>(p)]; };
    for (; slot > 0 && rank_of(parts_[slot - 1]) > rank_of(part); --slot) {
        parts_[slot] = parts_[slot - 1];
    }
    parts_[slot] = static_cast<std::int16_t>(part);
}

void Media::leave(int part) {
    const auto end = std::remove(parts_, parts_ + count_, static_cast<std::int16_t>(part));
    count_ = static_cast<std::int16_t>(end - parts_);
}

RenderScene::RenderScene(Scene scene) : scene_(std::move(scene)) {
    epsilon_ = static_cast<float>(ray_epsilon(scene_));
    accel_ = build_accel(scene_.parts);
    const auto closest_part = [this](const Ray& ray) { return accel_.closest(ray); };
    if (open_contact_gaps(scene_, 0, closest_part, epsilon_)) accel_ = build_accel(scene_.parts);
    lights_ = LightSampler(scene_.lights, scene_.ambient_radiance);
    measure_parts();
}

RenderScene::RenderScene(const RenderScene& world, std::vector<Part> virtual_parts)
    : RenderScene(world) {
    VITRINE_CHECK(added_accel_.empty());
    const std::size_t first = scene_.parts.size();
    for (Part& part : virtual_parts) {
        part.is_virtual = true;
        scene_.parts.push_back(std::move(part));
    }
    const auto build = [&] {
        added_accel_ = build_accel(std::span<const Part>(scene_.parts).subspan(first));
    };
    build();
    const auto closest_part = [this](const Ray& ray) { return closest(ray); };
    if (open_contact_gaps(scene_, first, closest_part, epsilon_)) build();
    measure_parts();
}

namespace {

/// Whether normals per vertex say anything else than the facets do.
bool is_rounded(const Mesh& mesh) {
    constexpr float kSquare = 1e-11f;  // of what rounding to float does to a unit vector
    if (mesh.normals.empty()) return false;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3f facet = triangle_normal(mesh, t);
        for (const int v : mesh.triangles[t]) {
            const Vec3f normal = mesh.normals[static_cast<std::size_t>(v)].normalized();
            if (!((normal - facet).squaredNorm() < kSquare)) return true;
        }
    }
    return false;
}

}  // namespace

void RenderScene::measure_parts() {
    VITRINE_CHECK_LT(scene_.parts.size(), std::size_t{1} << 15);  // as numbered by `Media`
    const Box3 box = bounds(scene_);
    if (!box.is_empty()) {
        bounding_sphere_ = {box.centre().cast<float>(), static_cast<float>(box.radius())};
    }
    for (std::size_t p = bodies_.size(); p < scene_.parts.size(); ++p) {
        const Part& part = scene_.parts[p];
        const Mesh& mesh = *part.mesh;
        volumes_m3_.push_back(std::abs(volume(mesh)));
        const auto* diffuse = std::get_if<Diffuse>(&part.material);
        const bool is_textured = diffuse && diffuse->albedo_texture && !mesh.uv.empty();
        const bool is_painted = diffuse && diffuse->use_vertex_colours && !mesh.colours.empty();
        shapes_.push_back({mesh.triangles.data(), mesh.vertices.data(),
                           is_rounded(mesh) ? mesh.normals.data() : nullptr,
                           mesh.colours.empty() ? nullptr : mesh.colours.data(), diffuse != nullptr,
                           std::holds_alternative<Dielectric>(part.material),
                           !is_textured && !is_painted,
                           diffuse ? diffuse->albedo : Rgb(Rgb::Zero())});
        triangle_count_ += mesh.triangles.size();
        const auto* translucent = std::get_if<Translucent>(&part.material);
        const bool is_body = translucent && !part.mesh->empty();
        bodies_.push_back(is_body ? std::make_shared<TranslucentBody>(part.mesh, *translucent)
                                  : nullptr);
    }
    std::vector<int> order(volumes_m3_.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
        return volumes_m3_[static_cast<std::size_t>(a)] < volumes_m3_[static_cast<std::size_t>(b)];
    });
    medium_rank_.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        medium_rank_[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
    }
}

void RenderScene::closest(std::span<const Ray> rays, std::span<Hit> hits) const {
    accel_.closest(rays, hits);
    if (added_accel_.empty()) return;
    std::vector<Ray> nearer(rays.begin(), rays.end());
    std::vector<Hit> added(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!(rays[i].mask & kVirtualParts))
            nearer[i].max_distance = -1.0f;
        else if (hits[i].is_hit())
            nearer[i].max_distance = hits[i].distance;
    }
    added_accel_.closest(nearer, added);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!added[i].is_hit()) continue;
        hits[i] = added[i];
        hits[i].part += static_cast<int>(accel_.parts().size());
    }
}

void RenderScene::add_closest(const RayList& rays, bool are_alike) const {
    std::vector<std::int32_t> met;
    met.reserve(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        met.push_back(rays[i].part);
        rays[i].part = -1;
    }
    added_accel_.closest(rays, are_alike);
    const auto first = static_cast<std::int32_t>(accel_.parts().size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        rays[i].part = rays[i].is_hit() ? first + rays[i].part : met[i];
    }
}

void RenderScene::occluded(std::span<BareRay> rays) const {
    accel_.occluded(rays);
    // Rays that are answered already (negative) end before they begin: they stay what they are.
    if (!added_accel_.empty()) added_accel_.occluded(rays);
}

bool RenderScene::has_bodies() const {
    return std::any_of(bodies_.begin(), bodies_.end(), [](const auto& body) { return body; });
}

bool RenderScene::has_virtual() const {
    return std::any_of(scene_.parts.begin(), scene_.parts.end(),
                       [](const Part& part) { return part.is_virtual; });
}

Rgb RenderScene::transmittance(const Media& media, float distance) const {
    const Dielectric* medium = dielectric(media.current());
    if (!medium || (medium->sigma_a_per_m == 0).all()) return Rgb::Ones();
    return (-medium->sigma_a_per_m * distance).exp();
}

ShadingPoint RenderScene::surface(const Hit& hit, const Vec3f& ray_direction) const {
    const Mesh& mesh = *scene_.parts[static_cast<std::size_t>(hit.part)].mesh;
    ShadingPoint point;
    point.part = hit.part;
    point.distance = hit.distance;
    point.position = hit_point(mesh, hit);
    point.is_front = hit.normal.dot(ray_direction) <= 0;
    const float side = point.is_front ? 1.0f : -1.0f;
    point.geometric_normal = side * hit.normal;
    const bool is_flat = !shape(hit.part).normals;
    point.shading_normal = is_flat ? point.geometric_normal : side * shading_normal(mesh, hit);
    point.smooth_position = point.position;
    if (!is_flat && !dielectric(hit.part)) {
        // Hanika 2021, "Hacking the shadow terminator": the point seen from the tangent planes of
        // the vertices, lifted where these lie above it.
        const Triangle& t = mesh.triangles[static_cast<std::size_t>(hit.triangle)];
        const float weights[3] = {1 - hit.barycentric.x() - hit.barycentric.y(),
                                  hit.barycentric.x(), hit.barycentric.y()};
        for (int k = 0; k < 3; ++k) {
            const auto v = static_cast<std::size_t>(t[k]);
            const Vec3f n = side * mesh.normals[v];
            const float below = std::min(0.0f, (point.position - mesh.vertices[v]).dot(n));
            point.smooth_position -= weights[k] * below * n;
        }
    }
    return point;
}

Rgb RenderScene::diffuse_albedo(int part, const Hit& hit) const {
    const Part& p = scene_.parts[static_cast<std::size_t>(part)];
    if (const auto* ward = std::get_if<Ward>(&p.material)) return ward->rho_d;
    if (const TranslucentBody* translucent = body(part)) return translucent->albedo();
    const auto* diffuse = std::get_if<Diffuse>(&p.material);
    if (!diffuse) return Rgb::Zero();
    if (diffuse->albedo_texture && !p.mesh->uv.empty()) {
        const ImageRgb& texture = *diffuse->albedo_texture;
        const Vec2f uv = interpolate_uv(*p.mesh, hit);
        return bilinear(texture, uv.x() * static_cast<float>(texture.width()) - 0.5f,
                        (1.0f - uv.y()) * static_cast<float>(texture.height()) - 0.5f);
    }
    if (diffuse->use_vertex_colours && !p.mesh->colours.empty()) {
        return interpolate_colour(*p.mesh, hit);
    }
    return diffuse->albedo;
}

Bsdf RenderScene::bsdf(const ShadingPoint& point, const Hit& hit) const {
    const Material& m = material(point.part);
    if (const auto* ward = std::get_if<Ward>(&m)) {
        return WardBsdf{ward->rho_d, ward->rho_s, static_cast<float>(ward->sigma_x),
                        static_cast<float>(ward->sigma_y), ward->form == WardForm::Duer};
    }
    if (const auto* mirror = std::get_if<Mirror>(&m)) return MirrorBsdf{mirror->reflectance};
    if (const TranslucentBody* translucent = body(point.part)) {
        const auto& face = std::get<Translucent>(m);
        return TranslucentBsdf{translucent->near_share(), static_cast<float>(face.eta),
                               static_cast<float>(face.sigma)};
    }
    return DiffuseBsdf{diffuse_albedo(point.part, hit)};
}

}  // namespace vitrine
