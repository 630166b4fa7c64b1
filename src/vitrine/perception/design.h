// perception/design.h: which questions an observer is asked, in which order and at which place.
#pragma once

#include "perception/trial.h"

#include <cstdint>
#include <string>
#include <vector>

namespace vitrine {

enum class TrialKind {
    Practice,  ///< shown first, easy, never analysed
    Catch,     ///< so easy that a wrong answer says the observer was not looking
    Main,
};
std::string kind_name(TrialKind kind);

/// One question and how it is laid out on the screen.
struct PlannedTrial {
    TrialKind kind = TrialKind::Main;
    Quadruple rank{};                ///< S1 < S2 <= S3 < S4 in the analysis
    bool is_first_pair_top = true;   ///< (S1, S2) above, (S3, S4) below; else the reverse
    bool is_first_mirrored = false;  ///< S2 on the left of S1
    bool is_second_mirrored = false;
};

struct DesignOptions {
    int stimulus_count = 10;  ///< ten give 210 questions, the paper's number
    int trial_count = 0;      ///< main trials per repeat; 0: all C(N, 4) quadruples
    int repeats = 1;          ///< how often the whole set is asked
    int practice_count = 0;   ///< before the main trials
    int catch_count = 0;      ///< scattered among the main trials
    std::uint64_t seed = 0;
};

/// All a < b < c < d of 1 .. count, in lexicographic order: C(count, 4) of them.
std::vector<Quadruple> all_quadruples(int count);

/// `wanted` different quadruples in which every stimulus occurs nearly equally often: greedily the
/// quadruple whose stimuli have been used least, ties broken by the seed.
std::vector<Quadruple> balanced_subset(int stimulus_count, int wanted, std::uint64_t seed);

/// Practice trials first, then the main ones in random order with the catch trials among them, no
/// two catch trials in a row. Top and bottom and the sides are balanced to one trial and random.
/// @throws InputError for fewer than four stimuli or more trials than there are quadruples.
std::vector<PlannedTrial> make_design(const DesignOptions& options);

/// `trial,kind,S1,S2,S3,S4,top_left,top_right,bottom_left,bottom_right`.
std::string design_to_csv(const std::vector<PlannedTrial>& design);

/// Ranks as they stand on the screen: top left, top right, bottom left, bottom right.
Quadruple screen_order(const PlannedTrial& trial);

/// 1 when the chosen row shows (S3, S4).
int response_of(const PlannedTrial& trial, bool chose_top);

}  // namespace vitrine
