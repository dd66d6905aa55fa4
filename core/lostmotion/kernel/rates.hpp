// The rates of one regime as arrays: what the linear forms of a regime are turned into for computing.
#pragma once

#include <cassert>
#include <cmath>

#include "form.hpp"
#include "inputs.hpp"

namespace lostmotion {

template <class D>
struct MatrixOf;

// The columns of a matrix of the coupled states.
template <class D>
struct ColumnsOf {
    static constexpr int n = D::coupled;
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;

    std::array<Column, n> column{};

    static constexpr int size() { return n; }
    // Zero, as large as another.
    static MatrixOf<D> like(const ColumnsOf&) { return {}; }
    double operator()(int row, int col) const { return column[col][row]; }
    double& operator()(int row, int col) { return column[col][row]; }
    [[gnu::always_inline]] Coupled at(int c) const { return load(column[c]); }
    [[gnu::always_inline]] void set_column(int c, const Coupled& v) { v.store(column[c].data()); }

    static const MatrixOf<D>& identity() {
        static constexpr MatrixOf<D> one = [] {
            MatrixOf<D> m{};
            for (std::size_t k = 0; k < n; ++k) m.column[k][k] = 1.0;
            return m;
        }();
        return one;
    }
    Coupled unit(int c) const { return identity().at(c); }
    void add_identity(double factor) { static_cast<MatrixOf<D>&>(*this).add(factor, identity()); }

    template <bool magnitudes = false>
    [[gnu::always_inline]] Coupled product(const Coupled& v) const {
        return sum_in_fours<n>([&](auto k) ALWAYS_INLINE { return v.template spread<k>() * at(k); });
    }
    // The same for a vector that is in memory.
    [[gnu::always_inline]] Coupled product(const Column& v) const {
        return sum_in_fours<n>([&](auto k) ALWAYS_INLINE { return v[k] * at(k); });
    }
};

// Columns of a train of any size that lie in a block.
class ColumnsAt {
 public:
    using Coupled = Numbers;
    using Column = ColumnOf<Any>;

    ColumnsAt() = default;
    ColumnsAt(double* at, int n) : at_(at), n_(n) {}
    int size() const { return n_; }
    double operator()(int row, int col) const { return at_[col * n_ + row]; }
    double& operator()(int row, int col) { return at_[col * n_ + row]; }
    NumbersAt at(int c) const { return {at_ + c * n_, n_}; }
    template <InFours E>
    void set_column(int c, const E& v) {
        NumbersRoom{at_ + c * n_, n_} = v;
    }
    Coupled unit(int c) const {
        Coupled out;
        out[c] = 1.0;
        return out;
    }
    void add_identity(double factor) {
        for (int k = 0; k < n_; ++k) (*this)(k, k) += factor;
    }
    // Column by column, four at a time, and as many rows as registers hold. What comes behind v is zero.
    template <bool magnitudes = false, InFours E>
    Coupled product(const E& v) const {
        if constexpr (requires { v.at; }) {
            Coupled out;
            multiply<magnitudes>(v.at, std::min(n_, v.size()), out.resized(n_));
            return out;
        } else if constexpr (requires { v.all(); }) {
            return product<magnitudes>(v.all());
        } else {
            return product<magnitudes>(Numbers(v).all());
        }
    }

 protected:
    double* at_ = nullptr;
    int n_ = 0;

