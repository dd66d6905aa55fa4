// Times the paper's run by SUNDIALS CVODE with root functions: the same regimes, the same contact logic at events,
// another integrator. Prints lines as bench_run does.
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cstdio>

#include "paper_run.hpp"

using namespace lostmotion;

namespace {

// What CVODE's callbacks need of the regime that is under way.
struct Context {
    const Regime* regime = nullptr;
    Memory memory;
    InputState<DriveDims>* input = nullptr;
    LinearRates linear;
    Column constant{};
    // Guards that have been off zero since the regime began. CVODE refuses to go on from a root, or from near one.
    std::array<bool, max_guards> left_zero{};
};

State state_of(N_Vector y) {
    State x{};
    std::copy_n(N_VGetArrayPointer(y), n_states, x.begin());
    return x;
}

int rates(realtype t, N_Vector y, N_Vector rate, void* user) {
    auto& c = *static_cast<Context*>(user);
    c.input->anchor(t);
    const State out = c.linear(state_of(y), c.constant, c.input->values());
    std::copy_n(out.begin(), n_states, N_VGetArrayPointer(rate));
    return 0;
}

int roots(realtype t, N_Vector y, realtype* g, void* user) {
    auto& c = *static_cast<Context*>(user);
    c.input->anchor(t);
    const State x = state_of(y);
    const auto u = c.input->values();
    for (int k = 0; k < max_guards; ++k) {
        g[k] = 1.0;
        if (k >= c.regime->n_guards) continue;
        const LinearForm& form = c.regime->guards[k].form;
        const double value = evaluate(form, x, c.memory, u), size = magnitude(form, x, c.memory, u);
        c.left_zero[k] = c.left_zero[k] || value > 1e-6 * size;
        g[k] = c.left_zero[k] ? value : size;
    }
    return 0;
}

class Cvode {
 public:
    Cvode(const Drive& drive, const Signals& signals, int method, double tolerance)
        : drive_(drive), system_(drive_), cache_(system_), basis_(input_basis(signals)), input_(signals, basis_) {
        SUNContext_Create(nullptr, &context_);
        y_ = N_VNew_Serial(n_states, context_);
        N_Vector absolute = N_VNew_Serial(n_states, context_);
        for (int k = 0; k < n_states; ++k) NV_Ith_S(absolute, k) = tolerance * drive_.rated_scale()[k];
        matrix_ = SUNDenseMatrix(n_states, n_states, context_);
        solver_ = SUNLinSol_Dense(y_, matrix_, context_);
        memory_ = CVodeCreate(method, context_);
        N_VConst(0.0, y_);
        CVodeInit(memory_, rates, 0.0, y_);
        CVodeSVtolerances(memory_, tolerance, absolute);
        CVodeSetUserData(memory_, &user_);
        CVodeSetLinearSolver(memory_, solver_, matrix_);
        CVodeSetMaxNumSteps(memory_, 1000000);
        CVodeRootInit(memory_, max_guards, roots);
        CVodeSetNoInactiveRootWarn(memory_);
        N_VDestroy(absolute);
        user_.input = &input_;
    }
    Cvode(const Cvode&) = delete;
    Cvode& operator=(const Cvode&) = delete;
    ~Cvode() {
        CVodeFree(&memory_);
        SUNLinSolFree(solver_);
        SUNMatDestroy(matrix_);
        N_VDestroy(y_);
        SUNContext_Free(&context_);
    }

    // Load speed and twist at `samples` instants, as channels of a table. False if it gives up.
    bool run(double interval, std::size_t samples, double* table) {
        Instant now;
        RegimeKey key;
        see(now, 0.0);
        if (system_.start(cache_, now, key) != Found::yes) return false;
        enter(now, key);
        std::size_t next = 0;
        const auto keep = [&](const State& x) {
            table[ch_load_speed * samples + next] = x[load_speed];
            table[ch_twist * samples + next] = x[twist];
            ++next;
        };
        keep(now.x);
        std::array<int, max_guards> found{};
        while (next < samples) {
            realtype t = 0.0;
            const double wanted = static_cast<double>(next) * interval;
            const int status = CVode(memory_, wanted, y_, &t, CV_NORMAL);
            if (status < 0) return false;
            if (status != CV_ROOT_RETURN) {
                keep(state_of(y_));
                continue;
            }
            CVodeGetRootInfo(memory_, found.data());
            now.x = state_of(y_);
            see(now, t);
            const Regime& old = cache_.regime(key);
            const Guard* fired = nullptr;
            for (int k = 0; k < old.n_guards; ++k)
                if (found[k] < 0) fired = &old.guards[k];
            if (fired == nullptr) continue;  // a guard that rises from zero, where the regime began
            if (system_.next(cache_, now, fired, key, now.input[0]) != Found::yes) return false;
            enter(now, key);
        }
        return true;
    }

 private:
    void see(Instant& now, double t) {
        input_.anchor(t);
        now.time = t;
        now.input = input_.jet();
        now.input_magnitudes = input_.magnitudes();
    }
    void enter(const Instant& now, const RegimeKey& key) {
        const Regime& r = cache_.regime(key);
        user_.regime = &r;
        user_.memory = now.memory;
        user_.left_zero = {};
        user_.linear = LinearRates(r.rate);
        user_.constant = user_.linear.constant(now.memory);
        std::copy_n(now.x.begin(), n_states, N_VGetArrayPointer(y_));
        CVodeReInit(memory_, now.time, y_);
    }

    const Drive& drive_;
    SwitchedDrive system_;
    RegimeCache<SwitchedDrive> cache_;
    std::vector<InputBasis> basis_;
    InputState<DriveDims> input_;
    Context user_;
    SUNContext context_ = nullptr;
    N_Vector y_ = nullptr;
    SUNMatrix matrix_ = nullptr;
    SUNLinearSolver solver_ = nullptr;
    void* memory_ = nullptr;
};

void compare(const char* map, const PaperRun& paper) {
    const Table exact = paper.exact();
    for (const auto& [method, name] : {std::pair{CV_ADAMS, "Adams"}, std::pair{CV_BDF, "BDF"}})
        for (const double tolerance : {1e-6, 1e-8}) {
            Table table(n_channels * paper.samples);
            bool done = true;
            const double time = best_ms(20, [&] {
                Cvode cvode(paper.drive, paper.signals, method, tolerance);
                done = cvode.run(1e-3, paper.samples, table.data()) && done;
            });
            if (done)
                std::printf("%s|SUNDIALS CVODE %s in C, rtol %g|%.6f|%.3g\n", map, name, tolerance, time,
                            paper.error(table, exact));
            else
                std::printf("%s|SUNDIALS CVODE %s in C, rtol %g: gave up|nan|-\n", map, name, tolerance);
        }
}

}  // namespace

int main() {
    for (const auto& [map, paper] : PaperRun::both()) compare(map, paper);
}
