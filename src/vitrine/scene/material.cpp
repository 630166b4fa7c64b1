#include "scene/material.h"

namespace vitrine {

std::string kind_name(const Material& material) {
    static const char* const names[] = {"diffuse", "ward", "mirror", "dielectric", "translucent"};
    return names[material.index()];
}

}  // namespace vitrine
