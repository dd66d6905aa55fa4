// Whether a run is to end before its time.
#pragma once

namespace lostmotion {

// Polled in every loop whose length no constant bounds. It asks after 64 steps, each of which takes microseconds, so
// that a run ends within milliseconds of the answer "true", which stays.
class Interruption {
 public:
    Interruption() = default;
    Interruption(bool (*asked)(void*), void* context) : asked_(asked), context_(context) {}

    // steps: how many the time since the last call was worth.
    [[gnu::always_inline]] bool operator()(unsigned steps = 1) { return (steps_ += steps) >= 64 && ask(); }
    bool requested() const { return requested_; }

 private:
    [[gnu::noinline]] bool ask() {
        steps_ = 0;
        requested_ = requested_ || (asked_ != nullptr && asked_(context_));
        return requested_;
    }

    bool (*asked_)(void*) = nullptr;
    void* context_ = nullptr;
    unsigned steps_ = 0;
    bool requested_ = false;
};

}  // namespace lostmotion
