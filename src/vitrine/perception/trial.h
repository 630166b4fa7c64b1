// perception/trial.h: what an observer was asked and what was answered, as numbers and as CSV text.
//
// A trial shows two pairs of stimuli and asks which pair differs more. Stimuli are named by their
// rank along the physical scale, from 1. The columns `resp,S1,S2,S3,S4` are those of the R package
// MLDS: resp 1 says that the pair (S3, S4) looks more different, 0 that (S1, S2) does.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace vitrine {

/// Two pairs of ranks: (S1, S2) against (S3, S4).
using Quadruple = std::array<int, 4>;

struct Trial {
    int response = 0;  ///< 1: (S3, S4) looks more different; 0: (S1, S2) does
    Quadruple rank{};  ///< S1, S2, S3, S4
};

/// The answers of one observer.
struct Observations {
    std::string observer;
    std::vector<Trial> trials;  ///< main trials
    int catch_count = 0;        ///< catch trials asked
    int catch_failed = 0;       ///< of which the pair with less between its ranks was chosen
};

/// The same question with each pair in rising order and the lower pair first, the answer turned
/// with it. The likelihood of a symmetric link does not change (R's `SwapOrder`).
Trial canonical(const Trial& trial);

/// Reads trials from CSV text. The header names the columns; `resp`, `S1` .. `S4` are required in
/// any order, `participant` splits the rows into observers (in order of first appearance), rows
/// whose `kind` is `catch` are counted alone, `practice` is left out, the columns of the trial log
/// are accepted and ignored.
/// @param name for messages and as the observer's name where no participant is given
/// @throws InputError with name:line for a bad header, a response other than 0 or 1, a rank below
/// one, a pair of equal stimuli.
std::vector<Observations> parse_trials_csv(const std::string& text, const std::string& name);

/// `resp,S1,S2,S3,S4` and one line per trial.
std::string trials_to_csv(const std::vector<Trial>& trials);

/// The largest rank that occurs.
int highest_rank(const std::vector<Trial>& trials);

}  // namespace vitrine
