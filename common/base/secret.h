// Comparing secrets.
#pragma once

#include <string_view>

namespace ls {

// Equality whose run time tells neither where the texts differ nor how long the secret is.
bool equal_secret(std::string_view a, std::string_view b);

}  // namespace ls
