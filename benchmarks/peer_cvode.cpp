// Times the paper's run and runs of trains by SUNDIALS CVODE with root functions: the same regimes, the same contact
// logic at events, another integrator. Prints lines as bench_run does, for trains without samples.
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cstdio>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "cascade.hpp"
#include "train_runs.hpp"

using namespace lostmotion;

namespace {

// What CVODE's callbacks need of the regime that is under way.
template <class System>
struct Context {
    using D = typename System::Dims;

    const typename System::Regime* regime = nullptr;
    typename D::Memory memory;
    InputState<D>* input = nullptr;
    const LinearRatesOf<D>* linear = nullptr;
    ColumnOf<D> constant{};
    std::vector<int> states;  // those that CVODE integrates, one after the other
    // Guards that have been off zero since the regime began. CVODE refuses to go on from a root, or from near one.
    std::vector<bool> left_zero;

    StateOf<D> state_of(N_Vector y) const {
        StateOf<D> x{};
        for (std::size_t k = 0; k < states.size(); ++k) x[states[k]] = N_VGetArrayPointer(y)[k];
        return x;
    }
    void put(const StateOf<D>& x, N_Vector y) const {
        for (std::size_t k = 0; k < states.size(); ++k) N_VGetArrayPointer(y)[k] = x[states[k]];
    }
};

template <class System>
int rates(realtype t, N_Vector y, N_Vector rate, void* user) {
    auto& c = *static_cast<Context<System>*>(user);
    c.input->follow(t);
    c.put((*c.linear)(c.state_of(y), c.constant, c.input->values()), rate);
    return 0;
}

template <class System>
int jacobian(realtype, N_Vector, N_Vector, SUNMatrix J, void* user, N_Vector, N_Vector, N_Vector) {
    const auto& c = *static_cast<Context<System>*>(user);
    SUNMatZero(J);
    for (std::size_t r = 0; r < c.states.size(); ++r) {
        const int row = c.states[r];
        if (row < System::Dims::coupled)
            c.linear->each_in_row(row, [&](int k, double factor) {
                if (k < static_cast<int>(c.states.size()))
                    SM_ELEMENT_D(J, static_cast<sunindextype>(r), static_cast<sunindextype>(k)) = factor;
            });
        else if (const int angle = row - System::Dims::coupled; true)
            SM_ELEMENT_D(J, static_cast<sunindextype>(r), static_cast<sunindextype>(c.linear->angle_speed[angle])) =
                c.linear->angle_coefficient[angle];
    }
    return 0;
}

template <class System>
int roots(realtype t, N_Vector y, realtype* g, void* user) {
    using D = typename System::Dims;
    auto& c = *static_cast<Context<System>*>(user);
    c.input->follow(t);
    const StateOf<D> x = c.state_of(y);
    const auto u = c.input->values();
    for (int k = 0; k < static_cast<int>(c.left_zero.size()); ++k) {
        g[k] = 1.0;
        if (k >= static_cast<int>(c.regime->guards.size())) continue;
        const LinearForm& form = c.regime->guards[static_cast<std::size_t>(k)].form;
        const double value = evaluate<D>(form, x, c.memory, u), size = magnitude<D>(form, x, c.memory, u);
        c.left_zero[k] = c.left_zero[k] || value > 1e-6 * size;
        g[k] = c.left_zero[k] ? value : size;
    }
    return 0;
}

// A run that is to be made, from this state.
template <class System>
struct Task {
    using D = typename System::Dims;

    const System& system;
    const SignalsOf<D>& signals;
    StateOf<D> start, rated, balanced;  // the state, its natural sizes
    std::vector<int> states;            // those that the drive has
    std::array<int, 2> watched;         // load speed and twist
    RegimeCache<System>& cache;         // kept from run to run
};

template <class System_>
class Cvode {
 public:
    using System = System_;
    using Observer = lostmotion::Observer<System>;
    using D = typename System::Dims;
    using State = StateOf<D>;
    using Guard = typename System::Guard;

