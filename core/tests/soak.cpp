// Random drives at length, each property checked and every disagreement put before the referee. `make soak` runs it:
// soak [cases of each kind] [seed]. Prints what it found; ends with 1 if anything is wrong.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>

#include "properties.hpp"
#include "random_train_runs.hpp"
#include "referee_compare.hpp"
#include "round_drives.hpp"

namespace lostmotion::test {

namespace {

struct Tally {
    const char* what;
    long cases = 0, refused = 0, ambiguous = 0, ill_conditioned = 0, wrong = 0;

    void print() const {
        std::printf("%-58s %8ld runs, %ld refused, %ld with several motions, %ld ill-conditioned, %ld wrong\n", what,
                    cases, refused, ambiguous, ill_conditioned, wrong);
    }
};

bool jams(const Drive& d) { return d.jams(); }

// The exact run of a drive against the referee's.
void adjudicate(Tally& t, const std::string& which, const Drive& drive, const Signals& signals, double duration,
                const Samples& exact, const Start& start = {}) {
    referee::Agreement a;
    if (referee::referee_agrees(drive, signals, duration, duration / 100.0, exact, 1e-8, &a, start)) return;
    if (a.truth.outcome == referee::Outcome::several_continuations) {
        ++t.ambiguous;
        return;
    }
    // A motion that is ill-conditioned: a change of the inputs by 1e-14 carries the referee itself as far away.
    if (exact.report.status == Status::done && a.truth.outcome == referee::Outcome::done) {
        const referee::Result other =
            referee::referee_run(referee::case_of(drive, perturbed(signals), duration, duration / 100.0, start));
        if (other.outcome == referee::Outcome::done && a.worst <= 10.0 * referee::spread(drive, other, a.truth)) {
            ++t.ill_conditioned;
            return;
        }
    }
    ++t.wrong;
    std::printf("  %s: %s, exact status %d at %.9g s, referee %d at %.9g s, difference %.2g\n", t.what, which.c_str(),
                static_cast<int>(exact.report.status), exact.report.time, static_cast<int>(a.truth.outcome),
                a.truth.time, a.worst);
}

// Exact against adaptive solver; the referee decides where they differ.
Tally solvers(long count, unsigned seed) {
    Tally t{"exact and adaptive solver on random drives"};
    RandomDrives random(seed);
    for (long n = 0; n < count; ++n) {
        const Drive drive = random.drive();
        const Signals signals = random.signals(drive, 0.2);
        if (jams(drive)) {
            ++t.refused;
            continue;
        }
        ++t.cases;
        const Samples exact = run(drive, signals, 0.2, 2e-3), fine = run(drive, signals, 0.2, 2e-3, {}, 1e-10);
        if (exact.report.status == Status::done && fine.report.status == Status::done &&
            difference_at_end(drive, exact, fine.report.x) < 1e-6)
            continue;
        adjudicate(t, "seed " + std::to_string(seed) + " drive " + std::to_string(n), drive, signals, 0.2, exact);
    }
    return t;
}

Tally splits(long count, unsigned seed) {
    Tally t{"runs that are split at a random instant"};
    RandomDrives random(seed);
    for (long n = 0; n < count; ++n) {
        const SplitCase c(random, n);
        if (jams(c.drive)) {
            ++t.refused;
            continue;
        }
        ++t.cases;
        const Splitting s = split_run(c.drive, c.signals, c.duration, c.at);
        if (same_beyond_rounding(s)) continue;
        ++t.wrong;
        std::printf("  %s: seed %u drive %ld at %.9g s: status %d, split %d, gap %.2g, amplification %.2g\n", t.what,
                    seed, n, c.at, static_cast<int>(s.status), static_cast<int>(s.split), s.gap, s.amplification);
    }
    return t;
}

Tally self_locking(long count, unsigned seed, bool hysteresis) {
    Tally t{hysteresis ? "self-locking gears with hysteresis" : "self-locking gears without any other friction"};
    SelfLockingDrives random(seed, hysteresis);
    for (long n = 0; n < count; ++n) {
        const Drive drive = random.drive();
        const Signals signals = random.reversing(drive);
        ++t.cases;
        const Samples whole = run(drive, signals, 1.0, 1e-2);
        const std::string which = "seed " + std::to_string(seed) + " drive " + std::to_string(n);
        if (whole.report.status != Status::done)
            adjudicate(t, which, drive, signals, 1.0, whole);
        else if (n % 50 == 0)
            adjudicate(t, which, drive, signals, 0.1, run(drive, signals, 0.1, 1e-3));
    }
    return t;
}

Tally round_numbers(long count, unsigned seed) {
    Tally t{"drives of round numbers, against the referee"};
    RoundDrives random(seed);
    for (long n = 0; n < count; ++n) {
        const RoundDrives::Run r = random.next(1.0);
        if (jams(r.drive)) {
            ++t.refused;
            continue;
        }
        ++t.cases;
        adjudicate(t, "seed " + std::to_string(seed) + " drive " + std::to_string(n), r.drive, r.signals, 1.0,
                   run(r.drive, r.signals, 1.0, 1e-2, r.start), r.start);
    }
    return t;
}

// What a run takes: processor time [s], event checks and events in a second of motion.
struct Effort {
    double seconds = 0.0, checks = 0.0, events = 0.0;
    long number = 0;
};

// Trains of all elements run to their end, in finite numbers. The hundred that take longest are described.
Tally endings(long count, unsigned seed) {
    Tally t{"random trains of all elements to their end"};
    constexpr double duration = 1.0;
    std::vector<Effort> all;
    for (long n = 0; n < count; ++n) {
        const auto is = [n](int bit) { return (n >> bit & 1) != 0; };
        model::RandomTrains random(seed + static_cast<unsigned>(n), is(0), is(1), is(2));
        const model::RandomRun r(random, 6, duration);
        const std::clock_t begin = std::clock();
        const model::Recorded run(r.train, r.inputs, duration, duration / 50.0);
        const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
        ++t.cases;
        all.push_back({seconds, static_cast<double>(run.report.steps) / duration,
                       static_cast<double>(run.report.switching_count) / duration, n});
        if (run.done() && std::ranges::all_of(run.out, [](double v) { return std::isfinite(v); })) continue;
        ++t.wrong;
        std::printf("  %s: seed %u train %ld: %s\n", t.what, seed, n,
                    run.done() ? "a value is not finite" : error_text(run.report, run.run.assembly()).c_str());
    }
    std::ranges::sort(all, std::ranges::greater(), &Effort::seconds);
    for (const std::size_t k :
         {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{9}, std::size_t{99}, all.size() / 2})
        if (k < all.size())
            std::printf(
                "  number %zu by time: %.2g ms, %.0f checks and %.0f events in a second of motion (train %ld)\n", k + 1,
                1e3 * all[k].seconds, all[k].checks, all[k].events, all[k].number);
    return t;
}

// Trains: exact against adaptive solver, the laws of every run, time stepping.
template <class Sum, class Check>
Tally trains(const char* what, long count, unsigned seed, Check check) {
    Tally t{what};
    model::RandomTrains random(seed);
    Sum sum;
    for (long n = 0; n < count; ++n)
        check(random, sum, ("seed " + std::to_string(seed) + " train " + std::to_string(n)).c_str());
    t.cases = count;
    t.wrong = sum.failed();
    if constexpr (requires { sum.open; }) t.ambiguous = sum.open;
    t.ill_conditioned = sum.undecided;
    return t;
}

}  // namespace

}  // namespace lostmotion::test

