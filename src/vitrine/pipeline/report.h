// pipeline/report.h: one self-contained HTML page about a run: pictures with a slider, the light
// drawn over the scene, the estimates with their doubt.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

struct ReportPicture {
    std::string title;
    std::filesystem::path before_png, after_png;
};

/// Bytes as base64 (RFC 4648).
std::string base64(const std::string& bytes);
std::string escape_html(const std::string& text);
/// A picture as a data: URL.
std::string png_data_url(const std::filesystem::path& path);
/// Two pictures of one size with a slider between them; `id` is unique in the page.
std::string comparison_html(const std::string& id, const ReportPicture& picture);
/// The page around `body`, with our style sheet and the slider's script; opens from disk.
std::string html_page(const std::string& title, const std::string& body);

/// Writes report.html of an insertion run from the files of its workspace.
void write_insertion_report(const std::filesystem::path& workspace, const std::string& capture_name,
                            const std::vector<std::string>& warnings);

}  // namespace vitrine