    Cvode(const Task<System>& task, int method, double tolerance)
        : task_(task), signals_(task.signals), basis_(input_basis(signals_)), input_(signals_, basis_) {
        const auto n = static_cast<sunindextype>(task.states.size());
        user_.states = task.states;
        user_.input = &input_;
        user_.left_zero.resize(static_cast<std::size_t>(task.system.most_guards()));
        SUNContext_Create(nullptr, &context_);
        y_ = N_VNew_Serial(n, context_);
        N_Vector absolute = N_VNew_Serial(n, context_);
        user_.put(task.rated, absolute);
        N_VScale(tolerance, absolute, absolute);
        matrix_ = SUNDenseMatrix(n, n, context_);
        solver_ = SUNLinSol_Dense(y_, matrix_, context_);
        memory_ = CVodeCreate(method, context_);
        N_VConst(0.0, y_);
        CVodeInit(memory_, rates<System>, 0.0, y_);
        CVodeSVtolerances(memory_, tolerance, absolute);
        CVodeSetUserData(memory_, &user_);
        CVodeSetLinearSolver(memory_, solver_, matrix_);
        CVodeSetJacFn(memory_, jacobian<System>);
        CVodeSetMaxNumSteps(memory_, 1000000);
        CVodeRootInit(memory_, task.system.most_guards(), roots<System>);
        CVodeSetNoInactiveRootWarn(memory_);
        N_VDestroy(absolute);
    }
    Cvode(const Cvode&) = delete;
    Cvode& operator=(const Cvode&) = delete;
    // What only synchronous motors under field orientation ask of a solver: none here has them.
    std::unique_ptr<Cvode> twin() const { throw std::logic_error("no second solver"); }
    void follow(const Cvode&) {}
    std::size_t switchings() const { return 0; }
    const auto& linear_rates() { return task_.cache.entry(key_).rates; }
    ~Cvode() {
        CVodeFree(&memory_);
        SUNLinSolFree(solver_);
        SUNMatDestroy(matrix_);
        N_VDestroy(y_);
        SUNContext_Free(&context_);
    }

    // As the project's own solvers have it, so that controllers run on it.
    Status begin(double t, const State& x, const typename D::Memory&) {
        now_.x = x;
        time_ = t;
        input_.anchor(t);
        see_inputs(input_, t, now_);
        if (task_.system.start(now_, key_) != Found::yes) return Status::jammed;
        enter();
        return Status::done;
    }
    Status advance(double t_end, Observer&) {
        std::vector<int> found(user_.left_zero.size());
        while (time_ < t_end) {
            CVodeSetStopTime(memory_, controlled_ ? std::fmin(limit_, t_end) : limit_);
            const int status = CVode(memory_, t_end, y_, &time_, CV_NORMAL);
            if (status < 0) return Status::zeno;
            const Guard* fired = nullptr;
            if (status == CV_ROOT_RETURN) {
                CVodeGetRootInfo(memory_, found.data());
                const auto& old = task_.cache.regime(key_);
                for (std::size_t k = 0; k < old.guards.size(); ++k)
                    if (found[k] < 0) fired = &old.guards[k];
                if (fired == nullptr) continue;  // a guard that rises from zero, where the regime began
            } else if (time_ < limit_) {
                continue;
            }
            input_.follow(time_);
            if (!go_on(fired, input_.values())) return Status::jammed;
        }
        return Status::done;
    }
    // As a controller does: the integration begins anew.
    void set_ramp(int input, double value, double slope) {
        controlled_ = true;
        before_ = input_.values();
        signals_[static_cast<std::size_t>(input)].breakpoints[0] = {time_, value, slope};
    }
    Status inputs_changed(Observer&) { return go_on(nullptr, before_) ? Status::done : Status::jammed; }
    State state() const { return user_.state_of(y_); }
    const typename D::Memory& memory() const { return user_.memory; }
    double time() const { return time_; }

    // Calls keep(state) at `samples` instants. False if it gives up.
    template <class Keep>
    bool run(double interval, std::size_t samples, Keep&& keep) {
        if (begin(0.0, task_.start, {}) != Status::done) return false;
        keep(now_.x);
        for (std::size_t k = 1; k < samples; ++k) {
            if (advance(static_cast<double>(k) * interval, nothing_) != Status::done) return false;
            keep(state());
        }
        return true;
    }

