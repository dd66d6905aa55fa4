// Observer that evaluates the exact state at the instants of a record.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "lostmotion/kernel/stride.hpp"
#include "lostmotion/simulation/sample_times.hpp"
#include "lostmotion/simulation/train_channels.hpp"
#include "lostmotion/solver/exact_solver.hpp"

namespace lostmotion {

// Writes samples at some instants, channel by channel: out[c * count + k] is that of channels[c].
// Reader(model, regime, memory) reads them.
template <class System, class Reader>
class SamplerOf : public Observer<System> {
 public:
    using D = typename System::Dims;
    using Instants = InstantsOf<D>;

    SamplerOf(const TrainModel& model, const SampleTimes& times, double* out, std::span<const int> channels)
        : model_(model), times_(times), out_(out), channels_(channels) {}

    Interruption interruption;

    double left_data_at = std::numeric_limits<double>::infinity();  // first instant outside the loss map's data [s]

    bool segment(const Segment<System>& s) final {
        if (!s.entry.regime->in_data) left_data_at = std::fmin(left_data_at, s.begin);
        const std::size_t end = due(s);
        if (next_ < end) {
            std::optional<Piece>& room = pieces_[n_pieces_++];
            Piece& p = room ? *room : room.emplace(s.at);
            p.entry = &s.entry;
            ++p.entry->readers;
            p.memory = s.memory;
            p.constant = s.constant;
            p.first = next_;
            p.end = next_ = end;
            p.at_once = times_.listed.empty() && LongStep<D>::pays(s.entry.propagator, s.end - s.begin);
            if (p.at_once) {
                p.cursor = s.at;
                if (times_[p.first] > s.begin) p.cursor.leap_to(times_[p.first]);
                p.rest = 0.0;
            } else {
                p.rest = p.cursor.advance_by_levels(s.at, times_[p.first] - s.begin);
            }
            p.cursor.keep(p.constant);
        }
        return s.last || n_pieces_ == max_pieces ? write() : true;
    }
    // The sample `next` and those behind it are written again.
    void go_back_to(std::size_t next) { next_ = next; }
    // Writes what has been collected. Only needed if the last segment has not come.
    bool write() {
        // Every piece is a chain of steps that wait for one another, so it pays to have several at hand.
        const std::span pieces(pieces_.data(), std::exchange(n_pieces_, 0));
        for (auto& p : pieces) p->cursor.taylor_step(p->rest);
        bool written = true;
        for (auto& p : pieces) {
            written = written && write(*p);
            --p->entry->readers;
        }
        return written;
    }

 private:
    // The samples of one segment.
    struct Piece {
        explicit Piece(const Cursor<D>& like) : cursor(like) {}
        typename Segment<System>::Entry* entry = nullptr;
        typename D::Memory memory;
        ColumnOf<D> constant;
        Cursor<D> cursor;
        std::size_t first = 0, end = 0;
        double rest = 0.0;     // from the cursor to the first [s]
        bool at_once = false;  // whether the segment is long enough for it
    };
    static constexpr std::size_t max_pieces = 4;

    [[gnu::noinline]] bool write(Piece& p) {
        auto& propagator = p.entry->propagator;
        const int level = times_.listed.empty() && !propagator.by_series() ? propagator.level_of(times_.interval) : -1;
        if (level < 0 && p.at_once) return write_at_once(p);
        const Reader reader(model_, *p.entry->regime, p.memory);
        for (std::size_t next = p.first;;) {
            int n =
                static_cast<int>(std::min<std::size_t>(p.end - next, Instants::max_count - next % Instants::max_count));
            if (n > 1 && times_.is_early(next + static_cast<std::size_t>(n) - 1)) --n;
            if (level >= 0) {
                stride_.place(propagator, level, p.constant, p.cursor);
                stride_.run(n, instants_);
            } else {
                instants_.set(0, load(p.cursor.x()), p.cursor.input().values());
                for (int k = 1; k < n; ++k) {
                    p.cursor.advance(times_[next + k] - p.cursor.time());
                    instants_.set(k, load(p.cursor.x()), p.cursor.input().values());
                }
            }
            set_given(p, next, n);
            write(reader, next, n);
            next += static_cast<std::size_t>(n);
            if (next == p.end) return true;
            if (interruption()) return false;
            if (level >= 0) p.cursor.move_to(times_[next - 1], stride_.x());
            p.cursor.advance(times_[next] - p.cursor.time());
        }
    }

