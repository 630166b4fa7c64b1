// benchmarks/runtime/cpu_time.h: what the work cost, in spite of what else the machine does.
#pragma once

#include "math/statistics.h"

#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <sys/resource.h>
#include <time.h>
#include <vector>

namespace vitrine {

/// CPU seconds of all threads of this process so far.
inline double cpu_seconds() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

inline double wall_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

struct Cost {
    double cpu_s = 0, wall_s = 0;
};
template <typename Work>
Cost cost_of(const Work& work) {
    const double cpu = cpu_seconds(), wall = wall_seconds();
    work();
    return {cpu_seconds() - cpu, wall_seconds() - wall};
}

/// Medians of CPU and wall seconds over `repeats` runs.
template <typename Work>
Cost median_cost(int repeats, const Work& work) {
    std::vector<double> cpu, wall;
    for (int i = 0; i < repeats; ++i) {
        const Cost cost = cost_of(work);
        cpu.push_back(cost.cpu_s);
        wall.push_back(cost.wall_s);
    }
    return {median(cpu), median(wall)};
}

/// Largest resident size so far, and the present one, in MB.
inline double peak_mb() {
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024.0;
}
inline double resident_mb() {
    std::ifstream file("/proc/self/statm");
    double total = 0, resident = 0;
    file >> total >> resident;
    return resident * 4096.0 / (1024.0 * 1024.0);
}

}  // namespace vitrine
