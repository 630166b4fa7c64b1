#include "pipeline/insertion_recipe.h"

#include "base/file.h"
#include "base/json_reader.h"
#include "base/text.h"
#include "capture/read_capture.h"
#include "compose/composite.h"
#include "estimate/estimate_json.h"
#include "estimate/scene_estimate.h"
#include "geometry/mesh_io.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "pipeline/ior_step.h"
#include "pipeline/report.h"
#include "pipeline/scan_files.h"
#include "reconstruct/labelled_scene.h"
#include "scene/scene_json.h"

#include <algorithm>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

/// Hash of what the capture's reader looks at; pictures of truth and insertion files do not count.
std::string hash_capture(const fs::path& folder) {
    std::vector<std::string> files;
    for (const fs::path& file : capture_files(folder)) {
        files.push_back(fs::relative(file, folder).string());
    }
    return hash_files(folder, files);
}

std::string hash_if_given(const fs::path& path) {
    if (path.empty()) return "none";
    if (fs::is_directory(path)) return hash_folder(path);
    return fs::exists(path) ? fmt::format("{:016x}", hash_file(path)) : "missing";
}

/// An insertion is its file, the meshes and materials beside it, and where it goes.
std::string insertion_identity(const InsertionRunOptions& options) {
    std::string text = hash_if_given(options.insertion);
    if (options.at) {
        text += fmt::format(" at {} {} {}", options.at->frame, options.at->pixel.x(),
                            options.at->pixel.y());
    } else if (!options.insertion.empty() && fs::exists(options.insertion)) {
        for (const Part& part : read_insertion(options.insertion).objects) {
            text += " " + hash_if_given(options.insertion.parent_path() / part.mesh_file);
            if (const auto* translucent = std::get_if<Translucent>(&part.material)) {
                text += " " + hash_if_given(options.insertion.parent_path() / translucent->file);
            }
        }
    }
    return text;
}

/// Hulls whose box a mesh of `folder` overlaps give way to that mesh.
void replace_hulls(Candidates& candidates, const fs::path& folder) {
    constexpr double kMinShare = 0.3;  // of the union of the boxes: the same thing, roughly placed
    if (!fs::is_directory(folder)) {
        throw InputError({folder.string(), "a folder of PLY meshes", "no such folder", ""});
    }
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".ply") continue;
        const Mesh mesh = read_ply(entry.path());
        const Box3 box = bounds(mesh);
        for (Candidate& candidate : candidates.objects) {
            const Vec3 low = box.min.cwiseMax(candidate.box.min);
            const Vec3 high = box.max.cwiseMin(candidate.box.max);
            if ((high.array() <= low.array()).any()) continue;
            const double both = (high - low).prod();
            if (both < kMinShare * (box.size().prod() + candidate.box.size().prod() - both))
                continue;
            candidate.hull = mesh;
            if (mesh.normals.empty())
                candidate.hull = with_creased_normals(welded(mesh, 1e-7), 40.0);
            candidate.box = box;
            candidate.evidence +=
                " Its geometry was given (" + entry.path().filename().string() + ").";
        }
    }
}

void add_if_weak(const std::string& what, Outcome outcome, const std::string& reason,
                 std::vector<std::string>& sentences) {
    if (outcome == Outcome::Converged) return;
    sentences.push_back(what + " is " + outcome_name(outcome) +
                        (reason.empty() ? "" : ": " + reason));
}