 private:
    using Instant = InstantOf<D>;

    bool go_on(const Guard* fired, const InputsOf<D>& before) {
        now_.x = state();
        input_.anchor(time_);
        see_inputs(input_, time_, now_);
        if (task_.system.next(task_.cache, now_, fired, key_, before) != Found::yes) return false;
        enter();
        return true;
    }
    void enter() {
        const auto& r = task_.cache.regime(key_);
        user_.regime = &r;
        user_.memory = now_.memory;
        std::fill(user_.left_zero.begin(), user_.left_zero.end(), false);
        user_.linear = &task_.cache.entry(key_).rates;
        user_.constant = user_.linear->constant(now_.memory);
        limit_ = next_breakpoint(signals_, now_.time);
        Interruption never;
        if (r.driving_input >= 0) limit_ = input_.turning(r.driving_input, r.driving_way, limit_, never);
        user_.put(now_.x, y_);
        CVodeReInit(memory_, now_.time, y_);
    }

    const Task<System>& task_;
    SignalsOf<D> signals_;
    std::vector<InputBasis> basis_;
    InputState<D> input_;
    Context<System> user_;
    Instant now_;
    typename System::Key key_;
    InputsOf<D> before_{};
    double time_ = 0.0;        // [s]
    bool controlled_ = false;  // no step leads across a tick
    Observer nothing_;
    double limit_ = 0.0;  // [s], of the stretch that has no jump of an input
    SUNContext context_ = nullptr;
    N_Vector y_ = nullptr;
    SUNMatrix matrix_ = nullptr;
    SUNLinearSolver solver_ = nullptr;
    void* memory_ = nullptr;
};

// Load speed and twist at `samples` instants, one after the other.
class Watched {
 public:
    Watched(std::array<int, 2> states, std::size_t samples) : states_(states), samples_(samples) {}
    template <class State>
    void keep(const State& x) {
        for (std::size_t c = 0; c < 2; ++c) table_[c].push_back(x[states_[c]]);
    }
    double gap(const Watched& exact) const {
        double worst = 0.0;
        for (std::size_t c = 0; c < 2; ++c)
            worst = std::max(worst, relative_gap(table_[c].data(), exact.table_[c].data(), samples_));
        return worst;
    }

