// The rates of one regime as arrays: what the linear forms of a regime are turned into for computing.
#pragma once

#include <cassert>
#include <cmath>

#include "form.hpp"
#include "inputs.hpp"

namespace lostmotion {

// A linear map of the coupled states, column by column.
template <class D>
struct MatrixOf {
    static constexpr int n = D::coupled;
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;

    std::array<Column, n> column{};

    static const MatrixOf& identity() {
        static constexpr MatrixOf one = [] {
            MatrixOf m{};
            for (std::size_t k = 0; k < n; ++k) m.column[k][k] = 1.0;
            return m;
        }();
        return one;
    }

    [[gnu::always_inline]] Coupled at(int c) const { return load(column[c]); }
    [[gnu::always_inline]] Coupled operator*(const Coupled& v) const {
        return sum_in_fours<n>([&](auto k) ALWAYS_INLINE { return v.template spread<k>() * at(k); });
    }
    // The same for a vector that is in memory.
    [[gnu::always_inline]] Coupled operator*(const Column& v) const {
        return sum_in_fours<n>([&](auto k) ALWAYS_INLINE { return v[k] * at(k); });
    }
    double operator()(int row, int col) const { return column[col][row]; }
    double& operator()(int row, int col) { return column[col][row]; }
    // Zero, as large as another.
    static MatrixOf like(const MatrixOf&) { return {}; }
    void make_room_like(const MatrixOf&) {}
    void add_identity(double factor) { add(factor, identity()); }
    // A column of 1.
    Coupled unit(int c) const { return identity().at(c); }
    void set_column(int c, const Coupled& v) { v.store(column[c].data()); }
    int size() const { return n; }
    Coupled row(int r) const {
        std::array<double, n> numbers;
        for (int c = 0; c < n; ++c) numbers[c] = column[c][r];
        return Coupled::of(numbers);
    }
    // A row times this.
    Coupled after(const Coupled& row) const {
        Coupled out;
        for (int c = 0; c < n; c += 4)
            out.set_four(c / 4, sums(row * at(c), row * at(c + 1), row * at(c + 2), row * at(c + 3)));
        return out;
    }

    // factor * other, entry by entry
    void add(double factor, const MatrixOf& other) {
        for (int c = 0; c < n; ++c) (at(c) + factor * other.at(c)).store(column[c].data());
    }
    void scale(double factor) {
        for (int c = 0; c < n; ++c) (factor * at(c)).store(column[c].data());
    }
    MatrixOf magnitudes() const {
        MatrixOf out;
        for (int c = 0; c < n; ++c) absolute(at(c)).store(out.column[c].data());
        return out;
    }
    friend MatrixOf operator*(const MatrixOf& a, const MatrixOf& b) {
        MatrixOf out;
        for (int c = 0; c < n; ++c) (a * b.column[c]).store(out.column[c].data());
        return out;
    }
};

// The same of a train of any size: one block of as many numbers as there are.
template <>
struct MatrixOf<Any> {
    using Coupled = Numbers;
    using Column = ColumnOf<Any>;

    MatrixOf() = default;
    explicit MatrixOf(int n) : n_(n), entry_(static_cast<std::size_t>(n) * static_cast<std::size_t>(n)) {}
    static MatrixOf like(const MatrixOf& o) { return MatrixOf(o.n_); }
    void make_room_like(const MatrixOf& o) {
        n_ = o.n_;
        entry_.resize(o.entry_.size());
    }

