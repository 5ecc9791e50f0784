// The result of checking the parameters of an object.
#pragma once

#include <string>
#include <string_view>

namespace ls::scene {

// The first problem of an object: the parameter that causes it, and a predicate ("has no direction") that
// describes it. Both are empty if there is no problem.
struct ParameterProblem {
  std::string_view parameter;
  std::string what;
};

}  // namespace ls::scene
