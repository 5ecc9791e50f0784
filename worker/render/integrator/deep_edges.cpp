// Slices are placed by probes: camera rays through fixed points of the pixel, its filter and the lens. Where
// probes meet surfaces, also such that only shine, there is a slice of their own for each range of depths
// without large gaps. The other slices divide the media before, between and behind them, so that each takes
// about the same share of the light: equal parts of what is scattered on the way to the camera, not of
// optical depth, of which most can lie where nothing is seen. So no slice is seen through less than about one
// over the number of slices, and colours divided by that stay small and free of noise.
#include "worker/render/integrator/deep_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "core/image/aov/deep_planes.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/media/optical_depth.h"

namespace ls::render {
namespace {

// The number of probes, and the number if the first ones meet nothing: something may be seen at an edge of
// the pixel alone.
constexpr std::uint32_t kProbes = 16;
constexpr std::uint32_t kMoreProbes = 64;
// Surfaces whose depths differ by less than this share belong to one slice.
constexpr float kGap = .01f;
// A slice of surfaces is this share of its depths larger on both sides than the probes say, as samples are
// met between and beside them; and at least by the rounding of depths.
constexpr float kDeepMargin = .25f;
constexpr float kDeepRounding = 1e-5f;
// Points on the way through the media of a pixel at which their transmittance is computed.
constexpr int kSteps = 32;
// The share of the slices that divides the way evenly, whatever the transmittance: media may shine or be
// thin.
constexpr double kEven = .1;
// Media without end are divided up to this optical depth.
constexpr float kDeepest = 12;

struct Range {
  float begin = std::numeric_limits<float>::infinity(), end = -std::numeric_limits<float>::infinity();
  bool any() const { return begin <= end; }
  void add(float from, float to) {
    begin = std::min(begin, from);
    end = std::max(end, to);
  }
};

std::vector<DeepProbe> probes_of(const World& w, int x, int y, std::uint32_t count) {
  std::vector<DeepProbe> probes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const SampleStream stream(0, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), i);
    probes.push_back(PathTracer<kAnyMotion>(w, stream).deep_probe(camera_ray(w, stream, x, y)));
  }
  return probes;
}

float mean_extinction(const Medium& m) { return (m.sigma_t.x + m.sigma_t.y + m.sigma_t.z) / 3; }

// One medium of a segment.
struct Crossing {
  OpticalDepth depth;
  float begin = 0;  // depth of the segment's start
  float sigma = 0;
};
// A probe, prepared to compute its transmittance.
struct Prepared {
  std::vector<std::vector<Crossing>> segments;
  std::span<const DeepSegment> of;

  // Adds, for each of the ascending depths, the share of the light that media on the way scatter or absorb up
  // to there.
  void add_taken(std::span<const float> depths, std::span<double> taken) const {
    std::vector<float> t(depths.size());
    std::vector<double> x(depths.size()), optical(depths.size());
    double left = 1, before = 0;
    for (std::size_t i = 0; i < of.size(); ++i) {
      std::ranges::fill(optical, 0.0);
      double whole = 0;
      for (const Crossing& c : segments[i]) {
        for (std::size_t k = 0; k < depths.size(); ++k)
          t[k] = std::clamp(depths[k] - c.begin, c.depth.from(), c.depth.to());
        c.depth.at_each(t, x);
        for (std::size_t k = 0; k < depths.size(); ++k) optical[k] += double{c.sigma} * x[k];
        if (c.sigma > 0) whole += double{c.sigma} * c.depth.total();
      }
      for (std::size_t k = 0; k < depths.size(); ++k)
        if (depths[k] > of[i].begin && (depths[k] <= of[i].end || i + 1 == of.size()))
          taken[k] += before + of[i].surfaces * left * -std::expm1(-optical[k]);
        else if (i + 1 < of.size() && depths[k] > of[i].end && depths[k] <= of[i + 1].begin)
          taken[k] += before + of[i].surfaces * left * -std::expm1(-whole);
      const double behind = left * std::exp(-whole);
      before += of[i].surfaces * (left - behind);
      left = behind;
    }
  }
};