    // Given speeds at n instants, as their signals have them.
    void set_given(const Piece& p, std::size_t first, int n) {
        const auto* given = p.entry->rates.given;
        if (given == nullptr) return;
        for (const GivenState& g : *given)
            for (int k = 0; k < n; ++k)
                instants_.x[static_cast<std::size_t>(g.state)][static_cast<std::size_t>(k)] =
                    p.cursor.input().given_at(g, times_[first + static_cast<std::size_t>(k)]);
    }

    // By one long step from sample to sample.
    [[gnu::noinline]] bool write_at_once(Piece& p) {
        const Reader reader(model_, *p.entry->regime, p.memory);
        const Cursor<D> first = p.cursor;
        LongStep<D> step = p.cursor.long_step(whole_interval(p));
        for (std::size_t next = p.first;;) {
            const int n = static_cast<int>(std::min<std::size_t>(p.end - next, Instants::max_count));
            for (int k = 0; k < n; ++k) {
                if (k > 0) leap_to(p, next + static_cast<std::size_t>(k), step);
                instants_.set(k, load(p.cursor.x()), p.cursor.input().values());
            }
            write(reader, next, n);
            next += static_cast<std::size_t>(n);
            if (next == p.end) return true;
            if (interruption()) return false;
            if ((next - p.first) % (1024 * Instants::max_count) == 0) {  // so that rounding does not add up
                p.cursor = first;
                p.cursor.leap_to(times_[next]);
            } else {
                leap_to(p, next, step);
            }
        }
    }
    void leap_to(Piece& p, std::size_t k, LongStep<D>& step) const {
        if (times_.is_early(k))
            p.cursor.leap_to(times_[k]);
        else
            p.cursor.leap_to(times_[k], step);
    }
    // As much of the interval as lies between any two of the samples, as the clock shows them.
    double whole_interval(const Piece& p) const {
        const double end = times_[p.end], tick = std::nextafter(end, 2.0 * end) - end;
        const double whole = tick * std::floor(times_.interval / tick);
        return whole < times_.interval ? whole - tick : whole;
    }
    // The number of the first sample after a segment.
    std::size_t due(const Segment<System>& s) const {
        const auto within = [&](std::size_t k) {
            const double t = times_[k];
            return t < s.end || (s.last && t <= s.end * (1.0 + 4.0 * std::numeric_limits<double>::epsilon()));
        };
        std::size_t k = next_;
        if (times_.listed.empty()) k = std::clamp(static_cast<std::size_t>(s.end * per_interval_), next_, times_.count);
        while (k > next_ && !within(k - 1)) --k;
        while (k < times_.count && within(k)) ++k;
        return k;
    }
    // All channels at n instants, of which the first is the sample `at`. What goes beyond these is written again by the
    // segment that they belong to, but must not go beyond the channel.
    void write(const Reader& reader, std::size_t at, int n) {
        double* to = out_ + at;
        const bool has_room = at + static_cast<std::size_t>(n + vec_width - 1) / vec_width * vec_width <= times_.count;
        for (const int c : channels_) {
            if (has_room) {
                reader.read(c, instants_, n, to);
            } else {
                typename Instants::Column values;
                reader.read(c, instants_, n, values.data());
                std::copy_n(values.begin(), n, to);
            }
            to += times_.count;
        }
    }

    const TrainModel& model_;
    SampleTimes times_;
    double per_interval_ = 1.0 / times_.interval;  // rounded
    std::size_t next_ = 0;
    double* out_;
    std::span<const int> channels_;
    std::array<std::optional<Piece>, max_pieces> pieces_;
    std::size_t n_pieces_ = 0;  // that have been collected
    Stride<D> stride_;
    Instants instants_;
};

}  // namespace lostmotion
