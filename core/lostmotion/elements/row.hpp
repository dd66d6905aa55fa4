// Linear forms of a train while it is composed, by its layout.
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

#include "../base/few.hpp"

namespace lostmotion::model {

// The order of the terms of a form: [coupled states][angles][1][memory][inputs], then [reactions of stuck contacts].
// The names are those of the kernel's dimensions.
struct Layout {
    int coupled = 0, angles = 0, inputs = 0, memory = 0, contacts = 0, branches = 0;
    int states = 0, one = 0, first_memory = 0, first_input = 0, terms = 0;

    void arrange();
};

using Coefficients = Few<double, 20>;

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
