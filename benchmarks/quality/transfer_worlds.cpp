// Nine worlds of half B made here: three materials x three shapes, random lights, as an 8-bit
// picture with noise and a highlight. Prints how well material, lights and transfers come back.
//
//   vitrine_transfer_worlds [FIRST [LAST]] [--flat] [--ground] [--refine N]
//
// The truth is a dipole, summed on a finer lattice than the estimator's but by the same integral
// (with C(s) of a closed body; --flat leaves it out on both sides). --ground adds light from below.
#include "base/rng.h"
#include "compose/transfer.h"
#include "estimate/translucent_world.h"
#include "image/colour.h"
#include "math/statistics.h"
#include "optics/dipole.h"
#include "render/render_object.h"
#include "transfer_measures.h"

#include <fmt/format.h>

#include <string>

using namespace vitrine;
using testing_world::nearest_deg;

namespace {

constexpr int kSize = 280;
constexpr double kPxPerMm = 12;  // bodies of 16 to 20 mm, like grapes

struct Medium {
    const char* name;
    DipoleMedium per_mm[3];
};
/// Jensen, Marschner, Levoy, Hanrahan 2001, table of measured media.
const Medium kMedia[3] = {
    {"apple", {{2.29, 0.0030, 1.3}, {2.39, 0.0034, 1.3}, {1.97, 0.046, 1.3}}},
    {"marble", {{2.19, 0.0021, 1.5}, {2.62, 0.0041, 1.5}, {3.00, 0.0071, 1.5}}},
    {"skim milk", {{0.70, 0.0014, 1.3}, {1.22, 0.0025, 1.3}, {1.90, 0.0142, 1.3}}},
};
const char* const kShapes[3] = {"ball", "egg", "bumps"};

RadialProfile profile_px(const Medium& medium) {
    RadialProfile profile;
    profile.r.push_back(0);
    for (int i = 0; i < 300; ++i) profile.r.push_back(0.01 * std::pow(80 / 0.01, i / 299.0));
    for (double& r : profile.r) {
        Rgbd rd;
        for (int c = 0; c < 3; ++c) rd[c] = dipole_reflectance(medium.per_mm[c], r);
        profile.rd.push_back(rd / (kPxPerMm * kPxPerMm));
        r *= kPxPerMm;
    }
    return profile;
}

/// Height over the silhouette plane; <= 0 outside.
double height(int shape, double u, double v, Rng bumps) {
    if (shape == 0) return std::sqrt(std::max(0.0, 105.0 * 105 - u * u - v * v));
    if (shape == 1) {
        const double turn = 0.5, a = std::cos(turn) * u + std::sin(turn) * v;
        const double b = -std::sin(turn) * u + std::cos(turn) * v;
        const double width = 88 * (1 - 0.14 * a / 118);  // blunt and pointed end
        return std::sqrt(std::max(0.0, 1 - a * a / (118.0 * 118) - b * b / (width * width))) *
               width;
    }
    const double base = std::sqrt(std::max(0.0, 1 - u * u / (115.0 * 115) - v * v / (92.0 * 92)));
    double z = 92 * base;
    for (int k = 0; k < 8; ++k) {
        const double x = 130 * (bumps.next_double() - 0.5), y = 100 * (bumps.next_double() - 0.5);
        const double wide = 14 + 14 * bumps.next_double(), high = 12 * (bumps.next_double() - 0.4);
        z += std::sqrt(base) * high *
             std::exp(-0.5 * ((u - x) * (u - x) + (v - y) * (v - y)) / (wide * wide));
    }
    return base > 0 ? z : 0;
}

Relief make_shape(int shape, std::uint64_t seed) {
    Relief relief;
    relief.mask = Mask(kSize, kSize);
    relief.depth_px = ImageF(kSize, kSize);
    relief.normals = Image<Vec3f>(kSize, kSize, Vec3f(0, 0, 1));
    const Rng bumps(stream_key(seed, 0x51));
    const auto at = [&](double x, double y) {
        return height(shape, x - 0.5 * (kSize - 1), 0.5 * (kSize - 1) - y, bumps);
    };
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const double z = at(x, y);
            if (z <= 0) continue;
            relief.mask(x, y) = 255;
            relief.depth_px(x, y) = static_cast<float>(z);
            // Gradient of the squared height: finite at the rim.
            constexpr double h = 0.25;
            const auto q = [&](double dx, double dy) { return std::pow(at(x + dx, y + dy), 2); };
            const double zx = (q(h, 0) - q(-h, 0)) / (4 * h * z);
            const double zy = (q(0, -h) - q(0, h)) / (4 * h * z);
            relief.normals(x, y) = Vec3(-zx, -zy, 1).normalized().cast<float>();
        }
    }
    relief.inradius_px = inradius_px(relief.mask);
    return relief;
}

