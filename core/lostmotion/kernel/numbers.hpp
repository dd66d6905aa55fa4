// What form.hpp has in registers and arrays of compile-time sizes, for trains of any size. All sums are added up in the
// same order there.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dims.hpp"
#include "vec.hpp"

namespace lostmotion {

// Up to so many coupled states, whole matrices cost less than what of them is not zero.
inline constexpr int few_states = 16;

// Numbers that are computed with at once, in whole fours.
class Numbers : public Few<double, few_states> {
 public:
    using Few::operator=;
    Numbers() = default;

    // Takes them from where there are so many, a multiple of four.
    static Numbers load(const double* from, std::size_t count) {
        Numbers out;
        out.reach(count);
        std::copy_n(from, count, out.data());
        return out;
    }
    void store(double* to, std::size_t count) const {
        for (std::size_t k = 0; k < count; ++k) to[k] = (*this)[k];
    }
    void set(int k, double number) { (*this)[k] = number; }
    // act(four of this, four of the other) for all of both.
    template <class Act>
    [[gnu::always_inline]] Numbers& each_four(const Numbers& o, Act&& act) {
        reach(o.size());
        double* to = data();
        const double* from = o.data();
        for (std::size_t k = 0; k < o.size(); k += 4) act(Pack<4>::load(to + k), Pack<4>::load(from + k)).store(to + k);
        return *this;
    }
    template <class Act>
    [[gnu::always_inline]] Numbers& each_four(Act&& act) {
        double* to = data();
        for (std::size_t k = 0; k < size(); k += 4) act(Pack<4>::load(to + k)).store(to + k);
        return *this;
    }
    [[gnu::always_inline]] double sum() const {
        double all = 0.0;
        for (std::size_t k = 0; k < size(); k += 4) all += Pack<4>::load(data() + k).sum();
        return all;
    }
    friend Numbers operator+(Numbers a, const Numbers& b) {
        a.each_four(b, [](Pack<4> x, const Pack<4>& y) { return x + y; });
        return a;
    }
    friend Numbers operator*(double a, Numbers b) {
        b.each_four([a](const Pack<4>& x) { return a * x; });
        return b;
    }
    // Beyond the shorter of them there is nothing but zeros.
    friend Numbers operator*(Numbers a, const Numbers& b) {
        a.reach(b.size());
        double* to = a.data();
        for (std::size_t k = 0; k < a.size(); k += 4)
            (k < b.size() ? Pack<4>::load(to + k) * Pack<4>::load(b.data() + k) : Pack<4>{}).store(to + k);
        return a;
    }
    friend Numbers absolute(Numbers a) {
        a.each_four([](const Pack<4>& x) { return lostmotion::absolute(x); });
        return a;
    }
    friend Numbers max_of(Numbers a, const Numbers& b) {
        a.each_four(b, [](const Pack<4>& x, const Pack<4>& y) { return lostmotion::max_of(x, y); });
        return a;
    }
    friend Numbers at_most(Numbers a, double bound) {
        a.each_four([bound](const Pack<4>& x) { return lostmotion::at_most(x, bound); });
        return a;
    }
    // The sum of the products.
    friend double product(const Numbers& a, const Numbers& b) {
        double all = 0.0;
        for (std::size_t k = 0; k < std::min(a.size(), b.size()); k += 4)
            all += (Pack<4>::load(a.data() + k) * Pack<4>::load(b.data() + k)).sum();
        return all;
    }
};
inline Pack<4> sums(const Numbers& a, const Numbers& b, const Numbers& c, const Numbers& d) {
    return Pack<4>::of({a.sum(), b.sum(), c.sum(), d.sum()});
}
template <class T, std::size_t few>
Few<T, few> magnitudes(Few<T, few> v) {
    for (T& x : v) x = std::fabs(x);
    return v;
}

// A linear expression with few terms, in the order of their places.
class AnyForm {
 public:
    struct Term {
        int place;
        double factor;
    };
    class Coefficients {
     public:
        double operator[](int place) const {
            const auto at = find(place);
            return at != terms_.end() && at->place == place ? at->factor : 0.0;
        }
        double& operator[](int place) {
            auto at = terms_.begin() + (find(place) - terms_.begin());
            if (at == terms_.end() || at->place != place) at = terms_.insert(at, {place, 0.0});
            return at->factor;
        }
        const std::vector<Term>& terms() const { return terms_; }
        std::vector<Term>& terms() { return terms_; }

     private:
        std::vector<Term>::const_iterator find(int place) const {
            return std::lower_bound(terms_.begin(), terms_.end(), place,
                                    [](const Term& t, int p) { return t.place < p; });
        }
        std::vector<Term> terms_;
    };
    Coefficients c;

    AnyForm& operator+=(const AnyForm& o) {
        for (const Term& t : o.c.terms()) c[t.place] += t.factor;
        return *this;
    }
    AnyForm& operator*=(double a) {
        for (Term& t : c.terms()) t.factor *= a;
        return *this;
    }
    friend AnyForm operator*(double a, AnyForm f) { return f *= a; }
    // Calls use(place, factor) for each term.
    template <class Use>
    void each_term(Use&& use) const {
        for (const Term& t : c.terms()) use(t.place, t.factor);
    }
    // Terms of the places from `first` on to `end`.
    std::pair<const Term*, const Term*> between(int first, int end) const {
        const Term* begin = c.terms().data();
        const Term* last = begin + c.terms().size();
        const auto below = [](const Term& t, int p) { return t.place < p; };
        const Term* from = std::lower_bound(begin, last, first, below);
        return {from, std::lower_bound(from, last, end, below)};
    }
    // sum factor value(place) over the coupled states, in fours.
    template <class Value>
    static double sum_of_coupled(const Term* t, const Term* end, Value&& value) {
        double all = 0.0;
        while (t != end) {
            const int four = t->place / 4;
            double part[4] = {};
            for (; t != end && t->place / 4 == four; ++t) part[t->place % 4] = value(*t);
            all += (part[0] + part[1]) + (part[2] + part[3]);
        }
        return all;
    }
};

}  // namespace lostmotion
