// The derivative of a linear motion with respect to parameters of its rates.
//
// From w' = M w follows for each parameter p
//     (dw/dp)' = M dw/dp + dM/dp w,   so that over a length h   w += C w,   dw/dp += C dw/dp + L_p w
// with C = exp(M h) - 1 and L_p its derivative. Both come from their Taylor series over a short base length and are
// doubled as often as needed:
//     C(2h) = 2 C + C C,   L_p(2h) = 2 L_p + L_p C + C L_p.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lostmotion {

// Numbers of all parameters, entry by entry of a matrix: those of one entry stand together.
class Varied {
 public:
    Varied() = default;
    Varied(int rows, int columns, int parameters)
        : columns_(columns),
          parameters_(parameters),
          v_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns) *
             static_cast<std::size_t>(parameters)) {}

    double* at(int row, int column) { return v_.data() + index(row, column); }
    const double* at(int row, int column) const { return v_.data() + index(row, column); }
    int parameters() const { return parameters_; }
    std::vector<double>& all() { return v_; }

 private:
    std::size_t index(int row, int column) const {
        return static_cast<std::size_t>((row * columns_ + column) * parameters_);
    }

    int columns_ = 0, parameters_ = 0;
    std::vector<double> v_;
};

// y[p] += a x[p]
inline void add_scaled(double* y, double a, const double* x, int count) {
    for (int p = 0; p < count; ++p) y[p] += a * x[p];
}

class TangentPropagator {
 public:
    // M: size x size. base: a length [s] over which the Taylor series of the motion converge at once.
    // moving: how many rows of M, from the first on, are not zero; varied: the same of dM.
    void prepare(int size, int moving, int varied, std::vector<double> M, Varied dM, double base);
    bool ready() const { return size_ > 0; }

    // w and its derivatives, size x parameters, after s >= 0.
    void advance(double* w, double* derivative, double s);

 private:
    static constexpr std::uint64_t few = 12;  // base lengths, for which doubling does not pay
    static constexpr int order = 14;          // 0.25^14/14! < 1e-19
    struct Entry {                            // of M that is not zero or varies
        int row, column;
        double rate;
        bool varied;
    };
    struct Level {
        std::vector<double> C;  // moving x size
        Varied L;               // varied x size
    };

    double M(int r, int c) const { return M_[static_cast<std::size_t>(r * size_ + c)]; }
    static double& at(std::vector<double>& m, int columns, int r, int c) {
        return m[static_cast<std::size_t>(r * columns + c)];
    }

    void step(int k, double* w, double* derivative);
    // Terms of the series over a share of the base length, within which they fall as 0.25^j/j!.
    static int terms_for(double share);
    void apply(double* w, double* derivative) const;

    // The Taylor series of a motion over s: each term from the last.
    void taylor(double* w, double* derivative, double s);

    void add_base();

    void add_doubled();

    int size_ = 0, moving_ = 0, varied_ = 0, parameters_ = 0;
    std::vector<double> M_;
    Varied dM_;
    double base_ = 0.0;
    std::vector<Entry> entries_;
    std::vector<Level> levels_;
    std::vector<double> change_, term_, next_;
};

}  // namespace lostmotion
