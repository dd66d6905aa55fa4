// What a train's motion goes by beside its parameters, as one vector
//     w = [states] [1] [memory] [piecewise-linear parts of the inputs] [their slopes] [sine and cosine of each sine]
// of which each part but the states is known at any instant, and so are its derivatives with respect to parameters.
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "tangent_propagator.hpp"
#include "variation.hpp"

namespace lostmotion {

class InputTangents {
 public:
    InputTangents(const model::Layout& layout, const std::vector<Signal>& inputs, const std::vector<Variation>& all);

    const DerivativeFault& fault() const { return fault_; }
    int size() const { return size_; }
    int parameters() const { return parameters_; }
    // Rows of the vector that change within a regime, and those of them that a parameter changes beside the states.
    bool moves() const { return varying_ || !sine_places_.empty(); }
    bool frequency_varies() const { return frequency_varies_; }
    // Whether the equations of both are the same.
    bool moves_as(const InputTangents& o) const;
    double fastest() const;

    // The part beside the states and the memory: w at t, and of each entry the derivatives; left: the left limits.
    // An input that a controller gives has its own value; see hold().
    void fill(double t, bool left, double* w, double* derivative) const;
    // An input that a controller holds.
    void hold(int i, double value, const double* by_parameter, double* w, double* derivative) const;

    // The equations of that part, in those of w.
    void add_rates(std::vector<double>& M, Varied& dM) const;
    // A form in states, 1, memory and inputs as one in w: calls use(index, coefficient term) for each.
    template <class Use>
    void each_term(Use&& use) const {
        for (int k = 0; k < n_.terms; ++k) use(k, k);
        for (std::size_t j = 0; j < sine_places_.size(); ++j)
            use(first_sine_ + 2 * static_cast<int>(j), n_.first_input + sine_places_[j].first);
    }
    // Rates of the inputs at w.
    double rate(int input, const double* w) const;
    // Of the inputs of which a piece begins at t: by how much it comes later, by parameter. False if they differ.
    bool shift_of_breakpoint(double t, double* by_parameter) const;

 private:
    static constexpr double two_pi = 2.0 * std::numbers::pi;

    bool any_not_zero(const double* by_parameter) const {
        return std::any_of(by_parameter, by_parameter + parameters_, [](double v) { return v != 0.0; });
    }
    double* row(double* derivative, int k) const { return derivative + k * parameters_; }
    double omega(int i, int k) const {
        return two_pi * inputs_[static_cast<std::size_t>(i)].sines[static_cast<std::size_t>(k)].frequency;
    }

    void add(int i, int p, const Signal& at, double weight, const std::vector<Variation>& all);

    void fill_sine(int j, double t, double* w, double* derivative) const;

    const model::Layout& n_;
    std::vector<Signal> inputs_;
    int parameters_, size_ = 0, slopes_ = 0, first_sine_ = 0;
    std::vector<std::pair<int, int>> sine_places_;  // input, number
    std::vector<Varied> breakpoints_;               // of each input: pieces x (time, value, slope)
    std::vector<Varied> sines_;                     // of each input: sines x (amplitude, frequency, phase)
    bool varying_ = false, frequency_varies_ = false;
    DerivativeFault fault_;
};

}  // namespace lostmotion
