// base/log.h: log lines to stderr. Results never go through here.
#pragma once

#include <fmt/format.h>

#include <string>

namespace vitrine {

enum class LogLevel { Quiet, Warning, Info, Debug };

/// Sets what is shown on stderr; the default is Warning, so the library is silent when all is well.
void set_log_level(LogLevel level);

void log_line(LogLevel level, const std::string& text);

template <typename... Args>
void log_info(fmt::format_string<Args...> text, Args&&... args) {
    log_line(LogLevel::Info, fmt::format(text, std::forward<Args>(args)...));
}
template <typename... Args>
void log_warning(fmt::format_string<Args...> text, Args&&... args) {
    log_line(LogLevel::Warning, fmt::format(text, std::forward<Args>(args)...));
}
template <typename... Args>
void log_debug(fmt::format_string<Args...> text, Args&&... args) {
    log_line(LogLevel::Debug, fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace vitrine
