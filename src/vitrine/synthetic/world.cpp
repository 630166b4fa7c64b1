#include "synthetic/world.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "geometry/primitives.h"
#include "image/colour.h"
#include "render/render_image.h"
#include "trace/accel.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

double between(Rng& rng, double low, double high) { return low + (high - low) * rng.next_double(); }

Vec3 on_hemisphere(double elevation_deg, double azimuth_deg, double distance) {
    const double e = radians(elevation_deg), a = radians(azimuth_deg);
    return distance * Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
}

DiscLight random_lamp(Rng& rng, double azimuth_deg, double strength) {
    const Vec3 position = on_hemisphere(between(rng, 32, 65), azimuth_deg, between(rng, 0.85, 1.3));
    const Rgb tint(1.0f, static_cast<float>(between(rng, 0.9, 1.0)),
                   static_cast<float>(between(rng, 0.8, 1.0)));
    return {position, -position.normalized(), between(rng, 0.03, 0.06),
            static_cast<float>(strength * position.squaredNorm()) * tint};
}

/// Splits triangles until edges are below `edge_m`, so that vertex colours can hold shadows.
Mesh subdivided(Mesh mesh, double edge_m) {
    mesh.normals.clear();
    mesh.uv.clear();
    for (bool is_coarse = true; is_coarse;) {
        is_coarse = false;
        Mesh next;
        for (const Triangle& t : mesh.triangles) {
            const Vec3f a = mesh.vertices[static_cast<std::size_t>(t[0])];
            const Vec3f b = mesh.vertices[static_cast<std::size_t>(t[1])];
            const Vec3f c = mesh.vertices[static_cast<std::size_t>(t[2])];
            const double longest = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
            const auto base = static_cast<int>(next.vertices.size());
            if (longest <= edge_m) {
                next.vertices.insert(next.vertices.end(), {a, b, c});
                next.triangles.emplace_back(base, base + 1, base + 2);
                continue;
            }
            is_coarse = true;
            const Vec3f ab = 0.5f * (a + b), bc = 0.5f * (b + c), ca = 0.5f * (c + a);
            next.vertices.insert(next.vertices.end(), {a, b, c, ab, bc, ca});
            next.triangles.insert(
                next.triangles.end(),
                {Triangle(base, base + 3, base + 5), Triangle(base + 3, base + 1, base + 4),
                 Triangle(base + 5, base + 4, base + 2), Triangle(base + 3, base + 4, base + 5)});
        }
        mesh = std::move(next);
    }
    return welded(mesh, 1e-6);
}

/// Patches of paint over a slow wave: what a desk mat looks like.
Rgb table_albedo(const Vec3f& p, std::uint64_t seed) {
    constexpr float kPatch = 0.035f;
    const auto cell = [](float x) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / kPatch)));
    };
    Rng patch(stream_key(seed, cell(p.x()), cell(p.y())));
    const float wave = 0.04f * (std::sin(23.0f * p.x() + 9.0f * p.y()) + std::sin(31.0f * p.y()));
    const float paint = patch.next_float() < 0.3f ? 0.16f * (patch.next_float() - 0.5f) : 0.0f;
    return Rgb(0.42f, 0.37f, 0.31f) + wave + paint;
}

Mesh make_scan_mesh(Rng& rng, std::uint64_t seed) {
    Mesh scan = make_plane(1.1, 0.0, 180);
    scan.uv.clear();
    scan.normals.clear();
    std::vector<Rgb> albedo;
    for (const Vec3f& p : scan.vertices) albedo.push_back(table_albedo(p, seed));
    const double turn = between(rng, 0, 360);
    for (int k = 0; k < 3; ++k) {
        const Vec3 place =
            on_hemisphere(0, turn + 120 * k + between(rng, -20, 20), between(rng, 0.17, 0.25));
        const double height = between(rng, 0.05, 0.12);
        Mesh body = k == 1
                        ? make_cylinder(0.035, height, place)
                        : make_box(Vec3(between(rng, 0.06, 0.1), between(rng, 0.06, 0.1), height),
                                   place + Vec3(0, 0, 0.5 * height));
        const Rgb paint(static_cast<float>(between(rng, 0.1, 0.7)),
                        static_cast<float>(between(rng, 0.1, 0.7)),
                        static_cast<float>(between(rng, 0.1, 0.7)));
        append(scan, subdivided(std::move(body), 0.012));
        albedo.resize(scan.vertices.size(), paint);
    }
    scan.normals.clear();
    scan.colours = std::move(albedo);
    return with_creased_normals(scan, 30.0);
}

