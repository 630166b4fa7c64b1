// estimate/estimate.h: a number with its doubt. Weak data is an answer here, never an exception.
#pragma once

#include <string>
#include <type_traits>

namespace vitrine {

enum class Outcome {
    Converged,        ///< found, and the data hold it there
    AtBound,          ///< the best value lies at the end of the search range
    Ambiguous,        ///< two distant values explain the data about as well
    NotIdentifiable,  ///< the data do not depend on it enough; the value is a default or a guess
};

/// "converged", "at_bound", "ambiguous", "not_identifiable", as in estimate.json.
std::string outcome_name(Outcome outcome);
/// @throws InternalError for another word.
Outcome outcome_from_name(const std::string& name);

/// Zero of a number or a colour: Eigen's types leave `T{}` uninitialised.
template <typename T>
T zero_quantity() {
    if constexpr (std::is_arithmetic_v<T>)
        return T{0};
    else
        return T::Zero();
}

template <typename T>
struct Estimate {
    T value = zero_quantity<T>();
    T stddev = zero_quantity<T>();
    double residual_rms = 0.0;
    Outcome outcome = Outcome::NotIdentifiable;
    std::string reason;  ///< one sentence when the outcome is not Converged
    bool is_usable() const { return outcome == Outcome::Converged || outcome == Outcome::AtBound; }
};

/// What a candidate is made of. Diffuse is a false candidate, kept and harmless.
enum class ObjectClass { Unsure, Transparent, Specular, Diffuse };

std::string class_name(ObjectClass object_class);  ///< "transparent", "specular", ...
ObjectClass class_from_name(const std::string& name);

}  // namespace vitrine
