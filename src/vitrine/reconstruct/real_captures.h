// reconstruct/real_captures.h: pictures of real sensors as capture folders (TUM layout), for tests
// and benchmarks. They are not part of the project: the folder is named by VITRINE_REAL_DATA.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace vitrine {

/// VITRINE_REAL_DATA if it is set and holds a folder `name`.
std::optional<std::filesystem::path> real_data(const std::string& name);

/// 15 calibrated views of one shelf (RealSense F200): depth codes are rotated by 3 bits, 0.1 mm.
void convert_shelf(const std::filesystem::path& from, const std::filesystem::path& to);

/// One view of a desk with a glass and a plastic cup (Kinect v1).
void convert_kinect_glasses(const std::filesystem::path& from, const std::filesystem::path& to);

/// One view (RealSense D435) of `scene` ("000000080"), `kind` "transparent" or "opaque".
void convert_d435(const std::filesystem::path& from, const std::string& scene,
                  const std::string& kind, const std::filesystem::path& to);

/// One view with glasses on a counter; depth in millimetres.
void convert_single_view(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace vitrine
