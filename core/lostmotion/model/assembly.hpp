// Composes the elements of a train into the equations and guards of a regime.
#pragma once

#include "guards.hpp"

namespace lostmotion::model {

class Assembly : public ElementForms {
 public:
    explicit Assembly(Train train, bool with_remainders = false)
        : ElementForms(std::move(train), with_remainders), equations_(*this) {}

    // r: may be that of another key, whose memory is used again.
    void build(const Key& key, Regime& r) const;
    Regime build(const Key& key) const {
        Regime r;
        build(key, r);
        return r;
    }

 private:
    Equations equations_;
};

}  // namespace lostmotion::model
