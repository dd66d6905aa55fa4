#include "respond.hpp"

#include "analyses.hpp"

namespace lostmotion {

ResponseTable respond_train(const TrainRun& run, const std::vector<ResponseRequest>& points, const ResponseSpec& spec,
                            unsigned threads, const Waiting& waiting) {
    return Analyses::of(run.assembly()).respond(run.model(), points, spec, threads, waiting);
}

}  // namespace lostmotion
