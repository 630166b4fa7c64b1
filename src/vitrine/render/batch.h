// render/batch.h: a list that is filled and emptied over and over.
#pragma once

#include <algorithm>
#include <cassert>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace vitrine {

/// Room is asked for before a loop and not within it, so that adding an item is storing it.
template <typename T>
class Batch {
    static_assert(std::is_trivially_destructible_v<T>);

  public:
    /// Room for `count` items beyond those that are there. Moves them: pointers to them end.
    void make_room(std::size_t count) {
        const std::size_t needed = size_ + count;
        if (items_.size() < needed) items_.resize(std::max(needed, 2 * items_.size()));
    }
    /// Room has been made for it.
    template <typename... Args>
    T& add(Args&&... args) {
        assert(size_ < items_.size());
        return *new (&items_[size_++]) T(std::forward<Args>(args)...);
    }
    /// Items that are stored from `end()` on, where there is room, belong to it up to `end`.
    void take(const T* end) {
        size_ = static_cast<std::size_t>(end - items_.data());
        assert(size_ <= items_.size());
    }
    void clear() { size_ = 0; }
    void swap(Batch& other) {
        items_.swap(other.items_);
        std::swap(size_, other.size_);
    }
    std::size_t size() const { return size_; }
    T& operator[](std::size_t i) { return items_[i]; }
    T* begin() { return items_.data(); }
    T* end() { return items_.data() + size_; }
    const T* begin() const { return items_.data(); }
    const T* end() const { return items_.data() + size_; }
    std::span<T> items() { return {begin(), size_}; }

  private:
    std::vector<T> items_;  // those from `size_` on are waste
    std::size_t size_ = 0;
};

}  // namespace vitrine
