// A train of the C interface, and what its functions share.
#pragma once

#include <algorithm>
#include <cmath>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "lostmotion.h"
#include "lostmotion/model/train_description.hpp"
#include "lostmotion/scenario/part_fields.hpp"

// What change() returns as text, or what it throws, where there are exceptions.
template <class Change>
std::string attempted(Change&& change) {
#ifdef __cpp_exceptions
    try {
        return change();
    } catch (const std::exception& e) {
        return e.what();
    }
#else
    return change();
#endif
}

struct lm_train {
    lostmotion::model::TrainDescription description;
    std::string error;

    template <class Change>
    int attempt(Change&& change) {
        error = attempted(change);
        return error.empty() ? LM_OK : LM_INVALID;
    }
};

inline bool finite(const double* v, std::size_t n) {
    return v != nullptr && std::all_of(v, v + n, [](double x) { return std::isfinite(x); });
}
inline std::string text(const char* s) { return s == nullptr ? std::string() : std::string(s); }
inline std::vector<double> list(const double* from, std::size_t n) {
    return from == nullptr ? std::vector<double>() : std::vector<double>(from, from + n);
}

// Lists of numbers in the order of a description, each with its length.
class NumberLists {
 public:
    NumberLists& number(double v) {
        numbers_.push_back(v);
        return *this;
    }
    // width: of an entry.
    NumberLists& list(const double* from, std::size_t n, std::size_t width = 1) {
        missing_ = missing_ || (from == nullptr && n > 0);
        number(static_cast<double>(n));
        if (from != nullptr) numbers_.insert(numbers_.end(), from, from + n * width);
        return *this;
    }
    // The same in both directions. NULL: missing.
    NumberLists& curve(const lm_curve* c) {
        missing_ = missing_ || c == nullptr;
        number(0.0);
        for (int side = 0; side < 2 && c != nullptr; ++side)
            list(c->breaks, c->n_breaks).list(c->slopes, c->n_breaks + 1);
        return *this;
    }
    NumberLists& curve(const lm_periodic_curve* c) {
        missing_ = missing_ || c == nullptr;
        number(0.0);
        if (c != nullptr) number(c->period).list(c->angles, c->n).list(c->values, c->n);
        return number(0.0).number(1.0).number(0.0);  // of no sine
    }
    // What is wrong with the part that is described so.
    template <class Part>
    std::string read(Part& to, const std::string& what = {}) const {
        const std::string about = what.empty() ? what : what + ": ";
        if (missing_) return about + "has no numbers";
        lostmotion::FieldReader f(numbers_);
        if constexpr (requires { to.describe(f); })
            to.describe(f);
        else
            describe(f, to);
        return f.well() ? std::string() : about + f.error();
    }

 private:
    std::vector<double> numbers_;
    bool missing_ = false;
};
