#include "tangent_propagator.hpp"

namespace lostmotion {

void TangentPropagator::prepare(int size, int moving, int varied, std::vector<double> M, Varied dM, double base) {
    size_ = size;
    moving_ = moving;
    varied_ = varied;
    parameters_ = dM.parameters();
    M_ = std::move(M);
    dM_ = std::move(dM);
    base_ = base;
    levels_.clear();
    entries_.clear();
    for (int r = 0; r < moving_; ++r)
        for (int c = 0; c < size_; ++c) {
            const double* d = dM_.at(r, c);
            const bool varies = r < varied_ && std::any_of(d, d + parameters_, [](double v) { return v != 0.0; });
            const double rate = this->M(r, c);
            if (rate != 0.0 || varies) entries_.push_back({r, c, rate, varies});
        }
}

void TangentPropagator::advance(double* w, double* derivative, double s) {
    auto n = static_cast<std::uint64_t>(s / base_);
    for (; static_cast<double>(n) * base_ > s; --n) {
    }
    const double rest = s - static_cast<double>(n) * base_;
    if (n <= few)
        for (; n > 0; --n) taylor(w, derivative, base_);
    for (int k = 63; k >= 0; --k)
        if (n >> k & 1) step(k, w, derivative);
    taylor(w, derivative, rest);
}

void TangentPropagator::step(int k, double* w, double* derivative) {
    while (static_cast<int>(levels_.size()) <= k) levels_.empty() ? add_base() : add_doubled();
    const Level& l = levels_[static_cast<std::size_t>(k)];
    change_.assign(static_cast<std::size_t>(moving_ * (parameters_ + 1)), 0.0);
    double* own = change_.data() + moving_ * parameters_;
    for (int r = 0; r < moving_; ++r) {
        double* d = change_.data() + r * parameters_;
        const double* C = l.C.data() + r * size_;
        for (int c = 0; c < size_; ++c) {
            if (C[c] != 0.0) {
                own[r] += C[c] * w[c];
                add_scaled(d, C[c], derivative + c * parameters_, parameters_);
            }
            if (r < varied_ && w[c] != 0.0) add_scaled(d, w[c], l.L.at(r, c), parameters_);
        }
    }
    apply(w, derivative);
}

int TangentPropagator::terms_for(double share) {
    double term = 1.0;
    int j = 0;
    while (j < order && term > 1e-19) term *= 0.25 * share / ++j;
    return j;
}

void TangentPropagator::apply(double* w, double* derivative) const {
    for (int k = 0; k < moving_ * parameters_; ++k) derivative[k] += change_[static_cast<std::size_t>(k)];
    for (int r = 0; r < moving_; ++r) w[r] += change_[static_cast<std::size_t>(moving_ * parameters_ + r)];
}

void TangentPropagator::taylor(double* w, double* derivative, double s) {
    if (!(s > 0.0)) return;
    const auto columns = static_cast<std::size_t>(parameters_ + 1);
    const auto whole = static_cast<std::size_t>(size_) * columns;
    change_.assign(static_cast<std::size_t>(moving_) * columns, 0.0);
    term_.assign(whole, 0.0);
    for (int r = 0; r < size_; ++r) {
        double* t = term_.data() + r * (parameters_ + 1);
        for (int p = 0; p < parameters_; ++p) t[p] = derivative[r * parameters_ + p];
        t[parameters_] = w[r];
    }
    next_.assign(whole, 0.0);
    const int last = terms_for(s / base_);
    for (int j = 1; j <= last; ++j) {
        std::fill_n(next_.begin(), static_cast<std::size_t>(moving_) * columns, 0.0);
        if (j == 2) std::fill(next_.begin() + moving_ * (parameters_ + 1), next_.end(), 0.0);
        const double factor = s / j;
        for (const Entry& e : entries_) {
            double* to = next_.data() + e.row * (parameters_ + 1);
            const double* t = term_.data() + e.column * (parameters_ + 1);
            if (e.rate != 0.0) add_scaled(to, factor * e.rate, t, parameters_ + 1);
            if (e.varied && t[parameters_] != 0.0)
                add_scaled(to, factor * t[parameters_], dM_.at(e.row, e.column), parameters_);
        }
        for (int r = 0; r < moving_; ++r) {
            const double* to = next_.data() + r * (parameters_ + 1);
            for (int p = 0; p < parameters_; ++p) change_[static_cast<std::size_t>(r * parameters_ + p)] += to[p];
            change_[static_cast<std::size_t>(moving_ * parameters_ + r)] += to[parameters_];
        }
        std::swap(term_, next_);
    }
    apply(w, derivative);
}

void TangentPropagator::add_base() {
    Level l{std::vector<double>(static_cast<std::size_t>(moving_ * size_)), Varied(varied_, size_, parameters_)};
    std::vector<double> P(static_cast<std::size_t>(size_ * size_)), P_next(P.size());
    Varied Q(size_, size_, parameters_), Q_next(size_, size_, parameters_);
    for (int r = 0; r < size_; ++r) at(P, size_, r, r) = 1.0;
    for (int j = 1; j <= order; ++j) {
        std::fill(P_next.begin(), P_next.end(), 0.0);
        std::fill(Q_next.all().begin(), Q_next.all().end(), 0.0);
        const double factor = base_ / j;
        for (int r = 0; r < moving_; ++r)
            for (int k = 0; k < size_; ++k) {
                const double a = factor * M(r, k);
                for (int c = 0; c < size_; ++c) {
                    at(P_next, size_, r, c) += a * at(P, size_, k, c);
                    if (r >= varied_) continue;
                    if (k < varied_ && a != 0.0) add_scaled(Q_next.at(r, c), a, Q.at(k, c), parameters_);
                    if (const double b = factor * at(P, size_, k, c); b != 0.0)
                        add_scaled(Q_next.at(r, c), b, dM_.at(r, k), parameters_);
                }
            }
        std::swap(P, P_next);
        std::swap(Q, Q_next);
        for (std::size_t k = 0; k < l.C.size(); ++k) l.C[k] += P[k];
        for (std::size_t k = 0; k < l.L.all().size(); ++k) l.L.all()[k] += Q.all()[k];
    }
    levels_.push_back(std::move(l));
}

void TangentPropagator::add_doubled() {
    Level& a = levels_.back();
    Level b = a;
    for (double& v : b.C) v *= 2.0;
    for (double& v : b.L.all()) v *= 2.0;
    for (int r = 0; r < moving_; ++r)
        for (int k = 0; k < moving_; ++k) {
            const double C = at(a.C, size_, r, k);
            if (C != 0.0)
                for (int c = 0; c < size_; ++c) at(b.C, size_, r, c) += C * at(a.C, size_, k, c);
            if (r >= varied_) continue;
            if (C != 0.0 && k < varied_)
                for (int n = 0; n < size_ * parameters_; ++n) b.L.at(r, 0)[n] += C * a.L.at(k, 0)[n];
            for (int c = 0; c < size_; ++c)
                if (const double D = at(a.C, size_, k, c); D != 0.0)
                    add_scaled(b.L.at(r, c), D, a.L.at(r, k), parameters_);
        }
    levels_.push_back(std::move(b));
}

}  // namespace lostmotion