Vec3 random_direction(Rng& rng, double z_low, double z_high) {
    const double z = z_low + (z_high - z_low) * rng.next_double();
    const double turn = 2 * kPi * rng.next_double(), rho = std::sqrt(1 - z * z);
    return {rho * std::cos(turn), rho * std::sin(turn), z};
}

ViewLights random_lights(const Relief& relief, std::uint64_t seed, bool with_ground) {
    Rng rng(stream_key(seed, 0x77));
    ViewLights lights;
    lights.lights.push_back({random_direction(rng, 0.35, 0.85), Rgbd::Constant(1.0)});
    // Behind, or a fill on the other side.
    const bool is_behind = rng.next_double() < 0.6;
    Vec3 second;
    do {
        second = is_behind ? random_direction(rng, -0.8, -0.2) : random_direction(rng, 0.1, 0.6);
    } while (angle_between(second, lights.lights[0].direction) < radians(60));
    lights.lights.push_back(
        {second, Rgbd::Constant((is_behind ? 1.2 : 0.4) + 0.4 * rng.next_double())});
    lights.ambient = Rgbd::Constant(0.03 + 0.07 * rng.next_double());
    if (with_ground) lights.from_below = Rgbd(0.30, 0.22, 0.15);
    normalise_lights(lights, relief, 1.3);
    return lights;
}

/// 8 bits, 1 % noise, the lamps' reflections as Phong lobes of exponent 100, grey background.
Photo photograph(const std::string& name, const Relief& relief, const ViewLights& lights,
                 const ImageRgb& diffuse, std::uint64_t seed) {
    double brightest = 0;
    for (const Rgb& pixel : diffuse) brightest = std::max<double>(brightest, pixel.maxCoeff());
    Photo photo;
    photo.name = name;
    photo.mask = relief.mask;
    photo.linear = ImageRgb(kSize, kSize, Rgb(0.30f, 0.22f, 0.15f));
    for (std::size_t i = 0; i < diffuse.size(); ++i) {
        if (relief.mask[i] <= 127) continue;
        Rng rng(stream_key(seed, i));
        for (int c = 0; c < 3; ++c) {
            const double noise = 1 + 0.01 * std::sqrt(3.0) * (2 * rng.next_double() - 1);
            photo.linear[i][c] = static_cast<float>(0.75 / brightest * noise) * diffuse[i][c];
        }
        const Vec3 n = relief.normals[i].cast<double>();
        for (const ViewLight& light : lights.lights) {
            if (n.dot(light.direction) <= 0) continue;
            const Vec3 half = (light.direction + Vec3(0, 0, 1)).normalized();
            photo.linear[i] += static_cast<float>(std::pow(std::max(0.0, n.dot(half)), 400));
        }
    }
    photo.linear = srgb_to_linear(linear_to_srgb8(photo.linear));
    return photo;
}

/// Radius within which half of the albedo lies.
double half_radius(const RadialProfile& profile, int channel) {
    double low = 0, high = profile.r.back();
    const double half = 0.5 * profile.total()[channel];
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (profile.cumulative(middle)[channel] < half ? low : high) = middle;
    }
    return low;
}

struct ProfileErrors {
    double ks = 0, albedo = 0, half = 0, ratio = 0;  ///< worst channel; relative but ks
};
ProfileErrors compare(const RadialProfile& found, const RadialProfile& truth) {
    ProfileErrors errors;
    const Rgbd a = found.total(), b = truth.total();
    for (int c = 0; c < 3; ++c) {
        errors.ks = std::max(errors.ks, profile_ks_distance(found, truth, c, 2.0, 400));
        errors.albedo = std::max(errors.albedo, std::abs(a[c] / b[c] - 1));
        errors.half =
            std::max(errors.half, std::abs(half_radius(found, c) / half_radius(truth, c) - 1));
        errors.ratio = std::max(errors.ratio, std::abs(a[c] / a[1] / (b[c] / b[1]) - 1));
    }
    return errors;
}