    int size() const { return n_; }
    const double* column(int c) const { return entry_.data() + c * n_; }
    double* column(int c) { return entry_.data() + c * n_; }
    double operator()(int row, int col) const { return column(col)[row]; }
    double& operator()(int row, int col) { return column(col)[row]; }
    Coupled at(int c) const { return Numbers::load(column(c), static_cast<std::size_t>(n_)); }
    void set_column(int c, const Coupled& v) { v.store(column(c), static_cast<std::size_t>(n_)); }
    Coupled unit(int c) const {
        Coupled out;
        out[c] = 1.0;
        return out;
    }
    Coupled row(int r) const {
        Coupled out;
        out.reach(static_cast<std::size_t>(n_));
        for (int c = 0; c < n_; ++c) out[c] = (*this)(r, c);
        return out;
    }
    // Column by column, four at a time, and as many rows as registers hold.
    Coupled operator*(const Coupled& v) const {
        Coupled out;
        out.reach(static_cast<std::size_t>(n_));
        multiply(v.data(), std::min(n_, static_cast<int>(v.size())), out.data());
        return out;
    }
    Coupled after(const Coupled& row) const {
        Coupled out;
        out.reach(static_cast<std::size_t>(n_));
        const int known = std::min(n_, static_cast<int>(row.size()));
        for (int c = 0; c < n_; ++c) {
            double sum = 0.0;
            for (int k = 0; k < known; k += 4)
                sum += (Pack<4>::load(row.data() + k) * Pack<4>::load(column(c) + k)).sum();
            out[c] = sum;
        }
        return out;
    }
    void add(double factor, const MatrixOf& o) {
        for (std::size_t k = 0; k < entry_.size(); k += 4)
            (Pack<4>::load(&entry_[k]) + factor * Pack<4>::load(&o.entry_[k])).store(&entry_[k]);
    }
    void add_identity(double factor) {
        for (int k = 0; k < n_; ++k) (*this)(k, k) += factor;
    }
    void scale(double factor) {
        for (double& v : entry_) v *= factor;
    }
    MatrixOf magnitudes() const {
        MatrixOf out = *this;
        for (double& v : out.entry_) v = std::fabs(v);
        return out;
    }
    friend MatrixOf operator*(const MatrixOf& a, const MatrixOf& b) {
        MatrixOf out = like(a);
        for (int c = 0; c < a.n_; ++c) a.multiply(b.column(c), a.n_, out.column(c));
        return out;
    }

 private:
    // The first `count` columns; what comes behind is multiplied by zero.
    void multiply(const double* v, int count, double* out) const {
        static constexpr int strip = 16;
        for (int r = 0; r < n_; r += strip) {
            const int rows = std::min(strip, n_ - r);
            if (rows == strip)
                multiply_rows<strip>(r, v, count, out);
            else
                for (int four = r; four < n_; four += 4) multiply_rows<4>(four, v, count, out);
        }
    }
    template <int rows>
    void multiply_rows(int r, const double* v, int count, double* out) const {
        Pack<rows> sum{};
        for (int c = 0; c < count; c += 4) {
            const auto part = [&](int k) ALWAYS_INLINE { return v[c + k] * Pack<rows>::load(column(c + k) + r); };
            sum = sum + ((part(0) + part(1)) + (part(2) + part(3)));
        }
        sum.store(out + r);
    }

