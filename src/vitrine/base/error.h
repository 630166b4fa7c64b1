// base/error.h: the three kinds of wrong, and who answers for each.
//
// The user's: `InputError` (exit code 3) or `UsageError` (2), caught once in main.
// The machine's: `MachineError` (1): disk full, folder read-only, workspace busy.
// Ours: VITRINE_CHECK prints both values and throws `InternalError` (1).
// Weak data is none of these: it is an answer (estimate/estimate.h, `Outcome`), exit code 4.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace vitrine {

/// Input that cannot be used. The message reads: where: expected, found. hint.
class InputError : public std::runtime_error {
  public:
    struct Parts {
        std::string where;     ///< file, file:line:column, frame or option that is wrong
        std::string expected;  ///< what would have been right
        std::string found;     ///< what was there instead
        std::string hint;      ///< what the user can do; may be empty
    };
    explicit InputError(Parts parts);
    const Parts& parts() const { return parts_; }

  private:
    Parts parts_;
};

/// A command line that cannot be understood.
class UsageError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// The machine could not do it: no space, no permission, workspace in use.
class MachineError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// A broken promise of our own code.
class InternalError : public std::logic_error {
  public:
    using std::logic_error::logic_error;
};

/// Thrown out of a stage when its `Progress` was told to stop.
class Cancelled : public std::runtime_error {
  public:
    Cancelled() : std::runtime_error("cancelled") {}
};

namespace detail {
[[noreturn]] void check_failed(const char* file, int line, const char* expression,
                               const std::string& values);
}

}  // namespace vitrine

#define VITRINE_CHECK(condition)                                                               \
    do {                                                                                       \
        if (!(condition)) ::vitrine::detail::check_failed(__FILE__, __LINE__, #condition, ""); \
    } while (false)

#define VITRINE_CHECK_OP(a, op, b)                                                          \
    do {                                                                                    \
        const auto& vitrine_a = (a);                                                        \
        const auto& vitrine_b = (b);                                                        \
        if (!(vitrine_a op vitrine_b))                                                      \
            ::vitrine::detail::check_failed(__FILE__, __LINE__, #a " " #op " " #b,          \
                                            fmt::format("{} vs {}", vitrine_a, vitrine_b)); \
    } while (false)

#define VITRINE_CHECK_EQ(a, b) VITRINE_CHECK_OP(a, ==, b)
#define VITRINE_CHECK_LT(a, b) VITRINE_CHECK_OP(a, <, b)
#define VITRINE_CHECK_LE(a, b) VITRINE_CHECK_OP(a, <=, b)
#define VITRINE_CHECK_GT(a, b) VITRINE_CHECK_OP(a, >, b)
#define VITRINE_CHECK_GE(a, b) VITRINE_CHECK_OP(a, >=, b)
