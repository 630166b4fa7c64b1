#include "base/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace vitrine {
namespace {

spdlog::logger& logger() {
    static std::shared_ptr<spdlog::logger> instance = [] {
        auto created = spdlog::stderr_color_mt("vitrine");
        created->set_pattern("%^%l%$: %v");
        created->set_level(spdlog::level::warn);
        return created;
    }();
    return *instance;
}

}  // namespace

void set_log_level(LogLevel level) {
    switch (level) {
        case LogLevel::Quiet:
            logger().set_level(spdlog::level::err);
            break;
        case LogLevel::Warning:
            logger().set_level(spdlog::level::warn);
            break;
        case LogLevel::Info:
            logger().set_level(spdlog::level::info);
            break;
        case LogLevel::Debug:
            logger().set_level(spdlog::level::debug);
            break;
    }
}

void log_line(LogLevel level, const std::string& text) {
    switch (level) {
        case LogLevel::Quiet:
            break;
        case LogLevel::Warning:
            logger().warn("{}", text);
            break;
        case LogLevel::Info:
            logger().info("{}", text);
            break;
        case LogLevel::Debug:
            logger().debug("{}", text);
            break;
    }
}

}  // namespace vitrine
