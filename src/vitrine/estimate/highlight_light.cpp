#include "estimate/highlight_light.h"

#include <algorithm>

namespace vitrine {
namespace {

struct Vote {
    Vec3 direction;
    double weight;
    Rgbd colour;
};

std::vector<Vote> cast_votes(const Highlights& highlights, const Relief& relief) {
    const Image<Vec3f>& normals =
        relief.base_normals.empty() ? relief.normals : relief.base_normals;
    std::vector<Vote> votes;
    for (const HighlightBlob& blob : highlights.blobs) {
        Vec3 sum = Vec3::Zero();
        for (const std::size_t i : blob.pixels) {
            if (highlights.core[i] <= 127) continue;
            if (relief.is_cluster() && relief.ball_of[i] < 0) continue;
            const Vec3 n = normals[i].cast<double>();
            sum += luminance(highlights.residual[i]) * (2 * n.z() * n - Vec3(0, 0, 1));
        }
        if (sum.norm() < 1e-9) continue;
        // A pixel more or less turns the normal by 1 / n_z: at the rim an image says little.
        const Vec3 direction = sum.normalized();
        const double normal_z2 = 0.5 * (1 + direction.z());  // n is half way from v to the lamp
        votes.push_back({direction, blob.weight * normal_z2, blob.colour.cast<double>()});
    }
    return votes;
}

}  // namespace

std::vector<HighlightLight> highlight_lights(const Highlights& highlights, const Relief& relief,
                                             double agree_deg) {
    std::vector<Vote> votes = cast_votes(highlights, relief);
    double total = 0;
    for (const Vote& vote : votes) total += vote.weight;
    const auto agrees = [&](const Vec3& a, const Vec3& b) {
        return angle_between(a, b) < radians(agree_deg);
    };
    std::vector<HighlightLight> lights;
    while (!votes.empty()) {
        // The direction on which most weight agrees, then the mean of those that do.
        std::size_t best = 0;
        double most = -1;
        for (std::size_t i = 0; i < votes.size(); ++i) {
            double weight = 0;
            for (const Vote& other : votes)
                if (agrees(votes[i].direction, other.direction)) weight += other.weight;
            if (weight > most) {
                most = weight;
                best = i;
            }
        }
        const Vec3 centre = votes[best].direction;
        HighlightLight light;
        light.votes = 0;
        Vec3 sum = Vec3::Zero();
        Rgbd colour = Rgbd::Zero();
        std::vector<Vote> rest;
        for (const Vote& vote : votes) {
            if (!agrees(centre, vote.direction)) {
                rest.push_back(vote);
                continue;
            }
            sum += vote.weight * vote.direction;
            colour += vote.weight * vote.colour;
            ++light.votes;
        }
        light.direction = sum.normalized();
        light.intensity = colour / std::max(total, 1e-12);
        lights.push_back(light);
        votes = std::move(rest);
    }
    std::stable_sort(lights.begin(), lights.end(),
                     [](const HighlightLight& a, const HighlightLight& b) {
                         return luminance(a.intensity) > luminance(b.intensity);
                     });
    return lights;
}

}  // namespace vitrine
