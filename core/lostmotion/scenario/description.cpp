#include "description.hpp"

#include "../base/arctangent.hpp"
#include "../base/powers.hpp"
#include "../base/sine.hpp"

namespace lostmotion {

namespace {

// The keys of a part.
class KeySum : public FieldVisitor {
 public:
    explicit KeySum(Checksum& sum) : sum_(sum) {}

    using FieldVisitor::flag;
    using FieldVisitor::number;
    void number(const Field& field, double) { add(field); }
    void pair(const Field& field, const std::array<double, 2>&) { add(field); }
    template <class Integer>
    void integer(const Field& field, Integer, long long, long long) {
        add(field);
    }
    void flag(const Field& field, bool) { add(field); }
    void list(const Field& field, const std::vector<double>&) { add(field); }

 private:
    void add(const Field& field) { sum_.add(std::string_view(field.key)); }

    Checksum& sum_;
};

}  // namespace

double ScenarioDescription::version() {
    static const double of_keys = [] {
        Checksum sum;
        sum.add(layout);
        const auto add = [&](const char* part, auto&& describe_part) {
            sum.add(std::string_view(part));
            KeySum keys(sum);
            describe_part(keys);
        };
        model::each_table(add);
        control::each_table(add);
        return static_cast<double>(sum.value());
    }();
    return of_keys;
}

std::string ParameterRange::refuses(double v) const {
    const auto must = [v](const char* be, double limit) {
        return general_text(v, 10) + " must be " + be + ' ' + general_text(limit, 6);
    };
    return !(v > above)       ? must("greater than", above)
           : !(v >= at_least) ? must("at least", at_least)
           : !(v <= at_most)  ? must("at most", at_most)
                              : "";
}

namespace {

// As Python has it, also far out.
SineCosine sine_cosine_at(double angle) {
    constexpr double farthest = 0x1p42, turn = 2.0 * std::numbers::pi;
    if (!std::isfinite(angle)) return {std::nan(""), std::nan("")};
    return sine_cosine(std::fabs(angle) < farthest ? angle : std::fmod(angle, turn));
}

}  // namespace

std::optional<std::vector<double>> Derivation::values(std::span<const double> parameters) const {
    std::vector<double> v;
    v.reserve(formulas.size());
    for (const Formula& f : formulas) {
        const auto k = static_cast<std::size_t>(f.one), n = static_cast<std::size_t>(f.other);
        switch (f.law) {
            case Formula::parameter: v.push_back(parameters[k]); break;
            case Formula::constant: v.push_back(f.value); break;
            case Formula::sum: v.push_back(v[k] + v[n]); break;
            case Formula::difference: v.push_back(v[k] - v[n]); break;
            case Formula::product: v.push_back(v[k] * v[n]); break;
            case Formula::quotient: v.push_back(v[k] / v[n]); break;
            case Formula::root: v.push_back(std::sqrt(v[k])); break;
            case Formula::sine: v.push_back(sine_cosine_at(v[k]).sin); break;
            case Formula::cosine: v.push_back(sine_cosine_at(v[k]).cos); break;
            case Formula::arctangent: v.push_back(arctangent(v[k], 1.0)); break;
            case Formula::cube_root: v.push_back(cube_root(v[k])); break;
            case Formula::worm_driving: v.push_back(model::MeshEfficiency::worm(v[k], v[n]).driving()); break;
            case Formula::worm_overrunning: v.push_back(model::MeshEfficiency::worm(v[k], v[n]).overrunning()); break;
        }
    }
    const auto met = [&v](const Condition& c) {
        const double a = v[static_cast<std::size_t>(c.one)], b = v[static_cast<std::size_t>(c.other)];
        const bool so = c.comparison == Condition::less ? a < b : c.comparison == Condition::at_most ? a <= b : a == b;
        return so == c.holds;
    };
    if (!std::all_of(conditions.begin(), conditions.end(), met)) return {};
    return v;
}

std::vector<double> ScenarioDescription::write(Scenario scenario, std::vector<ScenarioParameter> parameters,
                                               Derivation derivation) {
    FieldWriter body;
    describe(body, scenario);
    return write(body.numbers, std::move(parameters), std::move(derivation));
}

std::vector<double> ScenarioDescription::write(const std::vector<double>& body,
                                               std::vector<ScenarioParameter> parameters, Derivation derivation) {
    FieldWriter f;
    f.numbers = {mark, version(), 0.0, static_cast<double>(body.size())};
    f.numbers.insert(f.numbers.end(), body.begin(), body.end());
    describe(f, parameters, derivation, body.size());
    f.numbers[2] = checksum(f.numbers);
    return std::move(f.numbers);
}

double ScenarioDescription::checksum(std::span<const double> numbers) {
    Checksum sum;
    sum.add(numbers.subspan(head - 1));
    return sum.value();
}

std::string ScenarioDescription::set(std::size_t k, double value) {
    if (k >= parameters_.size()) return "there is no parameter of this number";
    std::vector<double> values = values_of_parameters();
    values[k] = value;
    return set_all(values);
}

std::string ScenarioDescription::set_all(std::span<const double> values) {
    if (values.size() != parameters_.size()) return "there are " + std::to_string(parameters_.size()) + " parameters";
    const std::vector<double> before = values_of_parameters();
    std::string changed;
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (values[k] == before[k]) continue;
        const std::string& key = parameters_[k].key;
        if (!std::isfinite(values[k])) return "parameter " + key + ": it must be finite";
        if (std::string wrong = parameters_[k].range.refuses(values[k]); !wrong.empty())
            return "parameter " + key + ": " + wrong;
        changed += (changed.empty() ? "parameter " : ", ") + key;
    }
    for (std::size_t k = 0; k < values.size(); ++k) parameters_[k].value = values[k];
    const std::string error = changed.empty() ? "" : apply();
    if (error.empty()) return {};
    for (std::size_t k = 0; k < values.size(); ++k) parameters_[k].value = before[k];
    return changed + ": " + error;
}

