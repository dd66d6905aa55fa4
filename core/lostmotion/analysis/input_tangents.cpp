#include "input_tangents.hpp"

namespace lostmotion {

InputTangents::InputTangents(const model::Layout& layout, const std::vector<Signal>& inputs,
                             const std::vector<Variation>& all)
    : n_(layout), inputs_(inputs), parameters_(static_cast<int>(all.size())) {
    inputs_.resize(static_cast<std::size_t>(n_.inputs));
    for (int i = 0; i < n_.inputs; ++i) {
        const Signal& s = inputs_[static_cast<std::size_t>(i)];
        breakpoints_.emplace_back(static_cast<int>(s.breakpoints.size()), 3, parameters_);
        sines_.emplace_back(static_cast<int>(s.sines.size()), 3, parameters_);
        for (int p = 0; p < parameters_; ++p)
            for (const Neighbour& n : all[static_cast<std::size_t>(p)].neighbours)
                if (n.inputs) add(i, p, (*n.inputs)[static_cast<std::size_t>(i)], n.weight, all);
    }
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
        for (std::size_t k = 0; k < inputs_[i].breakpoints.size(); ++k)
            varying_ = varying_ || inputs_[i].breakpoints[k].slope != 0.0 ||
                       any_not_zero(breakpoints_[i].at(static_cast<int>(k), 2));
        for (std::size_t k = 0; k < inputs_[i].sines.size(); ++k)
            frequency_varies_ = frequency_varies_ || any_not_zero(sines_[i].at(static_cast<int>(k), 1));
    }
    slopes_ = n_.terms;
    first_sine_ = slopes_ + n_.inputs;
    size_ = first_sine_;
    for (int i = 0; i < n_.inputs; ++i)
        for (int k = 0; k < static_cast<int>(inputs_[static_cast<std::size_t>(i)].sines.size()); ++k, size_ += 2)
            sine_places_.push_back({i, k});
}

bool InputTangents::moves_as(const InputTangents& o) const {
    return parameters_ == o.parameters_ && size_ == o.size_ && varying_ == o.varying_ && sine_places_.empty() &&
           o.sine_places_.empty();
}

double InputTangents::fastest() const {  // [rad/s]
    double omega = 0.0;
    for (const auto& [i, k] : sine_places_) omega = std::fmax(omega, std::fabs(this->omega(i, k)));
    return omega;
}

void InputTangents::fill(double t, bool left, double* w, double* derivative) const {
    w[n_.one] = 1.0;
    for (int i = 0; i < n_.inputs; ++i) {
        const Signal& s = inputs_[static_cast<std::size_t>(i)];
        std::size_t k = s.segment(t);
        while (left && k > 0 && s.breakpoints[k].time >= t) --k;
        const Breakpoint& b = s.breakpoints[k];
        w[n_.first_input + i] = b.value + b.slope * (t - b.time);
        w[slopes_ + i] = b.slope;
        double *value = row(derivative, n_.first_input + i), *slope = row(derivative, slopes_ + i);
        const auto at = [&](int what) {
            return breakpoints_[static_cast<std::size_t>(i)].at(static_cast<int>(k), what);
        };
        for (int p = 0; p < parameters_; ++p) {
            value[p] = at(1)[p] + at(2)[p] * (t - b.time) - b.slope * at(0)[p];
            slope[p] = at(2)[p];
        }
    }
    for (std::size_t j = 0; j < sine_places_.size(); ++j) fill_sine(static_cast<int>(j), t, w, derivative);
}

void InputTangents::hold(int i, double value, const double* by_parameter, double* w, double* derivative) const {
    w[n_.first_input + i] = value;
    w[slopes_ + i] = 0.0;
    std::copy_n(by_parameter, parameters_, row(derivative, n_.first_input + i));
    std::fill_n(row(derivative, slopes_ + i), parameters_, 0.0);
}