int main(int argc, char** argv) {
    using namespace lostmotion;
    using namespace test;
    const long count = argc > 1 ? std::atol(argv[1]) : 100000;
    const unsigned seed = argc > 2 ? static_cast<unsigned>(std::strtoul(argv[2], nullptr, 10)) : 1;
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    std::printf("soak: %ld cases of each kind, seed %u\n", count, seed);
    long wrong = 0;
    const auto done = [&wrong](const Tally& t) {
        t.print();
        wrong += t.wrong;
    };
    done(splits(count, seed));
    done(self_locking(count, seed, false));
    done(self_locking(count, seed, true));
    done(solvers(count / 10, seed));
    done(round_numbers(count / 100, seed));
    done(endings(count / 10, seed));
    done(trains<model::SolverTally>(
        "exact and adaptive solver on random trains", count / 20, seed,
        [](auto& random, auto& sum, const char* which) { model::compare_solvers(random, 6, 1.0, sum, which); }));
    done(trains<model::LawTally>(
        "laws of runs of random trains", count / 20, seed,
        [](auto& random, auto& sum, const char* which) { model::check_laws(random, 6, 0.4, sum, which); }));
    done(trains<model::SteppingTally>("random trains against time stepping", count / 100, seed,
                                      [](auto& random, auto& sum, const char* which) {
                                          model::compare_with_steps(random, 4, 0.5, 2000, sum, which);
                                      }));
    return wrong > 0;
}
