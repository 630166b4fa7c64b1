#include "base/file.h"

#include "base/error.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <system_error>
#include <unistd.h>

namespace vitrine {
namespace fs = std::filesystem;

std::string read_text_file(const fs::path& path) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) {
        throw InputError({path.string(), "a file", "a folder", ""});
    }
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        throw InputError({path.string(), "a readable file", std::strerror(errno), ""});
    }
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_file_atomically(const fs::path& path,
                           const std::function<void(const fs::path&)>& write) {
    // The extension stays last: image writers choose their format by it.
    const fs::path temporary =
        path.parent_path() /
        (path.stem().string() + ".tmp" + std::to_string(::getpid()) + path.extension().string());
    const auto fail = [&](const std::string& why) -> void {
        std::error_code ignored;
        fs::remove(temporary, ignored);
        throw MachineError(fmt::format("cannot write {}: {}", path.string(), why));
    };
    try {
        std::error_code error;
        if (!path.parent_path().empty()) fs::create_directories(path.parent_path(), error);
        if (error) fail(error.message());
        write(temporary);
    } catch (const MachineError&) {
        std::error_code ignored;
        fs::remove(temporary, ignored);
        throw;
    } catch (...) {
        std::error_code ignored;
        fs::remove(temporary, ignored);
        throw;
    }
    const int descriptor = ::open(temporary.c_str(), O_RDONLY);
    if (descriptor < 0) fail(std::strerror(errno));
    const int synced = ::fsync(descriptor);
    const int sync_error = errno;
    ::close(descriptor);
    if (synced != 0) fail(std::strerror(sync_error));
    std::error_code error;
    fs::rename(temporary, path, error);
    if (error) fail(error.message());
}

void write_text_file(const fs::path& path, std::string_view text) {
    write_file_atomically(path, [&](const fs::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out.write(text.data(), static_cast<std::streamsize>(text.size()));
        out.flush();
        if (!out) {
            throw MachineError(
                fmt::format("cannot write {}: {}", path.string(), std::strerror(errno)));
        }
    });
}

std::uint64_t hash_bytes(std::string_view bytes, std::uint64_t start) {
    std::uint64_t hash = start;
    for (const char c : bytes) {
        hash ^= static_cast<unsigned char>(c);
        hash *= 0x100000001b3ULL;
    }
    return hash;
}

std::uint64_t hash_file(const fs::path& path) { return hash_bytes(read_text_file(path)); }

}  // namespace vitrine
