// Part of path.h, which includes it: the media on both sides of a boundary, and boundaries on each other.
#pragma once

#include <algorithm>

#include "worker/render/world.h"

namespace ls::render {

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::start_medium() const -> Within {
  Within in;
  if (!world_.use_media) return in;
  if constexpr (F.overlaps) {
    if (world_.overlaps) return world_.camera_media;
  }
  in.only(world_.camera_medium);
  return in;
}

// The media on the side of w, for a path that travels along `from` and is in `in`. Everything that lets all
// light pass and lies where the surface does is crossed with it.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::beyond(const SurfaceHit& hit, const V3& w, const V3& from, Within in) const
    -> Within {
  if constexpr (F.media) {
    if (!world_.use_media) return in;
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if (!surface.transition && !(surface.together > 0)) return in;
    const bool outside = dot(w, hit.ng) > 0, through = outside == (dot(from, hit.ng) > 0);
    if (surface.together > 0 && through) return through_all(hit, w, from, in);
    stand(surface, outside, through, in);
  }
  return in;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::stand(const SurfaceInfo& s, bool outside, bool through, Within& in) const {
  if constexpr (F.overlaps) {
    if (world_.overlaps) return in.stand(s, outside, through, world_.media);
  }
  if (s.transition) in.only(outside ? s.exterior : s.interior);
}

template <Features F, template <Features> class Light>
std::optional<float> PathTracer<F, Light>::scatter_in_media(const SurfaceHit* end) {
  if constexpr (F.overlaps) {
    if (medium_.several()) return scatter_among(end);
  }
  return scatter_in_medium(world_.media[medium_.one()], end);
}

// From one side of a surface to the other: from in front of all that may be meant to lie where it does, but
// not from behind the ray's own beginning, to where the ray goes on.
template <Features F, template <Features> class Light>
Together PathTracer<F, Light>::others_at(const SurfaceHit& hit, const V3& from, const V3& w) const {
  const V3 back = offset_point(hit, -w) - hit.p;
  const float share = hit.t * std::abs(dot(from, back)) / dot(back, back);
  Together all = world_.accel.between(hit.p + back * std::min(1.f, share), offset_point(hit, w));
  const auto end = std::remove(all.ids.begin(), all.ids.begin() + all.count, hit.primitive);
  all.count = static_cast<int>(end - all.ids.begin());
  return all;
}

// What is left is left before anything is entered, so that nobody is ever inside of more than there is: cells
// of one mesh that share a wall are one body.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::through_all(const SurfaceHit& hit, const V3& w, const V3& from, Within in) const
    -> Within {
  const Together others = others_at(hit, from, w);
  const V3 o = offset_point(hit, -w), d = normalize(offset_point(hit, w) - o);
  for (const bool outside : {true, false}) {
    const SurfaceInfo& own = world_.geometry.surfaces[hit.surface];
    if ((dot(w, hit.ng) > 0) == outside) stand(own, outside, true, in);
    for (int i = 0; i < others.count; ++i) {
      SurfaceHit other;
      if (!world_.geometry.complete(others.ids[static_cast<std::size_t>(i)], o, d, other)) continue;
      const SurfaceInfo& s = world_.geometry.surfaces[other.surface];
      if (s.null && (dot(d, other.ng) > 0) == outside) stand(s, outside, true, in);
    }
  }
  return in;
}

// Of surfaces on each other the one that scatters light is met, whichever the ray found: else fog on a floor
// would let light through the floor.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::prefer_scatterer(SurfaceHit& hit) const {
  const SurfaceInfo& s = world_.geometry.surfaces[hit.surface];
  if (!s.null || !(s.together > 0)) return;
  const Together others = others_at(hit, d_, d_);
  for (int i = 0; i < others.count; ++i) {
    SurfaceHit other;
    const PrimitiveId id = others.ids[static_cast<std::size_t>(i)];
    if (!world_.geometry.complete(id, o_, d_, other) || world_.geometry.surfaces[other.surface].null)
      continue;
    hit = other;
    return;
  }
}

}  // namespace ls::render
