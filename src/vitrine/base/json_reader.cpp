#include "base/json_reader.h"

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"

#include <cmath>
#include <map>

namespace vitrine {
namespace {

constexpr int kMaxNesting = 64;  // our files need 6; a thousand would overflow the parser's stack

struct Place {
    std::size_t line = 1;
    std::size_t column = 1;
};

Place place_of(const std::string& text, std::size_t offset) {
    Place place;
    for (std::size_t i = 0; i < offset && i < text.size(); ++i) {
        if (text[i] == '\n') {
            ++place.line;
            place.column = 1;
        } else {
            ++place.column;
        }
    }
    return place;
}

std::string where(const std::string& name, const std::string& text, std::size_t offset) {
    const Place place = place_of(text, offset);
    return fmt::format("{}:{}:{}", name, place.line, place.column);
}

/// Walks valid or invalid JSON text without building it: finds the offset of each value by its
/// pointer, and the first duplicate key. The parser proper has judged the grammar before.
class PlaceFinder {
  public:
    explicit PlaceFinder(const std::string& text) : text_(text) {
        skip_space();
        value("");
    }
    std::size_t offset(const std::string& pointer) const {
        const auto found = offsets_.find(pointer);
        return found == offsets_.end() ? 0 : found->second;
    }
    const std::string& duplicate() const { return duplicate_; }
    std::size_t duplicate_offset() const { return duplicate_offset_; }

  private:
    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
    void skip_space() {
        while (at_ < text_.size() &&
               std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) {
            ++at_;
        }
    }
    std::string string_token() {
        const std::size_t begin = at_++;
        while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
        ++at_;
        const std::string token = text_.substr(begin, at_ - begin);
        const Json parsed = Json::parse(token, nullptr, false);
        return parsed.is_string() ? parsed.get<std::string>() : token;
    }
    void value(const std::string& pointer) {
        offsets_.emplace(pointer, at_);
        if (peek() == '{') {
            members(pointer);
        } else if (peek() == '[') {
            items(pointer);
        } else if (peek() == '"') {
            string_token();
        } else {
            while (at_ < text_.size() &&
                   std::string_view(",]} \t\r\n").find(text_[at_]) == std::string_view::npos) {
                ++at_;
            }
        }
    }
    void members(const std::string& pointer) {
        std::set<std::string> seen;
        ++at_;
        skip_space();
        while (peek() == '"') {
            const std::size_t key_offset = at_;
            const std::string key = string_token();
            if (!seen.insert(key).second && duplicate_.empty()) {
                duplicate_ = key;
                duplicate_offset_ = key_offset;
            }
            skip_space();
            ++at_;  // the colon
            skip_space();
            value(pointer + "/" + key);
            skip_space();
            if (peek() == ',') ++at_;
            skip_space();
        }
        ++at_;
    }
    void items(const std::string& pointer) {
        ++at_;
        skip_space();
        for (std::size_t index = 0; at_ < text_.size() && peek() != ']'; ++index) {
            value(pointer + "/" + std::to_string(index));
            skip_space();
            if (peek() == ',') ++at_;
            skip_space();
        }
        ++at_;
    }

