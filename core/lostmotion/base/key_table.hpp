// A hash table of things that know their keys.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace lostmotion {

// It refers to things that lie elsewhere. KeyOf()(thing) is the key of one, which has hash().
template <class T, class KeyOf>
class KeyTable {
 public:
    // The thing of this key, or where it is to be put.
    template <class Key>
    T*& operator[](const Key& key) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t k = key.hash() & mask;
        while (slots_[k] != nullptr && !(KeyOf()(*slots_[k]) == key)) k = (k + 1) & mask;
        return slots_[k];
    }
    // Puts a thing where its key has been looked for last.
    void put(T*& here, T& thing) {
        here = &thing;
        if (2 * ++count_ <= slots_.size()) return;
        std::vector<T*> old(2 * slots_.size(), nullptr);
        std::swap(old, slots_);
        for (T* t : old)
            if (t != nullptr) (*this)[KeyOf()(*t)] = t;
    }
    void clear() {
        std::fill(slots_.begin(), slots_.end(), nullptr);
        count_ = 0;
    }

 private:
    std::vector<T*> slots_ = std::vector<T*>(128, nullptr);  // a power of two, by hash, at most half full
    std::size_t count_ = 0;
};

}  // namespace lostmotion
