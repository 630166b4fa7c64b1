// scene/insertion.h: virtual objects and where they go ("vitrine.insertion/1").
#pragma once

#include "scene/scene.h"

namespace vitrine {

struct Insertion {
    std::vector<Part> objects;        ///< in the world, `is_virtual` set
    std::vector<std::string> frames;  ///< ids; empty: all
};

/// Mesh and material paths are relative to the file.
/// @throws InputError for a missing mesh, unknown keys, a transform that is not finite.
Insertion read_insertion(const std::filesystem::path& path);

}  // namespace vitrine
