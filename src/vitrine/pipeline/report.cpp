#include "pipeline/report.h"

#include "base/error.h"
#include "base/file.h"

namespace vitrine {
namespace {

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--line:#8884;--soft:#8881;--accent:#2a7fb8}
body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.6rem;margin-bottom:.2rem}h2{font-size:1.15rem;margin-top:2.2rem}
table{border-collapse:collapse;width:100%}td,th{border-bottom:1px solid var(--line);
padding:.3rem .7rem .3rem 0;text-align:left;vertical-align:top}th{font-weight:600}
td.number{font-variant-numeric:tabular-nums;white-space:nowrap}
.compare{position:relative;width:fit-content;max-width:100%;user-select:none;overflow:hidden}
.compare img{display:block;max-width:100%}.compare .after{position:absolute;inset:0;
clip-path:inset(0 0 0 var(--cut,50%))}.compare input{position:absolute;inset:auto 0 0 0;width:100%;
margin:0;opacity:.85}.compare .rule{position:absolute;top:0;bottom:0;left:var(--cut,50%);width:2px;
background:#fffc;pointer-events:none}
figure{margin:1rem 0}figcaption{font-size:.85rem;opacity:.75}.note{background:var(--soft);
border-left:3px solid var(--accent);padding:.4rem .8rem;margin:.5rem 0}
.bad{color:#b3541e}.good{color:#2d7d46})";

constexpr const char* kScript = R"(
document.querySelectorAll('.compare input').forEach(function(slider){
slider.addEventListener('input',function(){
slider.parentElement.style.setProperty('--cut',slider.value+'%')})}))";

}  // namespace

std::string base64(const std::string& bytes) {
    static const char* const digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned group = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            group =
                group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            text += i + k <= bytes.size() ? digits[group >> (18 - 6 * k) & 63u] : '=';
        }
    }
    return text;
}

std::string escape_html(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        switch (c) {
            case '<':
                safe += "&lt;";
                break;
            case '>':
                safe += "&gt;";
                break;
            case '&':
                safe += "&amp;";
                break;
            case '"':
                safe += "&quot;";
                break;
            default:
                safe += c;
        }
    }
    return safe;
}

std::string png_data_url(const std::filesystem::path& path) {
    return "data:image/png;base64," + base64(read_text_file(path));
}

std::string comparison_html(const std::string& id, const ReportPicture& picture) {
    return fmt::format(
        "<figure><div class=\"compare\" id=\"{}\"><img src=\"{}\" alt=\"before\">"
        "<img class=\"after\" src=\"{}\" alt=\"after\"><div class=\"rule\"></div>"
        "<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"before and after\">"
        "</div><figcaption>{}</figcaption></figure>\n",
        escape_html(id), png_data_url(picture.before_png), png_data_url(picture.after_png),
        escape_html(picture.title));
}

std::string html_page(const std::string& title, const std::string& body) {
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
        "<title>{}</title><style>{}</style></head>\n<body>\n{}<script>{}</script></body></html>\n",
        escape_html(title), kStyle, body, kScript);
}

}  // namespace vitrine
