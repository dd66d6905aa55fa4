// Observer that evaluates the exact state at equidistant instants.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "exact_solver.hpp"
#include "reader.hpp"
#include "stride.hpp"

namespace lostmotion {

// Writes `count` samples at begin + k * interval, channel by channel: out[c * count + k] is that of channels[c].
class Sampler {
 public:
    Sampler(const Drive& drive, double begin, double interval, std::size_t count, double* out,
            std::span<const int> channels = all_channels)
        : drive_(drive), begin_(begin), interval_(interval), count_(count), out_(out), channels_(channels) {}

    // Polled now and then; true ends the run.
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;

    std::size_t written() const { return next_; }
    double left_data_at = std::numeric_limits<double>::infinity();  // first instant outside the loss map's data [s]

    bool segment(const Segment<SwitchedDrive>& s) {
        if (!s.entry.regime.in_data) left_data_at = std::fmin(left_data_at, s.begin);
        const std::size_t end = due(s);
        if (next_ == end) return true;
        Propagator& p = s.entry.propagator;
        if (!cursor_) cursor_.emplace(s.at.input());
        Cursor& cursor = *cursor_;
        cursor.advance_from(s.at, instant(next_) - s.begin);
        const int level = level_of_interval(p);
        const Reader reader(drive_, s.entry.regime, s.memory);
        while (true) {
            const int n = static_cast<int>(std::min<std::size_t>(end - next_, Instants::most - next_ % Instants::most));
            if (level >= 0) {
                stride_.place(p, level, s.constant, cursor);
                stride_.run(n, instants_);
            } else {
                instants_.set(0, load(cursor.x()), cursor.input().values());
                for (int k = 1; k < n; ++k) {
                    cursor.advance(instant(next_ + k) - cursor.time());
                    instants_.set(k, load(cursor.x()), cursor.input().values());
                }
            }
            for (int k = 0; k < n; k += vec_width) write(reader, k, n);
            next_ += static_cast<std::size_t>(n);
            if (next_ == end) return true;
            if (next_ % 4096 == 0 && interrupted != nullptr && interrupted(interrupted_context)) return false;
            if (level >= 0) cursor.move_to(instant(next_ - 1), stride_.x());
            cursor.advance(instant(next_) - cursor.time());
        }
    }

 private:
    double instant(std::size_t k) const { return begin_ + static_cast<double>(k) * interval_; }
    // The number of the first sample after a segment.
    std::size_t due(const Segment<SwitchedDrive>& s) const {
        const auto within = [&](std::size_t k) {
            const double t = instant(k);
            return t < s.end || (s.last && t <= s.end * (1.0 + 4.0 * std::numeric_limits<double>::epsilon()));
        };
        std::size_t k = std::clamp(static_cast<std::size_t>((s.end - begin_) / interval_), next_, count_);
        while (k > next_ && !within(k - 1)) --k;
        while (k < count_ && within(k)) ++k;
        return k;
    }
    // All channels at the instants k, k + 1, ... of n. What goes beyond these is written again by the segment that they
    // belong to, but must not go beyond the channel.
    void write(const Reader& reader, int k, int n) {
        double* to = out_ + next_ + k;
        const bool whole = next_ + static_cast<std::size_t>(k + vec_width) <= count_;
        for (const int c : channels_) {
            const Vec value = reader.read(c, instants_, k);
            if (whole)
                store(value, to);
            else
                for (int lane = 0; k + lane < n; ++lane) to[lane] = value[lane];
            to += count_;
        }
    }
    // The level whose length is the sampling interval, or -1.
    int level_of_interval(Propagator& p) const {
        const int k = p.level_below(interval_);
        return p.length(k) == interval_ ? k : -1;
    }

    const Drive& drive_;
    double begin_, interval_;
    std::size_t count_, next_ = 0;
    double* out_;
    std::span<const int> channels_;
    std::optional<Cursor> cursor_;  // kept from segment to segment for its memory, as the stride
    Stride stride_;
    Instants instants_;
};

}  // namespace lostmotion
