// Independent tasks on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace lostmotion {

// Distributes `count` tasks over threads. worker(next, stop) runs once on each thread: it takes the number of its next
// task from next() until that is `count` or beyond. waiting(done) is called by the calling thread every 20 ms, with the
// number of finished tasks; false stops the work.
template <class Worker>
void distribute(std::size_t count, unsigned threads, const std::function<bool(std::size_t)>& waiting,
                const Worker& worker) {
    std::atomic<std::size_t> started{0}, finished{0};
    std::atomic<bool> stop{false};
    unsigned running =
        static_cast<unsigned>(std::min<std::size_t>(std::max(1u, threads), std::max<std::size_t>(1, count)));
    std::mutex mutex;
    std::condition_variable worker_finished;
    std::vector<std::jthread> workers;
    for (unsigned k = running; k > 0; --k)
        workers.emplace_back([&] {
            bool has_task = false;
            worker(
                [&] {
                    if (has_task) ++finished;
                    has_task = true;
                    return started++;
                },
                stop);
            const std::lock_guard lock(mutex);
            --running;
            worker_finished.notify_one();
        });
    using namespace std::chrono_literals;
    std::unique_lock lock(mutex);
    while (!worker_finished.wait_for(lock, 20ms, [&] { return running == 0; })) {
        lock.unlock();
        if (!stop && !waiting(std::min<std::size_t>(finished, count))) stop = true;
        lock.lock();
    }
    lock.unlock();
    workers.clear();
    if (!stop) waiting(count);
}

}  // namespace lostmotion