struct Row {
    ProfileErrors known, blind;
    double known_self = 0, key = 0, fill = 0, self = 0, transfer = 0, above_lambert = 0;
};

double encoded_psnr(const ImageRgb& picture, const ImageRgb& truth, const Mask& mask) {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        for (int c = 0; c < 3; ++c) {
            const double d = linear_to_srgb(picture[i][c]) - linear_to_srgb(truth[i][c]);
            sum += d * d;
            count += 1;
        }
    }
    return -10 * std::log10(std::max(sum / count, 1e-12));
}

Row run_world(int index, bool use_curved_body, bool with_ground, int refinement_rounds) {
    const Medium& medium = kMedia[index / 3];
    const int shape = index % 3;
    const auto seed = static_cast<std::uint64_t>(100 + index);
    const Relief relief = make_shape(shape, seed);
    const ViewLights lights = random_lights(relief, seed, with_ground);
    TranslucentRenderOptions fine;
    fine.cells_per_side = 8000;
    fine.eta = 1.3;
    fine.use_curved_body = use_curved_body;
    const RadialProfile truth = profile_px(medium);
    const ImageRgb diffuse = render_object(relief, lights, truth, fine);
    const Photo photo = photograph("world", relief, lights, diffuse, seed);
    TransferAnalysisOptions options;
    options.refinement_rounds = refinement_rounds;
    options.bssrdf.use_curved_body = options.lights.use_curved_body = use_curved_body;
    options.softness = 0.5;  // these worlds have hard lights on hard and soft materials alike

    Row row;
    const LiftedMaterial lifted = lift_material(photo, options);
    row.blind = compare(lifted.medium.profile(), truth);
    row.key = nearest_deg(lifted.analysis.lights.lights, lights.lights[0].direction);
    row.fill = nearest_deg(lifted.analysis.lights.lights, lights.lights[1].direction);
    row.self = lifted.self_psnr_db;

    // Known shape and lights: light level and picture in the same unit.
    double brightest = 0;
    for (const Rgb& pixel : diffuse) brightest = std::max<double>(brightest, pixel.maxCoeff());
    ImageRgb shown = lifted.analysis.highlights.diffuse;
    for (Rgb& pixel : shown) pixel *= static_cast<float>(brightest / 0.75);
    BssrdfOptions exact = options.bssrdf;
    // The shape is exact: fine samples pay, and a long tail is no sign of its errors.
    exact.smoothing = 0.01;
    exact.samples_per_side = 8000;
    exact.longest = 1;
    exact.is_level_known = exact.prefers_random_walk = true;
    const MediumEstimate known =
        estimate_bssrdf(shown, relief, lifted.analysis.highlights.grown, lights, exact);
    row.known = compare(known.profile(), truth);
    TranslucentRenderOptions coarse;
    coarse.eta = known.is_fresnel ? 1.3 : 1.0;
    coarse.use_curved_body = use_curved_body;
    ImageRgb again = render_object(relief, lights, known.profile(), coarse);
    ImageRgb wanted = diffuse;
    for (std::size_t i = 0; i < again.size(); ++i) {
        again[i] *= static_cast<float>(0.75 / brightest);
        wanted[i] *= static_cast<float>(0.75 / brightest);
    }
    row.known_self = encoded_psnr(again, wanted, relief.mask);

    // Onto another shape under other light, photographed opaque.
    const Relief other = make_shape((shape + 1) % 3, seed + 500);
    const ViewLights other_lights = random_lights(other, seed + 500, with_ground);
    const ReliefIrradiance other_light = irradiance_with_shadows(other, other_lights, 1.0);
    const Photo object =
        photograph("object", other, other_lights,
                   lambertian_recolouring(other, other_light, Rgbd::Constant(0.7)), seed + 500);
    const ImageRgb exact_picture = render_object(other, other_lights, truth, fine);
    TranslucentRenderOptions render_options;
    render_options.use_curved_body = use_curved_body;
    const TransferSession session(analyse_object(object, options), IrradianceSource::Photo,
                                  render_options);
    const ImageRgb dressed = session.render(lifted.medium.profile(), {}).diffuse;
    const ObjectScore ours = score_object(dressed, exact_picture, other.mask);
    Rgbd albedo;
    for (int c = 0; c < 3; ++c)
        albedo[c] = lifted.medium.channels[static_cast<std::size_t>(c)].albedo;
    const PhotoAnalysis& analysis = session.object();
    const ObjectScore lambert = score_object(
        lambertian_recolouring(analysis.relief,
                               irradiance_from_lights(analysis.relief, analysis.lights.lights, 1.3),
                               albedo),
        exact_picture, other.mask);
    row.transfer = ours.psnr_db;
    row.above_lambert = ours.psnr_db - lambert.psnr_db;
    fmt::print(
        "{:9} {:5} known: KS {:.3f} albedo {:.1f} % half r {:.0f} % self {:.1f} dB | blind: key "
        "{:.1f} fill {:.1f} deg KS {:.3f} ratios {:.1f} % half r {:.0f} % self {:.1f} dB transfer "
        "{:.1f} dB ({:+.1f} over Lambert)\n",
        medium.name, kShapes[shape], row.known.ks, 100 * row.known.albedo, 100 * row.known.half,
        row.known_self, row.key, row.fill, row.blind.ks, 100 * row.blind.ratio,
        100 * row.blind.half, row.self, row.transfer, row.above_lambert);
    std::fflush(stdout);
    return row;
}

