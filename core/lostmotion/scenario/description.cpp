#include "description.hpp"

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
        char text[96];
        std::snprintf(text, sizeof text, "%.10g must be %s %g", v, be, limit);
        return std::string(text);
    };
    return !(v > above)       ? must("greater than", above)
           : !(v >= at_least) ? must("at least", at_least)
           : !(v <= at_most)  ? must("at most", at_most)
                              : "";
}

std::vector<double> ScenarioDescription::write(Scenario scenario, std::vector<ScenarioParameter> parameters) {
    FieldWriter body;
    describe(body, scenario);
    return write(body.numbers, std::move(parameters));
}

std::vector<double> ScenarioDescription::write(const std::vector<double>& body,
                                               std::vector<ScenarioParameter> parameters) {
    FieldWriter f;
    f.numbers = {mark, version(), 0.0, static_cast<double>(body.size())};
    f.numbers.insert(f.numbers.end(), body.begin(), body.end());
    describe(f, parameters, body.size());
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
    describe(f, parameters_, n);
    if (!f.well()) return f.error();
    if (f.left() != 0) return "the description goes on beyond its end";
    if (std::string error = read_scenario(body_); !error.empty()) return error;
    for (std::size_t k = 0; k < parameters_.size(); ++k) {
        initial_.push_back(parameters_[k].value);
        for (const Effect& e : parameters_[k].effects) effects_[e.place].emplace_back(k, e);
    }
    return {};
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
    std::vector<double> body = body_;
    for (const auto& [place, effects] : effects_) {
        double& entry = body[static_cast<std::size_t>(place)];
        const bool product =
            effects.size() > 1 && entry != 0.0 &&
            std::all_of(effects.begin(), effects.end(), [](const auto& of) { return of.second.offset == 0.0; });
        double sum = 0.0, factor = 1.0;
        const Effect* only = nullptr;
        int changed = 0;
        for (const auto& [k, effect] : effects) {
            const double now = parameters_[k].value, before = initial_[k];
            if (now == before) continue;
            ++changed;
            only = &effect;
            sum += effect(now) - effect(before);
            factor *= effect(now) / effect(before);
            if (changed == 1 && effects.size() == 1) entry = effect(now);
        }
        if (changed == 0 || (only != nullptr && effects.size() == 1)) continue;
        entry = product ? entry * factor : entry + sum;
    }
    return read_scenario(body);
}

}  // namespace lostmotion
