#include "perception/trial.h"

#include "base/error.h"
#include "base/text.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <map>
#include <utility>

namespace vitrine {
namespace {

/// Columns of the trial log that say nothing about the answer itself.
const std::vector<std::string> kIgnoredColumns = {
    "trial",       "top_left",         "top_right", "bottom_left", "bottom_right", "key", "choice",
    "reaction_ms", "stimulus_size_px", "time_utc",  "seed",        "index",        ""};

std::vector<std::string> split_fields(const std::string& line) {
    std::vector<std::string> fields;
    std::size_t begin = 0;
    while (true) {
        const std::size_t end = line.find(',', begin);
        std::string field =
            line.substr(begin, end == std::string::npos ? std::string::npos : end - begin);
        // R writes names and factors in double quotes.
        if (field.size() >= 2 && field.front() == '"' && field.back() == '"') {
            field = field.substr(1, field.size() - 2);
        }
        fields.push_back(field);
        if (end == std::string::npos) return fields;
        begin = end + 1;
    }
}

struct Columns {
    std::map<std::string, std::size_t> at;
    std::size_t count = 0;
};

Columns read_header(const std::string& line, const std::string& name) {
    static const std::vector<std::string> kRequired = {"resp", "S1", "S2", "S3", "S4"};
    Columns columns;
    const auto fields = split_fields(line);
    columns.count = fields.size();
    for (std::size_t i = 0; i < fields.size(); ++i) {
        const bool known =
            std::find(kRequired.begin(), kRequired.end(), fields[i]) != kRequired.end() ||
            fields[i] == "participant" || fields[i] == "kind" ||
            std::find(kIgnoredColumns.begin(), kIgnoredColumns.end(), fields[i]) !=
                kIgnoredColumns.end();
        if (!known) {
            throw InputError({name + ":1", "a header with the columns resp,S1,S2,S3,S4",
                              "column \"" + fields[i] + "\"",
                              "name the columns as the R package MLDS does"});
        }
        if (!columns.at.emplace(fields[i], i).second && !fields[i].empty()) {
            throw InputError({name + ":1", "each column once", "\"" + fields[i] + "\" twice", ""});
        }
    }
    for (const std::string& key : kRequired) {
        if (!columns.at.count(key)) {
            throw InputError({name + ":1", "a header with the columns resp,S1,S2,S3,S4",
                              "no column \"" + key + "\"", ""});
        }
    }
    return columns;
}

int parse_integer(const std::string& field, const std::string& where, const std::string& what) {
    int value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size()) {
        throw InputError({where, what, "\"" + field + "\"", ""});
    }
    return value;
}

Trial parse_row(const std::vector<std::string>& fields, const Columns& columns,
                const std::string& where) {
    Trial trial;
    trial.response = parse_integer(fields[columns.at.at("resp")], where, "resp 0 or 1");
    if (trial.response != 0 && trial.response != 1) {
        throw InputError({where, "resp 0 or 1", std::to_string(trial.response),
                          "1 says that the pair (S3, S4) looks more different"});
    }
    constexpr int kMaxRank = 1000;  // far beyond any study; bounds what a bad file can allocate
    for (int i = 0; i < 4; ++i) {
        const std::string key = "S" + std::to_string(i + 1);
        const int rank = parse_integer(fields[columns.at.at(key)], where, key + " a rank from 1");
        if (rank < 1 || rank > kMaxRank) {
            throw InputError({where, key + " a rank from 1 to " + std::to_string(kMaxRank),
                              std::to_string(rank), "ranks number the stimuli, not their values"});
        }
        trial.rank[static_cast<std::size_t>(i)] = rank;
    }
    if (trial.rank[0] == trial.rank[1] || trial.rank[2] == trial.rank[3]) {
        throw InputError({where, "two different stimuli in each pair", "a pair of equal ones", ""});
    }
    return trial;
}

/// The pair with more ranks between its stimuli was said to be the less different one.
bool is_failed_catch(const Trial& trial) {
    const auto& r = trial.rank;
    return (std::abs(r[3] - r[2]) > std::abs(r[1] - r[0])) != (trial.response == 1);
}

}  // namespace

Trial canonical(const Trial& trial) {
    Trial out = trial;
    auto& r = out.rank;
    if (r[0] > r[1]) std::swap(r[0], r[1]);
    if (r[2] > r[3]) std::swap(r[2], r[3]);
    if (std::pair(r[0], r[1]) > std::pair(r[2], r[3])) {
        std::swap(r[0], r[2]);
        std::swap(r[1], r[3]);
        out.response = 1 - out.response;
    }
    return out;
}

std::vector<Observations> parse_trials_csv(const std::string& text, const std::string& name) {
    std::vector<Observations> all;
    Columns columns;
    std::size_t begin = 0;
    int line_number = 0;
    while (begin < text.size()) {
        std::size_t end = text.find('\n', begin);
        if (end == std::string::npos) end = text.size();
        std::string line = text.substr(begin, end - begin);
        begin = end + 1;
        ++line_number;
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty()) continue;
        if (columns.count == 0) {
            columns = read_header(line, name);
            continue;
        }
        const std::string where = name + ":" + std::to_string(line_number);
        const auto fields = split_fields(line);
        if (fields.size() != columns.count) {
            throw InputError({where, std::to_string(columns.count) + " fields",
                              std::to_string(fields.size()), ""});
        }
        const std::string kind = columns.at.count("kind") ? fields[columns.at.at("kind")] : "main";
        if (kind == "practice") continue;
        if (kind != "main" && kind != "catch") {
            throw InputError({where, "kind main, catch or practice", "\"" + kind + "\"", ""});
        }
        const std::string observer =
            columns.at.count("participant") ? fields[columns.at.at("participant")] : name;
        const Trial trial = parse_row(fields, columns, where);
        auto known = std::find_if(all.begin(), all.end(),
                                  [&](const Observations& o) { return o.observer == observer; });
        if (known == all.end()) known = all.insert(known, Observations{observer, {}});
        if (kind == "main") {
            known->trials.push_back(trial);
        } else {
            ++known->catch_count;
            known->catch_failed += is_failed_catch(trial);
        }
    }
    std::erase_if(all, [](const Observations& o) { return o.trials.empty(); });
    if (all.empty()) {
        throw InputError({name, "a header and at least one trial", "none", ""});
    }
    return all;
}

std::string trials_to_csv(const std::vector<Trial>& trials) {
    std::string text = "resp,S1,S2,S3,S4\n";
    for (const Trial& t : trials) {
        text +=
            fmt::format("{},{},{},{},{}\n", t.response, t.rank[0], t.rank[1], t.rank[2], t.rank[3]);
    }
    return text;
}

int highest_rank(const std::vector<Trial>& trials) {
    int highest = 0;
    for (const Trial& t : trials) {
        highest = std::max(highest, *std::max_element(t.rank.begin(), t.rank.end()));
    }
    return highest;
}

}  // namespace vitrine
