// Light errors of the default method, the published joint optimisation and its two baselines, on
// captures of known truth and on worlds we make:
//   vitrine_method_quality [--scan CACHE] [--worlds N] [--first SEED] [--ours FILE.jsonl]...
//                          [--light-photons N] [--caustic-photons N] [CAPTURE...]
// The worlds are those of vitrine_estimation_worlds; with --ours the default method's lights are
// taken from the results it wrote instead of being estimated again.
// Where metal was found, also what its highlights add to the light (estimate/joint_light.h).
// Photons of the full emission (8 million into the half space) are timed and extrapolated.
#include "base/timer.h"
#include "estimate/grid_lights.h"
#include "estimate/scene_estimate.h"
#include "math/statistics.h"
#include "render/hemisphere_photons.h"
#include "truth_scene.h"
#include "world_errors.h"
#include "world_series.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>

using namespace vitrine;

namespace {

/// One scene with its truth.
struct Case {
    std::string name;
    Scene scene;
    Capture capture;
    std::vector<DiscLight> lights;
    Vec3 reference = Vec3::Zero();
};

struct Error {
    double direction_deg = 0.0, elevation_deg = 0.0;
};

struct Cost {
    double wall_s = 0.0, cpu_s = 0.0;
};

double elevation(const Vec3& d) { return degrees(std::asin(d.normalized().z())); }

/// Mean over the true lights of the error of the nearest estimated one.
Error error_of(const Case& c, const std::vector<Vec3>& positions) {
    Error error;
    for (const DiscLight& light : c.lights) {
        const Vec3 t = light.position_m - c.reference;
        Error least{180.0, 90.0};
        for (const Vec3& position : positions) {
            const Vec3 d = position - c.reference;
            const double angle = degrees(angle_between(d, t));
            if (angle < least.direction_deg) least = {angle, std::abs(elevation(d) - elevation(t))};
        }
        error.direction_deg += least.direction_deg / static_cast<double>(c.lights.size());
        error.elevation_deg += least.elevation_deg / static_cast<double>(c.lights.size());
    }
    return error;
}

std::vector<Vec3> positions_of(const LightEstimate& light) {
    std::vector<Vec3> positions;
    for (const FittedLight& fitted : light.lights) positions.push_back(fitted.light.position_m);
    return positions;
}

/// Wall and processor seconds.
struct Clock {
    Timer timer;
    std::clock_t start = std::clock();
    Cost cost() const {
        return {timer.seconds(),
                static_cast<double>(std::clock() - start) / static_cast<double>(CLOCKS_PER_SEC)};
    }
};

struct Table {
    std::vector<std::string> order;
    std::map<std::string, std::vector<double>> direction, elevation, wall, cpu;

