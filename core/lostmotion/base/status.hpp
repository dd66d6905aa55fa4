// How a search or a run has ended.
#pragma once

namespace lostmotion {

// Of the search for the regime that follows at an event.
enum class Found { yes, inconsistent, outside, interrupted };

// Of the searches of a run.
struct SearchCounts {
    long trials = 0;     // combinations of modes that were set up
    long fallbacks = 0;  // times that pivoting began anew from other modes
};

enum class Status {
    done,
    interrupted,
    jammed,      // no combination of contact modes is consistent
    outside,     // left the extended loss map, or the range of the arithmetic
    zeno,        // switching instants accumulate
    controller,  // one has failed, or its command is no number
    unseen,      // a nonlinear remainder acts on a drive whose contacts would not feel it
};

inline Status status_of(Found found) {
    switch (found) {
        case Found::yes: return Status::done;
        case Found::outside: return Status::outside;
        case Found::interrupted: return Status::interrupted;
        default: return Status::jammed;
    }
}

}  // namespace lostmotion
