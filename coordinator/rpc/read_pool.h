// Threads that read blobs for FetchBlob streams. A read may have to wait for another machine, so it must not
// run on one of gRPC's few threads, which must stay free for the messages of workers.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace ls::coordinator::rpc {

class ReadPool {
 public:
  void start(int threads) {
    for (int i = 0; i < threads; ++i)
      threads_.emplace_back([this](const std::stop_token& token) { work(token); });
  }
  void run(std::function<void()> read) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(read));
    changed_.notify_one();
  }
  // Ends the threads; call it when no more calls of run() can come. Returns when the reads in progress are
  // done.
  void stop() {
    for (auto& thread : threads_) thread.request_stop();
    threads_.clear();
  }

 private:
  void work(const std::stop_token& token) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, token, [&] { return !waiting_.empty(); })) {
      const auto read = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      read();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::function<void()>> waiting_;
  std::vector<std::jthread> threads_;  // last member: its threads use the others
};

}  // namespace ls::coordinator::rpc
