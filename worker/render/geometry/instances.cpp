#include "worker/render/geometry/instances.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ls::render {

Affine MovingInstance::to_world(double time) const {
  const Affine m(motion_.at(time));
  Affine all = m * to_own_;
  for (double& x : all.a) x *= scale_;
  all.b = (m.point(to_own_.b) - center_) * scale_;
  return all;
}

// Between two times without a key between them, every point is close to the straight line from where it is
// at the one to where it is at the other (Motion::bend), and that line is in the box around both.
Box MovingInstance::box(const Box& b, double from, double to) const {
  std::vector<double> times{from};
  for (const MotionKey& key : motion_.keys())
    if (key.time > from && key.time < to) times.push_back(key.time);
  times.push_back(to);
  double reach = 0;
  for (int k = 0; k < 8; ++k) reach = std::max(reach, to_own_.point(b.corner(k)).length());
  Box all;
  for (std::size_t i = 1; i < times.size(); ++i) {
    Box part = b.moved(to_world(times[i - 1]));
    part.add(b.moved(to_world(times[i])));
    all.add(part.grown(motion_.bend(times[i - 1], times[i], reach) * scale_));
  }
  return all;
}

std::size_t MovingInstance::parts(const Box& b) const {
  V3d last[8];
  double way = 0, size = 0;  // the longest way of a corner, and the least size of the box
  double ways[8] = {};
  for (std::size_t i = 0; i <= kMostParts; ++i) {
    const Affine m = to_world(static_cast<double>(i) / kMostParts);
    for (int k = 0; k < 8; ++k) {
      const V3d p = m.point(b.corner(k));
      if (i > 0) ways[k] += (p - last[k]).length();
      way = std::max(way, ways[k]);
      last[k] = p;
    }
    const double across = (last[7] - last[0]).length();
    size = i == 0 ? across : std::min(size, across);
  }
  if (!(way > 0)) return 1;
  const double wanted = std::ceil(8 * way / size);
  return wanted < kMostParts ? static_cast<std::size_t>(std::max(1., wanted)) : kMostParts;
}

}  // namespace ls::render
