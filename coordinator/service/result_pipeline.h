// The path of a worker's result: each result is verified separately, made durable in a batch with others,
// reported to the farm and acknowledged to its worker. Terms: docs/reference/glossary.md.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "coordinator/assemble/verify.h"
#include "coordinator/base/limits.h"
#include "coordinator/base/work_queue.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/service/state/records.h"
#include "coordinator/service/state/worker_entry.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

struct Core;

class ResultPipeline {
 public:
  ResultPipeline(Guarded<Core>& core, BackgroundWrites& writes, const Clock& clock)
      : core_(core), writes_(writes), clock_(clock) {}

  // Takes a result that a worker sent. Calls `next` when the worker's next message may be read: as soon as
  // this result is dropped or gets room in memory.
  void receive(const std::shared_ptr<Connection>& from, UnitResult result, std::function<void()> next);
  void close() { budget_.close(); }  // afterwards no `next` is called any more
  void put_figures(FarmFigures& figures) const;

  void verify_loop(const std::stop_token& token);
  void commit_loop(const std::stop_token& token);

 private:
  struct Arrived {
    std::shared_ptr<Connection> from;
    UnitResult result;
    EntryPtr job;
    UnitHeader expected;
    std::size_t bytes = 0;  // memory reserved for the result in budget_, in bytes
    TimePoint at{};         // time of arrival
  };
  struct Checked {
    Arrived arrived;
    Verified verified;
    TimePoint began{};   // time at which verification began
    double seconds = 0;  // duration of verification
  };
  // A result on its way into the log. prepare() decides whether it is stored; append() stores it.
  struct Stored {
    std::shared_ptr<PartialLog> log;         // log in which the result is stored; null: it is not stored
    double at_seconds = 0;                   // time of storing, in seconds on the job's clock
    std::uint64_t resumes = 0;               // the job's JobEntry::resumes when storing began
    std::optional<PartialLog::Place> place;  // set by append()
    std::optional<Error> error;              // why the job's record or the result cannot be written
  };
  void commit(std::vector<Checked> batch);
  std::vector<Stored> prepare(const std::vector<Checked>& batch);
  static void append(const std::vector<Checked>& batch, std::vector<Stored>& stored);
  void conclude(Core& core, Checked& item, const Stored& stored);
  void accept(Core& core, Checked& item, std::optional<PartialLog::Place> place);
  void refuse(Core& core, const Arrived& arrived, const Error& error);
  void cannot_store(Core& core, const Arrived& arrived, const Error& error, std::uint64_t resumes);

  Guarded<Core>& core_;
  BackgroundWrites& writes_;
  const Clock& clock_;
  ByteBudget budget_{limits::kMaxResultsWaiting};
  WorkQueue<Arrived> arrived_;
  WorkQueue<Checked> checked_;
};

}  // namespace ls::coordinator
