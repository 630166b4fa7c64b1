// base/json_reader.h: reads our JSON files strictly and says where they are wrong.
//
// Every key must be asked for: what is left over is an error that names the nearest valid key.
// Malformed text, duplicate keys and deep nesting are errors with line and column.
// Include from .cpp files only: nlohmann's header is heavy.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace vitrine {

/// For writing: keys keep the order in which they were added.
using Json = nlohmann::ordered_json;

/// A parsed file or text, with the means to find the line and column of any value in it.
struct JsonDocument {
    std::string name;  ///< file name for messages
    std::string text;
    Json root;
};

/// One object of a document, read key by key. Copyable views; keep the document alive.
class JsonObject {
  public:
    JsonObject(std::shared_ptr<const JsonDocument> document, const Json* value,
               std::string pointer);

    bool has(const std::string& key) const;

    double number(const std::string& key) const;
    double number_or(const std::string& key, double fallback) const;
    long long integer(const std::string& key) const;
    long long integer_or(const std::string& key, long long fallback) const;
    bool boolean_or(const std::string& key, bool fallback) const;
    std::string text(const std::string& key) const;
    std::string text_or(const std::string& key, const std::string& fallback) const;
    std::vector<double> numbers(const std::string& key) const;
    /// A list of exactly `count` numbers.
    std::vector<double> numbers(const std::string& key, std::size_t count) const;
    std::vector<std::string> texts(const std::string& key) const;
    JsonObject object(const std::string& key) const;
    std::vector<JsonObject> objects(const std::string& key) const;
    std::vector<std::string> keys() const;
    /// The value itself, for a shape the methods above do not cover.
    const Json& raw(const std::string& key) const;

    /// One of `allowed`; the error lists them.
    std::string choice(const std::string& key, const std::vector<std::string>& allowed) const;

    /// Accepts `key` without reading it (an extra key that is welcome).
    void ignore(const std::string& key) const { asked_->insert(key); }
    void ignore_rest() const;

    /// @throws InputError when a key was never asked for.
    void finish() const;

    /// Throws an InputError placed at `key` (or at this object when empty).
    [[noreturn]] void fail(const std::string& key, const std::string& expected,
                           const std::string& found, const std::string& hint = "") const;

  private:
    const Json& require(const std::string& key) const;

    std::shared_ptr<const JsonDocument> document_;
    const Json* value_;
    std::string pointer_;
    std::shared_ptr<std::set<std::string>> asked_ = std::make_shared<std::set<std::string>>();
};

/// @throws InputError with file:line:column when the text is malformed, has a duplicate key, nests
/// deeper than 64 levels, or is not an object.
JsonObject read_json_text(const std::string& text, const std::string& name);
JsonObject read_json_file(const std::filesystem::path& path);

/// Writes with two-space indent, numbers in their shortest exact form.
void write_json_file(const std::filesystem::path& path, const Json& value);

}  // namespace vitrine
