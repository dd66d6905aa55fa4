// Arrays of as many numbers as a train has. Sums and products of whole arrays are computed in one loop, four numbers
// at once, where they are assigned; every build adds in the same order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "../base/vec.hpp"

namespace lostmotion {

// Anything with numbers in fours: four(k) are the numbers k to k + 3, zeros beyond the size.
template <class E>
concept InFours = requires(const E& e) {
    e.size();
    e.four(0);
};
// Numbers that are computed when they are asked for.
template <class Four>
struct Computed {
    int count;
    Four computed;

    int size() const { return count; }
    [[gnu::always_inline]] Pack<4> four(int k) const { return computed(k); }
};
template <class Four>
Computed(int, Four) -> Computed<Four>;
// Numbers that are in memory.
struct NumbersAt {
    const double* at;
    int count;

    int size() const { return count; }
    [[gnu::always_inline]] Pack<4> four(int k) const { return k < count ? Pack<4>::load(at + k) : Pack<4>{}; }
};

// The same to be written to.
struct NumbersRoom {
    double* at;
    int count;

    template <InFours E>
    [[gnu::always_inline]] void operator=(const E& e) const {
        for (int k = 0; k < count; k += 4) e.four(k).store(at + k);
    }
};
// Arrays of the same size that lie one behind the other.
struct NumbersRows {
    double* at;
    int count;

    NumbersRoom operator[](int k) const { return {at + k * count, count}; }
};

// As many numbers as have been asked for, in whole fours; those beyond are zero. The first `few` need no allocation.
template <int few>
class NumbersIn {
 public:
    static_assert(few % 4 == 0);

    NumbersIn() = default;
    NumbersIn(const NumbersIn& o) { *this = o; }
    NumbersIn(NumbersIn&& o) noexcept { *this = std::move(o); }
    template <InFours E>
    [[gnu::always_inline]] NumbersIn(const E& e) {
        *this = e;
    }
    [[gnu::always_inline]] ~NumbersIn() {
        if (at_ != few_) [[unlikely]]
            release(at_);
    }
    [[gnu::always_inline]] NumbersIn& operator=(const NumbersIn& o) { return *this = o.all(); }
    [[gnu::always_inline]] NumbersIn& operator=(NumbersIn&& o) noexcept {
        if (o.at_ != o.few_) [[unlikely]]
            take(o);
        else
            *this = o.all();
        return *this;
    }
    template <InFours E>
    [[gnu::always_inline]] NumbersIn& operator=(const E& e) {
        const int n = e.size();
        double* before = nullptr;  // it may be what is assigned
        if (n > room_) [[unlikely]]
            before = widen(n);
        size_ = n;
        double* const to = at_;
        for (int k = 0; k < n; k += 4) e.four(k).store(to + k);
        if (before != nullptr) [[unlikely]]
            release(before);
        return *this;
    }
    static NumbersIn zeros(int size) {
        NumbersIn out;
        out.reach(size);
        return out;
    }

    int size() const { return size_; }
    [[gnu::always_inline]] NumbersAt all() const { return {at_, size_}; }
    [[gnu::always_inline]] Pack<4> four(int k) const { return all().four(k); }
    [[gnu::always_inline]] void reach(int size) {
        if (size > size_) grow((size + 3) / 4 * 4);
    }
    // That many, whose values are to follow.
    [[gnu::always_inline]] double* resized(int size) {
        if (size > room_) [[unlikely]]
            release(widen(size));
        size_ = size;
        return at_;
    }
    template <class Index>
    [[gnu::always_inline]] double operator[](Index k) const {
        return static_cast<int>(k) < size_ ? at_[k] : 0.0;
    }
    template <class Index>
    [[gnu::always_inline]] double& operator[](Index k) {
        reach(static_cast<int>(k) + 1);
        return at_[k];
    }
    double* data() { return at_; }
    const double* data() const { return at_; }
    double* begin() { return at_; }
    double* end() { return at_ + size_; }
    const double* begin() const { return at_; }
    const double* end() const { return at_ + size_; }

    friend bool operator==(const NumbersIn& a, const NumbersIn& b) {
        const NumbersIn &less = a.size_ < b.size_ ? a : b, &more = a.size_ < b.size_ ? b : a;
        return std::equal(less.begin(), less.end(), more.begin()) &&
               std::all_of(more.begin() + less.size_, more.end(), [](double v) { return v == 0.0; });
    }