 private:
    template <bool magnitudes>
    void multiply(const double* v, int count, double* out) const {
        int r = 0;
        for (; r + 16 <= n_; r += 16) multiply_rows<16, magnitudes>(r, v, count, out);
        if (n_ - r == 12)
            multiply_rows<12, magnitudes>(r, v, count, out);
        else
            for (; r < n_; r += 4) multiply_rows<4, magnitudes>(r, v, count, out);
    }
    template <int rows, bool magnitudes>
    void multiply_rows(int r, const double* v, int count, double* out) const {
        Pack<rows> sum{};
        const double* from = at_ + r;
        for (int c = 0; c < count; c += 4, from += 4 * n_) {
            const auto part = [&](int k) ALWAYS_INLINE {
                const auto factors = Pack<rows>::load(from + k * n_);
                return v[c + k] * (magnitudes ? absolute(factors) : factors);
            };
            sum = sum + ((part(0) + part(1)) + (part(2) + part(3)));
        }
        sum.store(out + r);
    }
};
struct alignas(32) FourInRow {
    double number[4];
};
// The same in a block of their own.
template <>
struct ColumnsOf<Any> : ColumnsAt {
    ColumnsOf() = default;
    explicit ColumnsOf(int n) {
        own_.resize(static_cast<std::size_t>(n * n / 4));
        refer(n);
    }
    ColumnsOf(const ColumnsOf& o) : ColumnsAt(), own_(o.own_) { refer(o.n_); }
    ColumnsOf(ColumnsOf&& o) noexcept : ColumnsAt(o), own_(std::move(o.own_)) {}
    ColumnsOf& operator=(ColumnsOf o) {
        own_.swap(o.own_);
        refer(o.n_);
        return *this;
    }
    static MatrixOf<Any> like(const ColumnsOf& o);

 private:
    void refer(int n) {
        n_ = n;
        at_ = own_.data()->number;
    }
    std::vector<FourInRow> own_;
};

// A linear map of the coupled states, by columns.
template <class Columns>
struct MatrixBy : Columns {
    using Columns::at, Columns::set_column, Columns::size, Columns::Columns;
    using typename Columns::Coupled, typename Columns::Column;

    template <class Vector>
        requires(!requires { typename Vector::Column; })  // of a matrix: below
    [[gnu::always_inline]] Coupled operator*(const Vector& v) const {
        return this->product(v);
    }
    Coupled row(int r) const {
        Column out;
        make_room(out, size());
        for (int c = 0; c < size(); ++c) out[c] = (*this)(r, c);
        return load(out);
    }
    // A row times this.
    Coupled after(const Coupled& row) const {
        Column out;
        make_room(out, size());
        for (int c = 0; c < size(); c += 4)
            sums(row * at(c), row * at(c + 1), row * at(c + 2), row * at(c + 3)).store(out.data() + c);
        return load(out);
    }
    // factor * other, entry by entry
    template <class Other>
    void add(double factor, const MatrixBy<Other>& other) {
        for (int c = 0; c < size(); ++c) set_column(c, at(c) + factor * other.at(c));
    }
    void scale(double factor) {
        for (int c = 0; c < size(); ++c) set_column(c, factor * at(c));
    }
    // Takes the numbers of another.
    template <class Other>
    void assign(const MatrixBy<Other>& other) {
        for (int c = 0; c < size(); ++c) set_column(c, other.at(c));
    }
};
using MatrixAt = MatrixBy<ColumnsAt>;
template <class D>
struct MatrixOf : MatrixBy<ColumnsOf<D>> {
    using Base = ColumnsOf<D>;
    using MatrixBy<Base>::MatrixBy;

    MatrixOf magnitudes() const {
        MatrixOf out = Base::like(*this);
        for (int c = 0; c < this->size(); ++c) out.set_column(c, absolute(this->at(c)));
        return out;
    }
    template <class Columns>
    friend MatrixOf operator*(const MatrixBy<Columns>& a, const MatrixOf& b) {
        MatrixOf out = Base::like(b);
        for (int c = 0; c < b.size(); ++c) out.set_column(c, a * b.at(c));
        return out;
    }
};
inline MatrixOf<Any> ColumnsOf<Any>::like(const ColumnsOf& o) { return MatrixOf<Any>(o.n_); }

// dx/dt = A x + constant + B u of one regime. The angles follow their speeds, and no rate depends on them.
template <class D>
struct LinearRatesOf {
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;
    using State = StateOf<D>;
    using Lanes = LanesOf<D>;
    using Inputs = InputsOf<D>;
    using Memory = typename D::Memory;

