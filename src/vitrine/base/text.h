// base/text.h: small work on words, for messages.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vitrine {

/// The name of `known` closest to `word` by edit distance; empty when none is near.
std::string nearest_name(std::string_view word, std::span<const std::string> known);

std::string join(std::span<const std::string> words, std::string_view separator);

std::vector<std::string> split_whitespace(std::string_view line);

/// Parses a number independently of the locale. @returns false when `text` is not one number.
bool parse_double(std::string_view text, double& value);

}  // namespace vitrine
