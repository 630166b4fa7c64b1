#include "base/error.h"

namespace vitrine {
namespace {

std::string sentence(const InputError::Parts& parts) {
    std::string text = parts.where.empty() ? "" : parts.where + ": ";
    text += "expected " + parts.expected;
    if (!parts.found.empty()) text += ", found " + parts.found;
    text += ".";
    if (!parts.hint.empty()) text += " " + parts.hint;
    return text;
}

}  // namespace

InputError::InputError(Parts parts)
    : std::runtime_error(sentence(parts)), parts_(std::move(parts)) {}

namespace detail {

void check_failed(const char* file, int line, const char* expression, const std::string& values) {
    throw InternalError(fmt::format("internal error at {}:{}: {} {}", file, line, expression,
                                    values.empty() ? "is false" : "does not hold: " + values));
}

}  // namespace detail
}  // namespace vitrine
