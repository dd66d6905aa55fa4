// Linear forms of a train of any size at one instant, by its layout: what the search of modes computes with.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "../base/linear_form.hpp"
#include "../base/sign.hpp"
#include "../elements/row.hpp"

namespace lostmotion::model {

// All that a regime's equations depend on at one instant. That of a kernel is the same in its own places.
struct Instant {
    double time = 0.0;  // [s]
    int coupled = 0;    // how many states come before the angles
    Few<double, 20> x;
    Few<double, 12> memory;
    std::array<Few<double, 8>, n_derivatives> input;  // [k]: k-th derivatives
    Few<double, 8> input_magnitudes;

    // Makes room for all that a train has.
    void reach(const Layout& n) {
        coupled = n.coupled;
        x.reach(static_cast<std::size_t>(n.states));
        memory.reach(static_cast<std::size_t>(n.memory));
        for (auto& u : input) u.reach(static_cast<std::size_t>(n.inputs));
        input_magnitudes.reach(static_cast<std::size_t>(n.inputs));
    }
    // With neither state nor inputs.
    Instant at_rest() const {
        Instant out = *this;
        std::fill(out.x.begin(), out.x.end(), 0.0);
        for (auto& u : out.input) std::fill(u.begin(), u.end(), 0.0);
        return out;
    }
};

// Added up as a kernel does: the constants, the inputs, the coupled states in fours, the angles.
double evaluate(const Layout& n, const Row& f, const Instant& now);
// Sum of the magnitudes of the terms, with those of the inputs' parts.
double magnitude(const Layout& n, const Row& f, const Instant& now);

// Makes forms of the terms of rows that are not zero, one after the other in memory that is used again.
class FormMaker {
 public:
    // rows: how many it is to make, at most.
    void begin(const Layout& n, std::size_t rows);
    LinearForm operator()(const Row& f);

    // The terms of all forms since the beginning, in a block of their own, to which `move` brings each of these forms.
    using Terms = std::unique_ptr<LinearForm::Term[]>;
    Terms block() const;
    void move(LinearForm& f, const Terms& to) const { f.begin = to.get() + (f.begin - room_.data()); }
    std::size_t terms() const { return static_cast<std::size_t>(end_ - room_.data()); }

 private:
    const Layout* layout_ = nullptr;
    std::vector<LinearForm::Term> room_;
    LinearForm::Term* end_ = nullptr;
};

// A form with terms of its own.
struct OwnForm : LinearForm {
    OwnForm(const Row& f, const Layout& n);
    OwnForm(OwnForm&&) = default;

 private:
    FormMaker::Terms terms_;
};

double evaluate(const LinearForm& f, const Instant& now);
double magnitude(const LinearForm& f, const Instant& now);
// Both at once, added up in the order of the terms.
struct Sized {
    double value, size;
};
inline Sized sized(const LinearForm& f, const Instant& now) {
    const double* x = now.x.data();
    Sized out{f.one, std::fabs(f.one)};
    const auto add = [&](double term, double size) {
        out.value += term;
        out.size += size;
    };
    for (const auto& [k, factor] : f.of_coupled()) add(factor * x[k], std::fabs(factor * x[k]));
    for (const auto& [k, factor] : f.of_angles())
        add(factor * x[now.coupled + k], std::fabs(factor * x[now.coupled + k]));
    for (const auto& [k, factor] : f.of_memory())
        add(factor * now.memory.data()[k], std::fabs(factor * now.memory.data()[k]));
    for (const auto& [i, factor] : f.of_inputs()) {
        const double u = now.input[0].data()[i];
        add(factor * u, std::fabs(factor) * std::fmax(std::fabs(u), now.input_magnitudes.data()[i]));
    }
    return out;
}

// Time derivatives along the flow of one regime, computed as far as they are asked for: the kernel's Flow for the
// search.
class SparseFlow {
 public:
    // Memory of the derivatives, used again from flow to flow.
    using Room = std::vector<double>;

    // rate: of the coupled states. No form that is asked for depends on an angle.
    SparseFlow(std::span<const LinearForm> rate, const Instant& now, Room& room);

    double noise(double size, double rate) const {
        return rounding * size + time_rounding * std::fabs(now_.time * rate);
    }
    // Value of the k-th derivative of a form, k > 0, and the sum of the magnitudes of its terms.
    double rate(const LinearForm& f, int k);
    double rate_magnitude(const LinearForm& f, int k);

 private:
    double* derivative(int k) { return room_.data() + static_cast<std::size_t>(k) * states_; }
    double* sizes(int k) { return derivative(n_derivatives + 1 + k); }
    void extend(int k);
    void extend_sizes(int k);

    std::span<const LinearForm> rate_;
    const Instant& now_;
    Room& room_;
    std::size_t states_;
    int order_ = 0, sized_ = 0;
};

}  // namespace lostmotion::model