template <typename Get>
void print_bar(const std::vector<Row>& rows, const char* name, const char* bar, Get get) {
    std::vector<double> values;
    for (const Row& row : rows) values.push_back(get(row));
    fmt::print("{:28} median {:7.3f}  lowest {:7.3f}  highest {:7.3f}   bar {}\n", name,
               median(values), *std::min_element(values.begin(), values.end()),
               *std::max_element(values.begin(), values.end()), bar);
}

}  // namespace

int main(int argc, char** argv) {
    int first = 0, last = 8;
    bool use_curved_body = true, with_ground = false;
    int refinement_rounds = TransferAnalysisOptions().refinement_rounds;
    std::vector<int> numbers;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--flat") {
            use_curved_body = false;
        } else if (word == "--ground") {
            with_ground = true;
        } else if (word == "--refine" && i + 1 < argc) {
            refinement_rounds = std::atoi(argv[++i]);
        } else {
            numbers.push_back(std::atoi(argv[i]));
        }
    }
    if (!numbers.empty()) first = numbers.front(), last = numbers.back();
    std::vector<Row> rows;
    for (int i = first; i <= last && i < 9; ++i)
        rows.push_back(run_world(i, use_curved_body, with_ground, refinement_rounds));
    if (rows.empty()) return 2;
    print_bar(rows, "known: KS", "<= 0.08", [](const Row& r) { return r.known.ks; });
    print_bar(rows, "known: albedo", "<= 0.02", [](const Row& r) { return r.known.albedo; });
    print_bar(rows, "known: half radius", "<= 0.15", [](const Row& r) { return r.known.half; });
    print_bar(rows, "known: self (dB)", ">= 36", [](const Row& r) { return r.known_self; });
    print_bar(rows, "blind: key light (deg)", "<= 5", [](const Row& r) { return r.key; });
    print_bar(rows, "blind: fill, back (deg)", "<= 12", [](const Row& r) { return r.fill; });
    print_bar(rows, "blind: KS", "<= 0.25", [](const Row& r) { return r.blind.ks; });
    print_bar(rows, "blind: channel ratios", "<= 0.05", [](const Row& r) { return r.blind.ratio; });
    print_bar(rows, "blind: self (dB)", ">= 28", [](const Row& r) { return r.self; });
    print_bar(rows, "transfer (dB)", ">= 28", [](const Row& r) { return r.transfer; });
    print_bar(rows, "transfer over Lambert (dB)", ">= 5 in the median",
              [](const Row& r) { return r.above_lambert; });
    return 0;
}
