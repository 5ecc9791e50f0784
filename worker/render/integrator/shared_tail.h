// Data that the paths of a group of pixels share, so that each pixel also gets the light that the other
// pixels' paths find from their second vertices on (path_reuse.h). That part of a path is its tail.
#pragma once

#include <array>
#include <optional>

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/medium_stack.h"

namespace ls::render {

// The largest number of pixels in a group.
inline constexpr std::size_t kMostSharing = 64;

struct PathVertex {
  V3 p{0, 0, 0};
  const Medium* medium = nullptr;  // null: on a surface, at `hit`
  SurfaceHit hit;
};

// The first vertex of a path, which is connected to the second vertices of other paths.
struct FirstVertex {
  bool usable = false;  // false: there is none, or it scatters by delta lobes alone
  PathVertex at;
  V3 d{0, 0, 0};        // the direction of travel before the vertex
  C3 beta{0, 0, 0};     // the weight of the path up to the vertex
  C3 density{1, 1, 1};  // the path's density with each channel as the hero (medium.h), over their mean
  OneMedium around;     // the medium in front of the vertex
  int passed = 0;       // surfaces passed straight through between the camera and the vertex
  // A cache for a diffuse surface: the BSDF for a direction along the normal, on the normal's side [0] or on
  // the other [1]; nullopt if it was not evaluated yet.
  std::array<std::optional<BsdfEval>, 2> by_side;
};

// The second vertex of a path, and the light that arrives there.
struct SharedTail {
  bool usable = false;  // false: there is none, or it was not sampled by a smooth lobe
  PathVertex at;
  int passed = 0;  // surfaces passed straight through between the camera and the vertex
  // Along the way from the path's own first vertex: the optical depth of the media in each channel, the null
  // transmission of the surfaces, and the probability of passing them.
  C3 depth{0, 0, 0}, transmission{1, 1, 1};
  float passing = 1;

  // Light found by next-event estimation; light_pdf = 0: none.
  V3 to_light{0, 0, 0};
  float light_pdf = 0;
  bool light_is_delta = false;
  C3 light{0, 0, 0};

  // Light from `onward`, the direction in which the path goes on: `emitted` by the light source that the ray
  // hits, if any, and `scattered` at later vertices. Next-event estimation finds that light source with the
  // density hit_pdf.
  bool goes_on = false;
  V3 onward{0, 0, 0};
  C3 emitted{0, 0, 0}, scattered{0, 0, 0};
  float hit_pdf = 0;

  bool brings_light() const { return light_pdf > 0 || !is_black(emitted) || !is_black(scattered); }
};

// The state of a path that records its first vertex and its tail.
struct SharingPath {
  enum class Part : std::uint8_t {
    alone,   // before the first vertex, and where light counts for this pixel only
    second,  // on the way from the first vertex to the second
    tail,    // from the second vertex on
  };
  Part part = Part::alone;
  FirstVertex first;
  SharedTail tail;
  C3 scale{1, 1, 1};   // the factor of light that counts for this pixel only
  float survival = 1;  // factor of the throughput that Russian roulette compares (size())
  // look_at() sets these two for the shadow ray that it traces:
  C3 flight{1, 1, 1};  // the transmittance of its media times the probability of passing its surfaces
  int crossed = 0;     // number of surfaces that it passed
};

}  // namespace ls::render
