// Trains and their runs, one and many, with the GIL released.
#pragma once

#include <nanobind/stl/optional.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "control.hpp"
#include "curves.hpp"
#include "interruption.hpp"
#include "lostmotion/analysis/steady_regime.hpp"
#include "lostmotion/analysis/train_batch.hpp"
#include "lostmotion/model/train_description.hpp"
#include "lostmotion/scenario/law_fields.hpp"
#include "lostmotion/scenario/variables.hpp"

namespace lostmotion::binding {

// Name, symbol, unit, meaning.
using ChannelRow = std::tuple<std::string, std::string, std::string, std::string>;
inline std::vector<ChannelRow> channel_rows(const std::vector<TrainChannel>& channels) {
    const auto unit = [](const TrainChannel& c) { return c.unit.empty() ? "1" : c.unit; };
    return rows_of(channels, &TrainChannel::name, &TrainChannel::symbol, unit, &TrainChannel::meaning);
}

// The same, and whether it follows from the others.
using VariableRow = std::tuple<std::string, std::string, std::string, std::string, bool>;
inline std::vector<VariableRow> variable_rows(const Variables& all) {
    std::vector<VariableRow> rows;
    for (const Variable& v : all.all())
        rows.emplace_back(v.name, v.symbol, v.unit, v.meaning, rows.size() >= all.channels());
    return rows;
}

// Idle workspaces.
class Workspaces {
 public:
    std::unique_ptr<Workspace> take() {
        const std::lock_guard<std::mutex> hold(mutex_);
        if (idle_.empty()) return nullptr;
        std::unique_ptr<Workspace> one = std::move(idle_.back());
        idle_.pop_back();
        return one;
    }
    void give_back(std::unique_ptr<Workspace> one) {
        const std::lock_guard<std::mutex> hold(mutex_);
        if (one && idle_.size() < max_idle) idle_.push_back(std::move(one));
    }

 private:
    static constexpr std::size_t max_idle = 8;

    std::mutex mutex_;
    std::vector<std::unique_ptr<Workspace>> idle_;
};

// A composed train with what its runs leave for the next ones. Each run takes a workspace for itself.
class SharedRun : public TrainRun {
 public:
    explicit SharedRun(const model::Train& train) : TrainRun(train) {}
    SharedRun(const SharedRun&) = delete;
    SharedRun& operator=(const SharedRun&) = delete;
    ~SharedRun() {
        for (std::unique_ptr<Workspace> w = own_.take(); w; w = own_.take()) {
            w->leave();
            spare_->give_back(std::move(w));
        }
    }
    std::unique_ptr<Workspace> take() const {
        std::unique_ptr<Workspace> w = own_.take();
        return w ? std::move(w) : spare_->take();
    }
    void give_back(std::unique_ptr<Workspace> w) const { own_.give_back(std::move(w)); }
    const Variables& variables() const {
        std::call_once(once_, [this] { variables_ = std::make_unique<Variables>(assembly()); });
        return *variables_;
    }

 private:
    // Of trains that are gone, the one of this module.
    static const std::shared_ptr<Workspaces>& store() {
        static const auto all = std::make_shared<Workspaces>();
        return all;
    }
    mutable Workspaces own_;
    mutable std::once_flag once_;
    mutable std::unique_ptr<const Variables> variables_;
    std::shared_ptr<Workspaces> spare_ = store();
};

// As Python describes a train.
class TrainDescription : public model::TrainDescription {
 public:
    void add_shaft(const Record& fields) {
        model::Shaft s;
        NamedFields named(fields);
        model::describe(named, s);
        named.refuse_unknown();
        model::TrainDescription::add_shaft(std::move(s));
    }
    void add_mass_matrix(const std::string& name, const std::vector<std::string>& shafts,
                         const std::vector<std::vector<double>>& matrix) {
        model::TrainDescription::add_mass_matrix(name, shafts, matrix);
    }
    // The same train with other numbers in one of its mass matrices.
    TrainDescription with_mass_matrix(const std::string& name, const std::vector<std::vector<double>>& matrix) const {
        TrainDescription other = *this;
        other.run_.reset();
        for (model::MassMatrix& m : other.train.mass_matrices)
            if (m.name == name) m.matrix = matrix;
        return other;
    }
    void add_motor(const std::string& name, const std::string& shaft, const Record& fields) {
        model::TrainDescription::add(with_law<model::ShaftMotor>(name, fields), shaft);
    }
    void add_gear(const std::string& name, const std::string& input, const std::string& output, const Record& fields) {
        model::TrainDescription::add(with_law<model::Gear>(name, fields), input, output);
    }

