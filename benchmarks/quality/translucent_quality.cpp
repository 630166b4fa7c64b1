// vitrine_translucent_quality: translucent bodies on meshes against the plain sum of their profile,
// and against photons followed through the medium; with a scene (and a PNG to write), the time of
// its picture.
#include "geometry/primitives.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "optics/dipole.h"
#include "optics/fresnel.h"
#include "random_walk.h"
#include "render/render_image.h"
#include "scene/scene.h"

#include <cstdio>
#include <ctime>

namespace vitrine {
namespace {

/// Processor time of all threads of this program.
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// sigma_t' in 1/m, one albedo' per channel.
Translucent dipole_material(double sigma_t, const Rgb& albedo, double eta) {
    Translucent material;
    material.eta = eta;
    material.r_m.push_back(0);
    for (int i = 0; i < 240; ++i) {
        material.r_m.push_back(0.005 / sigma_t * std::pow(1e5, i / 239.0));
    }
    for (const double r : material.r_m) {
        Rgbd rd;
        for (int c = 0; c < 3; ++c) {
            const double a = albedo[c];
            rd[c] = dipole_reflectance({a * sigma_t, (1 - a) * sigma_t, eta}, r);
        }
        material.rd_per_m2.push_back(rd);
    }
    return material;
}

using Irradiance = std::function<Rgb(const Vec3f& point, const Vec3f& normal)>;

/// B at the body's samples for a given irradiance.
std::vector<Rgb> exitance(const TranslucentBody& body, const Irradiance& irradiance) {
    std::vector<Rgb> entered;
    for (std::size_t i = 0; i < body.samples().size(); ++i) {
        entered.push_back(irradiance(body.samples().points[i], body.samples().normals[i]));
    }
    std::vector<Rgb> result = body.exitance(entered);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] += body.near_share() * entered[i];
    return result;
}

/// What enters of a beam along -z of unit irradiance.
Irradiance beam_from_above(double eta) {
    return [eta](const Vec3f&, const Vec3f& n) {
        const double cosine = n.z();
        return Rgb(Rgb::Constant(
            static_cast<float>(cosine > 0 ? cosine * fresnel_transmittance(cosine, eta) : 0.0)));
    };
}

void compare_with_plain_sum() {
    const Mesh torus = make_torus(0.05, 0.02, Vec3::Zero(), 192, 96);
    const EvenSamples dense = sample_evenly(torus, 0.00025, 2);
    const EvenSamples places = sample_evenly(torus, 0.02, 3);
    std::printf("fast sum against the plain sum over %zu points, torus 140 mm across:\n",
                dense.size());
    const Irradiance irradiance = [](const Vec3f& p, const Vec3f& n) {
        const float side = std::max(0.0f, n.dot(Vec3f(0.6f, 0.0f, 0.8f)));
        return Rgb(Rgb(1.0f, 0.8f, 0.6f) * (0.05f + side * (1 + 8 * p.x())));
    };
    for (const double free_path_mm : {0.5, 1.0, 3.0, 10.0}) {
        const Translucent material =
            dipole_material(1000 / free_path_mm, Rgb(0.95f, 0.98f, 0.99f), 1.3);
        const double start = cpu_seconds();
        const TranslucentBody body(std::make_shared<Mesh>(torus), material);
        const std::vector<Rgb> ours = exitance(body, irradiance);
        const double seconds = cpu_seconds() - start;
        const KernelTable kernel({material.r_m, material.rd_per_m2}, 1e-14f, 0.1f);
        double error = 0, norm = 0, worst = 0;
        for (std::size_t i = 0; i < places.size(); ++i) {
            const Vec3f& p = places.points[i];
            Rgbd truth = Rgbd::Zero();
            for (std::size_t k = 0; k < dense.size(); ++k) {
                const float q = (dense.points[k] - p).squaredNorm() + 1e-14f;
                truth += (kernel(q).head<3>() * irradiance(dense.points[k], dense.normals[k]) *
                          dense.area_m2[k])
                             .cast<double>();
            }
            const Rgbd value = body.interpolate(ours, p, places.normals[i]).cast<double>();
            error += (value - truth).abs().sum();
            norm += truth.sum();
            worst = std::max(worst, ((value - truth) / truth).abs().maxCoeff());
        }
        std::printf(
            "  free path %4.1f mm: %zu samples, paint %.2f, mean error %.2f %%, worst "
            "%.1f %%, %.2f s of processor time\n",
            free_path_mm, body.samples().size(), body.near_share()[1], 100 * error / norm,
            100 * worst, seconds);
    }
}

/// Flux leaving through each of `bin_count` regions, W, photons beside profile.
struct Bins {
    std::vector<Rgbd> walked, profile;
    explicit Bins(std::size_t count) : walked(count, Rgbd::Zero()), profile(count, Rgbd::Zero()) {}
    void print(const char* name, std::size_t first, std::size_t last) const {
        Rgbd w = Rgbd::Zero(), p = Rgbd::Zero();
        for (std::size_t i = first; i < last; ++i) {
            w += walked[i];
            p += profile[i];
        }
        const Rgbd difference = 100 * (p / w - 1);
        std::printf("    %-24s %+6.1f %+6.1f %+6.1f\n", name, difference[0], difference[1],
                    difference[2]);
    }
};

constexpr std::size_t kPhotons = 40'000;

void compare_sphere(double radius_in_free_paths, const Rgb& albedo, double eta) {
    const double sigma_t = 1000, radius = radius_in_free_paths / sigma_t;
    const Mesh mesh = make_sphere(radius, Vec3::Zero(), 96);
    const auto bin_of = [&](const Vec3f& p) {
        const double angle = angle_between(p.cast<double>(), Vec3(0, 0, 1));
        return std::min<std::size_t>(5, static_cast<std::size_t>(angle / kPi * 6));
    };
    Bins bins(6);
    const TranslucentBody body(std::make_shared<Mesh>(mesh), dipole_material(sigma_t, albedo, eta));
    const std::vector<Rgb> leaving = exitance(body, beam_from_above(eta));
    for (std::size_t i = 0; i < leaving.size(); ++i) {
        bins.profile[bin_of(body.samples().points[i])] +=
            (leaving[i] * body.samples().area_m2[i]).cast<double>();
    }
    const Accel accel({{std::make_shared<Mesh>(mesh)}});
    const WalkMedium medium{sigma_t, albedo, static_cast<float>(eta)};
    const auto power = static_cast<float>(kPi * radius * radius / kPhotons);
    walk_photons(
        accel, medium, kPhotons, 1,
        [&](std::size_t i) {
            const Vec2f d = sample_concentric_disc(r2_point(i)) * static_cast<float>(radius);
            return WalkPhoton{Vec3f(d.x(), d.y(), 2 * static_cast<float>(radius)), Vec3f(0, 0, -1),
                              Rgb::Constant(power)};
        },
        [&](const Vec3f& p, const Rgb& w) { bins.walked[bin_of(p)] += w.cast<double>(); });
    std::printf("  sphere, radius %.0f free paths, index %.1f, albedo' %.2f %.2f %.3f:\n",
                radius_in_free_paths, eta, albedo[0], albedo[1], albedo[2]);
    bins.print("all", 0, 6);
    bins.print("lit: 0 to 60 degrees", 0, 2);
    bins.print("60 to 120 degrees", 2, 4);
    bins.print("dark: 120 to 180 degrees", 4, 6);
}

void compare_slab(double thickness_in_free_paths, const Rgb& albedo, double eta) {
    const double sigma_t = 1000, side = 25 * thickness_in_free_paths / sigma_t;
    const double thickness = thickness_in_free_paths / sigma_t;
    // Light on the middle fifth alone: what leaves at the rim is nothing then.
    const auto half = static_cast<float>(0.1 * side);
    const Mesh mesh = make_box(Vec3(side, side, thickness));
    TranslucentBodyOptions options;
    options.max_samples = 200'000;
    const TranslucentBody body(std::make_shared<Mesh>(mesh), dipole_material(sigma_t, albedo, eta),
                               options);
    const Irradiance beam = beam_from_above(eta);
    const std::vector<Rgb> leaving = exitance(body, [&](const Vec3f& p, const Vec3f& n) {
        const bool is_lit = std::abs(p.x()) < half && std::abs(p.y()) < half;
        return is_lit ? beam(p, n) : Rgb(Rgb::Zero());
    });
    Bins bins(2);
    for (std::size_t i = 0; i < leaving.size(); ++i) {
        bins.profile[body.samples().points[i].z() > 0 ? 0 : 1] +=
            (leaving[i] * body.samples().area_m2[i]).cast<double>();
    }
    const Accel accel({{std::make_shared<Mesh>(mesh)}});
    const auto power = 4 * half * half / static_cast<float>(kPhotons);
    walk_photons(
        accel, {sigma_t, albedo, static_cast<float>(eta)}, kPhotons, 1,
        [&](std::size_t i) {
            const Vec2f u = r2_point(i);
            return WalkPhoton{Vec3f(half * (2 * u.x() - 1), half * (2 * u.y() - 1),
                                    2 * static_cast<float>(thickness)),
                              Vec3f(0, 0, -1), Rgb::Constant(power)};
        },
        [&](const Vec3f& p, const Rgb& w) { bins.walked[p.z() > 0 ? 0 : 1] += w.cast<double>(); });
    std::printf("  slab, %.0f free paths thick, index %.1f, albedo' %.2f %.2f %.3f:\n",
                thickness_in_free_paths, eta, albedo[0], albedo[1], albedo[2]);
    bins.print("lit side", 0, 1);
    bins.print("dark side", 1, 2);
}

void time_picture(const std::string& scene_file, const std::string& out) {
    const Scene scene = read_scene(scene_file);
    for (const bool is_translucent : {true, false}) {
        Scene variant = scene;
        for (Part& part : variant.parts) {
            if (is_translucent || !std::holds_alternative<Translucent>(part.material)) continue;
            part.material = Diffuse{Rgb::Constant(0.6f), nullptr, "", false};
        }
        FinalOptions options;
        options.samples_per_pixel = 16;
        options.caustics.photon_count = 300'000;
        options.caustics.gather_radius_m = 0;
        const double start = cpu_seconds();
        const RenderScene prepared(variant);
        const RenderedImage image = render_image(prepared, variant.cameras.front(), options);
        std::printf("  %s: %.1f s of processor time\n",
                    is_translucent ? "translucent" : "the same as matte paint",
                    cpu_seconds() - start);
        if (is_translucent && !out.empty()) write_png(out, linear_to_srgb8(image.radiance));
    }
}

int run(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::printf(
        "profile minus photons followed through the medium, %% of their flux, per channel:\n");
    const Rgb albedo(0.9f, 0.97f, 0.995f);
    for (const double eta : {1.0, 1.3}) {
        compare_sphere(10, albedo, eta);
        compare_sphere(30, albedo, eta);
        compare_slab(4, albedo, eta);
        compare_slab(10, albedo, eta);
    }
    compare_with_plain_sum();
    if (argc > 1) {
        std::printf("picture of %s, 640 x 360, 16 paths per pixel:\n", argv[1]);
        time_picture(argv[1], argc > 2 ? argv[2] : "");
    }
    return 0;
}

}  // namespace
}  // namespace vitrine

int main(int argc, char** argv) { return vitrine::run(argc, argv); }