    [[no_unique_address]] CountsOf<D> n;
    MatrixOf<D> rate;
    AnglesOf<D> angle_coefficient{};  // of each angle: 1 or, if its shaft is at rest, 0: its rate over its speed
    [[no_unique_address]] AngleSpeeds<D> angle_speed;
    std::array<Column, D::inputs> input_column{};
    Column fixed{};                              // the constant: its column for 1 ...
    std::array<Column, D::memory> per_memory{};  // ... and those for the memory
    [[no_unique_address]] DependsOn<D> depends_on;
    const std::vector<GivenState>* given = nullptr;  // states that are given speeds, if there are any

    LinearRatesOf() = default;
    // From those of the coupled states and of the angles.
    LinearRatesOf(const CountsOf<D>&, std::span<const LinearForm> of, std::span<const LinearForm> of_angles) {
        for (std::size_t j = 0; j < of_angles.size(); ++j)
            for (const auto& [k, factor] : of_angles[j].of_coupled()) {
                angle_speed.set(static_cast<int>(j), k);
                angle_coefficient[j] = factor;
            }
        for (std::size_t r = 0; r < of.size() && r < D::coupled; ++r) {
            const LinearForm& f = of[r];
            assert(f.of_angles().empty());
            for (const auto& [c, factor] : f.of_coupled()) rate.column[static_cast<std::size_t>(c)][r] = factor;
            for (const auto& [i, factor] : f.of_inputs()) {
                input_column[static_cast<std::size_t>(i)][r] = factor;
                depends_on.see_input(i, factor);
            }
            fixed[r] = f.one;
            for (const auto& [k, factor] : f.of_memory()) {
                per_memory[static_cast<std::size_t>(k)][r] = factor;
                depends_on.see_memory(k, factor);
            }
        }
    }
    // The part of dx/dt that depends on neither state nor inputs.
    Column constant(const Memory& m) const {
        Coupled kept = m[0] * load(per_memory[0]);
        for (int k = 1; k < depends_on.memory; ++k) kept = kept + m[k] * load(per_memory[k]);
        Column c;
        (load(fixed) + kept).store(c.data());
        return c;
    }
    // The part of it that the inputs bring.
    [[gnu::always_inline]] Coupled forced(const Inputs& u) const {
        Coupled sum = u[0] * load(input_column[0]);
        for (int i = 1; i < depends_on.inputs; ++i) sum = sum + u[i] * load(input_column[i]);
        return sum;
    }
    // From inputs that are asked for their values.
    template <class Input>
    [[gnu::always_inline]] Coupled forced(const Input& input) const {
        Inputs u{};
        input.values(depends_on.inputs, u);
        return forced(u);
    }
    // The rates of the angles.
    [[gnu::always_inline]] AnglesOf<D> angle_rate(const Coupled& x) const {
        AnglesOf<D> out;
        for (int j = 0; j < D::angles; ++j) out[j] = angle_coefficient[j] * x[angle_speed[j]];
        return out;
    }
    template <class Input>
    [[gnu::always_inline]] Lanes operator()(const Coupled& x, const Column& constant, const Input& u) const {
        return {(rate * x + forced(u)) + load(constant), angle_rate(x)};
    }
    [[gnu::always_inline]] State operator()(const State& x, const Column& constant, const Inputs& u) const {
        State out;
        (*this)(coupled(x), constant, u).store(out);
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    [[gnu::always_inline]] State higher(const State& derivative, const Inputs& u) const {
        return (*this)(derivative, Column{}, u);
    }

    const MatrixOf<D>& matrix() const { return rate; }
    // Calls use(column, coefficient) for each in a row.
    template <class Use>
    [[gnu::always_inline]] void each_in_row(int r, Use&& use) const {
        for (int c = 0; c < D::coupled; ++c) use(c, rate(r, c));
    }

    // The fastest rate [1/s] of one state, or of two that act on each other, whatever their units.
    double fastest() const {
        double square = 0.0;
        for (int j = 0; j < D::coupled; ++j)
            for (int k = 0; k <= j; ++k) square = std::fmax(square, std::fabs(rate(j, k) * rate(k, j)));
        return std::sqrt(square);
    }

    // Sums of the magnitudes of the terms of both, from magnitudes of what they depend on.
    State magnitude(const State& x, const Memory& m, const Inputs& u) const {
        State out = higher_magnitude(x, u);
        Coupled kept = m[0] * absolute(load(per_memory[0]));
        for (int k = 1; k < depends_on.memory; ++k) kept = kept + m[k] * absolute(load(per_memory[k]));
        (coupled(out) + (absolute(load(fixed)) + kept)).store(out.data());
        return out;
    }
    State higher_magnitude(const State& derivative, const Inputs& u) const {
        Coupled forced = u[0] * absolute(load(input_column[0]));
        for (int i = 1; i < depends_on.inputs; ++i) forced = forced + u[i] * absolute(load(input_column[i]));
        State out;
        (sum_in_fours<D::coupled>([&](auto k) { return derivative[k] * absolute(rate.at(k)); }) + forced)
            .store(out.data());
        for (int j = 0; j < D::angles; ++j) out[D::coupled + j] = angle_coefficient[j] * derivative[angle_speed[j]];
        return out;
    }
};

// The coefficients of A that are not zero, in strips, and those of B, input by input. A strip holds what lies on one
// diagonal in four rows that follow each other. The states of a chain depend on their neighbours, so few strips are all
// that a train has.
class SparseRates {
 public:
    std::vector<std::vector<std::pair<int, double>>> of_input;

