// What a test run knows to say when a scene kills it, and how many scenes it is to look at.
#pragma once

#include <cstdint>
#include <string>

namespace ls::test {

// Scenes of a run: seeds first, first + 1, ... From the environment, for those who look for trouble:
//   LIGHTSHAFT_SCENES=5000 LIGHTSHAFT_FIRST_SCENE=100 property_test --gtest_filter=...
struct SceneRange {
  std::uint64_t first, count;
};
SceneRange scenes_to_try(std::uint64_t usual);

// While it lives, a crash (or a scene that takes a minute of processor time) prints this text before the
// process dies.
class Watch {
 public:
  explicit Watch(std::string text);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  std::string text_;
};

// The scene as XML, with its seed: what a failing test prints.
struct RandomScene;
std::string told(const RandomScene& s);

}  // namespace ls::test
