// base/pool.h: things that cost something to make, kept for the next who needs one.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace vitrine {

/// Lends each thing to one user at a time; makes as many as there are users at once. What the
/// last user left in it is still there. Safe to use from all threads.
template <typename T>
class Pool {
  public:
    /// A thing on loan, given back at the end of its life.
    class Loan {
      public:
        Loan(Pool& pool, std::unique_ptr<T> item) : pool_(pool), item_(std::move(item)) {}
        Loan(Loan&&) = default;
        ~Loan() {
            if (item_) pool_.give_back(std::move(item_));
        }
        T& operator*() const { return *item_; }

      private:
        Pool& pool_;
        std::unique_ptr<T> item_;
    };

    /// @param make gives a new std::unique_ptr<T>, where all are lent
    template <typename Make>
    Loan lend(const Make& make) {
        std::unique_ptr<T> item;
        {
            const std::lock_guard lock(mutex_);
            if (!free_.empty()) {
                item = std::move(free_.back());
                free_.pop_back();
            }
        }
        if (!item) item = make();
        return Loan(*this, std::move(item));
    }

  private:
    void give_back(std::unique_ptr<T> item) {
        const std::lock_guard lock(mutex_);
        free_.push_back(std::move(item));
    }
    std::mutex mutex_;
    std::vector<std::unique_ptr<T>> free_;
};

}  // namespace vitrine