    struct Coefficient {
        int row, column;
        double factor;
    };
    // n: rows. all: row by row, each in the order of its columns.
    void set(int n, const std::vector<Coefficient>& all) {
        auto next = all.begin();
        for (int row = 0; row < n; row += 4) {
            std::vector<Coefficient> some;
            for (; next != all.end() && next->row < row + 4; ++next) some.push_back(*next);
            std::ranges::stable_sort(some, {}, [](const Coefficient& c) { return c.column - c.row; });
            for (const Coefficient& c : some) {
                const int from = c.column - c.row + row;
                if (strips_.size() == ends_.back() || strips_.back().from != from) strips_.push_back({from, {}, {}});
                const auto lane = static_cast<std::size_t>(c.row - row);
                strips_.back().factor[lane] = c.factor;
                strips_.back().positive[lane] = c.row == c.column ? std::fmax(0.0, c.factor) : std::fabs(c.factor);
            }
            ends_.push_back(strips_.size());
        }
    }
    // A x, in whole fours, or with magnitudes in place of its coefficients, but for what decays by itself. The terms of
    // a row are added up in the order of their columns. x: `slack` zeros lie before and behind it.
    static constexpr int slack = 4;
    void multiply(const double* x, double* out, bool of_positive = false) const {
        const auto each_four = [&](auto coefficients) ALWAYS_INLINE {
            const Strip* strip = strips_.data();
            for (std::size_t k = 1; k < ends_.size(); ++k) {
                Pack<4> sum{};
                for (const Strip* end = strips_.data() + ends_[k]; strip != end; ++strip)
                    sum = sum + Pack<4>::load((strip->*coefficients).data()) * Pack<4>::load(x + strip->from);
                sum.store(out + 4 * (k - 1));
            }
        };
        of_positive ? each_four(&Strip::positive) : each_four(&Strip::factor);
    }
    Numbers product(const Numbers& x, bool of_positive = false) const {
        const int n = 4 * static_cast<int>(ends_.size() - 1);
        Numbers room = Numbers::zeros(n + 2 * slack), out;
        std::copy_n(x.data(), std::min(x.size(), n), room.data() + slack);
        multiply(room.data() + slack, out.resized(n), of_positive);
        return out;
    }