Part make_object(Rng& rng, const WorldOptions& options) {
    Part part;
    part.name = "object_0";
    const double radius = between(rng, 0.035, 0.05);
    Mesh mesh;
    if (rng.next_double() < 0.5) {
        mesh = make_sphere(radius, Vec3(0, 0, radius + 5e-4), 64);
    } else {
        // A bottle without a neck: shoulders bend light as a sphere does, sides as a cylinder.
        mesh = make_lathe({Vec2(0, 5e-4), Vec2(0.9 * radius, 6e-4), Vec2(radius, 0.006),
                           Vec2(radius, 1.4 * radius), Vec2(0.8 * radius, 1.9 * radius),
                           Vec2(0.45 * radius, 2.2 * radius), Vec2(0, 2.3 * radius)},
                          128);
    }
    part.mesh = std::make_shared<const Mesh>(std::move(mesh));
    if (options.object == WorldObject::Glass) {
        part.material =
            Dielectric{between(rng, 1.35, 1.65), Rgb(static_cast<float>(between(rng, 0, 12)),
                                                     static_cast<float>(between(rng, 0, 6)),
                                                     static_cast<float>(between(rng, 0, 12)))};
    } else {
        Ward ward;
        for (int c = 0; c < 3; ++c) {
            ward.rho_d[c] = static_cast<float>(between(rng, 0.03, 0.2));
            ward.rho_s[c] = static_cast<float>(options.rho_s_scale * between(rng, 0.25, 0.5));
        }
        ward.sigma_x = ward.sigma_y = between(rng, 0.06, 0.2);
        part.material = ward;
    }
    return part;
}

Camera make_camera(const WorldOptions& options, int view) {
    Camera camera;
    camera.width = options.width;
    camera.height = options.height;
    camera.fx = camera.fy = 0.95 * options.width;
    camera.cx = 0.5 * (options.width - 1);
    camera.cy = 0.5 * (options.height - 1);
    const Vec3 eye =
        on_hemisphere(view % 2 == 0 ? 32 : 48, 360.0 * view / options.view_count, 0.75);
    camera.cam_from_world = look_at(eye, Vec3(0, 0, 0.02), Vec3(0, 0, 1)).inverse();
    camera.id = std::to_string(view);
    return camera;
}

Rgb as_recorded(const Rgb& radiance, const WorldOptions& options) {
    const auto level = static_cast<float>(options.saturation_level);
    Rgb recorded = radiance.max(0.0f).min(level);
    if (options.is_quantised)
        for (int c = 0; c < 3; ++c)
            recorded[c] =
                level *
                srgb_to_linear(std::round(255.0f * linear_to_srgb(recorded[c] / level)) / 255.0f);
    return recorded;
}

/// Median radiance at every vertex over the frames that see it.
std::vector<Rgb> observed_colours(const Scene& scene, const std::vector<RgbdFrame>& frames) {
    std::vector<AccelPart> parts;
    for (const Part& part : scene.parts) parts.push_back({part.mesh});
    const Accel accel(std::move(parts));
    const Mesh& scan = *scene.parts[0].mesh;
    std::vector<Rgb> colours(scan.vertices.size(), Rgb::Zero());
    parallel_for(colours.size(), 256, [&](std::size_t i) {
        const Vec3f origin = scan.vertices[i] + 2e-3f * scan.normals[i];
        std::vector<Rgb> seen;
        for (const RgbdFrame& frame : frames) {
            const Vec3f eye = frame.camera.centre_in_world().cast<float>();
            const Vec2 pixel = frame.camera.project(scan.vertices[i].cast<double>());
            if (!frame.camera.sees(pixel, 1.0) || scan.normals[i].dot(eye - origin) <= 0) continue;
            if (accel.is_occluded({origin, eye - origin, 0.0f, 1.0f})) continue;
            seen.push_back(bilinear(frame.colour, pixel.x(), pixel.y()));
        }
        if (seen.empty()) return;
        std::sort(seen.begin(), seen.end(),
                  [](const Rgb& a, const Rgb& b) { return luminance(a) < luminance(b); });
        colours[i] = seen[seen.size() / 2];
    });
    return colours;
}

