#include "image/image_io.h"

#include <jpeglib.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

namespace vitrine {
namespace {

struct JpegFailure {
    jpeg_error_mgr manager;  // first: libjpeg hands back a pointer to it
    std::jmp_buf escape;
    char message[JMSG_LENGTH_MAX] = "";
};

void on_error(j_common_ptr info) {
    auto* failure = reinterpret_cast<JpegFailure*>(info->err);
    (*info->err->format_message)(info, failure->message);
    std::longjmp(failure->escape, 1);
}

/// libjpeg only warns of a truncated file and paints the rest grey; for us it is an error.
void on_message(j_common_ptr info, int level) {
    if (level < 0) on_error(info);
}

}  // namespace

RasterImage read_jpeg(const std::filesystem::path& path) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                               &std::fclose);
    if (!file) throw InputError({path.string(), "a readable JPEG", std::strerror(errno), ""});
    jpeg_decompress_struct info{};
    JpegFailure failure;
    info.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = on_error;
    failure.manager.emit_message = on_message;
    RasterImage image;
    std::vector<JSAMPLE> row;
    if (setjmp(failure.escape)) {
        jpeg_destroy_decompress(&info);
        throw InputError({path.string(), "a whole JPEG", failure.message, ""});
    }
    jpeg_create_decompress(&info);
    jpeg_stdio_src(&info, file.get());
    jpeg_read_header(&info, TRUE);
    if (info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK) {
        jpeg_destroy_decompress(&info);
        throw InputError({path.string(), "an RGB or grey JPEG", "CMYK",
                          "Convert it to sRGB first, for example in GIMP."});
    }
    const std::int64_t pixels = static_cast<std::int64_t>(info.image_width) * info.image_height;
    if (pixels > kMaxPixels) {
        jpeg_destroy_decompress(&info);
        throw InputError({path.string(), fmt::format("at most {} megapixels", kMaxPixels >> 20),
                          fmt::format("{} x {}", info.image_width, info.image_height), ""});
    }
    info.dct_method = JDCT_ISLOW;
    jpeg_start_decompress(&info);
    image.width = static_cast<int>(info.output_width);
    image.height = static_cast<int>(info.output_height);
    image.channels = info.output_components;
    row.resize(info.output_width * static_cast<std::size_t>(info.output_components));
    image.codes.reserve(row.size() * info.output_height);
    while (info.output_scanline < info.output_height) {
        JSAMPROW pointer = row.data();
        jpeg_read_scanlines(&info, &pointer, 1);
        image.codes.insert(image.codes.end(), row.begin(), row.end());
    }
    jpeg_finish_decompress(&info);
    jpeg_destroy_decompress(&info);
    return image;
}

}  // namespace vitrine