/// One sentence for each quantity that the data do not hold.
std::vector<std::string> uncertain_quantities(const SceneEstimate& estimate) {
    std::vector<std::string> sentences;
    add_if_weak("the light", estimate.light.outcome, estimate.light.reason, sentences);
    for (const ObjectEstimate& object : estimate.objects) {
        switch (object.object_class) {
            case ObjectClass::Unsure:
                sentences.push_back(object.id + " is neither clearly glass nor clearly metal" +
                                    (object.reason.empty() ? "" : ": " + object.reason));
                break;
            case ObjectClass::Transparent:
                add_if_weak("the refractive index of " + object.id, object.ior.outcome,
                            object.ior.reason, sentences);
                add_if_weak("the absorption of " + object.id, object.sigma_a_per_m.outcome,
                            object.sigma_a_per_m.reason, sentences);
                if (object.is_hollow)
                    add_if_weak("the wall of " + object.id, object.wall_m.outcome,
                                object.wall_m.reason, sentences);
                break;
            case ObjectClass::Specular:
                for (const WardCluster& cluster : object.clusters) {
                    add_if_weak("the gloss of " + object.id, cluster.fit.sigma.outcome,
                                cluster.fit.sigma.reason, sentences);
                }
                break;
            case ObjectClass::Diffuse:
                break;
        }
    }
    return sentences;
}

class InsertionRun {
  public:
    InsertionRun(const fs::path& capture_folder, Workspace& workspace,
                 const InsertionRunOptions& options, const StageProgress& progress)
        : workspace_(workspace),
          options_(options),
          progress_(progress),
          capture_hash_(hash_capture(capture_folder)),
          capture_(read_capture(capture_folder, progress("read"))) {
        result_.warnings = capture_.warnings;
    }

    InsertionRunResult run(InsertionStage last) {
        reconstruct();
        if (last >= InsertionStage::Candidates) candidates();
        if (last >= InsertionStage::Lights) lights();
        if (last >= InsertionStage::Materials) materials();
        if (last >= InsertionStage::Insert && !options_.insertion.empty()) insert();
        if (last >= InsertionStage::Report) {
            write_insertion_report(workspace_.folder(), capture_.name, capture_.warnings);
        }
        return result_;
    }

  private:
    void reconstruct() {
        identity_ = workspace_.run_stage(
            "reconstruct", {capture_hash_, std::to_string(static_cast<int>(options_.poses))},
            [&] {
                ScanOptions scan_options;
                scan_options.poses = options_.poses;
                write_scan(workspace_.path("10_scan"),
                           make_scan(capture_, scan_options, progress_("reconstruct")), capture_);
            },
            [&] { return files_below(workspace_.folder(), "10_scan"); });
        scan_ = read_scan(workspace_.path("10_scan"), capture_);
        capture_ = frames_of_scan(std::move(capture_), scan_);
        for (const std::string& id : scan_.dropped) {
            result_.warnings.push_back("frame " + id + " dropped: its pose could not be found");
        }
    }

    void candidates() {
        const fs::path edits = workspace_.path("edits");
        identity_ = workspace_.run_stage(
            "candidates", {identity_, hash_if_given(options_.geometry), hash_if_given(edits)},
            [&] {
                CandidateOptions candidate_options;
                candidate_options.edited_silhouettes =
                    read_edited_silhouettes(edits / "silhouettes", capture_);
                candidate_options.boxes = read_edited_boxes(edits / "boxes.json", capture_, scan_);
                Candidates found =
                    find_candidates(capture_, scan_, candidate_options, progress_("candidates"));
                if (!options_.geometry.empty()) replace_hulls(found, options_.geometry);
                write_candidates(workspace_.path("20_candidates"), found, capture_);
            },
            [&] { return files_below(workspace_.folder(), "20_candidates"); });
        const Candidates found = read_candidates(workspace_.path("20_candidates"), capture_);
        if (static_cast<int>(capture_.frames.size()) < CandidateOptions().min_views) {
            result_.uncertain.insert(result_.uncertain.end(), found.notes.begin(),
                                     found.notes.end());
        }
        scene_ = build_scene(scan_, found);
    }

    EstimateOptions estimate_options() const {
        EstimateOptions estimate;
        estimate.method = options_.method;
        estimate.paper = options_.paper;
        estimate.materials.specular.is_certified = options_.certificate;
        estimate.lambertian = options_.lambertian;
        estimate.seed = options_.seed;
        if (!options_.overrides.empty()) estimate.overrides = read_overrides(options_.overrides);
        return estimate;
    }

