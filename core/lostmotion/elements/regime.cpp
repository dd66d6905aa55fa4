#include "regime.hpp"

namespace lostmotion::model {

// A sum of products that do not wait for one another, each with another odd number; zeros at the end count for nothing.
template <class Numbers>
static std::uint64_t sum_of_products(const Numbers& numbers, std::uint64_t factor) {
    constexpr std::size_t each = sizeof(std::uint64_t) / sizeof(*numbers.begin());
    std::uint64_t h = 0;
    const auto add = [&](std::size_t k, std::size_t count) {
        std::uint64_t word = 0;
        std::memcpy(&word, numbers.begin() + k, count * sizeof(*numbers.begin()));
        h += (word ^ (word >> 29)) * factor;
        factor += 0xc2b2ae3d27d4eb4eu;
    };
    std::size_t k = 0;
    for (const std::size_t n = numbers.size(); k + each <= n; k += each) add(k, each);
    if (k < numbers.size()) add(k, numbers.size() - k);
    return h;
}

static std::size_t folded(std::uint64_t h) { return static_cast<std::size_t>(h ^ (h >> 32)); }

std::size_t Key::hash() const {
    return folded(sum_of_products(modes, 0x9e3779b97f4a7c15u) + sum_of_products(branch, 0xd6e8feb86659fd93u));
}

std::size_t hash_of(const Flags& flags) { return folded(sum_of_products(flags, 0x9e3779b97f4a7c15u)); }
std::size_t hash_of(const decltype(Key::modes)& modes) { return folded(sum_of_products(modes, 0x9e3779b97f4a7c15u)); }

void Shares::set(int shaft, double share) {
    const auto k = static_cast<std::size_t>(find(shaft) - begin());
    if (k == count_ || begin()[k].shaft != shaft) {
        at_.reach(count_ + 1);
        std::copy_backward(at_.begin() + k, at_.begin() + count_, at_.begin() + count_ + 1);
        ++count_;
    }
    at_[k] = {shaft, share};
}

void Shares::erase(int shaft) {
    const auto k = static_cast<std::size_t>(find(shaft) - begin());
    if (k == count_ || begin()[k].shaft != shaft) return;
    std::copy(at_.begin() + k + 1, at_.begin() + count_, at_.begin() + k);
    --count_;
}

}  // namespace lostmotion::model
