// Where the blocks of a controller keep what they remember: one row of numbers, so that all of it can be copied,
// compared and restored.
#pragma once

namespace lostmotion::control {

// Gives each block its place in the row.
class Slots {
 public:
    int take(int count);
    int count() const { return count_; }

 private:
    int count_ = 0;
};

// What a low pass of first order takes over at a sample: 1 - exp(-T/time); all of it without one.
double share_of(double sample_time, double time);

// Low pass of first order, tau y' = u - y, exact for an input that is held from sample to sample.
class LowPass {
 public:
    void place(double sample_time, double time) { share_ = share_of(sample_time, time); }
    double operator()(double in, double& kept) const { return kept += share_ * (in - kept); }

 private:
    double share_ = 1.0;
};

// The first of some numbers, whose place the others move up to and a new one joins.
double shifted(double in, double* kept, int count);

inline constexpr long max_delay = 100000;  // [samples]

// What a signal was some samples ago; the oldest value comes first.
struct SampleDelay {
    int samples = 0;
    int first = 0;  // slot

    void place(Slots& slots) { first = slots.take(samples); }
    double operator()(double in, double* slot) const;
    void fill(double value, double* slot) const {
        for (int k = 0; k < samples; ++k) slot[first + k] = value;
    }
};

}  // namespace lostmotion::control
