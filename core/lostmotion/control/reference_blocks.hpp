// Blocks that shape the reference before the loops, one after the other.
//
// A block is a struct with
//   part, key, meaning          the name of its Python class, its table in a controller, and what the table is
//   describe(fields)            its parameters
//   place(slots, sample_time)   the numbers that it remembers, and what it derives from its parameters
//   start(value, slot)          its state before the first sample, from the measured value
//   (in, slot) -> out           its output at a sample, from the input there
// and its name in ReferenceBlocks. The binding, the Python class, the schema and the reference pages follow from these.
#pragma once

#include <optional>
#include <tuple>
#include <utility>

#include "../parts/field.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// Low pass whose output at a sample is its state there, so that its derivatives follow from its input.
struct ReferenceFilter {
    static constexpr const char *part = "ReferenceFilter", *key = "reference_filter",
                                *meaning = "First-order filter of the reference, before the loops.";

    double time_constant = 1.0;

    template <class Fields>
    void describe(Fields& f) {
        f.number({"time_constant", "tau", "s", Range::positive, Given::needed, "tau of tau y' = u - y"}, time_constant);
    }
    void place(Slots& slots, double sample_time) {
        first_ = slots.take(1);
        filter_.place(sample_time, time_constant);
    }
    void start(double value, double* slot) const { slot[first_] = value; }
    ReferencePoint operator()(const ReferencePoint& in, double* slot) const {
        ReferencePoint out{slot[first_]};
        out.rate = (in.value - out.value) / time_constant;
        out.acceleration = (in.rate - out.rate) / time_constant;
        out.jerk = (in.acceleration - out.acceleration) / time_constant;
        filter_(in.value, slot[first_]);
        return out;
    }

 private:
    LowPass filter_;
    int first_ = 0;
};

// In the order in which they act.
using ReferenceBlocks = std::tuple<ReferenceFilter>;

// The blocks of a controller, as far as it has them.
class ReferenceShaper {
 public:
    // use(block), block a std::optional of its struct
    template <class Use>
    void each(Use&& use) {
        std::apply([&](auto&... block) { (use(block), ...); }, blocks_);
    }
    bool present() const {
        return std::apply([](const auto&... block) { return (block.has_value() || ... || false); }, blocks_);
    }

    void place(Slots& slots, double sample_time) {
        each([&](auto& block) {
            if (block) block->place(slots, sample_time);
        });
        first_ = slots.take(present() ? 4 : 0);
    }
    void start(double value, double* slot) const {
        each_present([&](const auto& block) { block.start(value, slot); });
        keep({value}, slot);
    }
    void step(ReferencePoint point, double* slot) const {
        each_present([&](const auto& block) { point = block(point, slot); });
        keep(point, slot);
    }
    // Since the last step.
    ReferencePoint output(const double* slot) const {
        const double* kept = slot + first_;
        return {kept[0], kept[1], kept[2], kept[3]};
    }

 private:
    template <class>
    struct Optional;
    template <class... Block>
    struct Optional<std::tuple<Block...>> {
        using type = std::tuple<std::optional<Block>...>;
    };

    template <class Use>
    void each_present(Use&& use) const {
        std::apply([&](const auto&... block) { ((block ? use(*block) : void()), ...); }, blocks_);
    }
    void keep(const ReferencePoint& p, double* slot) const {
        if (!present()) return;
        double* kept = slot + first_;
        kept[0] = p.value;
        kept[1] = p.rate;
        kept[2] = p.acceleration;
        kept[3] = p.jerk;
    }

    Optional<ReferenceBlocks>::type blocks_;
    int first_ = 0;
};

// use(block), block with the values of a new one
template <class Use>
void each_reference_block(Use&& use) {
    std::apply([&](auto&&... block) { (use(block), ...); }, ReferenceBlocks{});
}

}  // namespace lostmotion::control
