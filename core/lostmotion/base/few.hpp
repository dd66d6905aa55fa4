// Numbers of which there are few in most trains: those lie in place, and allocate nothing.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <type_traits>
#include <utility>

namespace lostmotion {

// As many numbers as have been asked for, a multiple of four, and `few` at least. What lies beyond is zero.
template <class T, std::size_t few>
class Few {
 public:
    static_assert(std::is_trivially_copyable_v<T> && few % 4 == 0);

    Few() { std::fill_n(few_, few, T{}); }
    Few(const Few& o) { *this = o; }
    Few(Few&& o) noexcept { *this = std::move(o); }
    Few& operator=(const Few& o) {
        if (many_ == nullptr && o.many_ == nullptr)
            std::memcpy(few_, o.few_, sizeof few_);
        else if (this != &o)
            std::copy(o.begin(), o.end(), as_many_as(o));
        return *this;
    }
    Few& operator=(Few&& o) noexcept {
        if (many_ == nullptr && o.many_ == nullptr) {
            std::memcpy(few_, o.few_, sizeof few_);
            return *this;
        }
        if (o.many_ == nullptr) return *this = std::as_const(o);
        if (many_ == nullptr) std::fill_n(o.few_, few, T{});
        std::swap(size_, o.size_);
        std::swap(room_, o.room_);
        std::swap(many_, o.many_);
        return *this;
    }

    std::size_t size() const { return many_ == nullptr ? few : size_; }
    // As many as others, whose values are to follow.
    T* as_many_as(const Few& o) {
        if (o.size() > few && o.size() > room_) make_room(o.size());
        if (many_ != nullptr) size_ = o.size();
        return data();
    }
    void reach(std::size_t size) {
        if (size > this->size()) grow((size + 3) / 4 * 4);
    }
    template <class Index>
    T operator[](Index k) const {
        return static_cast<std::size_t>(k) < size() ? begin()[k] : T{};
    }
    template <class Index>
    T& operator[](Index k) {
        reach(static_cast<std::size_t>(k) + 1);
        return data()[k];
    }
    const T* begin() const { return many_ == nullptr ? few_ : many_.get(); }
    const T* end() const { return begin() + size(); }
    T* begin() { return data(); }
    T* end() { return data() + size(); }
    T* data() { return many_ == nullptr ? few_ : many_.get(); }
    const T* data() const { return begin(); }

    friend bool operator==(const Few& a, const Few& b) {
        if constexpr (std::has_unique_object_representations_v<T>)
            if (a.many_ == nullptr && b.many_ == nullptr) return std::memcmp(a.few_, b.few_, sizeof a.few_) == 0;
        const std::size_t both = std::min(a.size(), b.size());
        const Few& longer = a.size() > both ? a : b;
        return std::equal(a.begin(), a.begin() + both, b.begin()) &&
               std::all_of(longer.begin() + both, longer.end(), [](const T& v) { return v == T{}; });
    }

 private:
    void make_room(std::size_t size) {
        room_ = std::max(size, 2 * room_);
        many_ = std::make_unique_for_overwrite<T[]>(room_);
    }
    // Not inlined: it is rare.
    [[gnu::noinline]] void grow(std::size_t size) {
        const std::size_t before = this->size();
        if (size > room_) {
            const std::unique_ptr<T[]> old = std::move(many_);
            make_room(size);
            std::copy_n(old == nullptr ? few_ : old.get(), before, many_.get());
        }
        for (std::size_t k = before; k < size; ++k) many_[k] = T{};
        size_ = size;
    }

    T few_[few];                 // where there are not many
    std::unique_ptr<T[]> many_;  // as far as size_
    std::size_t size_ = 0, room_ = 0;
};

}  // namespace lostmotion
