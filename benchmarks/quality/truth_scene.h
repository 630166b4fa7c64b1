// benchmarks/quality/truth_scene.h: what is true of a made capture, for measuring estimates.
#pragma once

#include "capture/capture.h"
#include "scene/scene.h"

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

struct TrueObject {
    std::string name, object_class;
    Vec3 centroid = Vec3::Zero();
    bool is_hollow = false;
    double wall_m = 0.0;  ///< of a hollow one
    double ior = 0.0;
    Rgb sigma_a_per_m = Rgb::Zero();
    Rgb rho_d = Rgb::Zero(), rho_s = Rgb::Zero();
    double sigma = 0.0;
    std::string mesh;
};

struct TrueScene {
    Vec3 reference_point_m = Vec3::Zero();
    std::vector<DiscLight> lights;
    Rgb ambient_radiance = Rgb::Zero();
    std::vector<TrueObject> objects;  ///< the glass and metal ones only
};

TrueScene read_truth(const std::filesystem::path& capture_folder);

/// The labelled scene as reconstruction would make it, from the true meshes: diffuse ones merged to
/// "scan" with observed radiance at the vertices, glass and metal as "object_k".
Scene make_true_geometry(const std::filesystem::path& capture_folder, const Capture& capture);

/// Reconstructed geometry with found candidates, kept under `cache` for the next run.
Scene cached_reconstruction(const Capture& capture, const std::filesystem::path& cache);

}  // namespace vitrine
