#include "scene/light.h"

namespace vitrine {

std::string kind_name(const Light& light) {
    static const char* const names[] = {"point", "disc", "spot", "directional", "environment"};
    return names[light.index()];
}

}  // namespace vitrine
