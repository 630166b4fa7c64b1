#include "synthetic/world.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "geometry/primitives.h"
#include "image/colour.h"
#include "render/render_image.h"
#include "synthetic/world_shapes.h"
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
Rgb table_albedo(const Vec3f& p, const WorldOptions& options) {
    constexpr float kPatch = 0.035f;
    const auto cell = [](float x) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / kPatch)));
    };
    Rng patch(stream_key(options.seed, cell(p.x()), cell(p.y())));
    const float wave = 0.04f * (std::sin(23.0f * p.x() + 9.0f * p.y()) + std::sin(31.0f * p.y()));
    const float paint = patch.next_float() < 0.3f ? 0.16f * (patch.next_float() - 0.5f) : 0.0f;
    return Rgb(0.42f, 0.37f, 0.31f) + static_cast<float>(options.texture) * (wave + paint);
}

/// A board on the table that shades what stands at the origin from a lamp.
Mesh make_screen(const Vec3& lamp) {
    constexpr double kAway = 0.11, kWidth = 0.2, kThickness = 0.01;  // metres
    constexpr double kShadedRadius = 0.06, kShadedHeight = 0.13;     // of what stands there
    const double across = std::hypot(lamp.x(), lamp.y());
    const double height = kShadedHeight + (kAway + kShadedRadius) * lamp.z() / across;
    const Mesh board = make_box(Vec3(kThickness, kWidth, height), Vec3(kAway, 0, 0.5 * height));
    Mat4 turn = Mat4::Identity();
    const double c = lamp.x() / across, s = lamp.y() / across;
    turn.topLeftCorner<2, 2>() << c, -s, s, c;
    return transformed(board, turn);
}

Mesh make_scan_mesh(Rng& rng, const WorldOptions& options) {
    Mesh scan = make_plane(1.1, 0.0, 180);
    scan.uv.clear();
    scan.normals.clear();
    std::vector<Rgb> albedo;
    for (const Vec3f& p : scan.vertices) albedo.push_back(table_albedo(p, options));
    const double turn = between(rng, 0, 360);
    for (int k = 0; k < options.body_count; ++k) {
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
    if (options.is_shaded && !options.lamps.empty()) {
        append(scan, subdivided(make_screen(options.lamps[0].position_m), 0.012));
        albedo.resize(scan.vertices.size(), Rgb(0.5f, 0.5f, 0.5f));
    }
    scan.normals.clear();
    scan.colours = std::move(albedo);
    return with_creased_normals(scan, 30.0);
}

Material random_material(Rng& rng, const WorldOptions& options) {
    if (options.object == WorldObject::Glass || options.object == WorldObject::Vessel) {
        const double ior = between(rng, 1.35, 1.65);
        Rgb sigma_a;
        for (int c = 0; c < 3; ++c)
            sigma_a[c] = static_cast<float>(between(rng, 0, c == 1 ? 6 : 12));
        return Dielectric{ior, sigma_a};
    }
    Ward ward;
    const bool is_metal = options.object == WorldObject::Metal;
    for (int c = 0; c < 3; ++c) {
        ward.rho_d[c] =
            static_cast<float>(is_metal ? between(rng, 0.03, 0.2) : between(rng, 0.03, 0.08));
        ward.rho_s[c] = static_cast<float>(is_metal ? options.rho_s_scale * between(rng, 0.25, 0.5)
                                                    : between(rng, 0.02, 0.04));
    }
    ward.sigma_x = ward.sigma_y = is_metal ? between(rng, 0.06, 0.2) : between(rng, 0.2, 0.35);
    return ward;
}

/// The object as it is, its material included, and its hull.
struct Object {
    Part part;
    std::shared_ptr<const Mesh> hull;
    double wall_m = 0.0;
};

Object make_object(Rng& rng, const WorldOptions& options) {
    Object object;
    object.part.name = "object_0";
    const double radius = between(rng, 0.035, 0.05);
    if (options.object == WorldObject::Vessel) {
        Vessel vessel = make_vessel(radius, rng);
        object.part.mesh = std::make_shared<const Mesh>(std::move(vessel.glass));
        object.hull = std::make_shared<const Mesh>(std::move(vessel.hull));
        object.wall_m = vessel.wall_m;
    } else {
        object.part.mesh =
            std::make_shared<const Mesh>(make_world_shape(options.shape, radius, rng));
        object.hull = object.part.mesh;
    }
    object.part.material = random_material(rng, options);
    if (options.material) object.part.material = *options.material;
    return object;
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

/// Two uniform numbers give one normal one (Box and Muller 1958).
float normal_deviate(Rng& rng) {
    const float u = 1.0f - rng.next_float(), v = rng.next_float();
    return std::sqrt(-2.0f * std::log(u)) * std::cos(2.0f * kPif * v);
}

Rgb as_recorded(const Rgb& radiance, const WorldOptions& options, Rng& rng) {
    const auto level = static_cast<float>(options.saturation_level);
    Rgb recorded = radiance.max(0.0f).min(level);
    if (options.sensor_noise > 0.0) {
        for (int c = 0; c < 3; ++c)
            recorded[c] += static_cast<float>(options.sensor_noise) *
                           std::sqrt(level * recorded[c]) * normal_deviate(rng);
        recorded = recorded.max(0.0f).min(level);
    }
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
        for (std::size_t f = 0; f < frames.size(); ++f) {
            const Camera& camera = scene.cameras[f];
            const Vec3f eye = camera.centre_in_world().cast<float>();
            const Vec2 pixel = camera.project(scan.vertices[i].cast<double>());
            if (!camera.sees(pixel, 1.0) || scan.normals[i].dot(eye - origin) <= 0) continue;
            if (accel.is_occluded({origin, eye - origin, 0.0f, 1.0f})) continue;
            seen.push_back(bilinear(frames[f].colour, pixel.x(), pixel.y()));
        }
        if (seen.empty()) return;
        std::sort(seen.begin(), seen.end(),
                  [](const Rgb& a, const Rgb& b) { return luminance(a) < luminance(b); });
        colours[i] = seen[seen.size() / 2];
    });
    return colours;
}