    int n_ = 0;
    std::vector<double> entry_;  // column by column
};

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
    // From the rates of all states.
    LinearRatesOf(const CountsOf<D>&, const ByState<D, LinearFormOf<D>>& of) {
        for (int j = 0; j < D::angles; ++j) {
            const LinearFormOf<D>& angle = of[D::coupled + j];
            for (int k = 0; k < D::coupled; ++k)
                if (angle.c[k] != 0.0) angle_speed.set(j, k);
            angle_coefficient[j] = angle.c[angle_speed[j]];
            for (int k = 0; k < D::terms; ++k) assert(k == angle_speed[j] || angle.c[k] == 0.0);
        }
        for (int r = 0; r < D::coupled; ++r) {
            const LinearFormOf<D>& f = of[r];
            for (int j = D::coupled; j < D::states; ++j) assert(f.c[j] == 0.0);
            for (int c = 0; c < D::coupled; ++c) rate.column[c][r] = f.c[c];
            for (int i = 0; i < D::inputs; ++i) {
                input_column[i][r] = f.c[D::first_input + i];
                depends_on.see_input(i, input_column[i][r]);
            }
            fixed[r] = f.c[D::one];
            for (int k = 0; k < D::memory; ++k) {
                per_memory[k][r] = f.c[D::first_memory + k];
                depends_on.see_memory(k, per_memory[k][r]);
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

// The coefficients of A that are not zero, row by row, and those of B, input by input.
struct SparseRates {
    std::vector<int> begin{0}, column;
    std::vector<double> factor;
    std::vector<std::vector<std::pair<int, double>>> of_input;

    // A x
    void multiply(const double* x, double* out) const {
        const int rows = static_cast<int>(begin.size()) - 1;
        for (int r = 0; r < rows; ++r) {
            double sum = 0.0;
            for (int k = begin[static_cast<std::size_t>(r)]; k < begin[static_cast<std::size_t>(r) + 1]; ++k)
                sum += factor[static_cast<std::size_t>(k)] * x[column[static_cast<std::size_t>(k)]];
            out[r] = sum;
        }
    }
    // Without the signs, but for what decays by itself.
    SparseRates magnitudes() const {
        SparseRates out = *this;
        for (std::size_t r = 0; r + 1 < begin.size(); ++r)
            for (auto k = static_cast<std::size_t>(begin[r]); k < static_cast<std::size_t>(begin[r + 1]); ++k)
                out.factor[k] =
                    static_cast<std::size_t>(column[k]) == r ? std::fmax(0.0, factor[k]) : std::fabs(factor[k]);
        return out;
    }
};

// The same of a train of any size. Its rates are added up row by row, of the coefficients that are not zero; the matrix
// is made where it is needed.
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
    Few<double, 4> angle_coefficient;
    AngleSpeeds<D> angle_speed;
    std::vector<Column> input_column;
    DependsOn<D> depends_on;
    const std::vector<GivenState>* given = nullptr;

    LinearRatesOf() = default;
    LinearRatesOf(const CountsOf<D>& counts, const ByState<D, AnyForm>& of)
        : n(counts), input_column(static_cast<std::size_t>(counts.inputs)), rows_(&of.coupled) {
        for (int j = 0; j < n.angles; ++j)
            of[D::coupled + j].each_term([&](int place, double factor) {
                if (factor == 0.0) return;
                angle_speed.set(j, place);
                angle_coefficient[j] = factor;
            });
        for (int r = 0; r < n.coupled; ++r) {
            const AnyForm& f = row(r);
            each_input_of<D>(f, [&](int i, double factor) {
                input_column[static_cast<std::size_t>(i)][r] = factor;
                depends_on.see_input(i, factor);
            });
            fixed_[r] = f.c[D::one];
            each_memory_of<D>(f, [&](int k, double factor) {
                depends_on.see_memory(k, factor);
                of_memory_.push_back({r, k, factor});
            });
            each_coupled(r, [&](const AnyForm::Term& t) {
                sparse_.column.push_back(t.place);
                sparse_.factor.push_back(t.factor);
            });
            sparse_.begin.push_back(static_cast<int>(sparse_.column.size()));
        }
        for (const Column& c : input_column) {
            auto& of = sparse_.of_input.emplace_back();
            for (int r = 0; r < n.coupled; ++r)
                if (c[r] != 0.0) of.emplace_back(r, c[r]);
        }
        for (Column& c : input_column) c.reach(static_cast<std::size_t>(n.coupled));
    }

    const SparseRates& sparse() const { return sparse_; }
    const AnyForm& row(int r) const { return (*rows_)[static_cast<std::size_t>(r)]; }
    // Whole, once it is asked for.
    const MatrixOf<D>& matrix() const {
        if (matrix_.size() == 0) {
            matrix_ = MatrixOf<D>(n.coupled);
            for (int r = 0; r < n.coupled; ++r)
                each_coupled(r, [&](const AnyForm::Term& t) { matrix_(r, t.place) = t.factor; });
        }
        return matrix_;
    }

    Column constant(const Memory& m) const {
        Coupled kept;
        kept.reach(static_cast<std::size_t>(n.coupled));
        for (const OfMemory& t : of_memory_) kept[t.row] += m[t.memory] * t.factor;
        return fixed_ + kept;
    }
    Coupled forced(const Inputs& u) const {
        Coupled out;
        out.reach(static_cast<std::size_t>(n.coupled));
        for (int i = 0; i < depends_on.inputs; ++i)
            for (const auto& [r, factor] : sparse_.of_input[static_cast<std::size_t>(i)]) out[r] += factor * u[i];
        return out;
    }
    template <class Input>
    Coupled forced(const Input& input) const {
        Inputs u{};
        input.values(depends_on.inputs, u);
        return forced(u);
    }
    Few<double, 4> angle_rate(const Coupled& x) const {
        Few<double, 4> out;
        for (int j = 0; j < n.angles; ++j) out[j] = angle_coefficient[j] * x[angle_speed[j]];
        return out;
    }
    // A x; of few states in the order of a matrix.
    Coupled operator*(const Coupled& x) const {
        if (n.coupled <= few_states) return matrix() * x;
        if (x.size() < static_cast<std::size_t>(n.coupled)) {  // what lies beyond is zero
            Coupled whole = x;
            whole.reach(static_cast<std::size_t>(n.coupled));
            return *this * whole;
        }
        Coupled out;
        out.reach(static_cast<std::size_t>(n.coupled));
        sparse_.multiply(x.data(), out.data());
        return out;
    }
    template <class Input>
    Lanes operator()(const Coupled& x, const Column& constant, const Input& u) const {
        return {(*this * x + forced(u)) + load(constant), angle_rate(x)};
    }
    State operator()(const State& x, const Column& constant, const Inputs& u) const {
        State out;
        (*this)(coupled(x), constant, u).store(out);
        return out;
    }
    State higher(const State& derivative, const Inputs& u) const { return (*this)(derivative, Column{}, u); }

    double fastest() const {
        double square = 0.0;
        for (int r = 0; r < n.coupled; ++r)
            each_coupled(r, [&](const AnyForm::Term& t) {
                if (t.place <= r) square = std::fmax(square, std::fabs(t.factor * row(t.place).c[r]));
            });
        return std::sqrt(square);
    }
    // The fastest rates [1/s] by which a state decays or grows by itself, and by which two swing.
    double fastest_decay() const {
        double most = 0.0;
        for (int r = 0; r < n.coupled; ++r) most = std::fmax(most, std::fabs(row(r).c[r]));
        return most;
    }
    double fastest_swing() const {
        double square = 0.0;
        for (int r = 0; r < n.coupled; ++r)
            each_coupled(r, [&](const AnyForm::Term& t) {
                if (t.place != r) square = std::fmax(square, std::fabs(t.factor * row(t.place).c[r]));
            });
        return std::sqrt(square);
    }
    // Calls use(column, coefficient) for what of a row may be other than zero.
    template <class Use>
    void each_in_row(int r, Use&& use) const {
        each_coupled(r, [&](const AnyForm::Term& t) { use(t.place, t.factor); });
    }

    State magnitude(const State& x, const Memory& m, const Inputs& u) const {
        State out = higher_magnitude(x, u);
        out.coupled = out.coupled + of_rows([&](int r) {
                          double kept = 0.0;
                          each_memory_of<D>(row(r), [&](int k, double c) { kept += m[k] * std::fabs(c); });
                          return std::fabs(row(r).c[D::one]) + kept;
                      });
        return out;
    }
    State higher_magnitude(const State& derivative, const Inputs& u) const {
        State out;
        out.coupled = of_rows([&](int r) {
            const auto [begin, end] = row(r).between(0, D::coupled);
            const double own = AnyForm::sum_of_coupled(
                begin, end, [&](const auto& t) { return derivative.coupled[t.place] * std::fabs(t.factor); });
            double forced = 0.0;
            each_input_of<D>(row(r), [&](int i, double c) { forced += u[i] * std::fabs(c); });
            return own + forced;
        });
        for (int j = 0; j < n.angles; ++j) out.angle[j] = angle_coefficient[j] * derivative.coupled[angle_speed[j]];
        return out;
    }

 private:
    struct OfMemory {
        int row, memory;
        double factor;
    };
    template <class Use>
    void each_coupled(int r, Use&& use) const {
        const auto [begin, end] = row(r).between(0, D::coupled);
        for (auto* t = begin; t != end; ++t) use(*t);
    }
    template <class Value>
    Coupled of_rows(Value&& value) const {
        Coupled out;
        out.reach(static_cast<std::size_t>(n.coupled));
        double* to = out.data();
        for (int r = 0; r < n.coupled; ++r) to[r] = value(r);
        return out;
    }

    const std::vector<AnyForm>* rows_ = nullptr;  // those of the regime
    SparseRates sparse_;
    Column fixed_;
    std::vector<OfMemory> of_memory_;  // row by row
    mutable MatrixOf<D> matrix_;
};

}  // namespace lostmotion