    void add(const std::string& row, const Error& error, const Cost& cost) {
        if (!direction.contains(row)) order.push_back(row);
        direction[row].push_back(error.direction_deg);
        elevation[row].push_back(error.elevation_deg);
        wall[row].push_back(cost.wall_s);
        cpu[row].push_back(cost.cpu_s);
    }
    void print(const std::string& title) const {
        fmt::print("\n{}, {} scenes\n", title, direction.at(order[0]).size());
        fmt::print(
            "| method | direction, deg: mean +- sd | median | 90 % | elevation, deg: mean +- "
            "sd | seconds, wall | processor |\n|---|---|---|---|---|---|---|\n");
        for (const std::string& row : order) {
            const auto& d = direction.at(row);
            const auto& e = elevation.at(row);
            fmt::print(
                "| {} | {:.2f} +- {:.2f} | {:.2f} | {:.2f} | {:.2f} +- {:.2f} | {:.1f} | "
                "{:.1f} |\n",
                row, mean(d), d.size() > 1 ? standard_deviation(d) : 0.0, median(d),
                quantile(d, 0.9), mean(e), e.size() > 1 ? standard_deviation(e) : 0.0,
                mean(wall.at(row)), mean(cpu.at(row)));
        }
        if (!direction.contains("default")) return;
        fmt::print("ours over the nearest grid light: {:.2f} (direction), {:.2f} (elevation)\n",
                   mean(direction.at("default")) / mean(direction.at("nearest of the grid")),
                   mean(elevation.at("default")) / mean(elevation.at("nearest of the grid")));
    }
};

/// The default method, added to the table.
SceneEstimate measure_ours(const Case& c, Table& table) {
    const Clock clock;
    const SceneEstimate ours = estimate_scene(c.scene, c.capture, {});
    table.add("default", error_of(c, positions_of(ours.light)), clock.cost());
    table.add("best scored of the grid",
              error_of(c, {ours.light.reference_point_m + ours.light.grid_direction}), {});
    fmt::print("{}, default, seconds:", c.name);
    for (const auto& [part, seconds] : ours.seconds) fmt::print(" {} {:.1f}", part, seconds);
    fmt::print("\n");
    return ours;
}

/// The published methods. The paper's first step is the inverse-photon baseline: its photon maps
/// are made once.
void measure_published(const Case& c, const PaperOptions& paper, Table& table) {
    EstimateOptions options;
    options.paper = paper;
    const LightOptions light = first_light_options(c.capture, options);
    const auto grid = [&](GridLightModel model, const std::string& row) {
        GridLightOptions grid_options = paper.lights;
        grid_options.model = model;
        const Clock clock;
        GridLightEstimate found = estimate_grid_lights(
            c.scene, c.capture.frames, c.capture.saturation_level, light, grid_options);
        const Cost cost = clock.cost();
        table.add(row, error_of(c, positions_of(found.light)), cost);
        table.add(row + ", weighted mean",
                  error_of(c, {found.light.reference_point_m + found.mean_direction}), cost);
        return std::pair(found, cost);
    };
    const auto [local, local_cost] = grid(GridLightModel::Local, "local");
    const auto [photon, photon_cost] = grid(GridLightModel::Photons, "inverse-photon");

    options.method = EstimateMethod::Paper;
    options.first_light = photon.light;
    const Clock clock;
    const SceneEstimate published = estimate_scene(c.scene, c.capture, options);
    const Cost joint = clock.cost();
    table.add("paper", error_of(c, positions_of(published.light)),
              {joint.wall_s + photon_cost.wall_s, joint.cpu_s + photon_cost.cpu_s});
    table.add("nearest of the grid", error_of(c, local.positions_m), {});

    fmt::print("{}:", c.name);
    for (const std::string& row : table.order)
        fmt::print(" {} {:.2f}", row, table.direction.at(row).back());
    for (const ObjectEstimate& o : published.objects)
        fmt::print("; paper: {} {} (margin {:+.2f}) n {:.3f} sigma {:.3f}", o.id,
                   class_name(o.object_class), o.class_margin, o.ior.value,
                   o.clusters.empty() ? 0.0 : o.clusters.front().fit.sigma.value);
    fmt::print("\n  paper, seconds:");
    for (const auto& [part, seconds] : published.seconds) fmt::print(" {} {:.1f}", part, seconds);
    fmt::print("\n");
    std::fflush(stdout);
}

/// What highlights bring: the default's light moved by them, from the same start.
void measure_joint(const Case& c, const SceneEstimate& ours, Table& table) {
    LightOptions light = first_light_options(c.capture, {});
    bool has_metal = false;
    for (const ObjectEstimate& object : ours.objects) {
        light.object_classes.push_back(object.object_class);
        has_metal |= object.object_class == ObjectClass::Specular;
    }
    if (!has_metal) return;
    fmt::print("  highlights:");
    for (const auto& [mode, row] : {std::pair(JointMode::Separate, "shading and shadows"),
                                    std::pair(JointMode::Likelihoods, "with highlights"),
                                    std::pair(JointMode::HighlightsFirst, "highlights first")}) {
        JointOptions options;
        options.mode = mode;
        JointReport report;
        std::vector<ObjectEstimate> objects = ours.objects;
        const Clock clock;
        const LightEstimate moved =
            refine_light_jointly(c.scene, c.capture.frames, c.capture.saturation_level, ours.light,
                                 light, {}, options, objects, &report);
        const Error error = error_of(c, positions_of(moved));
        table.add(row, error, clock.cost());
        fmt::print(" {} {:.2f} deg (object cost {:.4f} to {:.4f})", row, error.direction_deg,
                   report.object_cost_before, report.object_cost_after);
    }
    fmt::print("\n");
    std::fflush(stdout);
}

/// What the paper's 8 million photons of one image cost when none is spared.
void time_full_emission(const Case& c) {
    constexpr int kPart = 1'000'000;
    const EstimationScene world(c.scene);
    HemispherePhotonOptions options;
    options.photon_count = kPart;
    const Clock clock;
    const std::size_t hits =
        trace_hemisphere_photons(world, c.lights[0].position_m, c.lights[0].normal, options).size();
    const double seconds = clock.cost().cpu_s;
    fmt::print(
        "full emission: {} photons, {} hits in {:.2f} processor seconds; 8 million for 9 "
        "places and 81 indices: {:.1f} hours (extrapolated)\n",
        kPart, hits, seconds, seconds * 8 * 9 * 81 / 3600);
}

Case read_case(const std::filesystem::path& folder, const std::filesystem::path& cache) {
    Case c;
    c.capture = read_capture(folder);
    c.name = c.capture.name;
    const TrueScene truth = read_truth(folder);
    c.lights = truth.lights;
    c.reference = truth.reference_point_m;
    c.scene = cache.empty() ? make_true_geometry(folder, c.capture)
                            : cached_reconstruction(c.capture, cache);
    return c;
}

Case make_case(std::uint64_t seed) {
    World world = make_world(series_world(seed));
    return {world.capture.name, std::move(world.labelled), std::move(world.capture), world.lights,
            Vec3::Zero()};
}

}  // namespace

