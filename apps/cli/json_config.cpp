#include "json_config.h"

#include "base/error.h"
#include "base/json_reader.h"

#include <set>

namespace vitrine::cli {
namespace {

Json as_json(const std::string& text) {
    const Json parsed = Json::parse(text, nullptr, false);
    return parsed.is_number() || parsed.is_boolean() ? parsed : Json(text);
}

void append_option(std::vector<std::string>& arguments, const std::string& name,
                   const Json& value) {
    if (value.is_boolean()) {
        if (value.get<bool>()) arguments.push_back("--" + name);
        return;
    }
    arguments.push_back("--" + name + "=" +
                        (value.is_string() ? value.get<std::string>() : value.dump()));
}

}  // namespace

std::vector<std::string> expand_config(const std::vector<std::string>& arguments) {
    std::vector<std::string> expanded;
    std::set<std::string> given;
    std::string file;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& word = arguments[i];
        if (word == "--config") {
            if (i + 1 == arguments.size()) throw UsageError("--config needs a file");
            file = arguments[++i];
        } else if (word.rfind("--config=", 0) == 0) {
            file = word.substr(9);
        } else {
            expanded.push_back(word);
            if (word.rfind("--", 0) == 0) given.insert(word.substr(2, word.find('=') - 2));
        }
    }
    if (file.empty()) return expanded;
    const JsonObject whole = read_json_file(file);
    const JsonObject options = whole.has("options") ? whole.object("options") : whole;
    for (const std::string& key : options.keys()) {
        if (given.count(key) > 0) continue;
        const Json& value = options.raw(key);
        if (value.is_array()) {
            for (const Json& entry : value) append_option(expanded, key, entry);
        } else {
            append_option(expanded, key, value);
        }
    }
    return expanded;
}

std::string options_as_json(const CLI::App& command) {
    Json options = Json::object();
    for (const CLI::Option* option : command.get_options({})) {
        if (!option->get_configurable() || option->get_lnames().empty()) continue;
        const std::string name = option->get_lnames().front();
        if (name.rfind("help", 0) == 0) continue;
        if (option->get_expected_max() == 0) {
            options[name] = option->count() > 0;
        } else if (option->count() > 1) {
            options[name] = option->results();
        } else if (option->count() == 1) {
            options[name] = as_json(option->results().front());
        } else if (!option->get_default_str().empty()) {
            options[name] = as_json(option->get_default_str());
        }
    }
    return options.dump(2);
}

}  // namespace vitrine::cli
