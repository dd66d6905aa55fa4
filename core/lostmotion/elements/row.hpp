// Linear forms of a train while it is composed: run-time layout, fixed storage, so that nothing is allocated.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

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

// Coefficients of a form, as many as have been asked for: what lies beyond is zero.
class Coefficients {
 public:
    Coefficients() {}
    Coefficients(const Coefficients& o) : size_(o.size_) { std::copy_n(o.c_.begin(), size_, c_.begin()); }
    Coefficients& operator=(const Coefficients& o) {
        size_ = o.size_;
        std::copy_n(o.c_.begin(), size_, c_.begin());
        return *this;
    }

    std::size_t size() const { return size_; }
    // Makes room for as many and, so that loops need no remainder, up to three more.
    void reach(std::size_t size) {
        if (size <= size_) return;
        const std::size_t whole = (size + 3) / 4 * 4;
        std::fill(c_.begin() + static_cast<std::ptrdiff_t>(size_), c_.begin() + static_cast<std::ptrdiff_t>(whole),
                  0.0);
        size_ = whole;
    }
    template <class Index>
    double operator[](Index k) const {
        return static_cast<std::size_t>(k) < size_ ? c_[static_cast<std::size_t>(k)] : 0.0;
    }
    template <class Index>
    double& operator[](Index k) {
        reach(static_cast<std::size_t>(k) + 1);
        return c_[static_cast<std::size_t>(k)];
    }
    const double* begin() const { return c_.data(); }
    const double* end() const { return c_.data() + size_; }
    double* data() { return c_.data(); }

 private:
    std::size_t size_ = 0;
    std::array<double, max_columns> c_;  // as far as size_
};
static_assert(max_columns % 4 == 0);

// sum_k c[k] * term[k]
struct Row {
    Coefficients c;

    static Row unit(int term, double factor = 1.0);
    Row& operator+=(const Row& o);
    Row& operator-=(const Row& o);
    Row& operator*=(double a);
    friend Row operator+(Row a, const Row& b) { return a += b; }
    friend Row operator-(Row a, const Row& b) { return a -= b; }
    friend Row operator*(double a, Row f) { return f *= a; }
    friend Row operator/(Row f, double a) { return f *= 1.0 / a; }
    friend Row operator-(Row f) { return f *= -1.0; }
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
