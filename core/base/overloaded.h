// overloaded{...} combines lambdas into one visitor: std::visit(overloaded{...}, variant).
#pragma once

namespace ls {
template <class... Ts>
struct overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
overloaded(Ts...) -> overloaded<Ts...>;
}  // namespace ls
