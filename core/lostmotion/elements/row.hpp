// Linear forms of a train while it is composed, by its layout. Those of a small train allocate nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <type_traits>
#include <utility>

namespace lostmotion::model {

inline constexpr int max_shafts = 16, max_contacts = 32, max_terms = 72, max_columns = max_terms + max_contacts;
inline constexpr int max_branches = 64, max_guards = 256, max_memory = 32, max_inputs = 24, max_states = 40;

// The order of the terms of a form: [coupled states][angles][1][memory][inputs], then [reactions of stuck contacts].
// The names are those of the kernel's dimensions.
struct Layout {
    int coupled = 0, angles = 0, inputs = 0, memory = 0, contacts = 0, branches = 0;
    int states = 0, one = 0, first_memory = 0, first_input = 0, terms = 0;

    void arrange();
};

// Coefficients of a form. The first few are there always; the others, as many as have been asked for: what lies beyond
// is zero.
class Coefficients {
 public:
    static constexpr std::size_t few = 20;

    Coefficients() = default;
    Coefficients(const Coefficients& o) { *this = o; }
    Coefficients(Coefficients&& o) noexcept { *this = std::move(o); }
    Coefficients& operator=(const Coefficients& o) {
        if (many_ == nullptr && o.many_ == nullptr)
            few_ = o.few_;
        else
            copy(o.begin(), o.size(), as_many_as(o));
        return *this;
    }
    Coefficients& operator=(Coefficients&& o) noexcept {
        if (o.many_ == nullptr) return *this = std::as_const(o);
        std::swap(size_, o.size_);
        std::swap(many_, o.many_);
        return *this;
    }

    std::size_t size() const { return many_ == nullptr ? few : size_; }
    // As many as others, whose values are to follow.
    double* as_many_as(const Coefficients& o) {
        if (o.many_ != nullptr && many_ == nullptr) many_ = room_for_all();
        size_ = o.size();
        return data();
    }
    // Makes room for as many and, so that loops need no remainder, up to three more.
    void reach(std::size_t size) {
        if (size > this->size()) grow(size);
    }
    template <class Index>
    double operator[](Index k) const {
        return static_cast<std::size_t>(k) < size() ? begin()[k] : 0.0;
    }
    template <class Index>
    double& operator[](Index k) {
        reach(static_cast<std::size_t>(k) + 1);
        return data()[k];
    }
    const double* begin() const { return many_ == nullptr ? few_.data() : many_->data(); }
    const double* end() const { return begin() + size(); }
    double* data() { return many_ == nullptr ? few_.data() : many_->data(); }

 private:
    static_assert(few % 4 == 0 && max_columns % 4 == 0);
    static void copy(const double* from, std::size_t size, double* to) {  // in fours
        for (std::size_t k = 0; k < size; k += 4) std::memcpy(to + k, from + k, 4 * sizeof(double));
    }
    using Many = std::array<double, max_columns>;
    static std::unique_ptr<Many> room_for_all() { return std::make_unique_for_overwrite<Many>(); }
    void grow(std::size_t size);

    std::array<double, few> few_{};  // where there are not many
    std::unique_ptr<Many> many_;     // as far as size_
    std::size_t size_ = 0;
};

// sum_k c[k] * term[k]
struct Row {
    // A multiple of a row that outlives it: sums add it without a copy.
    struct Scaled {
        double factor;
        const Row& row;
    };
    template <class T>
    static constexpr bool is_summand =
        std::is_same_v<std::remove_cvref_t<T>, Row> || std::is_same_v<std::remove_cvref_t<T>, Scaled>;

    Coefficients c;

    Row() = default;
    Row(Scaled&& of);
    static Row unit(int term, double factor = 1.0);
    Row& operator+=(const Row& o);
    Row& operator-=(const Row& o);
    Row& operator+=(Scaled&& o);
    Row& operator-=(Scaled&& o) { return *this += Scaled{-o.factor, o.row}; }
    Row& operator*=(double a);
    template <class A, class B>
        requires is_summand<A> && is_summand<B>
    friend Row operator+(A&& a, B&& b) {
        Row out = std::forward<A>(a);
        out += std::forward<B>(b);
        return out;
    }
    template <class A, class B>
        requires is_summand<A> && is_summand<B>
    friend Row operator-(A&& a, B&& b) {
        Row out = std::forward<A>(a);
        out -= std::forward<B>(b);
        return out;
    }
    friend Scaled operator*(double a, const Row& f) { return {a, f}; }
    friend Row operator*(double a, Scaled&& f) {
        Row out = std::move(f);
        out *= a;
        return out;
    }
    template <class A>
        requires is_summand<A>
    friend auto operator/(A&& f, double a) {
        return 1.0 / a * std::forward<A>(f);
    }
    template <class A>
        requires is_summand<A>
    friend auto operator-(A&& f) {
        return -1.0 * std::forward<A>(f);
    }
};

// Makes the forms that an element states.
class Terms {
 public:
    explicit Terms(const Layout& layout) : layout_(layout) {}
    Row state(int k, double factor = 1.0) const { return Row::unit(k, factor); }
    Row one(double factor = 1.0) const { return Row::unit(layout_.one, factor); }
    Row memory(int k, double factor = 1.0) const { return Row::unit(layout_.first_memory + k, factor); }
    Row input(int k, double factor = 1.0) const { return Row::unit(layout_.first_input + k, factor); }
    Row reaction(int contact) const { return Row::unit(layout_.terms + contact); }

 private:
    const Layout& layout_;
};

}  // namespace lostmotion::model