/// Where `amount(p)` says how much of the error there is.
template <typename Amount>
Mesh displaced(Mesh mesh, const DisplacementField& field, const Amount& amount) {
    for (Vec3f& v : mesh.vertices) v += amount(v) * field(v);
    return mesh;
}

/// The truth without its lights and materials, as far off as the options say.
Scene as_reconstructed(const World& world, const std::shared_ptr<const Mesh>& hull,
                       const WorldOptions& options) {
    constexpr double kTurnArm = 0.5;  // metres: a turn by error / arm moves what is there alike
    constexpr float kFoot = 0.01f;    // metres: bodies stand on the table, which fuses to a plane
    Rng rng(stream_key(options.seed, 0xe4404ULL));
    Scene scene = world.truth;
    scene.lights.clear();
    scene.ambient_radiance = Rgb::Zero();
    if (options.scan_error_m > 0.0) {
        const DisplacementField field(options.scan_error_m, 0.02, 0.08, rng);
        Mesh scan = displaced(*scene.parts[0].mesh, field,
                              [](const Vec3f& v) { return std::clamp(v.z() / kFoot, 0.0f, 1.0f); });
        scan.normals.clear();
        scene.parts[0].mesh = std::make_shared<const Mesh>(with_creased_normals(scan, 30.0));
    }
    if (scene.parts.size() > 1) {
        scene.parts[1].material = Diffuse{};
        scene.parts[1].mesh = hull;
        if (options.hull_error_m > 0.0) {
            const DisplacementField field(options.hull_error_m, 0.03, 0.08, rng);
            Mesh bent = displaced(*hull, field, [](const Vec3f&) { return 1.0f; });
            bent.normals.clear();
            scene.parts[1].mesh = std::make_shared<const Mesh>(with_creased_normals(bent, 40.0));
        }
    }
    for (Camera& camera : scene.cameras) {
        if (options.pose_error_m == 0.0) continue;
        const double per_axis = options.pose_error_m / std::sqrt(3.0);
        Vec3 shift, turn;
        for (int a = 0; a < 3; ++a) {
            shift[a] = per_axis * normal_deviate(rng);
            turn[a] = per_axis / kTurnArm * normal_deviate(rng);
        }
        camera.cam_from_world = rigid_from_twist(turn, shift) * camera.cam_from_world;
    }
    return scene;
}