    /// Photon counts only matter to the methods that use them.
    std::string method_identity() const {
        std::string identity = method_name(options_.method);
        if (options_.method != EstimateMethod::Default)
            identity += fmt::format(" {} {}", options_.paper.lights.photon_count,
                                    options_.paper.caustic_photon_count);
        return identity;
    }

    void lights() {
        identity_ = workspace_.run_stage(
            "lights",
            {identity_, hash_if_given(options_.overrides), std::to_string(options_.seed),
             method_identity()},
            [&] {
                SceneEstimate first;
                first.light =
                    estimate_first_light(scene_, capture_, estimate_options(), progress_("lights"));
                first.method = options_.method;
                write_estimate(workspace_.path("30_lights.json"), first);
            },
            [] { return std::vector<std::string>{"30_lights.json"}; });
    }

    /// 40_materials.json: what each part is made of, in the form that scene files take.
    static void write_materials(const fs::path& path, const Scene& scene) {
        Json json;
        json["schema"] = "vitrine.materials/1";
        json["parts"] = Json::array();
        for (const Part& part : scene.parts) {
            json["parts"].push_back({{"name", part.name}, {"material", to_json(part.material)}});
        }
        write_json_file(path, json);
    }

    /// Where lambda varies the indices lie that far apart; else one step does.
    void set_ior_step(EstimateOptions& options) const {
        if (options_.ior_step.empty()) return;
        const IorStep step = read_ior_step(options_.ior_step);
        TransparentOptions& glass = options.materials.transparent;
        if (step.local.empty()) {
            glass.ior_step = step.value;
            options.paper.ior_step = step.value;
        } else {
            glass.ior_grid = ior_samples(step, glass.ior_min, glass.ior_max);
        }
    }

    void materials() {
        identity_ = workspace_.run_stage(
            "materials",
            {identity_, options_.lambertian ? "lambertian" : "full",
             options_.certificate ? "certified" : "fast", options_.ior_step,
             options_.ior_step.empty() ? "none" : hash_if_given(options_.ior_step)},
            [&] {
                EstimateOptions options = estimate_options();
                set_ior_step(options);
                options.first_light = read_estimate(workspace_.path("30_lights.json")).light;
                SceneEstimate estimate =
                    estimate_scene(scene_, capture_, options, progress_("materials"));
                for (ObjectEstimate& object : estimate.objects) {
                    object.mesh_file = "20_candidates/" + object.id + ".ply";
                }
                write_estimate(workspace_.path("estimate.json"), estimate);
                const Scene measured = apply(scene_, estimate);
                write_materials(workspace_.path("40_materials.json"), measured);
                write_scene(workspace_.path("40_scene/scene.json"), measured);
            },
            [&] {
                std::vector<std::string> files = files_below(workspace_.folder(), "40_scene");
                files.insert(files.end(), {"40_materials.json", "estimate.json"});
                return files;
            });
        for (std::string& sentence :
             uncertain_quantities(read_estimate(workspace_.path("estimate.json")))) {
            result_.uncertain.push_back(std::move(sentence));
        }
    }

    void insert() {
        identity_ = workspace_.run_stage(
            "insert",
            {identity_, insertion_identity(options_),
             std::to_string(static_cast<int>(options_.quality)),
             std::to_string(options_.photon_count), std::to_string(options_.seed)},
            [&] { render_insertion(); },
            [&] {
                std::vector<std::string> files = files_below(workspace_.folder(), "50_insert");
                for (const std::string& file : files_below(workspace_.folder(), "60_composite")) {
                    files.push_back(file);
                }
                return files;
            });
        for (const std::string& file : files_below(workspace_.folder(), "60_composite")) {
            if (file.ends_with(".png") && !file.ends_with("_plate.png")) {
                result_.pictures.push_back(workspace_.path(file));
            }
        }
    }

