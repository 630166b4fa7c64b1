// apps/web/page_assets.h: the files of the page, compiled in.
#pragma once

#include <string_view>
#include <vector>

namespace vitrine::web {

struct PageAsset {
    const char* path;
    const char* type;
    std::string_view text;
};

std::vector<PageAsset> page_assets();

}  // namespace vitrine::web
