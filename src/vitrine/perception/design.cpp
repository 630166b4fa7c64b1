#include "perception/design.h"

#include "base/error.h"
#include "base/rng.h"

#include <algorithm>
#include <numeric>

namespace vitrine {
namespace {

enum Stream : std::uint64_t { kSubset = 1, kOrder, kTop, kFirst, kSecond, kPractice, kCatch };

template <typename T>
void shuffle(std::vector<T>& items, Rng rng) {
    for (std::size_t i = items.size(); i > 1; --i) {
        std::swap(items[i - 1], items[rng.next_index(static_cast<std::uint32_t>(i))]);
    }
}

/// Half true, half false (an odd one by chance), in random order.
std::vector<bool> balanced_coins(std::size_t count, std::uint64_t key) {
    Rng rng(key);
    const std::uint32_t odd = rng.next_index(2);
    std::vector<char> coins(count);
    for (std::size_t i = 0; i < count; ++i) coins[i] = static_cast<char>((i + odd) % 2);
    shuffle(coins, rng);
    return {coins.begin(), coins.end()};
}

/// Questions with one narrow and one wide pair: neighbours at one end against the rest.
std::vector<Quadruple> easy_quadruples(int stimulus_count, int wanted, Rng rng) {
    const int n = stimulus_count;
    const std::vector<Quadruple> easy = {{1, 2, 3, n}, {1, n - 2, n - 1, n}};
    std::vector<Quadruple> chosen;
    const std::uint32_t start = rng.next_index(2);
    for (int i = 0; i < wanted; ++i) {
        chosen.push_back(easy[(start + static_cast<std::size_t>(i)) % easy.size()]);
    }
    return chosen;
}

std::vector<PlannedTrial> laid_out(const std::vector<Quadruple>& quadruples, TrialKind kind,
                                   std::uint64_t seed) {
    const auto tag = static_cast<std::uint64_t>(kind);
    const auto top = balanced_coins(quadruples.size(), stream_key(seed, kTop, tag));
    const auto first = balanced_coins(quadruples.size(), stream_key(seed, kFirst, tag));
    const auto second = balanced_coins(quadruples.size(), stream_key(seed, kSecond, tag));
    std::vector<PlannedTrial> trials;
    for (std::size_t i = 0; i < quadruples.size(); ++i) {
        trials.push_back({kind, quadruples[i], top[i], first[i], second[i]});
    }
    return trials;
}

void check_options(const DesignOptions& o, std::size_t quadruple_count) {
    const auto fail = [](const std::string& expected, long long found, const std::string& hint) {
        throw InputError({"design", expected, std::to_string(found), hint});
    };
    if (o.trial_count < 0 || static_cast<std::size_t>(o.trial_count) > quadruple_count) {
        fail(fmt::format("at most {} trials from {} stimuli", quadruple_count, o.stimulus_count),
             o.trial_count, "use repeats for more");
    }
    if (o.repeats < 1 || o.repeats > 100) fail("1 to 100 repeats", o.repeats, "");
    if (o.practice_count < 0 || o.practice_count > 100) {
        fail("0 to 100 practice trials", o.practice_count, "");
    }
    if (o.catch_count < 0 || o.catch_count > 100) fail("0 to 100 catch trials", o.catch_count, "");
}

}  // namespace

std::string kind_name(TrialKind kind) {
    switch (kind) {
        case TrialKind::Practice:
            return "practice";
        case TrialKind::Catch:
            return "catch";
        case TrialKind::Main:
            return "main";
    }
    return "";
}

std::vector<Quadruple> all_quadruples(int count) {
    std::vector<Quadruple> all;
    for (int a = 1; a <= count; ++a)
        for (int b = a + 1; b <= count; ++b)
            for (int c = b + 1; c <= count; ++c)
                for (int d = c + 1; d <= count; ++d) all.push_back({a, b, c, d});
    return all;
}

std::vector<Quadruple> balanced_subset(int stimulus_count, int wanted, std::uint64_t seed) {
    std::vector<Quadruple> candidates = all_quadruples(stimulus_count);
    VITRINE_CHECK_LE(static_cast<std::size_t>(wanted), candidates.size());
    shuffle(candidates, Rng(stream_key(seed, kSubset)));
    std::vector<int> used(static_cast<std::size_t>(stimulus_count) + 1, 0);
    std::vector<bool> taken(candidates.size(), false);
    std::vector<Quadruple> chosen;
    while (static_cast<int>(chosen.size()) < wanted) {
        // Least sum of squares of the uses after taking it = least sum of the uses before.
        std::size_t best = candidates.size();
        int best_cost = 0;
        for (std::size_t i = 0; i < candidates.size(); ++i) {
            if (taken[i]) continue;
            int cost = 0;
            for (const int rank : candidates[i]) cost += used[static_cast<std::size_t>(rank)];
            if (best == candidates.size() || cost < best_cost) {
                best = i;
                best_cost = cost;
            }
        }
        taken[best] = true;
        chosen.push_back(candidates[best]);
        for (const int rank : candidates[best]) ++used[static_cast<std::size_t>(rank)];
    }
    return chosen;
}

std::vector<PlannedTrial> make_design(const DesignOptions& options) {
    // 40 stimuli have 91,390 quadruples: nobody answers more.
    if (options.stimulus_count < 4 || options.stimulus_count > 40) {
        throw InputError({"design", "4 to 40 stimuli", std::to_string(options.stimulus_count),
                          "two pairs of different stimuli need four"});
    }
    const std::vector<Quadruple> all = all_quadruples(options.stimulus_count);
    check_options(options, all.size());

    std::vector<Quadruple> questions;
    for (int r = 0; r < options.repeats; ++r) {
        const std::uint64_t seed = stream_key(options.seed, r);
        std::vector<Quadruple> once =
            options.trial_count == 0
                ? all
                : balanced_subset(options.stimulus_count, options.trial_count, seed);
        shuffle(once, Rng(stream_key(seed, kOrder)));
        questions.insert(questions.end(), once.begin(), once.end());
    }
    std::vector<PlannedTrial> main = laid_out(questions, TrialKind::Main, options.seed);

    Rng catch_rng(stream_key(options.seed, kCatch));
    const auto catches =
        laid_out(easy_quadruples(options.stimulus_count, options.catch_count, catch_rng),
                 TrialKind::Catch, options.seed);
    if (catches.size() > main.size()) {
        throw InputError(
            {"design", "fewer catch trials than main ones", std::to_string(catches.size()), ""});
    }
    // One catch trial within each equal stretch of the main trials.
    const std::size_t main_count = main.size();
    for (std::size_t i = catches.size(); i-- > 0;) {
        const std::size_t begin = i * main_count / catches.size();
        const std::size_t end = (i + 1) * main_count / catches.size();
        const auto span = static_cast<std::uint32_t>(std::max<std::size_t>(1, end - begin));
        const std::size_t at = begin + 1 + catch_rng.next_index(span);
        main.insert(main.begin() + static_cast<std::ptrdiff_t>(std::min(at, main_count)),
                    catches[i]);
    }
    std::vector<PlannedTrial> design =
        laid_out(easy_quadruples(options.stimulus_count, options.practice_count,
                                 Rng(stream_key(options.seed, kPractice))),
                 TrialKind::Practice, options.seed);
    design.insert(design.end(), main.begin(), main.end());
    return design;
}

Quadruple screen_order(const PlannedTrial& trial) {
    const auto& r = trial.rank;
    const std::array<int, 2> first =
        trial.is_first_mirrored ? std::array{r[1], r[0]} : std::array{r[0], r[1]};
    const std::array<int, 2> second =
        trial.is_second_mirrored ? std::array{r[3], r[2]} : std::array{r[2], r[3]};
    const auto& top = trial.is_first_pair_top ? first : second;
    const auto& bottom = trial.is_first_pair_top ? second : first;
    return {top[0], top[1], bottom[0], bottom[1]};
}

int response_of(const PlannedTrial& trial, bool chose_top) {
    return chose_top == trial.is_first_pair_top ? 0 : 1;
}

std::string design_to_csv(const std::vector<PlannedTrial>& design) {
    std::string text = "trial,kind,S1,S2,S3,S4,top_left,top_right,bottom_left,bottom_right\n";
    for (std::size_t i = 0; i < design.size(); ++i) {
        const auto& r = design[i].rank;
        const Quadruple s = screen_order(design[i]);
        text += fmt::format("{},{},{},{},{},{},{},{},{},{}\n", i + 1, kind_name(design[i].kind),
                            r[0], r[1], r[2], r[3], s[0], s[1], s[2], s[3]);
    }
    return text;
}

}  // namespace vitrine
