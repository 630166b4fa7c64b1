// render/small_stack.h: a stack of fixed capacity that is not filled beforehand: paths that split
// seldom should not pay for the branches they might have had.
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>

namespace vitrine {

template <typename T, int kCapacity>
class SmallStack {
    static_assert(std::is_trivially_destructible_v<T>);

  public:
    bool empty() const { return count_ == 0; }
    int size() const { return count_; }
    /// There must be room.
    void push(const T& value) {
        new (storage_ + sizeof(T) * static_cast<std::size_t>(count_++)) T(value);
    }
    /// Must not be empty.
    T pop() {
        return *std::launder(
            reinterpret_cast<T*>(storage_ + sizeof(T) * static_cast<std::size_t>(--count_)));
    }

  private:
    alignas(T) std::byte storage_[sizeof(T) * kCapacity];
    int count_ = 0;
};

}  // namespace vitrine
