// The C interface: trains, element by element.
#include "train.hpp"

#include <new>
#include <optional>
#include <span>
#include <utility>

namespace lm = lostmotion;

namespace {

using Values = std::span<const lm_value>;
using Texts = std::vector<std::string>;

// The numbers of a description of an element: what is given by key, and all else as the element has it.
class KeyedNumbers : public lm::FieldWriter {
 public:
    explicit KeyedNumbers(Values values) : values_(values), used_(values.size()) {}

    using FieldWriter::integer;  // the law of a curve, which has no key here
    void number(const char* key, double v, Range = Range::any) { numbers.push_back(value(key, v)); }
    void number(const lm::Field& field, double v) { number(field.key, v); }
    template <class Integer>
    void integer(const lm::Field& field, Integer v, long long, long long) {
        number(field.key, static_cast<double>(v));
    }
    template <class Enum>
    void choice(const char* key, Enum& v, std::initializer_list<const char*> names) {
        number(key, static_cast<double>(static_cast<int>(v)));
        for (std::size_t k = 0; k < names.size(); ++k)
            if (numbers.back() == static_cast<double>(k)) v = static_cast<Enum>(k);
    }
    void flag(const char* key, bool v) { number(key, v); }
    void flag(const lm::Field& field, bool v) { number(field.key, v); }
    void list(const char* key, const std::vector<double>& v, Range = Range::any) {
        const lm_value* given = find(key);
        FieldWriter::list(key, given == nullptr ? v : ::list(given->values, given->n));
    }
    template <class... Entries>
    void list(const lm::Field& field, const std::vector<double>& v, Entries...) {
        list(field.key, v);
    }
    template <class T, class Use>
    void optional(const char* key, std::optional<T>& v, const T& initial, Use&& use) {
        if (is_given(key)) v = initial;
        const lm::FieldPath::Step here(path_, key);
        FieldWriter::optional(key, v, initial, use);
    }
    template <class Use>
    void part(const char* key, Use&& use) {
        const lm::FieldPath::Step here(path_, key);
        use();
    }
    template <class Curve>
    void curve(const char* key, Curve& v) {
        part(key, [&] { describe(*this, v); });
    }
    template <class Curve>
    void curve_if(const char* key, bool& there, Curve& v) {
        there = there || is_given(key);
        FieldWriter::flag(key, there);
        if (there) curve(key, v);
    }
    // What is wrong with what was given, or nothing.
    std::string wrong() const {
        for (std::size_t k = 0; k < values_.size(); ++k) {
            const std::string key = ::text(values_[k].key);
            if (!used_[k]) return "there is no '" + key + "'";
            if (values_[k].values == nullptr) return key + " has no numbers";
        }
        return not_one_.empty() ? not_one_ : not_one_ + " must be one number";
    }

 private:
    double value(const char* key, double otherwise) {
        const lm_value* given = find(key);
        if (given == nullptr || given->values == nullptr) return otherwise;
        if (given->n != 1) not_one_ = given->key;
        return given->n == 1 ? *given->values : otherwise;
    }
    const lm_value* find(const char* key) {
        const lm_value* found = nullptr;
        for (std::size_t k = 0; k < values_.size(); ++k)
            if (::text(values_[k].key) == path_.to(key)) {
                used_[k] = true;
                found = &values_[k];
            }
        return found;
    }
    bool is_given(const char* part) const {
        const std::string begin = path_.to(part) + '.';
        return std::ranges::any_of(values_, [&](const lm_value& v) { return ::text(v.key).starts_with(begin); });
    }

