// What the checks of an object's parameters return.
#pragma once

#include <string>
#include <string_view>

namespace ls::scene {

// What is wrong with an object: the parameter that it is about, and a predicate ("has no direction"). Both
// are empty if nothing is.
struct ParameterProblem {
  std::string_view parameter;
  std::string what;
};

}  // namespace ls::scene
