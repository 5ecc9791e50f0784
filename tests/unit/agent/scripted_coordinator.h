// A coordinator in this process for tests of the agent. It records the worker's messages and answers as the
// test has set. It has no clock and no sockets.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "worker/agent/link.h"

namespace ls::worker {

class ScriptedCoordinator final : public CoordinatorLink {
 public:
  // The coordinator's behaviour: may be set before or while the agent runs.
  void acknowledge_results(bool on) {
    change([&] { acknowledge_ = on; });
  }
  void refuse_connections(bool on) {
    change([&] { refuse_ = on; });
  }
  void answer_hello_with(ToWorker message) {
    change([&] { greeting_ = std::move(message); });
  }
  void add_blob(const std::string& text) {
    change([&] { blobs_[sha256(std::string_view(text))] = text; });
  }
  void cut_next_fetch() {
    change([&] { cut_fetch_ = true; });
  }
  void fail_fetches_with(std::optional<Error> error) {
    change([&] { fetch_error_ = std::move(error); });
  }
  void tell(ToWorker message) {
    if (const auto to = observer()) to->received(std::move(message));
  }
  void cut() {
    std::shared_ptr<LinkObserver> gone;
    change([&] { gone = std::move(observer_); });
    if (gone) gone->lost({Errc::unavailable, "cut"});
  }

  // Waits for a condition on what the coordinator has received; fails the test if it does not come true.
  template <class Condition>
  void wait_for(Condition condition) {
    std::unique_lock lock(mutex_);
    ASSERT_TRUE(changed_.wait_for(lock, kPatience, [&] { return condition(*this); }));
  }
  // The same; meanwhile calls `drive`, which advances a fake clock, again and again.
  template <class Condition, class Drive>
  void wait_for(Condition condition, Drive drive) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    std::unique_lock lock(mutex_);
    while (!condition(*this)) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline);
      lock.unlock();
      drive();
      lock.lock();
      changed_.wait_for(lock, std::chrono::milliseconds(2), [&] { return condition(*this); });
    }
  }
  std::size_t results_so_far() {
    const std::lock_guard lock(mutex_);
    return results.size();
  }
  std::vector<WorkerHello> hellos;  // guarded by the mutex: read them in wait_for or after the agent's end
  std::vector<UnitResult> results;
  std::vector<UnitFailure> failures;
  std::vector<LeaseReturned> returned;
  std::vector<WorkerProgress> progress;
  int draining = 0, undrained = 0;
  std::vector<WorkerDraining> drains;
  int fetches = 0;

  // CoordinatorLink.
  Result<void> connect(const WorkerHello& hello, std::shared_ptr<LinkObserver> observer) override {
    ToWorker greeting;
    {
      const std::lock_guard lock(mutex_);
      if (refuse_) return fail(Errc::unavailable, "nobody listens");
      hellos.push_back(hello);
      observer_ = observer;
      greeting = greeting_;
    }
    changed_.notify_all();
    observer->received(greeting);
    return {};
  }
  void send(FromWorker message) override {
    std::optional<UnitKey> acknowledge;
    {
      const std::lock_guard lock(mutex_);
      if (!observer_) return;
      if (auto* m = std::get_if<UnitResult>(&message)) {
        results.push_back(*m);
        if (acknowledge_) acknowledge = m->unit;
      }
      if (auto* m = std::get_if<UnitFailure>(&message)) {
        failures.push_back(*m);
        if (acknowledge_) acknowledge = m->unit;
      }
      if (auto* m = std::get_if<LeaseReturned>(&message)) returned.push_back(*m);
      if (auto* m = std::get_if<WorkerProgress>(&message)) progress.push_back(*m);
      if (auto* m = std::get_if<WorkerDraining>(&message)) {
        ++(m->withdrawn ? undrained : draining);
        drains.push_back(*m);
      }
    }
    changed_.notify_all();
    if (acknowledge) tell(ResultAck{*acknowledge, {}});
  }
  void close() override {
    change([&] { observer_.reset(); });
  }
  Result<void> fetch_blob(const BlobRequest& wanted, const BlobSink& sink) override {
    std::string text;
    {
      const std::lock_guard lock(mutex_);
      ++fetches;
      if (std::exchange(cut_fetch_, false)) return fail(Errc::unavailable, "cut");
      if (fetch_error_) return tl::unexpected<Error>(*fetch_error_);
      const auto it = blobs_.find(wanted.digest);
      if (it == blobs_.end()) return fail(Errc::not_found, "no such blob");
      text = it->second.substr(wanted.offset);
    }
    return sink(std::as_bytes(std::span(text)));
  }

 private:
  static constexpr auto kPatience = std::chrono::seconds(60);

  template <class Change>
  void change(Change c) {
    {
      const std::lock_guard lock(mutex_);
      c();
    }
    changed_.notify_all();
  }
  std::shared_ptr<LinkObserver> observer() {
    const std::lock_guard lock(mutex_);
    return observer_;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<LinkObserver> observer_;
  ToWorker greeting_ = Welcome{WorkerId{"w-1"}, 1, "secret of w-1"};
  std::map<Digest, std::string> blobs_;
  std::optional<Error> fetch_error_;
  bool acknowledge_ = true, refuse_ = false, cut_fetch_ = false;
};

}  // namespace ls::worker