    void add(const std::string& table, const std::string& name, const std::string& shaft, const Record& fields) {
        add_on([&](auto&& use) { model::Train::each_kind(train, use); }, table, name, fields, shaft);
    }
    void add_coupling(const std::string& table, const std::string& name, const std::string& input,
                      const std::string& output, const Record& fields) {
        add_on([&](auto&& use) { model::Train::each_coupling_kind(train, use); }, table, name, fields, input, output);
    }

    void add_controller(const std::string& motor, const Record& fields) {
        model::TrainDescription::add_controller(described<model::LinearController>(fields), motor);
    }

    // Composed once, when it is first wanted; nothing may be added afterwards.
    const std::shared_ptr<const SharedRun>& run() const {
        if (!run_) run_ = std::make_shared<const SharedRun>(train);
        return run_;
    }
    // Table and name of the element, and what is wrong with it.
    std::optional<std::tuple<std::string, std::string, std::string>> check() const {
        const model::Fault& f = run()->fault();
        if (f.empty()) return std::nullopt;
        return std::tuple(f.table, f.name, f.reason);
    }
    // Shafts whose speeds follow from the balance of torques.
    std::vector<std::string> massless_shafts() const {
        return each_of(model::Places(train).massless,
                       [&](int s) { return train.shafts[static_cast<std::size_t>(s)].name; });
    }
    // The states that move; a kernel may have a place for others, which are constant.
    std::vector<std::string> moving_states() const {
        const model::Assembly a(train);
        const std::vector<std::string> states = model::state_names(a);
        const std::vector<bool> moves = model::moved_states(a);
        std::vector<std::string> names;
        for (std::size_t k = 0; k < states.size(); ++k)
            if (moves[k]) names.push_back(states[k]);
        return names;
    }
    std::string check_start(const std::vector<double>& speeds) const { return model::check_start(train, speeds); }
    // The train must have passed the check.
    std::vector<ChannelRow> channels() const { return channel_rows(run()->channels()); }
    std::vector<std::string> ledger_names() const { return lostmotion::ledger_names(run()->assembly()); }
    std::vector<std::string> input_names() const { return model::input_names(run()->assembly()); }
    std::vector<std::string> switching_columns() const { return SwitchingTable(run()->assembly()).columns(); }
    std::vector<VariableRow> variables() const { return variable_rows(run()->variables()); }
    // The variables that follow, from the channels; rows of a table.
    Array derive(const Values& channels) const {
        const Variables& all = run()->variables();
        const std::size_t n = channels.shape(1), derived = all.size() - all.channels();
        if (channels.shape(0) != all.channels()) throw nb::value_error("not the channels of this train");
        std::vector<double> data(all.size() * n);
        std::copy_n(channels.data(), all.channels() * n, data.begin());
        for (std::size_t k = 0; k < n; ++k) all.derive(data.data(), n, k);
        data.erase(data.begin(), data.begin() + static_cast<std::ptrdiff_t>(all.channels() * n));
        return as_array(data, {derived, n});
    }
    void name_as(const std::vector<std::pair<std::string, std::string>>& aliases) {
        for (const auto& [name, shown] : aliases) train.aliases.push_back({name, shown});
    }
    // Also those that have an alias although there are none.
    std::vector<std::string> shown_contacts() const {
        return each_of(model::shown_contacts(run()->assembly()), &model::ShownContact::name);
    }
    std::vector<std::string> contact_names() const {
        const model::Assembly& a = run()->assembly();
        std::vector<std::string> names;
        for (int c = 0; c < a.layout().contacts; ++c) names.push_back(model::contact_name(a, c));
        return names;
    }
    // (J [kg m2], holding friction [N m]) of each shaft, with what is on it; brakes are open.
    std::vector<std::pair<double, double>> shafts() const {
        const model::Assembly& a = run()->assembly();
        std::vector<std::pair<double, double>> out;
        for (std::size_t s = 0; s < train.shafts.size(); ++s) {
            const model::ShaftPlace& p = a.places().shafts[s];
            out.emplace_back(p.inertia, p.motor_friction + train.shafts[s].friction.holding());
        }
        return out;
    }
    std::pair<double, double> mesh_loss(std::size_t gear, double driven, double speed) const {
        const model::MeshLoss loss = train.gears.at(gear).loss(driven, speed);
        return {loss.torque, loss.per_torque};
    }
    std::tuple<std::vector<std::string>, Array, bool> steady_regime(const std::vector<double>& speeds,
                                                                    const std::vector<double>& torques) const {
        const SteadyRegime r = lostmotion::steady_regime(train, {speeds, torques});
        const std::size_t n = r.states.size();
        return {r.states, as_array(r.rate, {n, n}), r.determined};
    }

