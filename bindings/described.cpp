#include <algorithm>
#include <string_view>

#include "arrays.hpp"
#include "lostmotion/scenario/law_fields.hpp"
#include "module.hpp"

namespace lostmotion::binding {

namespace {

// Of each parameter that a scenario file may have: key, kind, symbol, unit, meaning, range (above, from on, up to),
// whether it is needed, its default, None where it is left out, and more: of a list the fewest and the most entries, of
// a table the name of its part.
class DescribedFields : public FieldVisitor {
 public:
    nb::list rows;

    using FieldVisitor::flag;
    using FieldVisitor::number;
    void number(const Field& field, double v = 0.0) { add(field, "number", limits(field.range), nb::float_(v)); }
    void pair(const Field& field, const std::array<double, 2>& v) {
        add(field, "pair", limits(field.range), nb::make_tuple(v[0], v[1]));
    }
    template <class Integer>
    void integer(const Field& field, Integer v, long long low, long long high) {
        const nb::object most = high == Entries::any ? nb::none() : nb::object(nb::int_(high));
        add(field, "integer", nb::make_tuple(nb::none(), low, most), nb::int_(v));
    }
    void flag(const Field& field, bool v) {
        add(field, "flag", nb::make_tuple(nb::none(), nb::none(), nb::none()), nb::bool_(v));
    }
    void list(const Field& field, const std::vector<double>& v) {
        list(field, v, {field.given == Given::needed ? 1 : 0});
    }
    void list(const Field& field, const std::vector<double>& v, Entries entries) {
        const nb::object most = entries.most == Entries::any ? nb::none() : nb::object(nb::int_(entries.most));
        add(field, "list", limits(field.range), nb::tuple(nb::cast(v)), nb::make_tuple(entries.fewest, most));
    }
    // Of what `use` describes only these keys, which are needed here.
    template <class Use>
    void need(std::initializer_list<std::string_view> keys, Use&& use) {
        needed_ = keys;
        use();
        needed_.clear();
    }
    template <class Use>
    void table(const Field& field, const char* part, Use&&) {
        add(field, "table", limits(Range::any), nb::dict(), nb::make_tuple(part));
    }

 private:
    std::vector<std::string_view> needed_;

    static nb::tuple limits(Range range) {
        const nb::object none = nb::none(), zero = nb::float_(0.0), one = nb::float_(1.0);
        switch (range) {
            case Range::above_one: return nb::make_tuple(one, none, none);
            case Range::positive:
            case Range::limit: return nb::make_tuple(zero, none, none);
            case Range::not_negative:
            case Range::limit_or_zero: return nb::make_tuple(none, zero, none);
            case Range::up_to_one: return nb::make_tuple(zero, none, one);
            case Range::share: return nb::make_tuple(none, zero, one);
            default: return nb::make_tuple(none, none, none);
        }
    }
    void add(const Field& field, const char* kind, const nb::tuple& range, const nb::object& value,
             const nb::object& more = nb::make_tuple()) {
        const bool chosen = std::ranges::find(needed_, field.key) != needed_.end();
        if (field.given == Given::none || chosen == needed_.empty()) return;
        rows.append(nb::make_tuple(field.key, kind, field.symbol, field.unit, field.meaning, range,
                                   chosen || field.given == Given::needed,
                                   !chosen && field.given == Given::has_default ? value : nb::none(), more));
    }
};

}  // namespace

void bind_described(nb::module_& m) {
    m.def(
        "described_tables",
        [](bool of_core) {
            nb::dict tables;
            const auto add = [&](const char* name, auto&& describe_table) {
                DescribedFields f;
                describe_table(f);
                tables[name] = f.rows;
            };
            if (of_core) {
                model::each_table(add);
                control::each_table(add);
            } else {
                laws::each_table(add);
            }
            return tables;
        },
        "of_core"_a,
        nb::sig("def described_tables(of_core: bool) -> dict[str, list[tuple[str, str, str, str, str, tuple[float | "
                "None, float | "
                "None, float | None], bool, typing.Any, tuple[typing.Any, ...]]]]"),
        "Of each part that the core takes by these keys, or of those of which it makes curves and filters, its "
        "parameters: "
        "key, kind, symbol, unit, meaning, range (above, from on, up to), "
        "whether it is needed, default, and more: of a list the fewest and the most entries, of a table the part.");
    m.def(
        "reference_blocks",
        [] {
            std::vector<std::tuple<std::string, std::string, std::string>> blocks;
            control::each_reference_block([&](const auto& b) { blocks.emplace_back(b.key, b.part, b.meaning); });
            return blocks;
        },
        "Of each block that shapes the reference: its table in a controller, its class, and what the table is.");
}

}  // namespace lostmotion::binding
