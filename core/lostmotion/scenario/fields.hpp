// Descriptions as rows of numbers: what writes one and what reads one, with every number, length and index checked.
//
// A structure is described once, by a function describe(fields, structure), which both call. A text is its length and
// its bytes, one number each; a list is its length and its entries; what may be absent is 0, or 1 and what it is.
// A Field also says what a parameter is; what documents parameters, and what sets them by name, calls the same
// function.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../base/decimal.hpp"
#include "../parts/field.hpp"

namespace lostmotion {

bool within(Range range, double v);
const char* range_text(Range range);

// Where in a description something stands, such as "gears[0].ratio".
class FieldPath {
 public:
    class Step {
     public:
        Step(FieldPath& path, std::string name) : path_(path) { path_.names_.push_back(std::move(name)); }
        ~Step() { path_.names_.pop_back(); }
        Step(const Step&) = delete;
        Step& operator=(const Step&) = delete;

     private:
        FieldPath& path_;
    };
    std::string to(const std::string& name) const;

 private:
    std::vector<std::string> names_;
};

class FieldWriter {
 public:
    static constexpr bool reads = false;
    using Range = lostmotion::Range;

    std::vector<double> numbers;

    bool well() const { return true; }
    void wrong(const std::string&, const std::string&) {}

    void number(const char*, double v, Range = Range::any) { numbers.push_back(v); }
    void number(const Field&, double v) { numbers.push_back(v); }
    void pair(const Field&, const std::array<double, 2>& v) { numbers.insert(numbers.end(), v.begin(), v.end()); }
    template <class Integer>
    void integer(const char*, Integer v, long long, long long) {
        numbers.push_back(static_cast<double>(v));
    }
    template <class Integer>
    void integer(const Field&, Integer v, long long, long long) {
        numbers.push_back(static_cast<double>(v));
    }
    template <class Enum>
    void choice(const char*, Enum v, std::initializer_list<const char*>) {
        numbers.push_back(static_cast<double>(static_cast<int>(v)));
    }
    void flag(const char*, bool v) { numbers.push_back(v ? 1.0 : 0.0); }
    void flag(const Field&, bool v) { numbers.push_back(v ? 1.0 : 0.0); }
    // What is there or not.
    template <class Use>
    void present(const char*, bool v, Use&& use) {
        numbers.push_back(v ? 1.0 : 0.0);
        if (v) use();
    }
    void text(const char*, const std::string& v);
    void texts(const char* name, std::vector<std::string>& v) {
        each(name, v, [&](std::string& entry) { text(name, entry); });
    }
    void list(const char*, const std::vector<double>& v, Range = Range::any);
    void matrix(const char* name, std::vector<std::vector<double>>& v) {
        each(name, v, [&](std::vector<double>& row) { list(name, row); });
    }
    void list(const Field& field, const std::vector<double>& v) { list(field.key, v); }
    void list(const Field& field, const std::vector<double>& v, Entries) { list(field.key, v); }
    template <class T, class Use>
    void each(const char*, std::vector<T>& v, Use&& use) {
        numbers.push_back(static_cast<double>(v.size()));
        for (T& entry : v) use(entry);
    }
    template <class T, class Use>
    void optional(const char* name, std::optional<T>& v, const T&, Use&& use) {
        flag(name, v.has_value());
        if (v) use(*v);
    }
    template <class Use>
    void part(const char*, Use&& use) {
        use();
    }
    template <class Curve>
    void curve(const char*, Curve& v) {
        describe(*this, v);
    }
    // A curve that is there or not.
    template <class Curve>
    void curve_if(const char* name, bool& there, Curve& v) {
        present(name, there, [&] { describe(*this, v); });
    }
};

class FieldReader {
 public:
    static constexpr bool reads = true;
    using Range = lostmotion::Range;

    explicit FieldReader(std::span<const double> numbers) : numbers_(numbers) {}

    bool well() const { return error_.empty(); }
    const std::string& error() const { return error_; }
    std::size_t left() const { return numbers_.size() - next_; }
    std::size_t place() const { return next_; }
    // The first thing that is wrong, and with what.
    void wrong(const std::string& name, const std::string& how) {
        if (well()) error_ = path_.to(name) + ' ' + how;
    }

    void number(const char* name, double& v, Range range = Range::any);
    // A key that may be left out may have the value that stands for that.
    void number(const Field& field, double& v);
    void pair(const Field& field, std::array<double, 2>& v);
    template <class Integer>
    void integer(const char* name, Integer& v, long long low, long long high) {
        const double given = take(name);
        if (!well()) return;
        if (!(given >= static_cast<double>(low) && given <= static_cast<double>(high)) || given != std::floor(given))
            return wrong(name, "is " + general_text(given, 10) + "; it must be a whole number from " +
                                   std::to_string(low) + " to " + std::to_string(high));
        v = static_cast<Integer>(given);
    }
    template <class Integer>
    void integer(const Field& field, Integer& v, long long low, long long high) {
        if (field.given == Given::may_be_left_out && left() > 0 && numbers_[next_] == static_cast<double>(v))
            ++next_;
        else
            integer(field.key, v, low, high);
    }
    template <class Enum>
    void choice(const char* name, Enum& v, std::initializer_list<const char*> names) {
        int given = 0;
        integer(name, given, 0, static_cast<int>(names.size()) - 1);
        if (well()) v = static_cast<Enum>(given);
    }
    void flag(const char* name, bool& v);
    void flag(const Field& field, bool& v) { flag(field.key, v); }
    template <class Use>
    void present(const char* name, bool& v, Use&& use) {
        flag(name, v);
        if (!well() || !v) return;
        const FieldPath::Step here(path_, name);
        use();
    }
    void text(const char* name, std::string& v);
    void texts(const char* name, std::vector<std::string>& v) {
        each(name, v, [&](std::string& entry) { text("", entry); });
    }
    void list(const char* name, std::vector<double>& v, Range range = Range::any);
    void matrix(const char* name, std::vector<std::vector<double>>& v) {
        each(name, v, [&](std::vector<double>& row) { list("", row); });
    }
    void list(const Field& field, std::vector<double>& v) { list(field.key, v, field.range); }
    void list(const Field& field, std::vector<double>& v, Entries) { list(field, v); }
    template <class T, class Use>
    void each(const char* name, std::vector<T>& v, Use&& use) {
        const std::size_t n = length(name);
        v.clear();
        for (std::size_t k = 0; k < n && well(); ++k) {
            const FieldPath::Step here(path_, name), entry(path_, '[' + std::to_string(k) + ']');
            v.emplace_back();
            use(v.back());
        }
    }
    // initial: of what is to be read.
    template <class T, class Use>
    void optional(const char* name, std::optional<T>& v, const T& initial, Use&& use) {
        bool given = false;
        flag(name, given);
        v.reset();
        if (!well() || !given) return;
        const FieldPath::Step here(path_, name);
        v = initial;
        use(*v);
    }
    template <class Use>
    void part(const char* name, Use&& use) {
        const FieldPath::Step here(path_, name);
        use();
    }
    template <class Curve>
    void curve(const char* name, Curve& v) {
        part(name, [&] { describe(*this, v); });
    }
    template <class Curve>
    void curve_if(const char* name, bool& there, Curve& v) {
        present(name, there, [&] { describe(*this, v); });
    }

 private:
    double take(const char* name);
    // Of a text or a list, each entry of which takes a number at least.
    std::size_t length(const char* name);

    std::span<const double> numbers_;
    std::size_t next_ = 0;
    FieldPath path_;
    std::string error_;
};

}  // namespace lostmotion
