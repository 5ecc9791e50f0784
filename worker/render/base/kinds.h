// Builds a std::variant type from the structs of all kinds of light or material. Each family of kinds (such
// as area lights) lists its kinds in its own file, so that adding a kind changes only the files of its
// family.
#pragma once

#include <cstddef>
#include <variant>

namespace ls::render {

template <class... K>
struct Kinds {};  // the kinds of one family

template <class... Families>
struct Joined;
template <class... K>
struct Joined<Kinds<K...>> {
  using Variant = std::variant<K...>;
};
template <class... A, class... B, class... Rest>
struct Joined<Kinds<A...>, Kinds<B...>, Rest...> : Joined<Kinds<A..., B...>, Rest...> {};

template <class... Families>
using VariantOf = typename Joined<Families...>::Variant;

// Calls f with the kind that v holds. For many kinds, std::visit makes an indirect call through a table of
// functions; with_kind() compiles to a switch, into which the calls can be inlined.
template <std::size_t I = 0, class Variant, class F>
[[gnu::always_inline]] inline auto with_kind(Variant& v, F&& f) {
  if constexpr (I + 1 < std::variant_size_v<std::remove_const_t<Variant>>)
    if (v.index() != I) return with_kind<I + 1>(v, f);
  return f(*std::get_if<I>(&v));
}

}  // namespace ls::render
