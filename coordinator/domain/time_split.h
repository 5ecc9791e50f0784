// Where the time of a job went, in core seconds: of the workers, but for `merge`. What was counted since the
// job was last stored is lost when the coordinator is killed; `render` never is.
#pragma once

namespace ls::coordinator {

struct TimeSplit {
  double load = 0;      // getting files
  double build = 0;     // reading them, making worlds
  double render = 0;    // CPU time of units: JobView::core_seconds
  double transfer = 0;  // packing results
  double merge = 0;     // of the coordinator: checking and folding results
  double idle = 0;      // threads between two units of the job
  void add(const TimeSplit& o);
  bool operator==(const TimeSplit&) const = default;
};

// By their names in JSON, wherever a split is written or read.
struct TimePart {
  const char* name;
  double TimeSplit::*seconds;
};
inline constexpr TimePart kTimeParts[] = {{"load", &TimeSplit::load},     {"build", &TimeSplit::build},
                                          {"render", &TimeSplit::render}, {"transfer", &TimeSplit::transfer},
                                          {"merge", &TimeSplit::merge},   {"idle", &TimeSplit::idle}};

inline void TimeSplit::add(const TimeSplit& o) {
  for (const TimePart& part : kTimeParts) this->*part.seconds += o.*part.seconds;
}

}  // namespace ls::coordinator
