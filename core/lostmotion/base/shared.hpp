// A thing that several own, in one thread. The WebAssembly core has no library that std::shared_ptr could come from.
#pragma once

#include <utility>

namespace lostmotion {

// The last owner deletes it.
template <class T>
class Shared {
 public:
    Shared() = default;
    template <class... Args>
    static Shared make(Args&&... args) {
        Shared out;
        out.at_ = new Owned(std::forward<Args>(args)...);
        return out;
    }
    Shared(const Shared& o) : at_(o.at_) {
        if (at_ != nullptr) ++at_->owners;
    }
    Shared(Shared&& o) noexcept : at_(std::exchange(o.at_, nullptr)) {}
    Shared& operator=(Shared o) noexcept {
        std::swap(at_, o.at_);
        return *this;
    }
    ~Shared() {
        if (at_ != nullptr && --at_->owners == 0) delete at_;
    }

    T& operator*() const { return at_->thing; }
    T* operator->() const { return &at_->thing; }
    explicit operator bool() const { return at_ != nullptr; }

 private:
    struct Owned {
        template <class... Args>
        explicit Owned(Args&&... args) : thing(std::forward<Args>(args)...) {}
        T thing;
        int owners = 1;
    };
    Owned* at_ = nullptr;
};

}  // namespace lostmotion
