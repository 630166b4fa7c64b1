#include "estimate/estimate.h"

#include "base/error.h"

#include <array>
#include <utility>

namespace vitrine {

namespace {
constexpr std::array<std::pair<Outcome, const char*>, 4> kOutcomes = {
    {{Outcome::Converged, "converged"},
     {Outcome::AtBound, "at_bound"},
     {Outcome::Ambiguous, "ambiguous"},
     {Outcome::NotIdentifiable, "not_identifiable"}}};
constexpr std::array<std::pair<ObjectClass, const char*>, 4> kClasses = {
    {{ObjectClass::Unsure, "unsure"},
     {ObjectClass::Transparent, "transparent"},
     {ObjectClass::Specular, "specular"},
     {ObjectClass::Diffuse, "diffuse"}}};

template <typename Table, typename Key>
std::string name_in(const Table& table, Key key) {
    for (const auto& [value, name] : table)
        if (value == key) return name;
    return table[0].second;
}
template <typename Table>
auto value_in(const Table& table, const std::string& word) {
    for (const auto& [value, name] : table)
        if (word == name) return value;
    throw InternalError("no such word in estimate.json's vocabulary: " + word);
}
}  // namespace

std::string outcome_name(Outcome outcome) { return name_in(kOutcomes, outcome); }
Outcome outcome_from_name(const std::string& name) { return value_in(kOutcomes, name); }
std::string class_name(ObjectClass object_class) { return name_in(kClasses, object_class); }
ObjectClass class_from_name(const std::string& name) { return value_in(kClasses, name); }

}  // namespace vitrine