    const std::string& text_;
    std::size_t at_ = 0;
    std::map<std::string, std::size_t> offsets_;
    std::string duplicate_;
    std::size_t duplicate_offset_ = 0;
};

void refuse_deep_nesting(const std::string& text, const std::string& name) {
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            if (c == '\\') ++i;
            if (c == '"') in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '{' || c == '[') {
            if (++depth > kMaxNesting) {
                throw InputError({where(name, text, i),
                                  fmt::format("at most {} levels of nesting", kMaxNesting), "more",
                                  ""});
            }
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
}

std::string describe(const Json& value) {
    std::string text = value.dump();
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    return text;
}

}  // namespace

JsonObject::JsonObject(std::shared_ptr<const JsonDocument> document, const Json* value,
                       std::string pointer)
    : document_(std::move(document)), value_(value), pointer_(std::move(pointer)) {}

void JsonObject::fail(const std::string& key, const std::string& expected, const std::string& found,
                      const std::string& hint) const {
    const std::string pointer = key.empty() ? pointer_ : pointer_ + "/" + key;
    const PlaceFinder finder(document_->text);
    throw InputError({where(document_->name, document_->text, finder.offset(pointer)),
                      key.empty() ? expected : fmt::format("\"{}\" to be {}", key, expected), found,
                      hint});
}

const Json& JsonObject::require(const std::string& key) const {
    asked_->insert(key);
    const auto found = value_->find(key);
    if (found == value_->end()) fail("", fmt::format("the key \"{}\"", key), "no such key");
    return *found;
}

bool JsonObject::has(const std::string& key) const {
    asked_->insert(key);
    const auto found = value_->find(key);
    return found != value_->end() && !found->is_null();
}

double JsonObject::number(const std::string& key) const {
    const Json& value = require(key);
    if (!value.is_number()) fail(key, "a number", describe(value));
    return value.get<double>();
}

double JsonObject::number_or(const std::string& key, double fallback) const {
    return has(key) ? number(key) : fallback;
}

long long JsonObject::integer(const std::string& key) const {
    const Json& value = require(key);
    const bool is_whole = value.is_number_integer() ||
                          (value.is_number_float() && std::abs(value.get<double>()) < 9e15 &&
                           value.get<double>() == std::floor(value.get<double>()));
    if (!is_whole) fail(key, "a whole number", describe(value));
    return value.is_number_integer() ? value.get<long long>()
                                     : static_cast<long long>(value.get<double>());
}

long long JsonObject::integer_or(const std::string& key, long long fallback) const {
    return has(key) ? integer(key) : fallback;
}

bool JsonObject::boolean_or(const std::string& key, bool fallback) const {
    if (!has(key)) return fallback;
    const Json& value = require(key);
    if (!value.is_boolean()) fail(key, "true or false", describe(value));
    return value.get<bool>();
}

std::string JsonObject::text(const std::string& key) const {
    const Json& value = require(key);
    if (!value.is_string()) fail(key, "a text in quotes", describe(value));
    return value.get<std::string>();
}

std::string JsonObject::text_or(const std::string& key, const std::string& fallback) const {
    return has(key) ? text(key) : fallback;
}

std::vector<double> JsonObject::numbers(const std::string& key) const {
    const Json& value = require(key);
    if (!value.is_array()) fail(key, "a list of numbers", describe(value));
    std::vector<double> result;
    for (const Json& item : value) {
        if (!item.is_number()) fail(key, "a list of numbers", describe(item));
        result.push_back(item.get<double>());
    }
    return result;
}

std::vector<double> JsonObject::numbers(const std::string& key, std::size_t count) const {
    std::vector<double> result = numbers(key);
    if (result.size() != count) {
        fail(key, fmt::format("a list of {} numbers", count), fmt::format("{}", result.size()));
    }
    return result;
}

std::vector<std::string> JsonObject::texts(const std::string& key) const {
    const Json& value = require(key);
    if (!value.is_array()) fail(key, "a list of texts", describe(value));
    std::vector<std::string> result;
    for (const Json& item : value) {
        if (!item.is_string()) fail(key, "a list of texts", describe(item));
        result.push_back(item.get<std::string>());
    }
    return result;
}

JsonObject JsonObject::object(const std::string& key) const {
    const Json& value = require(key);
    if (!value.is_object()) fail(key, "an object in braces", describe(value));
    return {document_, &value, pointer_ + "/" + key};
}

std::vector<JsonObject> JsonObject::objects(const std::string& key) const {
    const Json& value = require(key);
    if (!value.is_array()) fail(key, "a list of objects", describe(value));
    std::vector<JsonObject> result;
    for (std::size_t i = 0; i < value.size(); ++i) {
        if (!value[i].is_object()) fail(key, "a list of objects", describe(value[i]));
        result.emplace_back(document_, &value[i], pointer_ + "/" + key + "/" + std::to_string(i));
    }
    return result;
}

std::vector<std::string> JsonObject::keys() const {
    std::vector<std::string> result;
    for (const auto& item : value_->items()) result.push_back(item.key());
    return result;
}

const Json& JsonObject::raw(const std::string& key) const { return require(key); }

std::string JsonObject::choice(const std::string& key,
                               const std::vector<std::string>& allowed) const {
    const std::string value = text(key);
    for (const std::string& name : allowed) {
        if (name == value) return value;
    }
    const std::string near = nearest_name(value, allowed);
    fail(key, "one of " + join(allowed, ", "), "\"" + value + "\"",
         near.empty() ? "" : "Did you mean \"" + near + "\"?");
}

void JsonObject::ignore_rest() const {
    for (const std::string& key : keys()) asked_->insert(key);
}

void JsonObject::finish() const {
    for (const auto& item : value_->items()) {
        if (asked_->count(item.key()) > 0) continue;
        const std::vector<std::string> known(asked_->begin(), asked_->end());
        const std::string near = nearest_name(item.key(), known);
        const PlaceFinder finder(document_->text);
        throw InputError(
            {where(document_->name, document_->text, finder.offset(pointer_ + "/" + item.key())),
             "only known keys (" + join(known, ", ") + ")", "\"" + item.key() + "\"",
             near.empty() ? "" : "Did you mean \"" + near + "\"?"});
    }
}

JsonObject read_json_text(const std::string& text, const std::string& name) {
    refuse_deep_nesting(text, name);
    auto document = std::make_shared<JsonDocument>();
    document->name = name;
    document->text = text;
    try {
        document->root = Json::parse(text);
    } catch (const Json::parse_error& error) {
        const std::size_t offset = error.byte > 0 ? error.byte - 1 : 0;
        throw InputError({where(name, text, offset), "valid JSON",
                          text.empty() ? "an empty file" : "something else there",
                          "Often a missing comma or quote just before this place."});
    }
    const PlaceFinder finder(text);
    if (!finder.duplicate().empty()) {
        throw InputError({where(name, text, finder.duplicate_offset()), "each key once",
                          "\"" + finder.duplicate() + "\" again", ""});
    }
    if (!document->root.is_object()) {
        throw InputError({name, "an object in braces", describe(document->root), ""});
    }
    const Json* root = &document->root;
    return {document, root, ""};
}

JsonObject read_json_file(const std::filesystem::path& path) {
    return read_json_text(read_text_file(path), path.string());
}

void write_json_file(const std::filesystem::path& path, const Json& value) {
    write_text_file(path, value.dump(2) + "\n");
}

}  // namespace vitrine