int main(int argc, char** argv) {
    std::filesystem::path cache;
    PaperOptions paper;
    std::uint64_t worlds = 0, first = 1000;
    std::map<std::uint64_t, WorldErrors> ours;
    std::vector<std::filesystem::path> folders;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const auto number = [&] { return std::atof(argv[++i]); };
        if (word == "--scan") {
            cache = argv[++i];
        } else if (word == "--worlds") {
            worlds = static_cast<std::uint64_t>(number());
        } else if (word == "--first") {
            first = static_cast<std::uint64_t>(number());
        } else if (word == "--ours") {
            for (WorldErrors& known : read_world_errors(argv[++i]))
                ours.insert_or_assign(known.seed, std::move(known));
        } else if (word == "--light-photons") {
            paper.lights.photon_count = static_cast<int>(number());
        } else if (word == "--caustic-photons") {
            paper.caustic_photon_count = number();
        } else {
            folders.emplace_back(word);
        }
    }
    Table captures, made, joint;
    for (const std::filesystem::path& folder : folders) {
        const Case c = read_case(folder, cache);
        if (captures.order.empty()) time_full_emission(c);
        const SceneEstimate estimate = measure_ours(c, captures);
        measure_published(c, paper, captures);
        measure_joint(c, estimate, joint);
    }
    for (std::uint64_t seed = first; seed < first + worlds; ++seed) {
        const Case c = make_case(seed);
        if (const auto known = ours.find(seed); known != ours.end()) {
            const WorldErrors& e = known->second;
            made.add("default", {e.light_direction_deg, e.light_elevation_deg},
                     {0.0, e.estimate_cpu_seconds});
        } else {
            measure_joint(c, measure_ours(c, made), joint);
        }
        measure_published(c, paper, made);
    }
    if (!captures.order.empty())
        captures.print(cache.empty() ? "Captures, true geometry" : "Captures, reconstructed");
    if (!made.order.empty()) made.print("Made worlds");
    if (!joint.order.empty()) joint.print("Light and metal together, scenes with metal");
}
