// vitrine_estimation_speed CAPTURE [PHOTONS]: estimation mode on the true meshes of a capture.
//
// For each clear object: columns of its caustic for 81 refractive indices (1.2 to 2.0) at all
// pixels of all views that its light can reach, a search around the best with six times the
// photons, and how precisely the index comes out: of pictures that the whole renderer makes of the
// same scene for known indices, and of the capture's own pictures, which another renderer made.
#include "base/parallel.h"
#include "cpu_time.h"
#include "estimate/observations.h"
#include "image/image_io.h"
#include "math/optimise.h"
#include "render/caustics.h"
#include "render/estimation_columns.h"
#include "truth_scene.h"

#include <cstdlib>
#include <memory>

using namespace vitrine;

namespace {

constexpr int kIndexCount = 81;
constexpr double kRadius = 0.002;
constexpr int kFinePhotons = 6;  // times as many as for the 81
constexpr int kFineEvaluations = 8;

struct Model {
    std::vector<Rgb> albedo, background;  // background: direct and bounced light, W/m2
    Rgb intensity = Rgb::Ones();
    Rgb sigma_a = Rgb::Zero();
    float clip = 1.0f;

    Rgb radiance(std::size_t i, const Rgb& column) const {
        return (albedo[i] / kPif * (background[i] + intensity * column)).min(clip);
    }
    double cost(const std::vector<Rgb>& column, const std::vector<Rgb>& observed) const {
        return parallel_sum(column.size(), 4096, 0.0, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) {
                sum += (radiance(i, column[i]) - observed[i]).square().sum();
            }
            return sum;
        });
    }
};

/// Best of the grid of columns, then golden section on columns of more photons.
double best_index(const Model& model, const CausticColumns& fine, const std::vector<double>& iors,
                  const std::vector<std::vector<Rgb>>& grid, const std::vector<Rgb>& observed) {
    std::size_t best = 0;
    std::vector<double> cost;
    for (const std::vector<Rgb>& column : grid) cost.push_back(model.cost(column, observed));
    for (std::size_t n = 1; n < cost.size(); ++n) best = cost[n] < cost[best] ? n : best;
    const double step = iors[1] - iors[0];
    return minimise_golden(
               [&](double ior) { return model.cost(fine.at(ior, model.sigma_a), observed); },
               iors[best] - step, iors[best] + step, kFineEvaluations)
        .x;
}

/// The captures' tables: 1.2 m square around the origin, linear albedo (data/README.md).
class TableAlbedo {
  public:
    explicit TableAlbedo(const std::filesystem::path& capture)
        : image_(read_encoded_rgb(capture / "truth" / "mesh" / "table_albedo.png")) {}
    Rgb at(const Vec3f& p) const {
        constexpr float kSize = 1.2f;
        return bilinear(image_, (p.x() / kSize + 0.5f) * static_cast<float>(image_.width()) - 0.5f,
                        (0.5f - p.y() / kSize) * static_cast<float>(image_.height()) - 0.5f);
    }

  private:
    ImageRgb image_;
};

/// Pixels that see the table itself, whose albedo is known.
ViewReceivers on_table(const ViewReceivers& all) {
    ViewReceivers kept;
    for (std::size_t i = 0; i < all.points.size(); ++i) {
        if (std::abs(all.points[i].position.z()) > 1e-3f) continue;
        kept.points.push_back(all.points[i]);
        kept.camera.push_back(all.camera[i]);
        kept.x.push_back(all.x[i]);
        kept.y.push_back(all.y[i]);
    }
    return kept;
}

/// What the whole renderer, with its own random numbers and all faint branches, puts there.
std::vector<Rgb> rendered_column(const Scene& scene, int part, double ior, const Rgb& sigma_a,
                                 std::span<const SurfacePoint> points) {
    Scene made = scene;
    made.parts[static_cast<std::size_t>(part)].material = Dielectric{ior, sigma_a};
    CausticOptions options;
    options.photon_count = 2'000'000;
    const PhotonGrid photons(trace_caustics(RenderScene(made), options).photons, kRadius);
    std::vector<Rgb> column(points.size());
    parallel_for(points.size(), 256, [&](std::size_t i) {
        Rgb sum = Rgb::Zero();
        photons.gather(points[i].position, points[i].normal,
                       [&](const Photon& photon, float k) { sum += k * photon.power; });
        column[i] = sum;
    });
    return column;
}

