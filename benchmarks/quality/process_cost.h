// benchmarks/quality/process_cost.h: what a part of a run cost this process.
#pragma once

#include <sys/resource.h>

namespace vitrine {

/// Seconds of all cores together: other programs on the machine do not count.
class CpuTimer {
  public:
    double seconds() const { return now() - start_; }

  private:
    static double now() {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        const auto of = [](const timeval& t) {
            return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
        };
        return of(usage.ru_utime) + of(usage.ru_stime);
    }
    double start_ = now();
};

/// Largest memory of the process so far.
inline double peak_memory_mb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024.0;
}

}  // namespace vitrine