 private:
    // What is rare is not inlined.
    [[gnu::noinline, gnu::cold]] static void release(double* many) { delete[] many; }
    [[gnu::noinline, gnu::cold]] void take(NumbersIn& o) {
        if (at_ != few_) release(at_);
        at_ = std::exchange(o.at_, o.few_);
        size_ = std::exchange(o.size_, 0);
        room_ = std::exchange(o.room_, few);
    }
    // Makes room for so many. Returns what there was allocated before.
    [[gnu::noinline, gnu::cold]] double* widen(int size) {
        const int room = std::max(size, 2 * room_);
        double* const before = std::exchange(at_, new double[static_cast<std::size_t>(room)]);
        room_ = room;
        return before == few_ ? nullptr : before;
    }
    [[gnu::noinline]] void grow(int size) {
        if (size > room_) {
            const double* from = at_;
            double* before = widen(size);
            std::copy_n(from, size_, at_);
            release(before);
        }
        std::fill(at_ + size_, at_ + size, 0.0);
        size_ = size;
    }

    double* at_ = few_;
    int size_ = 0, room_ = few;
    double few_[few];
};
using Numbers = NumbersIn<32>;

// What an expression keeps of its parts: of an array where it is, of another expression all.
template <InFours E>
[[gnu::always_inline]] inline auto part_of(const E& e) {
    if constexpr (requires { e.all(); })
        return e.all();
    else
        return e;
}
template <InFours A, class Act>
[[gnu::always_inline]] inline auto each_four(const A& a, Act&& act) {
    return Computed{a.size(), [a = part_of(a), act](int k) ALWAYS_INLINE { return act(a.four(k)); }};
}
template <InFours A, InFours B, class Act>
[[gnu::always_inline]] inline auto each_four(const A& a, const B& b, Act&& act) {
    return Computed{std::max(a.size(), b.size()),
                    [a = part_of(a), b = part_of(b), act](int k) ALWAYS_INLINE { return act(a.four(k), b.four(k)); }};
}
template <InFours A, InFours B>
[[gnu::always_inline]] inline auto operator+(const A& a, const B& b) {
    return each_four(a, b, [](const Pack<4>& x, const Pack<4>& y) ALWAYS_INLINE { return x + y; });
}
template <InFours A, InFours B>
[[gnu::always_inline]] inline auto operator*(const A& a, const B& b) {
    return each_four(a, b, [](const Pack<4>& x, const Pack<4>& y) ALWAYS_INLINE { return x * y; });
}
template <InFours A>
[[gnu::always_inline]] inline auto operator*(double factor, const A& a) {
    return each_four(a, [factor](const Pack<4>& x) ALWAYS_INLINE { return factor * x; });
}
template <InFours A>
[[gnu::always_inline]] inline auto absolute(const A& a) {
    return each_four(a, [](const Pack<4>& x) ALWAYS_INLINE { return absolute(x); });
}
template <InFours A, InFours B>
[[gnu::always_inline]] inline auto max_of(const A& a, const B& b) {
    return each_four(a, b, [](const Pack<4>& x, const Pack<4>& y) ALWAYS_INLINE { return max_of(x, y); });
}
template <InFours A>
[[gnu::always_inline]] inline auto at_most(const A& a, double bound) {
    return each_four(a, [bound](const Pack<4>& x) ALWAYS_INLINE { return at_most(x, bound); });
}
template <InFours A>
[[gnu::always_inline]] inline double sum_of(const A& a) {
    double all = 0.0;
    for (int k = 0; k < a.size(); k += 4) all += a.four(k).sum();
    return all;
}
template <int n>
[[gnu::always_inline]] inline double sum_of(const Pack<n>& a) {
    return a.sum();
}
// The sums of four.
template <InFours A, InFours B, InFours C, InFours E>
[[gnu::always_inline]] inline Pack<4> sums(const A& a, const B& b, const C& c, const E& d) {
    Pack<4> all{};
    for (int k = 0; k < std::max({a.size(), b.size(), c.size(), d.size()}); k += 4)
        all = all + sums(a.four(k), b.four(k), c.four(k), d.four(k));
    return all;
}
template <int few>
NumbersIn<few> magnitudes(const NumbersIn<few>& v) {
    return absolute(v);
}

}  // namespace lostmotion
