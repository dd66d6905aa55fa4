// What a run shows while it goes: one interface for all that record, measure or differentiate it. It is called once for
// each stretch of time, switching or tick, so that its call costs nothing beside what it does.
#pragma once

#include "../kernel/form.hpp"

namespace lostmotion {

template <class System>
struct Segment;
template <class System>
struct SwitchingOf;
template <class D>
struct DenseStepOf;
template <class D>
struct ClosedLoop;
struct ControlCourse;

template <class System>
class Observer {
 public:
    using D = typename System::Dims;

    Observer() = default;
    Observer(const Observer&) = delete;
    Observer& operator=(const Observer&) = delete;
    virtual ~Observer() = default;

    // A stretch of time that the exact solver has spent in one regime. False ends the run.
    virtual bool segment(const Segment<System>&) { return true; }
    // A step of the adaptive solver; it holds up to its end, the last one there, too.
    virtual void step(const typename System::Regime&, const typename D::Memory&, const DenseStepOf<D>&, bool /*last*/) {
    }
    virtual bool wants_switching() const { return false; }
    virtual void switching(const SwitchingOf<System>&) {}
    // A tick of the controllers, before they compute.
    virtual void tick(const ClosedLoop<D>&, const ControlCourse&, const StateOf<D>&, const typename D::Memory&) {}
    // What has been seen but not yet read must be read: the inputs change. False ends the run.
    virtual bool flush() { return true; }
    // At the pause of a run under controllers, before the tick there: whether the run ends.
    virtual bool enough() { return false; }
    // Controllers, at the end of a run.
    virtual void finish(const ClosedLoop<D>&) {}
};

}  // namespace lostmotion
