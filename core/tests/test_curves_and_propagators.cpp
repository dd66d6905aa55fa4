// Curves, maps, propagation and the Runge-Kutta tableau on their own.
#include <doctest/doctest.h>

#include <random>

#include "drive_runs.hpp"
#include "least_kernel.hpp"
#include "lostmotion/analysis/reduction.hpp"
#include "lostmotion/solver/adaptive_solver.hpp"

namespace lostmotion::test {
using doctest::Approx;

namespace {

using Long = long double;
template <std::size_t n>
using LongMatrix = std::array<std::array<Long, n>, n>;  // [row][column]

// exp(A t) by a plain Taylor series of many short steps in extended precision.
template <class D>
LongMatrix<D::states> reference_exponential(const model::SparseRegime& regime, Long t) {
    constexpr std::size_t n = D::states;
    using Matrix = LongMatrix<n>;
    constexpr int steps = 1 << 14;
    const Long h = t / steps;
    Matrix step{}, term{};
    for (std::size_t i = 0; i < n; ++i) step[i][i] = term[i][i] = 1.0L;
    const auto multiply = [](const Matrix& a, const Matrix& b) {
        Matrix c{};
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t k = 0; k < n; ++k)
                for (std::size_t j = 0; j < n; ++j) c[i][j] += a[i][k] * b[k][j];
        return c;
    };
    Matrix A{};
    each_rate<D>(regime, [&](int row, const LinearForm& f) {
        each_state_of<D>(
            f, [&](int k, double c) { A[static_cast<std::size_t>(row)][static_cast<std::size_t>(k)] = c * h; });
    });
    for (int k = 1; k < 30; ++k) {
        term = multiply(term, A);
        for (auto& row : term)
            for (Long& v : row) v /= k;
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j) step[i][j] += term[i][j];
    }
    Matrix power = step;
    for (int k = 0; k < 14; ++k) power = multiply(power, power);
    return power;
}

// use(propagator of a regime of a drive, its rates, sizes of the states) in the kernel of the drive. slipping: of all
// contacts; else the regime at rest.
template <class Use>
void with_propagator(const Drive& drive, bool slipping, const Use& use) {
    const TrainRun run(train_of(drive));
    const TrainModel model = run.model();
    using D = model::Least;
    const model::TrainSystem<D> system(model.assembly);
    RegimeCache<model::TrainSystem<D>> cache(system);
    InstantOf<D> now;
    model::Key key;
    REQUIRE(system.start(now, key) == Found::yes);
    const auto& contacts = model.assembly.places().contacts;
    for (std::size_t c = 0; slipping && c < contacts.size(); ++c)
        if (key.modes[c] == 0 && !contacts[c].bilateral) key.modes[c] = 1;
    const auto regime = system.build(key);
    Propagator<D> p;
    const SignalsOf<D> none;
    PhaseRotations turns(1e-3, input_basis(none));
    const LinearRatesOf<D> rates(system.counts(), regime->rate, regime->angle_rate);
    p.prepare(rates, turns, system.balanced_scale());
    use(p, rates, *regime, system.balanced_scale());
}

}  // namespace

