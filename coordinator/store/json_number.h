// Figures in records. JSON knows no infinity: it would be written as null, and the record could not be read again.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/json_count.h"

namespace ls::coordinator {

inline double finite(double value) { return std::isfinite(value) ? value : 0; }
// null: written by a version that did not know that.
inline double number_of(const nlohmann::json& j) { return j.is_null() ? 0 : j.get<double>(); }

}  // namespace ls::coordinator
