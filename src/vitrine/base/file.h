// base/file.h: whole files in, whole files out; a reader never sees half of one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace vitrine {

/// @throws InputError when the file is missing or unreadable.
std::string read_text_file(const std::filesystem::path& path);

/// Writes `path` through a temporary sibling: `write(temporary)` fills it, then it is synced and
/// renamed over `path`. On failure the temporary is removed and an earlier `path` stays as it was.
/// @throws MachineError naming the path when the disk refuses.
void write_file_atomically(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path&)>& write);

void write_text_file(const std::filesystem::path& path, std::string_view text);

/// FNV-1a of the file's bytes, to notice a changed input. Not for security.
std::uint64_t hash_file(const std::filesystem::path& path);
std::uint64_t hash_bytes(std::string_view bytes, std::uint64_t start = 0xcbf29ce484222325ULL);

}  // namespace vitrine
