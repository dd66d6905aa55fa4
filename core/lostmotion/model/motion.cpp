#include "motion.hpp"

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

SparseForm::SparseForm(const Row& f, const Layout& n, std::vector<Term>& block) : begin(block.data() + block.size()) {
    int count = 0;
    const auto add = [&](int first, int end) {
        for (int k = first; k < end && k < static_cast<int>(f.c.size()); ++k)
            if (const double c = f.c[k]; c != 0.0) {
                block.push_back({k - first, c});
                ++count;
            }
        return count;
    };
    coupled = add(0, n.coupled);
    for (int k = n.coupled; k < n.states; ++k)
        if (const double c = f.c[k]; c != 0.0) {
            block.push_back({k, c});
            ++count;
        }
    states = count;
    one = f.c[n.one];
    memory = add(n.first_memory, n.first_memory + n.memory);
    inputs = add(n.first_input, n.first_input + n.inputs);
}

double evaluate(const SparseForm& f, const Instant& now) {
    const SparseForm::Term* t = f.begin;
    const double* x = now.x.data();
    double state = 0.0;
    for (const SparseForm::Term* end = t + f.coupled; t != end;) {
        const int four = t->place / 4;
        double first = 0.0, second = 0.0;  // the halves of the four
        for (; t != end && t->place / 4 == four; ++t) {
            const double term = t->factor * x[t->place];
            const bool behind = (t->place & 2) != 0;
            first += behind ? 0.0 : term;
            second += behind ? term : 0.0;
        }
        state += first + second;
    }
    for (; t != f.begin + f.states; ++t) state += t->factor * x[t->place];
    double constant = f.one, input = 0.0;
    for (const double* m = now.memory.data(); t != f.begin + f.memory; ++t) constant += t->factor * m[t->place];
    for (const double* u = now.input[0].data(); t != f.begin + f.inputs; ++t) input += t->factor * u[t->place];
    return (constant + input) + state;
}

double magnitude(const SparseForm& f, const Instant& now) {
    const SparseForm::Term* t = f.begin;
    double sum = std::fabs(f.one);
    for (; t != f.begin + f.states; ++t) sum += std::fabs(t->factor * now.x.data()[t->place]);
    for (; t != f.begin + f.memory; ++t) sum += std::fabs(t->factor * now.memory.data()[t->place]);
    for (; t != f.begin + f.inputs; ++t)
        sum += std::fabs(t->factor) *
               std::fmax(std::fabs(now.input[0].data()[t->place]), now.input_magnitudes.data()[t->place]);
    return sum;
}

Sized sized(const SparseForm& f, const Instant& now) {
    const SparseForm::Term* t = f.begin;
    Sized out{f.one, std::fabs(f.one)};
    const auto add = [&](double term, double size) {
        out.value += term;
        out.size += size;
    };
    for (const double* x = now.x.data(); t != f.begin + f.states; ++t)
        add(t->factor * x[t->place], std::fabs(t->factor * x[t->place]));
    for (const double* m = now.memory.data(); t != f.begin + f.memory; ++t)
        add(t->factor * m[t->place], std::fabs(t->factor * m[t->place]));
    for (const double* u = now.input[0].data(); t != f.begin + f.inputs; ++t)
        add(t->factor * u[t->place],
            std::fabs(t->factor) * std::fmax(std::fabs(u[t->place]), now.input_magnitudes.data()[t->place]));
    return out;
}

SparseFlow::SparseFlow(const std::vector<SparseForm>& rate, const Instant& now, Room& room)
    : rate_(rate), now_(now), room_(room), states_(rate.size()) {
    room_.resize(2 * (n_derivatives + 1) * states_);
}

double SparseFlow::rate(const SparseForm& f, int k) {
    while (order_ < k) extend(++order_);
    const SparseForm::Term* t = f.begin;
    double input = 0.0, state = 0.0;
    for (const double* x = derivative(k); t != f.begin + f.states; ++t) state += t->factor * x[t->place];
    t = f.begin + f.memory;
    for (const double* u = now_.input[static_cast<std::size_t>(k)].data(); t != f.begin + f.inputs; ++t)
        input += t->factor * u[t->place];
    return input + state;
}

double SparseFlow::rate_magnitude(const SparseForm& f, int k) {
    while (sized_ < k) extend_sizes(++sized_);
    const SparseForm::Term* t = f.begin;
    double sum = 0.0;
    for (const double* x = sizes(k); t != f.begin + f.states; ++t) sum += std::fabs(t->factor) * x[t->place];
    t = f.begin + f.memory;
    for (const double* u = now_.input[static_cast<std::size_t>(k)].data(); t != f.begin + f.inputs; ++t)
        sum += std::fabs(t->factor * u[t->place]);
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