std::vector<double> ScenarioDescription::values_of_parameters() const {
    std::vector<double> values;
    for (const ScenarioParameter& p : parameters_) values.push_back(p.value);
    return values;
}

std::string ScenarioDescription::set_times(double duration, double interval) {
    if (!(std::isfinite(duration) && std::isfinite(interval) && duration > 0.0 && interval > 0.0 &&
          duration / interval <= max_samples))
        return "duration and sample interval must be > 0, and the samples at most 1e8";
    times_ = {duration, interval};
    use_given();
    return {};
}

std::string ScenarioDescription::set_input(std::size_t k, Signal signal) {
    if (k >= scenario_.inputs.size()) return "there is no input of this number";
    inputs_[k] = std::move(signal);
    use_given();
    return {};
}

std::string ScenarioDescription::set_reference(std::size_t axis, control::Reference reference) {
    if (axis >= scenario_.control.axes.size()) return "there is no controller of this number";
    references_[axis] = std::move(reference);
    use_given();
    return {};
}

std::string ScenarioDescription::give_references(bool given) {
    if (std::string error = given ? check_given_references(scenario_) : ""; !error.empty()) return error;
    references_given_ = given;
    use_given();
    return {};
}

void ScenarioDescription::play(std::vector<bool> played) {
    played_ = std::move(played);
    use_given();
}

std::string ScenarioDescription::read(std::span<const double> numbers) {
    if (numbers.size() < head || numbers[0] != mark) return "these numbers are no description of a scenario";
    if (numbers[1] != version()) return "the description is of another version; write it anew";
    const double count = numbers[head - 1];
    if (!(count >= 1.0 && count <= static_cast<double>(numbers.size() - head)) || count != std::floor(count))
        return "the description is cut off";
    if (numbers[2] != checksum(numbers)) return "the description is damaged: its checksum is wrong; write it anew";
    const auto n = static_cast<std::size_t>(count);
    body_.assign(numbers.begin() + head, numbers.begin() + static_cast<std::ptrdiff_t>(head + n));
    FieldReader f(numbers.subspan(head + n));
    describe(f, parameters_, derivation_, n);
    if (!f.well()) return f.error();
    if (f.left() != 0) return "the description goes on beyond its end";
    return read_scenario(body_);
}

std::string ScenarioDescription::read_scenario(std::span<const double> body) {
    FieldReader f(body);
    Scenario s;
    describe(f, s);
    if (!f.well()) return f.error();
    if (f.left() != 0) return "the scenario goes on beyond its end";
    std::string error = check(s);
    if (!error.empty()) return error;
    scenario_ = std::move(s);
    use_given();
    return {};
}

void ScenarioDescription::use_given() {
    if (times_) std::tie(scenario_.duration, scenario_.sample_interval) = *times_;
    for (const auto& [k, signal] : inputs_) scenario_.inputs[k] = signal;
    for (const auto& [k, reference] : references_) scenario_.control.axes[k].law.reference = reference;
    scenario_.references_given = references_given_;
    scenario_.played = played_;
}

std::string ScenarioDescription::apply() {
    const std::optional<std::vector<double>> values = derivation_.values(values_of_parameters());
    if (!values) return "changes what the scenario consists of; make it anew with this value";
    std::vector<double> body = body_;
    for (const Derivation::Result& r : derivation_.results)
        body[static_cast<std::size_t>(r.place)] = (*values)[static_cast<std::size_t>(r.formula)];
    return read_scenario(body);
}

}  // namespace lostmotion