 private:
    template <class Element>
    static Element with_law(const std::string& name, const Record& fields) {
        Element element;
        element.name = name;
        NamedFields named(fields);
        element.law.describe(named);
        element.describe(named);
        named.refuse_unknown();
        return element;
    }
    // An element of one of these tables, on these shafts.
    template <class Tables, class... Shafts>
    void add_on(Tables&& tables, const std::string& table, const std::string& name, const Record& fields,
                const Shafts&... shafts) {
        bool known = false;
        tables([&](const char* own, const char*, const auto& elements) {
            if (table != own) return;
            known = true;
            auto element = described<typename std::decay_t<decltype(elements)>::value_type>(fields);
            element.name = name;
            model::TrainDescription::add(std::move(element), shafts...);
        });
        if (!known) throw nb::value_error(("there is no table '" + table + "'").c_str());
    }
    mutable std::shared_ptr<const SharedRun> run_;
};

// By name, in their order.
inline nb::dict in_order(const NamedInOrder& values) {
    nb::dict out;
    for (const auto& [name, value] : values) out[name.c_str()] = value;
    return out;
}

inline Array switching_table(const TrainReport& report, const model::Assembly& a) {
    const SwitchingTable table(a);
    return column(report.switchings, {table.columns().size()},
                  [&](const TrainSwitching& s, double* to) { table.write(s, to); });
}

inline void check_train_run(const TrainReport& report, const model::Assembly& a) {
    if (!report.message.empty()) throw nb::value_error(report.message.c_str());
    if (report.status == Status::interrupted) throw nb::python_error();
    if (const std::string error = error_text(report, a); !error.empty()) throw SolverError(error);
}

// Train, inputs and start of a run. Its states and the hysteresis capacities of its gears go by name; 0 if left out.
struct Case {
    std::shared_ptr<const SharedRun> train;
    std::vector<Signal> inputs;
    TrainStart start;

    const model::Assembly& assembly() const { return train->assembly(); }
    TrainCase of_batch() const { return {assembly().train(), inputs, start}; }

