#include "instant.hpp"

#include <algorithm>

namespace lostmotion::model {

double evaluate(const Layout& n, const Row& f, const Instant& now) {
    double constant = f.c[n.one], input = 0.0, state = 0.0;
    for (int k = 0; k < n.memory; ++k) constant += f.c[n.first_memory + k] * now.memory[k];
    for (int k = 0; k < n.inputs; ++k) input += f.c[n.first_input + k] * now.input[0][k];
    for (int k = 0; k < n.coupled; k += 4) {
        double part[4] = {};
        for (int j = k; j < n.coupled && j < k + 4; ++j) part[j - k] = f.c[j] * now.x[j];
        state += (part[0] + part[1]) + (part[2] + part[3]);
    }
    for (int k = n.coupled; k < n.states; ++k) state += f.c[k] * now.x[k];
    return (constant + input) + state;
}

double magnitude(const Layout& n, const Row& f, const Instant& now) {
    double sum = std::fabs(f.c[n.one]);
    for (int k = 0; k < n.memory; ++k) sum += std::fabs(f.c[n.first_memory + k] * now.memory[k]);
    for (int k = 0; k < n.inputs; ++k)
        sum += std::fabs(f.c[n.first_input + k]) * std::fmax(std::fabs(now.input[0][k]), now.input_magnitudes[k]);
    for (int k = 0; k < n.states; ++k) sum += std::fabs(f.c[k] * now.x[k]);
    return sum;
}

void FormMaker::begin(const Layout& n, std::size_t rows) {
    layout_ = &n;
    const std::size_t most = rows * static_cast<std::size_t>(n.terms) + 1;  // one is written beyond the last
    if (room_.size() < most) room_.resize(most);
    end_ = room_.data();
}

LinearForm FormMaker::operator()(const Row& f) {
    const Layout& n = *layout_;
    const double* c = f.c.begin();
    const int known = static_cast<int>(f.c.size());
    LinearForm out;
    out.begin = end_;
    LinearForm::Term* at = end_;
    // Every term is written, and that which is zero written over: which ones are cannot be foreseen.
    const auto add = [&](int first, int end) {
        for (int k = first; k < std::min(end, known); ++k) {
            *at = {k - first, c[k]};
            at += c[k] != 0.0;
        }
        return static_cast<int>(at - out.begin);
    };
    out.coupled = add(0, n.coupled);
    out.states = add(n.coupled, n.states);
    out.one = f.c[n.one];
    out.memory = add(n.first_memory, n.first_memory + n.memory);
    out.inputs = add(n.first_input, n.first_input + n.inputs);
    end_ = at;
    return out;
}

FormMaker::Terms FormMaker::block() const {
    Terms out = std::make_unique_for_overwrite<LinearForm::Term[]>(terms());
    std::copy_n(room_.data(), terms(), out.get());
    return out;
}

OwnForm::OwnForm(const Row& f, const Layout& n) {
    FormMaker maker;
    maker.begin(n, 1);
    static_cast<LinearForm&>(*this) = maker(f);
    terms_ = maker.block();
    maker.move(*this, terms_);
}

double evaluate(const LinearForm& f, const Instant& now) {
    const double* x = now.x.data();
    double state = f.sum_of_coupled([&](int k, double factor) { return factor * x[k]; });
    for (const auto& [k, factor] : f.of_angles()) state += factor * x[now.coupled + k];
    double constant = f.one, input = 0.0;
    for (const auto& [k, factor] : f.of_memory()) constant += factor * now.memory.data()[k];
    for (const auto& [i, factor] : f.of_inputs()) input += factor * now.input[0].data()[i];
    return (constant + input) + state;
}

double magnitude(const LinearForm& f, const Instant& now) { return sized(f, now).size; }

SparseFlow::SparseFlow(std::span<const LinearForm> rate, const Instant& now, Room& room)
    : rate_(rate), now_(now), room_(room), states_(rate.size()) {
    room_.resize(2 * (n_derivatives + 1) * states_);
}

double SparseFlow::rate(const LinearForm& f, int k) {
    while (order_ < k) extend(++order_);
    double input = 0.0, state = 0.0;
    for (const double* x = derivative(k); const auto& [j, factor] : f.of_coupled()) state += factor * x[j];
    for (const double* u = now_.input[static_cast<std::size_t>(k)].data(); const auto& [i, factor] : f.of_inputs())
        input += factor * u[i];
    return input + state;
}

double SparseFlow::rate_magnitude(const LinearForm& f, int k) {
    while (sized_ < k) extend_sizes(++sized_);
    double sum = 0.0;
    for (const double* x = sizes(k); const auto& [j, factor] : f.of_coupled()) sum += std::fabs(factor) * x[j];
    for (const double* u = now_.input[static_cast<std::size_t>(k)].data(); const auto& [i, factor] : f.of_inputs())
        sum += std::fabs(factor * u[i]);
    return sum;
}

void SparseFlow::extend(int k) {
    for (std::size_t r = 0; r < states_; ++r)
        derivative(k)[r] = k == 1 ? evaluate(rate_[r], now_) : rate(rate_[r], k - 1);
}

void SparseFlow::extend_sizes(int k) {
    for (std::size_t r = 0; r < states_; ++r)
        sizes(k)[r] = k == 1 ? magnitude(rate_[r], now_) : rate_magnitude(rate_[r], k - 1);
}

}  // namespace lostmotion::model
