// Parameters by name, from a dict of Python.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "arrays.hpp"
#include "lostmotion/scenario/fields.hpp"

namespace lostmotion::binding {

// Sets what a dict has, by name; the rest stays as it is. None stands for a key that is left out.
class NamedFields {
 public:
    static constexpr bool reads = true, by_name = true;
    using Range = lostmotion::Range;

    explicit NamedFields(nb::dict values) : values_(std::move(values)) {}

    bool well() const { return true; }
    void wrong(const std::string& name, const std::string& how) { throw nb::value_error((name + ' ' + how).c_str()); }

    void number(const char* name, double& v, Range = Range::any) {
        if (columns_.empty()) {
            take(name, v);
        } else if (const auto at = columns_.find(name); at != columns_.end()) {
            v = at->second[row_];
            ++used_;
        }
    }
    void number(const Field& field, double& v) { number(field.key, v); }
    void pair(const Field& field, std::array<double, 2>& v) { take(field.key, v); }
    template <class Integer>
    void integer(const char* name, Integer& v, long long, long long) {
        take(name, v);
    }
    template <class Integer>
    void integer(const Field& field, Integer& v, long long, long long) {
        take(field.key, v);
    }
    void flag(const char* name, bool& v) { take(name, v); }
    void text(const char* name, std::string& v) { take(name, v); }
    void texts(const char* name, std::vector<std::string>& v) { take(name, v); }
    void matrix(const char* name, std::vector<std::vector<double>>& v) { take(name, v); }
    void flag(const Field& field, bool& v) { take(field.key, v); }
    template <class Enum>
    void choice(const char* name, Enum& v, std::initializer_list<const char*> names) {
        std::string given;
        if (!take(name, given)) return;
        int k = 0;
        for (const char* each : names) {
            if (given == each) {
                v = static_cast<Enum>(k);
                return;
            }
            ++k;
        }
        wrong(name, "is " + given + ", which is none of its names");
    }
    void list(const char* name, std::vector<double>& v, Range = Range::any) { take(name, v); }
    void list(const Field& field, std::vector<double>& v) { take(field.key, v); }
    void list(const Field& field, std::vector<double>& v, Entries) { take(field.key, v); }
    template <class Use>
    void table(const Field& field, const char*, Use&& use) {
        part(field.key, use);
    }
    template <class Curve>
    void curve(const char* name, Curve& v) {
        take(name, v);
    }
    template <class Curve>
    void curve_if(const char* name, bool& there, Curve& v) {
        if (take(name, v)) there = true;
    }
    // A list of dicts; or, where all that an entry has is numbers, a dict with a list of each of these.
    template <class T, class Use>
    void each(const char* name, std::vector<T>& v, Use&& use) {
        if (nb::dict columns; values_.contains(name) && nb::try_cast(values_[name], columns)) {
            ++used_;
            within(columns, [&] {
                columns_ = nb::cast<std::map<std::string, std::vector<double>, std::less<>>>(columns);
                v.assign(columns_.empty() ? 0 : columns_.begin()->second.size(), T{});
                for (const auto& [key, column] : columns_)
                    if (column.size() != v.size()) wrong(key, "has another length");
                for (row_ = 0; row_ < v.size(); ++row_) {
                    used_ = 0;
                    use(v[row_]);
                }
                columns_.clear();
            });
            return;
        }
        std::vector<nb::dict> given;
        if (!take(name, given)) return;
        v.assign(given.size(), T{});
        for (std::size_t k = 0; k < given.size(); ++k) within(given[k], [&] { use(v[k]); });
    }
    template <class Use>
    void part(const char* name, Use&& use) {
        nb::dict given;
        if (take(name, given)) within(std::move(given), use);
    }
    template <class Use>
    void present(const char* name, bool& v, Use&& use) {
        part(name, [&] {
            v = true;
            use();
        });
    }
    template <class T, class Use>
    void optional(const char* name, std::optional<T>& v, const T& initial, Use&& use) {
        part(name, [&] {
            if (!v) v = initial;
            use(*v);
        });
    }
    // Whether it is given.
    template <class T>
    bool take(const char* name, T& v) {
        if (!values_.contains(name)) return false;
        ++used_;
        const nb::object given = values_[name];
        if (given.is_none()) return false;
        v = nb::cast<T>(given);
        return true;
    }
    // After all has been read.
    void refuse_unknown() const {
        if (used_ != values_.size()) wrong_keys();
    }

 private:
    template <class Use>
    void within(nb::dict inner, Use&& use) {
        std::swap(values_, inner);
        const std::size_t used = std::exchange(used_, 0);
        use();
        refuse_unknown();
        std::swap(values_, inner);
        used_ = used;
    }
    [[noreturn]] void wrong_keys() const {
        throw nb::value_error(("unknown keys among " + std::string(nb::repr(values_.keys()).c_str())).c_str());
    }

    nb::dict values_;
    std::map<std::string, std::vector<double>, std::less<>> columns_;
    std::size_t used_ = 0, row_ = 0;
};

// A part from a dict of its parameters. The describe() of the part, or that of its namespace, names them.
template <class T>
T described(const nb::dict& fields, T value = {}) {
    NamedFields f(fields);
    if constexpr (requires { value.describe(f); })
        value.describe(f);
    else
        describe(f, value);
    f.refuse_unknown();
    return value;
}

}  // namespace lostmotion::binding
