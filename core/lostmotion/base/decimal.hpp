// Numbers in messages, in the same words everywhere and without a C library, which a page would have to contain.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

namespace lostmotion {

// A finite number, without its sign: 0.DIGITS times 10 to `point`. All digits, which are as many as a double has bits.
class Decimal {
 public:
    explicit Decimal(double v) {
        if (v == 0.0) return;
        int exponent = 0;
        auto m = static_cast<unsigned long long>(std::ldexp(std::frexp(std::fabs(v), &exponent), 53));
        for (exponent -= 53; m % 2 == 0; m /= 2) ++exponent;
        for (; m > 0; m /= 10) digits_.insert(digits_.begin(), static_cast<char>('0' + m % 10));
        // A half is five tenths.
        for (int k = 0; k < std::abs(exponent); ++k) multiply(exponent < 0 ? 5 : 2);
        point_ = static_cast<int>(digits_.size()) + std::min(exponent, 0);
        drop_zeros();
    }
    int point() const { return point_; }
    // Of its digits this many, or fewer where the last would be 0; halves to the even one.
    void round(int count) {
        if (count < static_cast<int>(digits_.size())) {
            const auto n = static_cast<std::size_t>(std::max(count, 0));
            const bool tie = digits_[n] == '5' && n + 1 == digits_.size(), odd = n > 0 && digits_[n - 1] % 2 != 0;
            const bool up = count >= 0 && (tie ? odd : digits_[n] >= '5');
            digits_.resize(n);
            if (up) step_up();
        }
        drop_zeros();
        if (digits_.empty()) point_ = 0;
    }
    // The digits from `first` on, counted from the point to the right; there are zeros before and after the others.
    std::string places(int first, int count) const {
        std::string out;
        for (int k = first + point_; k < first + point_ + count; ++k)
            out += k >= 0 && k < static_cast<int>(digits_.size()) ? digits_[static_cast<std::size_t>(k)] : '0';
        return out;
    }
    int size() const { return static_cast<int>(digits_.size()); }

 private:
    void drop_zeros() { digits_.resize(digits_.find_last_not_of('0') + 1); }
    void multiply(int factor) {
        int carry = 0;
        for (auto d = digits_.rbegin(); d != digits_.rend(); ++d) {
            carry += (*d - '0') * factor;
            *d = static_cast<char>('0' + carry % 10);
            carry /= 10;
        }
        if (carry > 0) digits_.insert(digits_.begin(), static_cast<char>('0' + carry));
    }
    void step_up() {
        const std::size_t last = digits_.find_last_not_of('9');
        digits_.resize(last + 1);  // what follows is 0 now
        if (digits_.empty()) {
            digits_ = "1";
            ++point_;
        } else {
            ++digits_.back();
        }
    }

    std::string digits_;
    int point_ = 0;
};

inline std::string sign_or_name(double v) {
    return std::isnan(v) ? "nan" : std::string(std::signbit(v) ? "-" : "") + (std::isinf(v) ? "inf" : "");
}

// With this many digits, as printf's %.*g writes it.
inline std::string general_text(double v, int digits) {
    std::string out = sign_or_name(v);
    if (!std::isfinite(v)) return out;
    Decimal d(v);
    d.round(digits);
    const int before = d.point(), power = d.size() == 0 ? 0 : before - 1;
    const bool scientific = power < -4 || power >= digits;
    const int whole = scientific || before < 1 ? 1 : before, start = scientific ? -before : std::min(-before, -1);
    out += d.places(start, whole);
    if (const int rest = (scientific || before >= 1 ? d.size() : d.size() - before + 1) - whole; rest > 0)
        out += '.' + d.places(start + whole, rest);
    if (scientific) {
        const std::string e = std::to_string(std::abs(power));
        out += (power < 0 ? "e-" : "e+") + (e.size() < 2 ? '0' + e : e);
    }
    return out;
}
// With six digits after the point, as std::to_string writes it.
inline std::string fixed_text(double v) {
    constexpr int after = 6;
    std::string out = sign_or_name(v);
    if (!std::isfinite(v)) return out;
    Decimal d(v);
    d.round(d.point() + after);
    const int whole = std::max(d.point(), 1);
    return out + d.places(-whole, whole) + '.' + d.places(0, after);
}

}  // namespace lostmotion