TEST_SUITE("parts") {
    TEST_CASE("torsion curve is odd, continuous and has the published values") {
        const TorsionCurve curve({0.6e-3, 3e-3}, {2.65e3, 21.2e3, 26.5e3});
        CHECK(curve.torque(0.6e-3) == Approx(1.59));
        CHECK(curve.torque(3e-3) == Approx(52.47));
        for (const double d : {0.0, 1e-4, 0.6e-3, 1e-3, 3e-3, 5e-3}) {
            CHECK(curve.torque(-d) == -curve.torque(d));
            CHECK(curve.torque(d + 1e-12) == Approx(curve.torque(d)).scale(1.0).epsilon(1e-6));
        }
        // The energy is the integral of the torque.
        double sum = 0.0;
        for (int k = 0; k < 100000; ++k) sum += curve.torque((k + 0.5) * 4e-8) * 4e-8;
        CHECK(curve.energy(4e-3) == Approx(sum).epsilon(1e-9));
        CHECK(curve.energy(-4e-3) == curve.energy(4e-3));
        for (const double from : {-5e-3, -1e-4, 2e-3})
            for (const double to : {-3e-3, 0.0, 4e-3})
                CHECK(curve.energy(from, to) ==
                      Approx(curve.energy(to) - curve.energy(from)).scale(0.1).epsilon(1e-13));
        CHECK(curve.energy(2e-3, 2e-3 + 1e-15) == Approx(curve.torque(2e-3) * ((2e-3 + 1e-15) - 2e-3)).epsilon(1e-11));
    }
    TEST_CASE("loss map is continuous, takes its nodes, mirrors, and is never negative beyond them") {
        RandomDrives random(5);
        for (int n = 0; n < 50; ++n) {
            const LossMap map = random.loss_map();
            for (int t = 0; t < map.triangles(); ++t) {
                Edge edges[3];
                const int m = map.edges(t, edges);
                for (int k = 0; k < m; ++k) {
                    if (edges[k].neighbour < 0) continue;
                    // Walking back over the same edge leads home, and both planes agree on it.
                    Edge back[3];
                    const int l = map.edges(edges[k].neighbour, back);
                    bool home = false;
                    for (int j = 0; j < l; ++j) home |= back[j].neighbour == t;
                    CHECK(home);
                    const Plane a = map.plane(t), b = map.plane(edges[k].neighbour), e = edges[k].inside;
                    for (const double along : {0.1, 0.7}) {
                        const double v = std::fabs(e.per_load) > 0.0 ? along : -e.at_zero / e.per_speed;
                        const double mu =
                            std::fabs(e.per_load) > 0.0 ? -(e.at_zero + e.per_speed * v) / e.per_load : along;
                        CHECK(a.at_zero + a.per_speed * v + a.per_load * mu ==
                              Approx(b.at_zero + b.per_speed * v + b.per_load * mu).epsilon(1e-8));
                    }
                }
            }
            for (int k = 0; k < 200; ++k) CHECK(map(random.uniform(-9.0, 9.0), random.uniform(0.0, 9.0)) >= 0.0);
        }
        const LossMap mirrored = plane_map(0.02, 0.04, 0.06);
        CHECK(mirrored(0.5, 0.3) == Approx(0.02 + 0.012 + 0.03));
        CHECK(mirrored(-0.5, 0.3) == Approx(mirrored(0.5, 0.3)));
    }
    TEST_CASE("a loss map without loss at no load and standstill has none there in any cell, to the last bit") {
        RandomDrives random(11);
        for (int n = 0; n < 1000; ++n) {
            std::vector<double> speeds{0.0}, loads{0.0}, values;
            for (int k = 0; k < 3; ++k) {
                speeds.push_back(speeds.back() + random.uniform(0.1, 1.0));
                loads.insert(loads.begin(), loads.front() - random.uniform(0.1, 1.0));
                loads.push_back(loads.back() + random.uniform(0.1, 1.0));
            }
            for (const double mu : loads)
                for (const double v : speeds) values.push_back(mu == 0.0 && v == 0.0 ? 0.0 : random.uniform(0.0, 1.0));
            const LossMap map(speeds, loads, values);
            for (const double mu : {-1e-9, 1e-9}) {
                for (const double v : {0.0, 1e-12, 1e-6}) CHECK(map.plane(map.triangle(mu, v)).at_zero == 0.0);
                CHECK(map.line_at_standstill(map.load_interval(mu)).at_zero == 0.0);
            }
        }
    }
    TEST_CASE("propagation agrees with an exponential in extended precision, over nine decades of time") {
        RandomDrives random(3);
        for (int n = 0; n < 12; ++n) {
            const auto compare = [&]<class D>(Propagator<D>& p, const LinearRatesOf<D>& rates,
                                              const model::SparseRegime& regime, const StateOf<D>& scale) {
                for (int level = 0; p.length(level) < 1.0; level += 2) {
                    const auto& step = p.level(level);
                    const auto expected = reference_exponential<D>(regime, p.length(level));
                    for (int i = 0; i < D::states; ++i)
                        for (int j = 0; j < D::states; ++j) {
                            const double e = static_cast<double>(expected[i][j]) - (i == j ? 1.0 : 0.0);
                            // In balanced units; doubling adds about one rounding a doubling level.
                            const double change = j >= D::coupled   ? 0.0
                                                  : i >= D::coupled ? rates.angle_coefficient[i - D::coupled] *
                                                                          step.integral.coupled(load_speed, j)
                                                                    : step.change(i, j);
                            CHECK(std::fabs(change - e) * scale[j] / scale[i] < 1e-10);
                        }
                }
            };
            with_propagator(random.drive(), true, compare);
        }
    }
    TEST_CASE("a guard's exponential_bound bound really bounds the exponential") {
        RandomDrives random(4);
        for (int n = 0; n < 20; ++n) {
            with_propagator(random.drive(), false,
                            []<class D>(Propagator<D>& p, const auto&, const auto&, const auto&) {
                                for (int level = 3; level < 9; ++level)
                                    for (int inner = 0; inner <= level; ++inner)
                                        for (int j = 0; j < D::coupled; ++j)
                                            for (int i = 0; i < D::coupled; ++i)
                                                CHECK(std::fabs(p.level(inner).change(i, j) + (i == j ? 1.0 : 0.0)) <=
                                                      p.level(level).exponential_bound(i, j) * (1.0 + 1e-9) + 1e-300);
                            });
        }
    }
    TEST_CASE("reductions are what they are called, for any number of samples") {
        std::mt19937 random(5);
        std::uniform_real_distribution<double> uniform(-2.0, 1.0);
        for (std::size_t n = 1; n < 40; ++n) {
            std::vector<double> v(n);
            for (double& x : v) x = uniform(random);
            Long sum = 0.0L, squares = 0.0L;
            double peak = 0.0;
            for (const double x : v) {
                sum += x;
                squares += static_cast<Long>(x) * x;
                peak = std::max(peak, std::fabs(x));
            }
            CHECK(reduce(Reduction::peak, v.data(), n) == peak);
            CHECK(reduce(Reduction::min, v.data(), n) == *std::min_element(v.begin(), v.end()));
            CHECK(reduce(Reduction::max, v.data(), n) == *std::max_element(v.begin(), v.end()));
            CHECK(reduce(Reduction::final, v.data(), n) == v.back());
            CHECK(reduce(Reduction::mean, v.data(), n) ==
                  doctest::Approx(static_cast<double>(sum / n)).epsilon(1e-14).scale(1.0));
            CHECK(reduce(Reduction::rms, v.data(), n) ==
                  doctest::Approx(static_cast<double>(std::sqrt(squares / n))).epsilon(1e-14));
        }
        CHECK(std::isnan(reduce(Reduction::mean, nullptr, 0)));
    }
    TEST_CASE("Dormand-Prince tableau satisfies its conditions of order") {
        using DP = DormandPrince;
        for (int i = 0; i < DP::stages; ++i) {
            double row = 0.0;
            for (int j = 0; j < i; ++j) row += DP::a[i][j];
            CHECK(row == Approx(DP::c[i]).epsilon(1e-14).scale(1.0));
        }
        // The last row holds the weights of order five: sum b c^k = 1/(k + 1). The error weights sum to zero likewise
        // up to order four, and the dense output ends in the solution.
        for (int k = 0; k < 5; ++k) {
            double b = 0.0, e = 0.0;
            for (int i = 0; i < DP::stages; ++i) {
                const double power = std::pow(DP::c[i], k);
                b += DP::a[6][i] * (k == 0 ? 1.0 : power);
                e += DP::error[i] * (k == 0 ? 1.0 : power);
            }
            CHECK(b == Approx(1.0 / (k + 1)).epsilon(1e-13));
            if (k < 4) CHECK(e == Approx(0.0).scale(1.0).epsilon(1e-14));
        }
        for (int i = 0; i < DP::stages; ++i) {
            const double end = DP::dense[i][0] + DP::dense[i][1] + DP::dense[i][2] + DP::dense[i][3];
            CHECK(end == Approx(DP::a[6][i]).scale(1.0).epsilon(1e-12));
        }
    }
    TEST_CASE("the adaptive solver's error falls with its tolerance") {
        Drive d = plain_drive(1.0, 0.005, 0.005);
        set_curve(d, {}, {700.0});
        const Signals signals{sine(1.0, 20.0), Signal{}};
        const double exact = run(d, signals, 0.5).report.x[load_speed];
        double previous = 1.0;
        for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
            const double error = std::fabs(run(d, signals, 0.5, 1e-3, {}, tolerance).report.x[load_speed] - exact);
            CHECK(error < 0.1 * previous);
            previous = error;
        }
    }
}

}  // namespace lostmotion::test
