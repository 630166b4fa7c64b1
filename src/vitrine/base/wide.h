// base/wide.h: functions compiled once per width of vector registers.
#pragma once

/// Before a function whose loops run over arrays: the compiler makes a version for each width of
/// vector registers, and the widest that the machine has is picked when the program starts. All
/// give the same bits: arithmetic is neither fused (-ffp-contract=off) nor reassociated.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define VITRINE_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VITRINE_WIDE
#endif
