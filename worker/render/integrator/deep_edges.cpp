// Slices are placed by probes: camera rays through fixed points of the pixel, its filter and the lens. Where
// probes meet surfaces there is a slice of their own for each range of depths without large gaps. The other
// slices divide the media before, between and behind them, so that each takes about the same share of the
// light: equal parts of what is scattered on the way to the camera, not of optical depth, of which most can
// lie where nothing is seen. So no slice is seen through less than about one over the number of slices, and
// colours divided by that stay small and free of noise.
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
    probes.push_back(PathTracer<kEveryScene>(w, stream).deep_probe(camera_ray(w, stream, x, y)));
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

// Where media are on the probes' ways.
Range prepare(std::span<const DeepProbe> probes, std::vector<Prepared>& out) {
  Range media;
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
        if (std::isfinite(to)) media.add(s.begin + c.depth.from(), s.begin + to);
        crossings.push_back(std::move(c));
      }
    }
  }
  return media;
}

// Returns the ranges of the depths at which probes end on surfaces, at most `most` of them, separated where
// the gaps are largest.
std::vector<Range> surfaces_of(std::span<const DeepProbe> probes, std::size_t most) {
  std::vector<float> depths;
  for (const DeepProbe& probe : probes)
    if (std::isfinite(probe.surface)) depths.push_back(probe.surface);
  if (depths.empty() || most == 0) return {};
  std::ranges::sort(depths);
  std::vector<std::pair<float, std::size_t>> gaps;  // the share of a gap, negative, and the depth behind it
  for (std::size_t i = 1; i < depths.size(); ++i)
    if (const float gap = (depths[i] - depths[i - 1]) / depths[i]; gap > kGap) gaps.push_back({-gap, i});
  std::ranges::sort(gaps);
  gaps.resize(std::min(gaps.size(), most - 1));
  std::vector<std::size_t> begins{0};
  for (const auto& gap : gaps) begins.push_back(gap.second);
  std::ranges::sort(begins);
  std::vector<Range> ranges;
  for (std::size_t k = 0; k < begins.size(); ++k) {
    const float first = depths[begins[k]],
                last = depths[(k + 1 < begins.size() ? begins[k + 1] : depths.size()) - 1];
    const float margin = std::max(kDeepMargin * (last - first), kDeepRounding * last);
    // A range keeps at least half of the gap in front of it free.
    const float before = k > 0 ? depths[begins[k] - 1] : 0;
    ranges.push_back({std::max(first - margin, before + (first - before) / 2), last + margin});
    if (k > 0) ranges[k - 1].end = std::min(ranges[k - 1].end, ranges[k].begin);
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

std::vector<float> deep_edges(const World& w, int x, int y) {
  const std::size_t slices = w.aovs.deep().count;
  std::vector<DeepProbe> probes;
  std::vector<Prepared> prepared;
  Range media;
  bool met = false;
  for (const std::uint32_t count : {kProbes, kMoreProbes}) {
    probes = probes_of(w, x, y, count);
    prepared.clear();
    media = prepare(probes, prepared);
    met = media.any() || std::ranges::any_of(probes, [](const auto& p) { return std::isfinite(p.surface); });
    if (met) break;
  }
  if (!met) return std::vector<float>(slices + 1, static_cast<float>(kDeepFar * w.geometry.scale));

  struct Edge {
    float depth;
    bool surface;  // true if the slice that begins here has surfaces only
  };
  std::vector<Edge> edges;
  for (std::size_t most = std::max<std::size_t>(1, slices / 2);; --most) {
    const std::vector<Range> surfaces = surfaces_of(probes, most);
    edges.clear();
    if (media.any() && (surfaces.empty() || media.begin < surfaces[0].begin))
      edges.push_back({media.begin, false});
    for (const Range& surface : surfaces) {
      if (!edges.empty() && edges.back().depth == surface.begin)
        edges.back().surface = true;
      else
        edges.push_back({surface.begin, true});
      edges.push_back({surface.end, false});
    }
    if (media.any() && media.end > edges.back().depth) edges.push_back({media.end, false});
    if (edges.size() <= slices + 1) break;
    if (most > 0) continue;
    // One slice of everything
    Range all = media;
    for (const DeepProbe& probe : probes)
      if (std::isfinite(probe.surface)) all.add(probe.surface, probe.surface);
    edges = {{all.begin, false}, {all.end, false}};
    break;
  }
  if (edges.size() == 1) edges.push_back(edges.back());
  if (edges.size() <= slices && media.any()) {
    for (const float depth : divisions(prepared, media, slices + 1 - edges.size())) {
      const auto next = std::ranges::upper_bound(edges, depth, {}, &Edge::depth);
      if (next == edges.begin() || next == edges.end() || std::prev(next)->surface) continue;
      edges.insert(next, {depth, false});
    }
  }
  std::vector<float> out;
  for (const Edge& edge : edges) out.push_back(edge.surface ? -edge.depth : edge.depth);
  out.resize(slices + 1, edges.back().depth);
  return out;
}

}  // namespace ls::render