    Values values_;
    std::vector<bool> used_;
    std::string not_one_;
    lm::FieldPath path_;
};

bool is_taken(const lm::model::Train& t, const std::string& name) {
    bool taken = false;
    const auto any = [&](const char*, const char*, const auto& elements) {
        taken = taken || std::ranges::any_of(elements, [&](const auto& e) { return e.name == name; });
    };
    any("", "", t.shafts);
    any("", "", t.motors);
    any("", "", t.gears);
    lm::model::Train::each_kind(t, any);
    lm::model::Train::each_coupling_kind(t, any);
    return taken;
}

std::string add(lm::model::TrainDescription& train, const std::string& table, const std::string& name, const Texts& on,
                Values values) {
    if (name.empty()) return "an element has no name";
    if (is_taken(train.train, name)) return "the name '" + name + "' is taken; use another one";
    std::string wrong = "there is no table '" + table + "'";
    // An element of this name with its numbers, on one number of shafts or another.
    const auto add_one = [&](const char* one, auto element, std::size_t fewest, std::size_t most, auto&& describe,
                             auto&& put) {
        const std::string what = one + (" '" + name + "'");
        element.name = name;
        KeyedNumbers given(values);
        describe(given, element);
        lm::FieldReader f(given.numbers);
        wrong = given.wrong();
        if (wrong.empty() && (on.size() < fewest || on.size() > most))
            wrong = "is on " + std::to_string(on.size()) + " shafts; it must be on " + std::to_string(fewest);
        if (wrong.empty()) describe(f, element);
        if (wrong.empty()) wrong = f.error();
        if (wrong.empty())
            put(std::move(element));
        else
            wrong = what + ": " + wrong;
    };
    const auto own = [](auto& f, auto& element) { element.describe(f); };
    const auto own_and_law = [](auto& f, auto& element) {
        element.law.describe(f);
        element.describe(f);
    };
    const auto put_on_one = [&](auto element) { train.add(std::move(element), on[0]); };
    const auto put_between = [&](auto element) { train.add(std::move(element), on[0], on[1]); };
    if (table == "shafts")
        add_one(
            "shaft", lm::model::Shaft(), 0, 0, [](auto& f, lm::model::Shaft& s) { describe(f, s); },
            [&](lm::model::Shaft s) { train.add_shaft(std::move(s)); });
    if (table == "mass_matrices") {
        std::vector<double> flat(on.size() * on.size());
        const auto put = [&](const lm::model::MassMatrix&) {
            std::vector<std::vector<double>> rows;
            for (std::size_t k = 0; k < on.size() && flat.size() == on.size() * on.size(); ++k)
                rows.emplace_back(&flat[k * on.size()], &flat[k * on.size()] + on.size());
            train.add_mass_matrix(name, on, std::move(rows));
        };
        add_one(
            "mass matrix", lm::model::MassMatrix(), 1, on.size(),
            [&](auto& f, const lm::model::MassMatrix&) { f.list("matrix", flat); }, put);
    }
    if (table == "motors") add_one("motor", lm::model::ShaftMotor(), 1, 1, own_and_law, put_on_one);
    if (table == "gears") {
        if (on.size() == 3 &&
            std::ranges::find(train.train.shafts, on[2], &lm::model::Shaft::name) == train.train.shafts.end())
            return "gear '" + name + "': there is no shaft '" + on[2] + "' for its housing";
        add_one("gear", lm::model::Gear(), 2, 3, own_and_law, [&](lm::model::Gear gear) {
            put_between(std::move(gear));
            if (on.size() == 3) train.set_housing(name, on[2]);
        });
    }
    lm::model::Train::each_kind(train.train, [&](const char* its, const char* one, const auto& elements) {
        using Element = typename std::decay_t<decltype(elements)>::value_type;
        if (table == its) add_one(one, Element(), 1, 1, own, put_on_one);
    });
    lm::model::Train::each_coupling_kind(train.train, [&](const char* its, const char* one, const auto& elements) {
        using Element = typename std::decay_t<decltype(elements)>::value_type;
        if (table == its) add_one(one, Element(), 2, 2, own, put_between);
    });
    return wrong;
}

}  // namespace

extern "C" {

int lm_interface_version(void) { return LM_INTERFACE_VERSION; }

lm_train* lm_train_new(void) { return new (std::nothrow) lm_train; }
void lm_train_free(lm_train* train) { delete train; }
const char* lm_train_error(const lm_train* train) { return train->error.c_str(); }

int lm_add(lm_train* train, const char* table, const char* name, const char* const* shafts, size_t n_shafts,
           const lm_value* values, size_t n) {
    Texts on;
    for (size_t k = 0; k < n_shafts; ++k) on.push_back(text(shafts[k]));
    return train->attempt([&] { return add(train->description, text(table), text(name), on, {values, n}); });
}

}  // extern "C"
