#include <fmt/format.h>

#include "common/scene/schema/nori_words.h"
#include "tests/unit/scene/pages/pages.h"

namespace ls::scene::nori {
namespace {

constexpr std::string_view kIntroduction = R"(## Files of Nori

A `<scene>` without a version that has a `<camera>` or a `<mesh>` is a scene of Nori (or of a renderer that descends from it, such
as Kombu). It becomes the same scene as one of Mitsuba that means the same, with the same digest; `lightshaft convert` shows which.
What Nori means otherwise than Mitsuba:

- Every object stands where it is used; numbers are separated by commas or blanks; names are in camelCase.
- The camera's +x is on the right of the picture, so that a bare `<lookat>` shows the world mirrored. `fov` is over the width. The
  filter, if none is given, is `gaussian` with stddev 0.5; one sample a pixel is taken if there is no sampler.
- v of a mesh runs from the lower edge of an image upwards. On a sphere u begins at -x.
- A mesh whose file has no normals (`vn`) is flat; in Mitsuba it is smooth.
- A mesh without a bsdf is diffuse with albedo 0.5, also if it shines; if it bounds a medium it lets light through.
- A `<medium>` in a mesh is inside of it. One that stands in the scene itself is everywhere where no mesh holds another.
- Media come in three notations: `sigma_a`, `sigma_s` with `phase_g`, `density_scale` and `emission`; `sigma_t`, `albedo`, `scale`;
  `absorption`, `scattering`.
- A `<test type="ttest">` or `"chi2test">` holds scenes or bsdfs and what is expected of them; `lightshaft validate FILE` runs it.

)";

constexpr std::string_view kIntegratorParameters = R"(
`direct` and its kin show lamps, and the light that reaches a surface straight from them; mirrors and clear glass show lamps and
nothing else, also with `direct_ems`. `whitted` follows mirrors and clear glass until they show another surface. Nori ends one in
twenty such paths and weighs the others up, which changes no mean; here a path ends at random once it carries little light.

Those without a max_depth take `maxDepth` (-1: no limit), those with media `inmedium` (the camera is in the medium of the mesh around
it), `volpath_distant_mis` its `distance` and `heuristic` as in Mitsuba's language.
)";

}  // namespace

std::string markdown() {
  std::string out(kIntroduction);
  out += "| object of Nori | means here |\n|---|---|\n";
  for (const Plugin& p : plugins()) out += fmt::format("| {} `{}` | {} |\n", p.tag, p.type, p.becomes);
  out += "\n| parameter | of | given as | default | meaning |\n|---|---|---|---|---|\n";
  for (const Plugin& p : plugins())
    for (const Parameter& q : p.parameters)
      out += fmt::format("| `{}` | {} `{}` | `{}` | {} | {} |\n", q.name, p.tag, p.type, text_of(q.types),
                         q.fallback,
                         q.idle.empty() ? std::string(q.meaning) : fmt::format("no effect: {}", q.idle));
  out += "\nIts integrators:\n\n| name | means |\n|---|---|\n";
  for (const IntegratorRow& row : integrators())
    out += fmt::format("| `{}` | `{}`{}{} |\n", row.name, row.ours,
                       row.max_depth ? fmt::format(" with max_depth {}", *row.max_depth) : "",
                       row.but.empty() ? "" : fmt::format(", with a warning: {}", row.but));
  out += kIntegratorParameters;
  out += "\nRefused by name:\n\n| object | why |\n|---|---|\n";
  for (const Refused& r : refused_plugins())
    out += fmt::format("| {} `{}` | {} |\n", r.tag, r.type, r.because);
  return out + "\n";
}

}  // namespace ls::scene::nori
