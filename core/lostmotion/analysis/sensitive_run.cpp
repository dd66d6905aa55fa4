#include "sensitive_run.hpp"

namespace lostmotion {

TrainReport run_with_derivatives(const SensitiveCase& c, double* out, SensitivityOutput& output) {
    return c.run->in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
        return run_with_derivatives_in<D>(model, c, out, output);
    });
}

std::vector<std::size_t> pieces_of_work(const std::vector<SensitiveCase>& cases) {
    std::vector<std::size_t> first{0};
    for (std::size_t k = 1; k < cases.size(); ++k)
        if (cases[k].run != cases[k - 1].run ||
            cases[k].options.sample_interval != cases[k - 1].options.sample_interval || k - first.back() == together)
            first.push_back(k);
    first.push_back(cases.size());
    return first;
}

std::vector<SensitiveRow> run_sensitive(const std::vector<SensitiveCase>& cases,
                                        const std::vector<std::string>& channels, bool signals, unsigned threads,
                                        const std::function<bool(std::size_t)>& waiting) {
    std::vector<SensitiveRow> rows(cases.size());
    const std::vector<std::size_t> first = pieces_of_work(cases);
    distribute(first.size() - 1, threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        for (std::size_t n = next(); n + 1 < first.size() && !stop; n = next()) {
            const std::size_t begin = first[n], count = first[n + 1] - begin;
            const TrainRun& run = *cases[begin].run;
            if (!run.error().empty()) {
                for (std::size_t k = 0; k < count; ++k) rows[begin + k].problem.reason = run.error();
                continue;
            }
            run.in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
                run_sensitive_in<D>(model, std::span(cases).subspan(begin, count),
                                    std::span(rows).subspan(begin, count), channels, signals, stop);
            });
        }
    });
    return rows;
}

}  // namespace lostmotion
