// Linear forms of a train while it is composed, by its layout. Those of a small train allocate nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
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

// Coefficients of a form, as many as have been asked for: what lies beyond is zero.
class Coefficients {
 public:
    Coefficients() {}
    Coefficients(const Coefficients& o) { *this = o; }
    Coefficients(Coefficients&& o) noexcept { *this = std::move(o); }
    Coefficients& operator=(const Coefficients& o) {
        size_ = o.size_;
        if (size_ > few && many_ == nullptr) many_ = room_for_all();
        copy(o.begin(), size_, data());
        return *this;
    }
    Coefficients& operator=(Coefficients&& o) noexcept {
        if (o.many_ == nullptr) return *this = std::as_const(o);
        size_ = o.size_;
        std::swap(many_, o.many_);
        if (o.many_ == nullptr) o.size_ = 0;
        return *this;
    }

    std::size_t size() const { return size_; }
    // Makes room for as many and, so that loops need no remainder, up to three more.
    void reach(std::size_t size) {
        if (size <= size_) return;
        const std::size_t whole = (size + 3) / 4 * 4;
        if (whole > few && many_ == nullptr) {
            many_ = room_for_all();
            copy(few_.data(), size_, many_->data());
        }
        for (double *to = data() + size_, *end = data() + whole; to != end; to += 4) std::fill_n(to, 4, 0.0);
        size_ = whole;
    }
    template <class Index>
    double operator[](Index k) const {
        return static_cast<std::size_t>(k) < size_ ? begin()[k] : 0.0;
    }
    template <class Index>
    double& operator[](Index k) {
        reach(static_cast<std::size_t>(k) + 1);
        return data()[k];
    }
    const double* begin() const { return many_ == nullptr ? few_.data() : many_->data(); }
    const double* end() const { return begin() + size_; }
    double* data() { return many_ == nullptr ? few_.data() : many_->data(); }

 private:
    static constexpr std::size_t few = 20;
    static_assert(few % 4 == 0 && max_columns % 4 == 0);
    static void copy(const double* from, std::size_t size, double* to) {  // in fours
        for (std::size_t k = 0; k < size; k += 4) std::memcpy(to + k, from + k, 4 * sizeof(double));
    }
    using Many = std::array<double, max_columns>;
    static std::unique_ptr<Many> room_for_all() { return std::make_unique_for_overwrite<Many>(); }

    // As far as size_; the many, once there have been more than a few.
    std::size_t size_ = 0;
    std::unique_ptr<Many> many_;
    std::array<double, few> few_;
};

// sum_k c[k] * term[k]
struct Row {
    Coefficients c;

    static Row unit(int term, double factor = 1.0);
    Row& operator+=(const Row& o);
    Row& operator-=(const Row& o);
    Row& operator*=(double a);
    friend Row operator+(const Row& a, const Row& b) {
        return copy(a, [&](Row& out) { out += b; });
    }
    friend Row operator-(const Row& a, const Row& b) {
        return copy(a, [&](Row& out) { out -= b; });
    }
    friend Row operator*(double a, const Row& f) {
        return copy(f, [&](Row& out) { out *= a; });
    }
    friend Row operator/(const Row& f, double a) { return 1.0 / a * f; }
    friend Row operator-(const Row& f) { return -1.0 * f; }

 private:
    template <class Change>
    static Row copy(const Row& f, Change&& change) {
        Row out = f;
        change(out);
        return out;
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