 private:
    struct Strip {
        int from;  // the column of its first row
        std::array<double, 4> factor, positive;
    };
    std::vector<Strip> strips_;
    std::vector<std::size_t> ends_{0};  // of four rows each
};

// The same of a train of any size. The rates of a large train are added up row by row, of the coefficients that are not
// zero, and its matrix is made where it is needed.
template <>
struct LinearRatesOf<Any> {
    using D = Any;
    using Coupled = Numbers;
    using Column = ColumnOf<D>;
    using State = StateOf<D>;
    using Lanes = LanesOf<D>;
    using Inputs = InputsOf<D>;
    using Memory = D::Memory;

    CountsOf<D> n;
    AnglesOf<D> angle_coefficient;
    AngleSpeeds<D> angle_speed;
    std::vector<Column> input_column;
    DependsOn<D> depends_on;
    const std::vector<GivenState>* given = nullptr;

 private:
    struct OfMemory {
        int row, memory;
        double factor;
    };
    const LinearForm& row(int r) const { return rows_[static_cast<std::size_t>(r)]; }
    template <class Value>
    Coupled of_memory(Value&& value) const {
        Coupled kept = Coupled::zeros(n.coupled);
        for (const OfMemory& t : of_memory_) kept.data()[t.row] += value(t);
        return kept;
    }
    // sum_i u_i of(column i)
    template <class Of>
    [[gnu::always_inline]] auto of_inputs(const Inputs& u, Of of) const {
        return Computed{n.coupled, [this, &u, of](int k) ALWAYS_INLINE {
                            Pack<4> sum{};
                            for (int i = 0; i < depends_on.inputs; ++i)
                                sum = sum +
                                      u[i] * of(Pack<4>::load(input_column[static_cast<std::size_t>(i)].data() + k));
                            return sum;
                        }};
    }

 public:
    LinearRatesOf() = default;
    LinearRatesOf(const CountsOf<D>& counts, std::span<const LinearForm> of, std::span<const LinearForm> of_angles)
        : n(counts), input_column(static_cast<std::size_t>(counts.inputs)), rows_(of) {
        for (int j = 0; j < n.angles; ++j)
            for (const auto& [k, factor] : of_angles[static_cast<std::size_t>(j)].of_coupled()) {
                angle_speed.set(j, k);
                angle_coefficient[j] = factor;
            }
        make_room(angle_coefficient, n.angles);
        make_room(fixed_, n.coupled);
        for (Column& c : input_column) make_room(c, n.coupled);
        sparse_.of_input.resize(input_column.size());
        for (int r = 0; r < n.coupled; ++r) {
            const LinearForm& f = row(r);
            for (const auto& [i, factor] : f.of_inputs()) {
                input_column[static_cast<std::size_t>(i)][r] = factor;
                sparse_.of_input[static_cast<std::size_t>(i)].emplace_back(r, factor);
                depends_on.see_input(i, factor);
            }
            fixed_[r] = f.one;
            for (const auto& [k, factor] : f.of_memory()) of_memory_.push_back({r, k, factor});
        }
        if (is_small()) {
            matrix();
            return;
        }
        std::vector<SparseRates::Coefficient> all;
        for (int r = 0; r < n.coupled; ++r)
            each_in_row(r, [&](int c, double factor) { all.push_back({r, c, factor}); });
        sparse_.set(n.coupled, all);
    }

    // Whether the whole matrix is used in place of what of it is not zero.
    bool is_small() const { return n.coupled <= few_states; }
    const SparseRates& sparse() const { return sparse_; }
    // Whole, once it is asked for.
    const MatrixOf<D>& matrix() const {
        if (matrix_.size() == 0) {
            matrix_ = MatrixOf<D>(n.coupled);
            for (int r = 0; r < n.coupled; ++r) each_in_row(r, [&](int c, double factor) { matrix_(r, c) = factor; });
        }
        return matrix_;
    }

