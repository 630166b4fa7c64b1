// base/timer.h: wall-clock seconds of a stage, for the run record.
#pragma once

#include <chrono>

namespace vitrine {

class Timer {
  public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace vitrine