void measure(const Scene& scene, const EstimationScene& world, int object, const TrueScene& truth,
             const TrueObject& body, const Capture& capture, const TableAlbedo& table,
             int photon_count) {
    const DiscLight& lamp = truth.lights.front();
    const TrialLight light{lamp.position_m, lamp.normal, lamp.radius_m};
    std::vector<double> iors;
    for (int n = 0; n < kIndexCount; ++n) iors.push_back(1.2 + 0.01 * n);
    const std::uint32_t opaque = kAllMask & ~object_mask(object);

    ViewReceivers receivers;
    std::shared_ptr<const ReceiverGrid> grid;
    std::unique_ptr<CausticColumns> columns, fine;
    DirectColumn direct;
    GatheredLight gathered;
    std::vector<std::vector<Rgb>> trial;
    const Cost found = cost_of([&] {
        receivers = on_table(caustic_receivers(world, object, scene.cameras, light, iors, opaque));
    });
    const std::span<const SurfacePoint> points = receivers.points;
    const Cost prepared =
        cost_of([&] { grid = std::make_shared<const ReceiverGrid>(points, kRadius); });
    const Cost shadow = cost_of(
        [&] { direct = direct_column(world, points, light, 16, opaque, object_mask(object)); });
    const Cost bounced = cost_of([&] {
        gathered = gather_light(
            world, points, 8, 0,
            std::vector<Rgb>(static_cast<std::size_t>(world.object_count()), Rgb::Zero()), 1);
    });
    const Cost trials = cost_of([&] {
        CausticBeamOptions beam;
        beam.photon_count = photon_count;
        columns =
            std::make_unique<CausticColumns>(CausticBeam(world, object, light, opaque, beam), grid);
        trial = columns->at(iors, body.sigma_a_per_m);
    });
    Model model;
    model.intensity = lamp.intensity_w_per_sr;
    model.sigma_a = body.sigma_a_per_m;
    model.clip = static_cast<float>(capture.saturation_level);
    std::vector<Rgb> observed(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        model.albedo.push_back(table.at(points[i].position));
        model.background.push_back(direct.clear[i] * model.intensity + gathered.bounced[i] +
                                   gathered.openness[i] * truth.ambient_radiance);
        observed[i] = capture.frames[static_cast<std::size_t>(receivers.camera[i])]
                          .colour(receivers.x[i], receivers.y[i])
                          .min(model.clip);
    }
    double found_ior = 0;
    const Cost search = cost_of([&] {
        CausticBeamOptions beam;
        beam.photon_count = kFinePhotons * photon_count;
        fine =
            std::make_unique<CausticColumns>(CausticBeam(world, object, light, opaque, beam), grid);
        found_ior = best_index(model, *fine, iors, trial, observed);
    });
    std::printf("%s: %zu pixels of %zu views, %d photons of which %zu meet it\n", body.name.c_str(),
                points.size(), scene.cameras.size(), photon_count, columns->beam().met_count());
    const auto line = [](const char* what, const Cost& cost) {
        std::printf("  %-46s CPU %6.2f s  wall %6.2f s\n", what, cost.cpu_s, cost.wall_s);
    };
    line("pixels found", found);
    line("their cells", prepared);
    line("shadow and direct light, once", shadow);
    line("bounced light, once", bounced);
    line("81 indices", trials);
    line("search around the best, once", search);
    Cost sum;
    for (const Cost& cost : {found, prepared, shadow, bounced, trials, search}) {
        sum.cpu_s += cost.cpu_s;
        sum.wall_s += cost.wall_s;
    }
    line("together", sum);

    for (const double ior : {1.33, 1.45, 1.5, 1.62, 1.75}) {
        const std::vector<Rgb> made =
            rendered_column(scene, world.part_of_object(object), ior, body.sigma_a_per_m, points);
        for (std::size_t i = 0; i < points.size(); ++i) {
            observed[i] = model.radiance(i, made[i] / model.intensity);
        }
        const double best = best_index(model, *fine, iors, trial, observed);
        std::printf("  pictures made by the renderer for %.3f: best index %.4f, error %+.4f\n", ior,
                    best, best - ior);
        std::fflush(stdout);
    }
    std::printf("  the capture's pictures (true %.3f): best index %.4f, error %+.4f\n", body.ior,
                found_ior, found_ior - body.ior);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: vitrine_estimation_speed CAPTURE [PHOTONS]\n");
        return 2;
    }
    try {
        const int photon_count = argc > 2 ? std::atoi(argv[2]) : 60'000;
        const Capture capture = read_capture(argv[1]);
        const TrueScene truth = read_truth(argv[1]);
        Scene scene = make_true_geometry(argv[1], capture);
        for (const DiscLight& light : truth.lights) scene.lights.push_back(light);
        const EstimationScene world(scene);
        const TableAlbedo table(argv[1]);
        for (int k = 0; k < world.object_count(); ++k) {
            const TrueObject& body = truth.objects[static_cast<std::size_t>(k)];
            if (body.object_class != "transparent" || body.is_hollow) continue;
            measure(scene, world, k, truth, body, capture, table, photon_count);
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
