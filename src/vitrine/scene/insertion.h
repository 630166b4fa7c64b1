// scene/insertion.h: virtual objects and where they go ("vitrine.insertion/1").
#pragma once

#include "scene/scene.h"

namespace vitrine {

struct Insertion {
    std::vector<Part> objects;        ///< in the world, `is_virtual` set
    std::vector<std::string> frames;  ///< ids; empty: all
    std::vector<std::string> notes;   ///< what was mapped or repaired, one sentence each
};

/// Mesh and material paths are relative to the file.
/// @throws InputError for a missing mesh, unknown keys, a transform that is not finite, glass that
/// is not closed.
Insertion read_insertion(const std::filesystem::path& path);

}  // namespace vitrine