 private:
    std::array<int, 2> states_;
    std::size_t samples_;
    std::array<Table, 2> table_;
};

template <class System>
Watched exact_run(const Task<System>& task, double interval, std::size_t samples) {
    Observer<System> nothing;
    Watched out(task.watched, samples);
    ExactSolver<System> solver(task.system, task.signals, interval, task.balanced);
    Status status = solver.begin(0.0, task.start, {});
    for (std::size_t k = 0; k < samples && status == Status::done; ++k) {
        status = solver.advance(static_cast<double>(k) * interval, nothing);
        out.keep(solver.state());
    }
    return out;
}

// sampled: in the run that is timed, too.
template <class System>
void compare(const char* name, const Task<System>& task, double interval, std::size_t samples, bool sampled) {
    const Watched exact = exact_run(task, interval, samples);
    for (const auto& [method, method_name] : {std::pair{CV_ADAMS, "Adams"}, std::pair{CV_BDF, "BDF"}})
        for (const double tolerance : {1e-6, 1e-8}) {
            Watched other(task.watched, samples);
            bool done =
                Cvode<System>(task, method, tolerance).run(interval, samples, [&](const auto& x) { other.keep(x); });
            const double timed_interval = sampled ? interval : static_cast<double>(samples - 1) * interval;
            const double time = best_ms(done ? 20 : 0, [&] {
                Watched unused(task.watched, samples);
                done = Cvode<System>(task, method, tolerance)
                           .run(timed_interval, sampled ? samples : 2, [&](const auto& x) { unused.keep(x); }) &&
                       done;
            });
            if (done)
                std::printf("%s|SUNDIALS CVODE %s in C, rtol %g|%.6f|%.3g\n", name, method_name, tolerance, time,
                            other.gap(exact));
            else
                std::printf("%s|SUNDIALS CVODE %s in C, rtol %g: gave up|nan|-\n", name, method_name, tolerance);
        }
}

template <class D>
Task<model::TrainSystem<D>> task_of(const TrainIn<D>& in, const SignalsOf<D>& signals,
                                    RegimeCache<model::TrainSystem<D>>& cache) {
    const model::Places& p = in.assembly.places();
    return {in.system,
            signals,
            in.start,
            in.system.rated_scale(),
            in.system.balanced_scale(),
            in.states(),
            {p.shafts.back().speed, p.gears.back().twist},
            cache};
}

// The drive under the cascade of bench_control.cpp, restarted at each tick; errors against the exact solver.
template <class D>
void compare_cascade(const TrainIn<D>& in, const test::Drive& drive) {
    using System = model::TrainSystem<D>;
    RegimeCache<System> cache(in.system);
    const SignalsOf<D> none;
    const Task<System> task = task_of(in, none, cache);
    const Control control = cascade(drive, 0.0, 0.2);
    const std::vector<control::Axis> laws = control.laws();
    const ClosedLoop<D> loop = closed_loop_of<D>(in.assembly, control, laws);
    Observer<System> nothing;
    constexpr int instants = 100;
    const auto follow = [&](auto& solver, auto&& keep) {
        ClosedLoopRun run(solver, loop);
        Status status = run.begin({}, {}, nothing);
        for (int k = 1; k <= instants && status == Status::done; ++k) {
            status = run.advance(static_cast<double>(k) / instants, nothing, nullptr);
            keep(solver.state());
        }
        return status == Status::done;
    };
    Watched exact(task.watched, instants);
    ExactSolver<System> solver(in.system, none, 1.0 / instants, task.balanced);
    follow(solver, [&](const auto& x) { exact.keep(x); });
    for (const double tolerance : {1e-6, 1e-8}) {
        Watched other(task.watched, instants);
        Cvode<System> cvode(task, CV_ADAMS, tolerance);
        const bool done = follow(cvode, [&](const auto& x) { other.keep(x); });
        const double time = best_ms(done ? 3 : 0, [&] {
            Cvode<System> again(task, CV_ADAMS, tolerance);
            follow(again, [](const auto&) {});
        });
        std::printf("cascade|SUNDIALS CVODE Adams in C, rtol %g|%.6f|%.3g\n", tolerance, time, other.gap(exact));
    }
}

}  // namespace

// Chains of masses, each once, without samples: by BDF, 1e-6, and by Adams, 1e-9.
void compare_sizes() {
    for (const TimedTrain& t : chains())
        in_kernel(t, [&]<class D>(const TrainIn<D>& in) {
            RegimeCache<model::TrainSystem<D>> cache(in.system);
            const auto task = task_of(in, in.signals, cache);
            for (const auto& [method, name, tolerance] :
                 {std::tuple{CV_BDF, "CVODE BDF, 1e-6", 1e-6}, {CV_ADAMS, "CVODE Adams, 1e-9", 1e-9}}) {
                bool done = true;
                const double time = best_ms(t.train.shafts.size() > 16 ? 1 : 3, [&] {
                    done = Cvode(task, method, tolerance).run(t.duration, 2, [](const auto&) {}) && done;
                });
                std::printf("%s|%s|%.6f\n", t.name.c_str(), name, done ? time : std::nan(""));
                std::fflush(stdout);
            }
        });
}

int main(int argc, char**) {
    if (argc > 1) {
        compare_sizes();
        return 0;
    }
    std::vector<TimedTrain> trains = timed_trains();
    trains.resize(3);
    const test::Drive drive = PaperRun().drive;
    in_kernel(trains[0], [&](const auto& in) { compare_cascade(in, drive); });
    const auto compare_train = [](const char* name, const TimedTrain& t, bool sampled) {
        in_kernel(t, [&]<class D>(const TrainIn<D>& in) {
            RegimeCache<model::TrainSystem<D>> cache(in.system);
            compare(name, task_of(in, in.signals, cache), t.duration / (t.samples - 1),
                    static_cast<std::size_t>(t.samples), sampled);
        });
    };
    for (const auto& [map, paper] : PaperRun::both()) compare_train(map, {map, paper.train, paper.signals}, true);
    for (const TimedTrain& t : trains) compare_train(t.name.c_str(), t, false);
}
