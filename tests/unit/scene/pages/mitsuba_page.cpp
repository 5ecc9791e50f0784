#include <fmt/format.h>

#include "common/scene/schema/mitsuba_plugins.h"
#include "tests/unit/scene/pages/pages.h"

namespace ls::scene {
namespace {

constexpr std::string_view kMitsubaHead = R"(# Plugins of Mitsuba

<!-- Made by mitsuba_markdown() from the table in common/scene/schema/mitsuba_plugins.cpp; do not edit. -->

Every plugin of Mitsuba 3.9 and, marked 0.x, those that only earlier versions have; "ours" are Lightshaft's own. Their
parameters are in the [scene format](scene-format.md). What is refused is an error with its place, and this reason.

- **read**: with all parameters that change the picture. Parameters that do not are [warned of](scene-format.md#accepted-without-effect).
- **in part**: as the note says; what is left out is an error or a warning.
- **refused**: why, and what to use instead.

`tests/bench/mitsuba_plugins.py` compares this page with an installed Mitsuba.

| element | plugin | of | here | note |
|---|---|---|---|---|
)";

std::string_view text_of(Standing standing) {
  return standing == Standing::read ? "read" : standing == Standing::in_part ? "in part" : "refused";
}
std::string_view text_of(Origin origin) {
  return origin == Origin::mitsuba3 ? "3" : origin == Origin::older ? "0.x" : "ours";
}

}  // namespace

std::string mitsuba_markdown() {
  std::string out(kMitsubaHead);
  for (const PluginRow& row : mitsuba_plugins())
    out += fmt::format("| {} | `{}` | {} | {} | {} |\n", row.tag, row.name, text_of(row.origin),
                       text_of(row.standing), row.note);
  return out;
}

}  // namespace ls::scene
