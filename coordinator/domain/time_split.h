// Where the time of a job went, in core seconds of the workers (`merge`: of the coordinator). If the
// coordinator is killed, all parts except `render` lose what was counted since the job was last stored.
#pragma once

namespace ls::coordinator {

struct TimeSplit {
  double load = 0;      // fetching files
  double build = 0;     // parsing files, building worlds
  double render = 0;    // CPU time of units (rounds of tiles): JobView::core_seconds
  double transfer = 0;  // packing results
  double merge = 0;     // coordinator: verifying results and adding them to the image
  double idle = 0;      // worker threads between two units of the job
  void add(const TimeSplit& o);
  bool operator==(const TimeSplit&) const = default;
};

// The parts and their names in JSON, wherever a split is written or read
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
