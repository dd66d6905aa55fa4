// Observer that evaluates the exact state at the instants of a record.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "../kernel/stride.hpp"
#include "../solver/exact_solver.hpp"
#include "sample_times.hpp"

namespace lostmotion {

// Writes `count` samples at begin + k * interval, or at the instants of a list, channel by channel:
// out[c * count + k] is that of channels[c].
// Reader(model, regime, memory) reads them.
template <class System, class Reader, class Model>
class SamplerOf : public Observer<System> {
 public:
    using D = typename System::Dims;
    using Instants = InstantsOf<D>;

    SamplerOf(const Model& model, double begin, double interval, std::size_t count, double* out,
              std::span<const int> channels)
        : model_(model), begin_(begin), interval_(interval), count_(count), out_(out), channels_(channels) {}

    SamplerOf(const Model& model, const SampleTimes& times, double* out, std::span<const int> channels)
        : SamplerOf(model, 0.0, times.interval, times.count, out, channels) {
        listed_ = times.listed;
    }

    Interruption interruption;

    double left_data_at = std::numeric_limits<double>::infinity();  // first instant outside the loss map's data [s]

    bool segment(const Segment<System>& s) final {
        if (!s.entry.regime.in_data) left_data_at = std::fmin(left_data_at, s.begin);
        const std::size_t end = due(s);
        if (next_ < end) {
            std::optional<Piece>& room = pieces_[n_pieces_++];
            Piece& p = room ? *room : room.emplace(s.at);
            p.entry = &s.entry;
            p.memory = s.memory;
            p.constant = s.constant;
            p.first = next_;
            p.end = next_ = end;
            p.at_once = listed_.empty() && LongStep<D>::pays(s.entry.propagator, s.end - s.begin);
            if (p.at_once) {
                p.cursor = s.at;
                if (instant(p.first) > s.begin) p.cursor.leap_to(instant(p.first));
                p.rest = 0.0;
            } else {
                p.rest = p.cursor.advance_by_levels(s.at, instant(p.first) - s.begin);
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
        for (auto& p : pieces)
            if (!write(*p)) return false;
        return true;
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
        const int level = listed_.empty() ? propagator.level_of(interval_) : -1;
        if (level < 0 && p.at_once) return write_at_once(p);
        const Reader reader(model_, p.entry->regime, p.memory);
        for (std::size_t next = p.first;;) {
            const int n =
                static_cast<int>(std::min<std::size_t>(p.end - next, Instants::max_count - next % Instants::max_count));
            if (level >= 0) {
                stride_.place(propagator, level, p.constant, p.cursor);
                stride_.run(n, instants_);
            } else {
                instants_.set(0, load(p.cursor.x()), p.cursor.input().values());
                for (int k = 1; k < n; ++k) {
                    p.cursor.advance(instant(next + k) - p.cursor.time());
                    instants_.set(k, load(p.cursor.x()), p.cursor.input().values());
                }
            }
            set_given(p, next, n);
            write(reader, next, n);
            next += static_cast<std::size_t>(n);
            if (next == p.end) return true;
            if (interruption()) return false;
            if (level >= 0) p.cursor.move_to(instant(next - 1), stride_.x());
            p.cursor.advance(instant(next) - p.cursor.time());
        }
    }

    // Given speeds at n instants, as their signals have them.
    void set_given(const Piece& p, std::size_t first, int n) {
        const auto* given = p.entry->rates.given;
        if (given == nullptr) return;
        for (const GivenState& g : *given)
            for (int k = 0; k < n; ++k)
                instants_.x[static_cast<std::size_t>(g.state)][static_cast<std::size_t>(k)] =
                    p.cursor.input().given_at(g, instant(first + static_cast<std::size_t>(k)));
    }

    // By one long step from sample to sample.
    [[gnu::noinline]] bool write_at_once(Piece& p) {
        const Reader reader(model_, p.entry->regime, p.memory);
        const Cursor<D> first = p.cursor;
        LongStep<D> step = p.cursor.long_step(whole_interval(p));
        for (std::size_t next = p.first;;) {
            const int n = static_cast<int>(std::min<std::size_t>(p.end - next, Instants::max_count));
            for (int k = 0; k < n; ++k) {
                if (k > 0) p.cursor.leap_to(instant(next + static_cast<std::size_t>(k)), step);
                instants_.set(k, load(p.cursor.x()), p.cursor.input().values());
            }
            write(reader, next, n);
            next += static_cast<std::size_t>(n);
            if (next == p.end) return true;
            if (interruption()) return false;
            if ((next - p.first) % (1024 * Instants::max_count) == 0) {  // so that rounding does not add up
                p.cursor = first;
                p.cursor.leap_to(instant(next));
            } else {
                p.cursor.leap_to(instant(next), step);
            }
        }
    }
    // As much of the interval as lies between any two of the samples, as the clock shows them.
    double whole_interval(const Piece& p) const {
        const double end = instant(p.end), tick = std::nextafter(end, 2.0 * end) - end;
        const double whole = tick * std::floor(interval_ / tick);
        return whole < interval_ ? whole - tick : whole;
    }
    double instant(std::size_t k) const {
        return listed_.empty() ? begin_ + static_cast<double>(k) * interval_ : listed_[k];
    }
    // The number of the first sample after a segment.
    std::size_t due(const Segment<System>& s) const {
        const auto within = [&](std::size_t k) {
            const double t = instant(k);
            return t < s.end || (s.last && t <= s.end * (1.0 + 4.0 * std::numeric_limits<double>::epsilon()));
        };
        std::size_t k = next_;
        if (listed_.empty()) k = std::clamp(static_cast<std::size_t>((s.end - begin_) * per_interval_), next_, count_);
        while (k > next_ && !within(k - 1)) --k;
        while (k < count_ && within(k)) ++k;
        return k;
    }
    // All channels at n instants, of which the first is the sample `at`. What goes beyond these is written again by the
    // segment that they belong to, but must not go beyond the channel.
    void write(const Reader& reader, std::size_t at, int n) {
        double* to = out_ + at;
        const bool has_room = at + static_cast<std::size_t>(n + vec_width - 1) / vec_width * vec_width <= count_;
        for (const int c : channels_) {
            if (has_room) {
                reader.read(c, instants_, n, to);
            } else {
                typename Instants::Column values;
                reader.read(c, instants_, n, values.data());
                std::copy_n(values.begin(), n, to);
            }
            to += count_;
        }
    }

    const Model& model_;
    double begin_, interval_;
    double per_interval_ = 1.0 / interval_;  // rounded
    std::size_t count_, next_ = 0;
    std::span<const double> listed_;  // [s]; none: equidistant
    double* out_;
    std::span<const int> channels_;
    std::array<std::optional<Piece>, max_pieces> pieces_;
    std::size_t n_pieces_ = 0;  // that have been collected
    Stride<D> stride_;
    Instants instants_;
};

}  // namespace lostmotion
