#include "render/caustic_maps.h"

namespace vitrine {
namespace {

constexpr float kSoftRadiusFactor = 4.0f;
constexpr float kWideRadiusFactor = 8.0f;
constexpr float kBroadRadiusFactor = 32.0f;
constexpr float kNearFactor = 16.0f;
constexpr float kMergeShare = 0.3f;      // of the gather radius
constexpr float kSecondaryShare = 0.3f;  // of the distance from which they are looked at
/// Share of new photons that a progressive pass keeps: 2/3 shrinks noise and blur at equal rates.
constexpr double kProgressiveShare = 2.0 / 3.0;

}  // namespace

double progressive_radius(double first_m, int pass) {
    double area = first_m * first_m;
    for (int k = 1; k <= pass; ++k) area *= (k + kProgressiveShare) / (k + 1);
    return std::sqrt(area);
}

CausticMaps build_caustic_maps(const std::vector<Photon>& photons, double gather_radius_m) {
    const auto radius = static_cast<float>(gather_radius_m);
    CausticMaps maps;
    const float soft_radius = kSoftRadiusFactor * radius, wide_radius = kWideRadiusFactor * radius;
    std::vector<Photon> sharp = merge_photons(photons, kMergeShare * radius, PhotonChoice::Sharp);
    const std::vector<Photon> soft =
        merge_photons(photons, kMergeShare * soft_radius, PhotonChoice::Soft);
    maps.sharp = PhotonGrid(sharp, radius);
    maps.soft = PhotonGrid(soft, soft_radius);
    sharp.insert(sharp.end(), soft.begin(), soft.end());
    for (Photon& photon : sharp) photon.keeps_direction = false;
    const std::vector<Photon> merged = merge_photons(sharp, kMergeShare * wide_radius);
    maps.wide = PhotonGrid(merged, wide_radius);
    const float broad_radius = kBroadRadiusFactor * radius;
    maps.broad = PhotonGrid(merge_photons(merged, kMergeShare * broad_radius), broad_radius);
    std::vector<double> weights;
    for (const Photon& photon : merge_photons(merged, kSecondaryShare * kNearFactor * radius)) {
        const Rgb flux = photon.power * photon.diffuse_albedo();
        if (!(flux > 0).any()) continue;
        maps.secondary.push_back({photon.position, photon.normal.unpack(), flux, photon.views});
        weights.push_back(luminance(flux));
    }
    if (!weights.empty()) maps.secondary_choice = DiscreteDistribution(weights);
    maps.near_m = kNearFactor * radius;
    return maps;
}

}  // namespace vitrine