// Where media are on the probes' ways: all of them, and each.
struct MediaRanges {
  Range all;
  std::vector<Range> each;
  bool any() const { return all.any(); }
  // True if a medium lies between these depths.
  bool between(float from, float to) const {
    return from < to &&
           std::ranges::any_of(each, [&](const Range& r) { return r.begin < to && r.end > from; });
  }
};
MediaRanges prepare(std::span<const DeepProbe> probes, std::vector<Prepared>& out) {
  MediaRanges media;
  for (const DeepProbe& probe : probes) {
    Prepared& prepared = out.emplace_back();
    prepared.of = probe.segments;
    for (const DeepSegment& s : probe.segments) {
      auto& crossings = prepared.segments.emplace_back();
      const float length = std::max(0.f, s.end - s.begin);
      for (const Medium* m : s.media) {
        Crossing c{OpticalDepth(*m, s.start, s.d, length), s.begin, mean_extinction(*m)};
        if (!(c.depth.total() > 0)) continue;
        float to = c.depth.to();
        if (!std::isfinite(to))
          to = c.depth.from() + (c.sigma > 0 ? kDeepest / c.sigma : std::max(1.f, s.begin));
        if (std::isfinite(to)) {
          media.all.add(s.begin + c.depth.from(), s.begin + to);
          media.each.push_back({s.begin + c.depth.from(), s.begin + to});
        }
        crossings.push_back(std::move(c));
      }
    }
  }
  return media;
}

// Returns the depths, sorted, of the surfaces that probes end on, and of those that shine on their ways.
std::vector<float> depths_of(std::span<const DeepProbe> probes) {
  std::vector<float> depths;
  for (const DeepProbe& probe : probes) {
    if (std::isfinite(probe.surface)) depths.push_back(probe.surface);
    for (const float depth : probe.lamps)
      if (std::isfinite(depth)) depths.push_back(depth);
  }
  std::ranges::sort(depths);
  return depths;
}

// Depths of surfaces that share a slice, with its margins.
struct Surfaces {
  Range range;
  float middle;  // where the image has them
};
// Returns at most `most` ranges of these depths, separated where the gaps are largest.
std::vector<Surfaces> surfaces_of(std::span<const float> depths, std::size_t most) {
  if (depths.empty() || most == 0) return {};
  std::vector<std::pair<float, std::size_t>> gaps;  // the share of a gap, negative, and the depth behind it
  for (std::size_t i = 1; i < depths.size(); ++i)
    if (const float gap = (depths[i] - depths[i - 1]) / depths[i]; gap > kGap) gaps.push_back({-gap, i});
  std::ranges::sort(gaps);
  gaps.resize(std::min(gaps.size(), most - 1));
  std::vector<std::size_t> begins{0};
  for (const auto& gap : gaps) begins.push_back(gap.second);
  std::ranges::sort(begins);
  std::vector<Surfaces> ranges;
  for (std::size_t k = 0; k < begins.size(); ++k) {
    const float first = depths[begins[k]],
                last = depths[(k + 1 < begins.size() ? begins[k + 1] : depths.size()) - 1];
    const float margin = std::max(kDeepMargin * (last - first), kDeepRounding * last);
    // A range keeps at least half of the gap in front of it free.
    const float before = k > 0 ? depths[begins[k] - 1] : 0;
    const Range range{std::max(first - margin, before + (first - before) / 2), last + margin};
    if (k > 0) ranges[k - 1].range.end = std::min(ranges[k - 1].range.end, range.begin);
    ranges.push_back({range, first + (last - first) / 2});
  }
  return ranges;
}