    Column constant(const Memory& m) const {
        return fixed_ + of_memory([&](const OfMemory& t) { return m[t.memory] * t.factor; });
    }
    // Part of dx/dt by the inputs, as an expression if the train is small.
    Coupled forced(const Inputs& u) const {
        if (is_small()) return of_inputs(u, [](const Pack<4>& c) { return c; });
        Coupled out = Coupled::zeros(n.coupled);
        for (int i = 0; i < depends_on.inputs; ++i)
            for (const auto& [r, factor] : sparse_.of_input[static_cast<std::size_t>(i)])
                out.data()[r] += factor * u[i];
        return out;
    }
    template <class Input>
    Coupled forced(const Input& input) const {
        Inputs u{};
        input.values(depends_on.inputs, u);
        return forced(u);
    }
    AnglesOf<D> angle_rate(const Coupled& x) const {
        AnglesOf<D> out;
        double* to = out.resized(angle_coefficient.size());
        for (int j = 0; j < out.size(); ++j)
            to[j] = j < n.angles ? angle_coefficient.data()[j] * x[angle_speed[j]] : 0.0;
        return out;
    }
    // A x; of few states in the order of a matrix.
    Coupled operator*(const Coupled& x) const {
        if (is_small()) return matrix_ * x;
        return sparse_.product(x);
    }
    template <class Input>
    Lanes operator()(const Coupled& x, const Column& constant, const Input& u) const {
        return {(*this * x + forced(u)) + constant, angle_rate(x)};
    }
    State operator()(const State& x, const Column& constant, const Inputs& u) const {
        return (*this)(x.coupled, constant, u);
    }
    State higher(const State& derivative, const Inputs& u) const { return (*this)(derivative, Column{}, u); }

    double fastest() const {
        return fastest([](int r, int c) { return c <= r; });
    }
    // The fastest rates [1/s] by which a state decays or grows by itself, and by which two swing.
    double fastest_decay() const {
        double most = 0.0;
        for (int r = 0; r < n.coupled; ++r) most = std::fmax(most, std::fabs(row(r).of(r)));
        return most;
    }
    double fastest_swing() const {
        return fastest([](int r, int c) { return c != r; });
    }
    // Calls use(column, coefficient) for what of a row may be other than zero.
    template <class Use>
    void each_in_row(int r, Use&& use) const {
        for (const auto& [c, factor] : row(r).of_coupled()) use(c, factor);
    }

    State magnitude(const State& x, const Memory& m, const Inputs& u) const {
        State out = higher_magnitude(x, u);
        out.coupled = out.coupled + (absolute(fixed_) +
                                     of_memory([&](const OfMemory& t) { return m[t.memory] * std::fabs(t.factor); }));
        return out;
    }
    State higher_magnitude(const State& derivative, const Inputs& u) const {
        if (is_small())
            return {
                matrix_.product<true>(derivative.coupled) + of_inputs(u, [](const Pack<4>& c) { return absolute(c); }),
                angle_rate(derivative.coupled)};
        State out;
        double* to = out.coupled.resized(n.coupled);
        for (int r = 0; r < n.coupled; ++r) {
            to[r] =
                row(r).sum_of_coupled([&](int k, double factor) { return derivative.coupled[k] * std::fabs(factor); });
            double forced = 0.0;
            for (const auto& [i, c] : row(r).of_inputs()) forced += u[i] * std::fabs(c);
            to[r] += forced;
        }
        out.angle = angle_rate(derivative.coupled);
        return out;
    }

 private:
    // Of two states that act on each other, of those pairs that count.
    template <class Counts>
    double fastest(Counts&& counts) const {
        double square = 0.0;
        for (int r = 0; r < n.coupled; ++r)
            each_in_row(r, [&](int c, double factor) {
                if (counts(r, c)) square = std::fmax(square, std::fabs(factor * row(c).of(r)));
            });
        return std::sqrt(square);
    }

    std::span<const LinearForm> rows_;  // those of the regime
    SparseRates sparse_;
    Column fixed_;
    std::vector<OfMemory> of_memory_;  // row by row
    mutable MatrixOf<D> matrix_;
};

}  // namespace lostmotion