void InputTangents::add_rates(std::vector<double>& M, Varied& dM) const {
    const auto at = [&](int r, int c) -> double& { return M[static_cast<std::size_t>(r * size_ + c)]; };
    if (varying_)
        for (int i = 0; i < n_.inputs; ++i) at(n_.first_input + i, slopes_ + i) = 1.0;
    for (std::size_t j = 0; j < sine_places_.size(); ++j) {
        const auto [i, k] = sine_places_[j];
        const int sine = first_sine_ + 2 * static_cast<int>(j);
        at(sine, sine + 1) = omega(i, k);
        at(sine + 1, sine) = -omega(i, k);
        if (!frequency_varies_) continue;
        const double* f = sines_[static_cast<std::size_t>(i)].at(k, 1);
        for (int p = 0; p < parameters_; ++p) {
            dM.at(sine, sine + 1)[p] = two_pi * f[p];
            dM.at(sine + 1, sine)[p] = -two_pi * f[p];
        }
    }
}

double InputTangents::rate(int input, const double* w) const {
    double sum = w[slopes_ + input];
    for (std::size_t j = 0; j < sine_places_.size(); ++j)
        if (const auto [i, k] = sine_places_[j]; i == input)
            sum += omega(i, k) * w[first_sine_ + 2 * static_cast<int>(j) + 1];
    return sum;
}

bool InputTangents::shift_of_breakpoint(double t, double* by_parameter) const {
    bool found = false, alike = true;
    for (int i = 0; i < n_.inputs; ++i) {
        const Signal& s = inputs_[static_cast<std::size_t>(i)];
        const std::size_t k = s.segment(t);
        if (k == 0 || s.breakpoints[k].time != t) continue;
        const Breakpoint &before = s.breakpoints[k - 1], &at = s.breakpoints[k];
        if (before.slope == at.slope && before.value + before.slope * (t - before.time) == at.value) continue;
        const double* shift = breakpoints_[static_cast<std::size_t>(i)].at(static_cast<int>(k), 0);
        for (int p = 0; p < parameters_; ++p) {
            alike = alike && (!found || by_parameter[p] == shift[p]);
            by_parameter[p] = shift[p];
        }
        found = true;
    }
    return alike;
}

void InputTangents::add(int i, int p, const Signal& at, double weight, const std::vector<Variation>& all) {
    const Signal& s = inputs_[static_cast<std::size_t>(i)];
    if (s.breakpoints.size() != at.breakpoints.size() || s.sines.size() != at.sines.size()) {
        fault_ = {all[static_cast<std::size_t>(p)].name, "beside its value an input has other pieces"};
        return;
    }
    const auto note = [&](Varied& to, std::size_t k, int what, double a, double b) {
        to.at(static_cast<int>(k), what)[p] += weight * (b - a);
    };
    for (std::size_t k = 0; k < s.breakpoints.size(); ++k) {
        const Breakpoint &a = s.breakpoints[k], &b = at.breakpoints[k];
        Varied& to = breakpoints_[static_cast<std::size_t>(i)];
        note(to, k, 0, a.time, b.time);
        note(to, k, 1, a.value, b.value);
        note(to, k, 2, a.slope, b.slope);
    }
    for (std::size_t k = 0; k < s.sines.size(); ++k) {
        const Sine &a = s.sines[k], &b = at.sines[k];
        Varied& to = sines_[static_cast<std::size_t>(i)];
        note(to, k, 0, a.amplitude, b.amplitude);
        note(to, k, 1, a.frequency, b.frequency);
        note(to, k, 2, a.phase, b.phase);
    }
}

void InputTangents::fill_sine(int j, double t, double* w, double* derivative) const {
    const auto [i, k] = sine_places_[static_cast<std::size_t>(j)];
    const Sine& s = inputs_[static_cast<std::size_t>(i)].sines[static_cast<std::size_t>(k)];
    const auto [sine, cosine] = sine_cosine(two_pi * fraction_of_turn(s.frequency, t) + s.phase);
    const int at = first_sine_ + 2 * j;
    w[at] = s.amplitude * sine;
    w[at + 1] = s.amplitude * cosine;
    const Varied& d = sines_[static_cast<std::size_t>(i)];
    for (int p = 0; p < parameters_; ++p) {
        const double amplitude = d.at(k, 0)[p], angle = two_pi * t * d.at(k, 1)[p] + d.at(k, 2)[p];
        row(derivative, at)[p] = amplitude * sine + angle * w[at + 1];
        row(derivative, at + 1)[p] = amplitude * cosine - angle * w[at];
    }
}

}  // namespace lostmotion