// Returns `count` depths that divide the media into parts of about the same share of the light.
std::vector<float> divisions(std::span<const Prepared> probes, const Range& media, std::size_t count) {
  std::vector<double> taken(kSteps + 1, 0);
  std::vector<float> steps(kSteps + 1);
  const double step = (double{media.end} - media.begin) / kSteps;
  for (int i = 0; i <= kSteps; ++i)
    steps[static_cast<std::size_t>(i)] = static_cast<float>(media.begin + i * step);
  for (const Prepared& probe : probes) probe.add_taken(steps, taken);
  const double all = taken.back();
  // Shares of the slices up to each step, from 0 to 1
  for (int i = 0; i <= kSteps; ++i) {
    double& share = taken[static_cast<std::size_t>(i)];
    const double even = double{1} * i / kSteps;
    share = all > 1e-9 ? kEven * even + (1 - kEven) * share / all : even;
  }
  std::vector<float> depths;
  std::size_t i = 0;
  for (std::size_t k = 1; k <= count; ++k) {
    const double wanted = static_cast<double>(k) / static_cast<double>(count + 1);
    while (i + 2 < taken.size() && taken[i + 1] < wanted) ++i;
    const double width = taken[i + 1] - taken[i];
    const double part = width > 0 ? std::clamp((wanted - taken[i]) / width, 0.0, 1.0) : 0;
    depths.push_back(static_cast<float>(media.begin + (static_cast<double>(i) + part) * step));
  }
  return depths;
}

}  // namespace

DeepEdges deep_edges(const World& w, int x, int y) {
  const std::size_t slices = w.aovs.deep().count;
  std::vector<DeepProbe> probes;
  std::vector<Prepared> prepared;
  MediaRanges media;
  std::vector<float> depths;
  for (const std::uint32_t count : {kProbes, kMoreProbes}) {
    probes = probes_of(w, x, y, count);
    prepared.clear();
    media = prepare(probes, prepared);
    depths = depths_of(probes);
    if (media.any() || !depths.empty()) break;
  }
  if (!media.any() && depths.empty()) {
    const auto far = static_cast<float>(kDeepFar * w.geometry.scale);
    return {std::vector<float>(slices + 1, far), std::vector<float>(slices - 1, far), {}};
  }

  struct Edge {
    float depth;   // where the slice begins
    float stated;  // what the image says
    bool surface;  // true if the slice that begins here has surfaces only
  };
  std::vector<Edge> edges;
  const auto add_edge = [&](float depth) { edges.push_back({depth, depth, false}); };
  for (std::size_t most = std::max<std::size_t>(1, slices / 2);; --most) {
    const std::vector<Surfaces> surfaces = surfaces_of(depths, most);
    edges.clear();
    float end = 0;  // of the last surfaces
    for (const auto& [range, middle] : surfaces) {
      const bool first = edges.empty();
      if (first ? media.any() && media.all.begin < range.begin : media.between(end, range.begin)) {
        add_edge(first ? media.all.begin : end);
        edges.push_back({range.begin, middle, true});
      } else {
        // Without a medium between them the slices of surfaces meet halfway. A slice with thickness there
        // would turn surfaces that no probe met into fog.
        edges.push_back({first ? range.begin : end + (range.begin - end) / 2, middle, true});
      }
      end = range.end;
    }
    if (surfaces.empty()) {  // all that there is, as fog
      Range all = media.all;
      if (!depths.empty()) all.add(depths.front(), depths.back());
      add_edge(all.begin);
      add_edge(all.end);
    } else {
      add_edge(end);
      if (media.any() && media.all.end > end) add_edge(media.all.end);
    }
    if (edges.size() <= slices + 1) break;
  }
  if (edges.size() <= slices && media.any()) {
    for (const float depth : divisions(prepared, media.all, slices + 1 - edges.size())) {
      const auto next = std::ranges::upper_bound(edges, depth, {}, &Edge::depth);
      if (next == edges.begin() || next == edges.end() || std::prev(next)->surface) continue;
      edges.insert(next, {depth, depth, false});
    }
  }
  DeepEdges out;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    out.stated.push_back(edges[k].surface ? -edges[k].stated : edges[k].stated);
    if (k > 0) out.between.push_back(edges[k].depth);
    if (edges[k].surface) out.surfaces.push_back({edges[k].depth, edges[k + 1].depth});
  }
  out.stated.resize(slices + 1, edges.back().stated);
  out.between.resize(slices - 1, edges.back().depth);
  return out;
}

}  // namespace ls::render
