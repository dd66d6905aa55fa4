// A train of the C interface, and what its functions share.
#pragma once

#include <algorithm>
#include <cmath>
#include <exception>
#include <string>
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
    // width: of an entry.
    NumberLists& list(const double* from, std::size_t n, std::size_t width) {
        missing_ = missing_ || (from == nullptr && n > 0);
        numbers_.push_back(static_cast<double>(n));
        if (from != nullptr) numbers_.insert(numbers_.end(), from, from + n * width);
        return *this;
    }
    // What is wrong with the part that is described so.
    template <class Part>
    std::string read(Part& to) const {
        if (missing_) return "has no numbers";
        lostmotion::FieldReader f(numbers_);
        describe(f, to);
        return f.error();
    }

 private:
    std::vector<double> numbers_;
    bool missing_ = false;
};
