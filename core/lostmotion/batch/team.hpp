// Threads that share the drives of a batch and wait for work in between.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace lostmotion::batch {

inline constexpr std::size_t at_a_time = 64;  // drives that a thread takes

class Team {
 public:
    Team() = default;
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;
    ~Team() { end(); }

    // How many of at most so many threads share so many drives.
    static std::size_t needed(std::size_t count, unsigned threads) {
        return std::max<std::size_t>(1, std::min<std::size_t>(threads, (count + at_a_time - 1) / at_a_time));
    }
    // use(begin, end, thread) with parts of 0..count; the number of the thread is below needed().
    template <class Use>
    void share(std::size_t count, unsigned threads, Use&& use) {
        const std::size_t wanted = needed(count, threads);
        if (wanted == 1) return use(std::size_t{0}, count, std::size_t{0});
        if (members_.size() + 1 != wanted) {
            end();
            start(wanted);
        }
        std::atomic<std::size_t> next{0};
        run([&](std::size_t who) {
            for (std::size_t k = at_a_time * next++; k < count; k = at_a_time * next++)
                use(k, std::min(count, k + at_a_time), who);
        });
    }

 private:
    using Task = std::function<void(std::size_t)>;  // of the number of the thread

    void start(std::size_t threads) {
        for (std::size_t k = 1; k < threads; ++k)
            members_.emplace_back([this, k, seen = round_](const std::stop_token& stop) mutable {
                while (true) {
                    std::unique_lock lock(mutex_);
                    begin_.wait(lock, [&] { return round_ != seen || stop.stop_requested(); });
                    if (stop.stop_requested()) return;
                    seen = round_;
                    lock.unlock();
                    (*task_)(k);
                    lock.lock();
                    if (--working_ == 0) done_.notify_one();
                }
            });
    }
    void end() {
        {
            const std::lock_guard lock(mutex_);
            for (std::jthread& m : members_) m.request_stop();
        }
        begin_.notify_all();
        members_.clear();
    }
    void run(const Task& work) {
        {
            const std::lock_guard lock(mutex_);
            task_ = &work;
            working_ = members_.size();
            ++round_;
        }
        begin_.notify_all();
        work(0);
        std::unique_lock lock(mutex_);
        done_.wait(lock, [&] { return working_ == 0; });
    }

    std::mutex mutex_;
    std::condition_variable begin_, done_;
    const Task* task_ = nullptr;
    std::size_t working_ = 0;
    long round_ = 0;
    std::vector<std::jthread> members_;
};

}  // namespace lostmotion::batch
