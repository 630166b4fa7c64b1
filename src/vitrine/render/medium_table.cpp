#include "render/medium_table.h"

namespace vitrine {

std::uint32_t MediumTable::number_of(const Media& media) {
    const auto known = std::find_if(media_.begin(), media_.end(),
                                    [&](const Medium& m) { return m.media == media; });
    const auto number = static_cast<std::uint32_t>(known - media_.begin());
    if (known != media_.end()) return number;
    const Dielectric* glass = scene_.dielectric(media.current());
    const bool absorbs = glass && !(glass->sigma_a_per_m == 0).all();
    media_.push_back({media, absorbs, std::vector<Crossing>(2 * scene_.scene().parts.size())});
    return number;
}

MediumTable::Crossing MediumTable::find(std::uint32_t medium, int part, bool is_front) {
    const Boundary boundary = cross_boundary(scene_, part, is_front, media_[medium].media);
    const Crossing crossing{number_of(boundary.beyond), boundary.eta};
    media_[medium].crossings[2 * static_cast<std::size_t>(part) + (is_front ? 1 : 0)] = crossing;
    return crossing;
}

}  // namespace vitrine
