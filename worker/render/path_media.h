// Part of path.h, which includes it: the media on both sides of a boundary, and boundaries on each other.
#pragma once

#include <algorithm>

#include "worker/render/built.h"
#include "worker/render/world.h"

namespace ls::render {

template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::start_medium() const -> Within {
  Within in;
  if constexpr (F.overlaps) {
    if (world_.overlaps) return world_.camera_media;
  }
  in.only(world_.camera_medium);
  return in;
}

// The media on the side of w, for a path that travels along `from` and is in `in`. Everything that lets all
// light pass and lies where the surface does is crossed with it. Scenes in which something does are a matter
// of F.overlaps, so that no other ever asks.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::beyond(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& w,
                                  const V3& from, Within in) const -> Within {
  if constexpr (F.media) {
    if (!(F.overlaps ? surface.borders : surface.transition)) return in;
    const bool outside = dot(w, hit.ng) > 0;
    if constexpr (F.overlaps) {
      const bool through = outside == (dot(from, hit.ng) > 0);
      if (surface.together > 0 && through) return through_all(hit, w, from, in);
      stand(surface, outside, through, in);
    } else {
      in.only(outside ? surface.exterior : surface.interior);
    }
  }
  return in;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::stand(const SurfaceInfo& s, bool outside, bool through, Within& in) const {
  if (world_.overlaps) return in.stand(s, outside, through, world_.media);
  if (s.transition) in.only(outside ? s.exterior : s.interior);
}

template <Features F, template <Features> class Light>
std::optional<float> PathTracer<F, Light>::scatter_in_media(const SurfaceHit* end, float reach) {
  if constexpr (F.overlaps) {
    if (medium_.several()) return scatter_among(end, reach);
  }
  return scatter_in_medium(world_.media[medium_.one()], end, reach);
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

// Of surfaces on each other the one that scatters light is met, whichever the ray from o along d found: else
// fog on a floor would let light through the floor, and a pane on a boundary would take nothing of it. Shadow
// rays end at t_max, in front of what their light is on.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::prefer_scatterer(SurfaceHit& hit, const V3& o, const V3& d, float t_max) const {
  const SurfaceInfo& s = world_.geometry.surfaces[hit.surface];
  if (!s.null || !(s.together > 0)) return;
  const Together others = others_at(hit, d, d);
  for (int i = 0; i < others.count; ++i) {
    SurfaceHit other;
    const PrimitiveId id = others.ids[static_cast<std::size_t>(i)];
    if (!world_.geometry.complete(id, o, d, other) || world_.geometry.surfaces[other.surface].null ||
        other.t > t_max)
      continue;
    hit = other;
    return;
  }
}

// A light that lets all light pass shines on from where another surface lies, whichever the ray found:
// next-event estimation, which its share of the light is weighted against, finds it there as well.
template <Features F, template <Features> class Light>
void PathTracer<F, Light>::add_emission_of_others(const SurfaceHit& hit) {
  const Together others = others_at(hit, d_, d_);
  for (int i = 0; i < others.count; ++i) {
    SurfaceHit other;
    if (!world_.geometry.complete(others.ids[static_cast<std::size_t>(i)], o_, d_, other)) continue;
    const SurfaceInfo& s = world_.geometry.surfaces[other.surface];
    if (s.null && s.light != kNone) add_emission(other);
  }
}

}  // namespace ls::render