/// The best lit spot of the table near the middle as frame 0 sees it, and its mean albedo there.
ReferenceAlbedo known_albedo(const RenderScene& render, const Capture& capture) {
    constexpr int kHalf = 2;  // the reader takes the median of 5 x 5 pixels
    constexpr int kTrials = 36;
    const RgbdFrame& frame = capture.frames[0];
    const Geometry geometry = render_geometry(render, frame.camera);
    ReferenceAlbedo best;
    best.frame = frame.id;
    float brightest = 0.0f;
    for (int k = 0; k < kTrials; ++k) {
        const Vec2 pixel = frame.camera.project(on_hemisphere(0, 360.0 * k / kTrials, 0.13));
        const int u = static_cast<int>(std::round(pixel.x()));
        const int v = static_cast<int>(std::round(pixel.y()));
        Rgb albedo = Rgb::Zero();
        float darkest = 1e30f, flattest = 1.0f;
        for (int dv = -kHalf; dv <= kHalf; ++dv)
            for (int du = -kHalf; du <= kHalf; ++du) {
                const Rgb here = geometry.albedo.clamped(u + du, v + dv);
                albedo += here / 25.0f;
                flattest = std::min(flattest, geometry.normal.clamped(u + du, v + dv)[2]);
                darkest = std::min(darkest, luminance(frame.colour.clamped(u + du, v + dv)) /
                                                std::max(luminance(here), 0.01f));
            }
        if (flattest < 0.99f || darkest <= brightest) continue;
        if (is_saturated(frame.colour.clamped(u, v), capture.saturation_level)) continue;
        brightest = darkest;
        best.pixel = Vec2(u, v);
        best.albedo = albedo;
    }
    return best;
}

}  // namespace

World make_world(const WorldOptions& options) {
    World world;
    Rng rng(stream_key(options.seed, 0x301dULL));
    Part scan;
    scan.name = "scan";
    Diffuse vertex;
    vertex.use_vertex_colours = true;
    scan.material = vertex;
    scan.mesh = std::make_shared<const Mesh>(make_scan_mesh(rng, options.seed));
    world.truth.parts.push_back(scan);
    if (options.object != WorldObject::None) world.truth.parts.push_back(make_object(rng, options));
    const double azimuth = between(rng, 0, 360);
    for (int k = 0; k < options.light_count; ++k)
        world.lights.push_back(random_lamp(rng, azimuth + k * between(rng, 80, 180),
                                           k == 0 ? between(rng, 2.5, 3.5) : between(rng, 1.2, 2)));
    world.truth.lights.assign(world.lights.begin(), world.lights.end());
    world.truth.ambient_radiance = Rgb::Constant(static_cast<float>(between(rng, 0.0, 0.07)));
    for (int view = 0; view < options.view_count; ++view)
        world.truth.cameras.push_back(make_camera(options, view));

    const RenderScene render(world.truth);
    FinalOptions final;
    final.samples_per_pixel = options.samples_per_pixel;
    final.caustics.photon_count = options.photon_count;
    final.caustics.gather_radius_m = 0.003;
    const CausticMaps maps = build_caustic_maps(trace_caustics(render, final.caustics).photons,
                                                final.caustics.gather_radius_m);
    for (const Camera& camera : world.truth.cameras) {
        RgbdFrame frame;
        frame.id = camera.id;
        frame.camera = camera;
        final.seed = stream_key(options.seed, world.capture.frames.size());
        frame.colour = render_image(render, camera, &maps, final).radiance;
        for (Rgb& pixel : frame.colour) pixel = as_recorded(pixel, options);
        frame.depth_m = render_geometry(render, camera).z_m;
        world.capture.frames.push_back(std::move(frame));
    }
    world.capture.name = "world_" + std::to_string(options.seed);
    world.capture.saturation_level = options.saturation_level;
    world.capture.has_poses = true;

    world.labelled = world.truth;
    world.labelled.lights.clear();
    world.labelled.ambient_radiance = Rgb::Zero();
    Mesh observed = *scan.mesh;
    observed.colours = observed_colours(world.labelled, world.capture.frames);
    world.labelled.parts[0].mesh = std::make_shared<const Mesh>(std::move(observed));
    if (world.labelled.parts.size() > 1) world.labelled.parts[1].material = Diffuse{};

    world.capture.reference_albedo = known_albedo(render, world.capture);
    return world;
}

}  // namespace vitrine
