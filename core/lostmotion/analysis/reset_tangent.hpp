// How what a switching sets anew depends on parameters, the motion up to it as it is: speeds that follow others, the
// capacity of a hysteresis, torques that the motion leaves open, turns of angles.
#pragma once

#include <vector>

#include "../model/periodic_angles.hpp"
#include "regime_tangent.hpp"

namespace lostmotion {

// A form, and its row among those that change with parameters.
struct VariedForm {
    const model::Row& form;
    const Varied& varied;
    int row;
};

// Of the values that w stands for: a form, and its derivatives.
class FormTangent {
 public:
    FormTangent(const model::Layout& n, const InputTangents& inputs) : n_(n), inputs_(inputs) {}

    int parameters() const { return inputs_.parameters(); }

    double value(const model::Row& f, const double* w) const;
    // to[p] += factor * (df/dp as far as the form itself changes)
    void add_own(const Varied& forms, int row, const double* w, double factor, double* to) const;
    // to[p] += factor * (df/dp as far as what it depends on changes)
    void add_motion(const model::Row& f, const double* derivative, double factor, double* to) const {
        inputs_.each_term([&](int at, int term) { add_term(f, at, term, derivative, factor, to); });
    }
    // The same of the inputs alone.
    void add_inputs(const model::Row& f, const double* derivative, double factor, double* to) const;

 private:
    void add_term(const model::Row& f, int at, int term, const double* derivative, double factor, double* to) const;

    const model::Layout& n_;
    const InputTangents& inputs_;
};

// Derivatives of the states and of the memory after a switching, by the places of w; see ComponentLaws::reset for those
// with respect to what they were.
class ResetTangent {
 public:
    ResetTangent(const VariedTrain& trains, const FormTangent& form, int parameters)
        : trains_(trains), form_(form), parameters_(parameters) {}

    // Speeds that the contacts at rest tie to others. x: of before.
    void tied_speeds(std::span<const std::int8_t> modes, const double* x, double* to) const;
    // At a turning point of the twist of a gear.
    void capacity(std::size_t gear, double twist, const model::Key& key, double* to) const;
    // Where an angle begins another turn.
    void turn(const RegimeTangent& before, std::size_t guard, double* to) const;
    // A locked torque that a regime gives: of what is set anew beside it, `to` has the derivatives already.
    void given(const VariedForm& torque, const double* w, const double* derivative, int memory, double* to) const;
    // A locked torque, number k of a regime, at a bound: of what is set anew beside it, `to` has the derivatives
    // already. torques: those of other stuck contacts, and their derivatives.
    void at_bound(const RegimeTangent& after, std::size_t k, model::Bound bound, const double* w,
                  const double* derivative, const double* torques, const double* torque_derivatives, double* to) const;

 private:
    void add_now(const VariedForm& f, const double* w, const double* derivative, double factor, const double* to,
                 double* sum) const;
    static model::Ties tie(const model::Assembly& a, std::span<const std::int8_t> modes) {
        return a.places().ties(modes);
    }

    const VariedTrain& trains_;
    const FormTangent& form_;
    int parameters_;
};

}  // namespace lostmotion