/// A spot of the table near the middle that the lamps light, as frame 0 sees it, and its mean
/// albedo there. Not the brightest: that one lies in the light that glass or metal throws.
std::optional<ReferenceAlbedo> known_albedo(const RenderScene& render, const Capture& capture) {
    constexpr int kHalf = 2;  // the reader takes the median of 5 x 5 pixels
    constexpr int kTrials = 36;
    constexpr double kRank = 0.7;  // of the trials, by brightness: most of the table is lit
    const RgbdFrame& frame = capture.frames[0];
    const Geometry geometry = render_geometry(render, frame.camera);
    std::vector<std::pair<float, ReferenceAlbedo>> spots;  // with their irradiance, up to a factor
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
        if (flattest < 0.99f) continue;
        if (is_saturated(frame.colour.clamped(u, v), capture.saturation_level)) continue;
        spots.push_back({darkest, {frame.id, Vec2(u, v), albedo}});
    }
    if (spots.empty()) return std::nullopt;
    std::sort(spots.begin(), spots.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    return spots[static_cast<std::size_t>(kRank * static_cast<double>(spots.size() - 1))].second;
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
    scan.mesh = std::make_shared<const Mesh>(make_scan_mesh(rng, options));
    world.truth.parts.push_back(scan);
    Object object;
    if (options.object != WorldObject::None) {
        object = make_object(rng, options);
        world.truth.parts.push_back(object.part);
        world.wall_m = object.wall_m;
    }
    const double azimuth = between(rng, 0, 360);
    for (int k = 0; k < options.light_count; ++k)
        world.lights.push_back(random_lamp(rng, azimuth + k * between(rng, 80, 180),
                                           k == 0 ? between(rng, 2.5, 3.5) : between(rng, 1.2, 2)));
    if (!options.lamps.empty()) world.lights = options.lamps;
    world.truth.lights.assign(world.lights.begin(), world.lights.end());
    if (options.is_sunny) {
        constexpr double kSunDistance = 1000.0;  // metres
        const DiscLight lamp = world.lights[0];
        const auto d2 = static_cast<float>(lamp.position_m.squaredNorm());
        const Rgb irradiance = lamp.intensity_w_per_sr / d2;
        world.lights = {lamp};
        world.lights[0].position_m *= kSunDistance / lamp.position_m.norm();
        world.lights[0].radius_m = 0.0;
        world.lights[0].intensity_w_per_sr =
            irradiance * static_cast<float>(kSunDistance * kSunDistance);
        world.truth.lights = {DirectionalLight{lamp.normal, irradiance}};
    }
    const double ambient = between(rng, 0.0, 0.07);
    world.truth.ambient_radiance =
        options.ambient_radiance.value_or(Rgb::Constant(static_cast<float>(ambient)));
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
        Rng noise(stream_key(options.seed, 0x5e504ULL, world.capture.frames.size()));
        for (Rgb& pixel : frame.colour) pixel = as_recorded(pixel, options, noise);
        frame.depth_m = render_geometry(render, camera).z_m;
        world.capture.frames.push_back(std::move(frame));
    }
    world.capture.name = "world_" + std::to_string(options.seed);
    world.capture.saturation_level = options.saturation_level;
    world.capture.has_poses = true;

    world.labelled = as_reconstructed(world, object.hull, options);
    Mesh observed = *world.labelled.parts[0].mesh;
    observed.colours = observed_colours(world.labelled, world.capture.frames);
    world.labelled.parts[0].mesh = std::make_shared<const Mesh>(std::move(observed));

    world.capture.reference_albedo = known_albedo(render, world.capture);
    return world;
}

}  // namespace vitrine