    TrainReport run(TrainOptions& options, double* out) const {
        options.interrupted = poll_signals;
        nb::gil_scoped_release release;
        std::unique_ptr<Workspace> workspace = train->take();
        TrainReport report = train->run(inputs, start, options, out, workspace);
        train->give_back(std::move(workspace));
        return report;
    }
};

inline TrainOptions train_options(double duration, double sample_interval, std::size_t samples) {
    TrainOptions options;
    options.duration = duration;
    options.sample_interval = sample_interval;
    options.samples = samples;
    return options;
}

inline Record run(const Case& one, double duration, double sample_interval, std::size_t samples, bool energy,
                  double tolerance, std::size_t max_switchings, const BoundControl& bound) {
    const model::Assembly& a = one.assembly();
    const std::size_t channels = one.train->channels().size();
    TrainOptions options = train_options(duration, sample_interval, samples);
    options.energy = energy;
    options.max_switchings = max_switchings;
    options.tolerance = tolerance;
    options.control = control_of(bound);
    auto data = std::make_unique_for_overwrite<double[]>(channels * samples);
    auto signals = control_room(options);
    const TrainReport report = one.run(options, data.get());
    raise_again(bound);
    check_train_run(report, a);
    Record out;
    out["control"] = as_array(std::move(signals), control_shape(options));
    out["values"] = as_array(std::move(data), {channels, samples});
    out["switchings"] = switching_table(report, a);
    out["switching_count"] = report.switching_count;
    out["energy"] = in_order(named_ledger(report, a));
    out["end_state"] = in_order(named_end(report, a));
    out["left_data_at"] = report.left_data_at;
    out["steps"] = report.steps;
    out["mode_trials"] = report.searches.trials;
    out["mode_fallbacks"] = report.searches.fallbacks;
    return out;
}

// The same under controllers, some channels of it alone, into out: channels x samples. enough: called at the sample
// `pause`, up to which all is written; true ends the run there.
inline std::size_t run_into(const Case& one, const Room& out, double duration, double sample_interval,
                            const BoundControl& bound, const std::vector<int>& channels, std::size_t pause,
                            const nb::typed<nb::callable, bool()>& enough) {
    TrainOptions options = train_options(duration, sample_interval, out.shape(1));
    if (channels.size() != out.shape(0) || pause >= options.samples) throw nb::value_error("too little room");
    options.control = control_of(bound);
    options.channels = channels;
    options.pause = pause;
    std::exception_ptr raised;
    options.enough = [&] {
        nb::gil_scoped_acquire hold;
        try {
            return nb::cast<bool>(enough());
        } catch (...) {
            raised = std::current_exception();
            return true;
        }
    };
    const TrainReport report = one.run(options, out.data());
    if (raised) std::rethrow_exception(raised);
    check_train_run(report, one.assembly());
    return report.switching_count;
}

// fields, values: of one case, what differs from run to run, runs x fields. Of each run the text of its error, empty if
// it has none; switchings; the energies; and the samples, or what is kept of them.
inline Record run_batch(const std::vector<const Case*>& cases, const std::vector<int>& fields, const Values& values,
                        double duration, double sample_interval, std::size_t samples,
                        const std::vector<std::string>& energies, const std::vector<std::string>& channels,
                        const std::vector<std::pair<std::size_t, int>>& kept, unsigned threads,
                        const nb::object& progress) {
    TrainBatch batch{{}, {}, channels, {}, energies, fields, {values.data(), values.size()}};
    batch.options = train_options(duration, sample_interval, samples);
    batch.options.energy = !energies.empty();
    for (const Case* one : cases) batch.cases.push_back(one->of_batch());
    for (const auto& [channel, how] : kept) batch.kept.push_back({channel, static_cast<Reduction>(how)});
    std::vector<std::size_t> shape{batch.runs(), kept.size()};
    if (kept.empty()) shape = {batch.runs(), channels.size(), samples};
    auto data = std::make_unique_for_overwrite<double[]>(batch.runs() * batch.width());
    std::vector<TrainRow> rows;
    Watch watch(progress);
    {
        nb::gil_scoped_release release;
        rows = run_trains(batch, data.get(), threads, std::ref(watch));
    }
    watch.check();
    std::vector<std::string> errors;
    for (const TrainRow& r : rows) errors.push_back(r.error);
    Record out;
    out["values"] = as_array(std::move(data), shape);
    out["errors"] = errors;
    out["switchings"] = numbers(rows, [](const TrainRow& r) { return r.switchings; });
    out["energies"] =
        column(rows, {energies.size()}, [](const TrainRow& r, double* to) { std::ranges::copy(r.energies, to); });
    return out;
}

// The instants of a record.
inline Array sample_times(double duration, double interval) {
    const SampleTimes times(interval, sample_count(duration, interval), duration);
    auto data = std::make_unique_for_overwrite<double[]>(times.count);
    for (std::size_t k = 0; k < times.count; ++k) data[k] = times[k];
    return as_array(std::move(data), {times.count});
}

// A reduction of each row; last: the share of an interval that its last value stands for.
inline Array reduce_rows(int how, const Values& values, double last) {
    const std::size_t rows = values.shape(0), n = values.shape(1);
    auto data = std::make_unique_for_overwrite<double[]>(rows);
    for (std::size_t k = 0; k < rows; ++k)
        data[k] = reduce(static_cast<Reduction>(how), values.data() + k * n, n, last);
    return as_array(std::move(data), {rows});
}

inline void bind_train(nb::module_& m) {
    using model::PeriodicCurve;

    nb::class_<PeriodicCurve>(m, "PeriodicCurve")
        .def(nb::init<double, std::vector<double>, std::vector<double>>(), "period"_a, "angles"_a, "values"_a)
        .def("pieces", &PeriodicCurve::pieces)
        .def("__call__", &PeriodicCurve::operator(), "angle"_a);
    m.def(
        "worm_efficiencies",
        [](double lead_angle, double friction_angle) {
            const auto mesh = model::MeshEfficiency::worm(lead_angle, friction_angle);
            return std::make_pair(mesh.driving(), mesh.overrunning());
        },
        "lead_angle"_a, "friction_angle"_a);
    m.attr("USUAL_ERROR") = usual_error;
    m.def("harmonic", [](const Record& fields) { return made_by(described<HarmonicLaw>(fields)); }, "fields"_a);
    m.def("quadratic_drag", [](const Record& fields) { return made_by(described<QuadraticDrag>(fields)); }, "fields"_a);
    m.def(
        "dry_friction",
        [](const Record& fields) {
            const auto f = described<laws::FrictionTable>(fields).law();
            Record out;
            out["torque"] = f.torque, out["breakaway_torque"] = f.breakaway_torque;
            out["speeds"] = f.speeds, out["torques"] = f.torques;
            out["stribeck"] = f.origin.numbers;
            return out;
        },
        "fields"_a, "By its fields in the core; the lists are empty where there is no curve.");

    nb::class_<TrainDescription>(m, "Train", nb::is_weak_referenceable())
        .def(nb::init<>())
        .def("add_shaft", &TrainDescription::add_shaft, "fields"_a)
        .def("add_motor", &TrainDescription::add_motor, "name"_a, nb::kw_only(), "shaft"_a, "fields"_a)
        .def("add_gear", &TrainDescription::add_gear, "name"_a, nb::kw_only(), "input"_a, "output"_a, "fields"_a)
        .def("add_mass_matrix", &TrainDescription::add_mass_matrix, "name"_a, "shafts"_a, "matrix"_a,
             "Inertias [kg m2] of several shafts, in place of their own.")
        .def("with_mass_matrix", &TrainDescription::with_mass_matrix, "name"_a, "matrix"_a,
             "The same train with other numbers in one of its mass matrices.")
        .def("set_housing", &TrainDescription::set_housing, "gear"_a, "shaft"_a)
        .def("add", &TrainDescription::add, "table"_a, "name"_a, nb::kw_only(), "shaft"_a, "fields"_a,
             "What acts on one shaft: the table of its kind, and its fields in SI units.")
        .def("add_coupling", &TrainDescription::add_coupling, "table"_a, "name"_a, nb::kw_only(), "input"_a, "output"_a,
             "fields"_a, "What joins two shafts and is no gear, in the same way.")
        .def("add_controller", &TrainDescription::add_controller, "motor"_a, "fields"_a)
        .def("check", &TrainDescription::check)
        .def("name_as", &TrainDescription::name_as, "aliases"_a, "What entries of results are called.")
        .def("kernel", [](const TrainDescription& t) { return t.run()->kernel().name(); })
        .def(
            "guards", [](const TrainDescription& t) { return t.run()->kernel().sizes().guards; },
            "How many guards its kernel has room for.")
        .def("massless_shafts", &TrainDescription::massless_shafts)
        .def("moving_states", &TrainDescription::moving_states, "States that are not constant by the equations.")
        .def("check_start", &TrainDescription::check_start, "speeds"_a)
        .def("channels", &TrainDescription::channels, "Name, symbol, unit, meaning.")
        .def("variables", &TrainDescription::variables, "Name, symbol, unit, meaning, whether it is derived.")
        .def("derive", &TrainDescription::derive, "channels"_a,
             "The variables that follow, from the channels, row by row.")
        .def("ledger_names", &TrainDescription::ledger_names)
        .def("input_names", &TrainDescription::input_names)
        .def("switching_columns", &TrainDescription::switching_columns)
        .def("shafts", &TrainDescription::shafts,
             "Inertia [kg m2] and friction that holds at rest [N m] of each shaft.")
        .def("mesh_loss", &TrainDescription::mesh_loss, "gear"_a, "driven"_a, "speed"_a)
        .def("steady_regime", &TrainDescription::steady_regime, "speeds"_a, "torques"_a)
        .def("contact_names", &TrainDescription::contact_names)
        .def("shown_contacts", &TrainDescription::shown_contacts,
             "Also those that have an alias although the train has none of them.");
    nb::class_<Case>(m, "Case")
        .def(
            "__init__",
            [](Case* self, const TrainDescription& train, std::vector<Signal> inputs, Named start, Named capacities) {
                new (self) Case{train.run(), std::move(inputs), {std::move(start), std::move(capacities)}};
            },
            "train"_a, nb::kw_only(), "inputs"_a, "start"_a = Named(), "hysteresis_capacities"_a = Named(),
            "What a run begins with: a train, its inputs, and by name its states and the hysteresis of its gears; what "
            "is left out is 0.")
        .def_ro("inputs", &Case::inputs);
    m.def("run", &run, "case"_a, nb::kw_only(), "duration"_a, "sample_interval"_a, "samples"_a, "energy"_a = false,
          "tolerance"_a = 0.0, "max_switchings"_a = 0, "control"_a = BoundControl{1.0, {}});
    m.def("run_into", &run_into, "case"_a, "out"_a, nb::kw_only(), "duration"_a, "sample_interval"_a, "control"_a,
          "channels"_a, "pause"_a, "enough"_a);
    m.def("run_batch", &run_batch, "cases"_a, nb::kw_only(), "fields"_a, "values"_a, "duration"_a, "sample_interval"_a,
          "samples"_a, "energies"_a, "channels"_a, "kept"_a, "threads"_a, "progress"_a = nb::none());
    m.def("reduce_rows", &reduce_rows, "how"_a, "values"_a, "last"_a = 1.0);
    m.def("sample_count", &sample_count, "duration"_a, "interval"_a);
    m.def("sample_times", &sample_times, "duration"_a, "interval"_a);
}

}  // namespace lostmotion::binding
