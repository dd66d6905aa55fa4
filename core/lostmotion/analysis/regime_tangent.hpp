// How the equations of a regime change with parameters: rates, guards and what is read of it, in one mode.
#pragma once

#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "input_tangents.hpp"
#include "variation.hpp"

namespace lostmotion {

// Of a channel: the form that it is read by, or nothing for one of modes.
std::optional<model::Row> channel_form(const model::Assembly& a, const model::Regime& r, const TrainChannel& c);

// The forms of a locked torque, in the order of RegimeTangent::locked.
inline constexpr std::size_t n_locked_forms = 4;
inline std::array<const model::Row*, n_locked_forms> locked_forms(const model::LockedTorque<model::Row>& l) {
    return {&l.low, &l.high, &l.needs, &l.friction};
}

// A regime as composed in the train and in those beside it.
struct RegimeTangent {
    model::Regime regime;
    Varied rate;            // states x terms
    Varied guard;           // guards x terms
    Varied output_torque;   // gears x terms
    Varied contact_torque;  // contacts x terms
    Varied locked;          // forms of locked torques x terms, see locked_forms
    Varied needs_torque;    // locked torques x contacts
    std::vector<std::optional<model::Row>> channel;
    Varied channel_varied;  // channels x terms
    Varied shift;           // guards x 1: of the memory beyond an edge, see Guard
    bool alike = true;      // false: beside the parameter's value it has other guards
    TangentPropagator propagator;
};

class RegimeTangents {
 public:
    RegimeTangents(std::shared_ptr<const VariedTrain> trains, std::shared_ptr<const InputTangents> inputs,
                   std::vector<int> channels)
        : varied_(std::move(trains)), given_(std::move(inputs)), numbers_(std::move(channels)) {
        for (const int c : numbers_) channels_.push_back(train_channels(varied_->base())[static_cast<std::size_t>(c)]);
    }
    // Whether they are also those of another run: of the same trains, with inputs that move as these do.
    bool serve(const VariedTrain& trains, const InputTangents& inputs, const std::vector<int>& channels) const {
        return trains == *varied_ && inputs.moves_as(*given_) && channels == numbers_;
    }

    // base: a length [s] over which the series of this regime converge.
    RegimeTangent& operator()(const model::Key& key);
    void prepare(RegimeTangent& t, double base) const;
    const std::vector<TrainChannel>& channels() const { return channels_; }

 private:
    const model::Layout& layout() const { return trains_.base().layout(); }

    std::unique_ptr<RegimeTangent> compose(const model::Key& key) const;
    void add(RegimeTangent& t, const VariedTrain::Beside& b) const;

    const std::shared_ptr<const VariedTrain> varied_;
    const std::shared_ptr<const InputTangents> given_;
    const VariedTrain& trains_ = *varied_;
    const InputTangents& inputs_ = *given_;
    const std::vector<int> numbers_;
    std::vector<TrainChannel> channels_;
    std::unordered_map<model::Key, std::unique_ptr<RegimeTangent>, model::KeyHash> all_;
    RegimeTangent* last_ = nullptr;
};

}  // namespace lostmotion