    void render_insertion() {
        const Scene labelled = scene_;
        Insertion insertion;
        if (options_.at) {
            insertion = place_on_surface(options_.insertion, *options_.at, labelled,
                                         scan_.support_plane.normal);
        } else {
            insertion = read_insertion(options_.insertion);
        }
        for (const std::string& note : insertion.notes) result_.warnings.push_back(note);
        std::vector<std::size_t> frames;
        if (insertion.frames.empty()) {
            for (std::size_t i = 0; i < capture_.frames.size(); ++i) frames.push_back(i);
        }
        for (const std::string& id : insertion.frames) frames.push_back(frame_index(id));

        const Scene real = read_scene(workspace_.path("40_scene/scene.json"));
        DifferentialOptions render;
        if (options_.quality == RenderQuality::Preview) render = preview_options();
        render.seed = options_.seed;
        if (options_.photon_count > 0) render.photon_count = options_.photon_count;
        std::vector<Camera> cameras;
        for (const std::size_t i : frames) cameras.push_back(labelled.cameras[i]);
        const Progress progress = progress_("insert");
        const DifferentialRenderer renderer(real, insertion.objects, cameras, render,
                                            progress.part(0.0, 0.2));
        fs::remove_all(workspace_.path("50_insert"));
        fs::remove_all(workspace_.path("60_composite"));
        Json list = Json::array();
        for (std::size_t k = 0; k < frames.size(); ++k) {
            const double begin =
                0.2 + 0.8 * static_cast<double>(k) / static_cast<double>(frames.size());
            const double end =
                0.2 + 0.8 * static_cast<double>(k + 1) / static_cast<double>(frames.size());
            const RgbdFrame& frame = capture_.frames[frames[k]];
            write_frame(frame, cameras[k], renderer.render(cameras[k], progress.part(begin, end)));
            list.push_back({{"id", frame.id}, {"camera", to_json(cameras[k])}});
        }
        write_json_file(workspace_.path("60_composite/frames.json"), Json({{"frames", list}}));
    }

    void write_frame(const RgbdFrame& frame, const Camera& camera, const DifferentialImage& image) {
        ExrWriteOptions whole;
        whole.half = false;
        write_exr(workspace_.path("50_insert/" + frame.id + "_with.exr"), image.with, whole);
        write_exr(workspace_.path("50_insert/" + frame.id + "_without.exr"), image.without, whole);
        const ImageRgb picture = composite(frame.colour, image);
        const double white = capture_.saturation_level < 1e20 ? capture_.saturation_level : 1.0;
        const std::string base = "60_composite/" + frame.id;
        write_composite_exr(workspace_.path(base + ".exr"), frame.colour, image, camera,
                            {.seed = options_.seed});
        write_composite_png(workspace_.path(base + ".png"), picture, white);
        write_composite_png(workspace_.path(base + "_plate.png"), frame.colour, white);
    }

    std::size_t frame_index(const std::string& id) const {
        std::vector<std::string> ids;
        for (std::size_t i = 0; i < capture_.frames.size(); ++i) {
            if (capture_.frames[i].id == id) return i;
            ids.push_back(capture_.frames[i].id);
        }
        throw InputError({options_.insertion.string(),
                          "frames of the capture (" + join(ids, " ") + ")", "\"" + id + "\"", ""});
    }

    Workspace& workspace_;
    InsertionRunOptions options_;
    StageProgress progress_;
    std::string capture_hash_;
    Capture capture_;  ///< from the first stage on, as the scan knows it
    Scan scan_;
    Scene scene_;  ///< labelled, as the candidates leave it
    std::string identity_;
    InsertionRunResult result_;
};

}  // namespace

InsertionRunResult run_insertion(const fs::path& capture_folder, Workspace& workspace,
                                 const InsertionRunOptions& options, InsertionStage last,
                                 const StageProgress& progress) {
    return InsertionRun(capture_folder, workspace, options, progress).run(last);
}

}  // namespace vitrine
