// geometry/mesh_io.h: PLY (ASCII and binary little-endian) and OBJ, metres.
#pragma once

#include "geometry/mesh.h"

#include <filesystem>

namespace vitrine {

/// Reads positions, normals, uv, colours (8-bit sRGB or float linear) and polygons (split to fans).
/// @throws InputError for damaged files, indices out of range, or counts beyond the file's size.
Mesh read_ply(const std::filesystem::path& path);
/// Reads `v vt vn f o g`; materials are left to the scene file.
Mesh read_obj(const std::filesystem::path& path);
Mesh read_mesh(const std::filesystem::path& path);  ///< by extension: .ply, .obj

/// Binary little-endian; colours as float "red green blue" so that albedo keeps its precision.
void write_ply(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace vitrine
