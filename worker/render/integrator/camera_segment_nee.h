// A strategy of path_tracer.h for light in media. On segments that start at the camera or at a delta lobe
// (mirror, smooth glass), light scattered on the segment is estimated by next-event estimation at several
// points of the segment (segment_nee.h), instead of at the vertex where the free flight ends. On all other
// segments the default strategy is used (vertex_nee.h).
//
// In a thin medium few flights end on the camera's segment, and the few that do carry all of its scattered
// light: this is most of the noise of light shafts. Points on the segment exist in every sample, and share
// the cost of the camera ray.
#pragma once

#include <optional>

#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/vertex_nee.h"

namespace ls::render {

template <Features F>
class CameraSegmentNee {
  using Points = SegmentNee<F>;
  using Single = VertexNee<F>;

 public:
  struct Plan {
    std::optional<typename Points::Plan> points;  // nullopt: the default strategy
    typename Single::Plan single;

    bool matters() const { return points || single.matters(); }
  };
  struct Vertex {
    bool by_points = false;
    typename Points::Vertex points;
    typename Single::Vertex single;

    float found_as_light() const { return by_points ? points.found_as_light() : single.found_as_light(); }
    float found_as_light(const Pivot& pivot) const {
      return by_points ? points.found_as_light(pivot) : single.found_as_light(pivot);
    }
    bool light_chosen_first() const { return by_points; }
    bool uses_equiangular(bool is_point) const { return single.uses_equiangular(is_point); }
    float equiangular_ratio(const Pivot& pivot) const { return single.equiangular_ratio(pivot); }
  };

  template <class Path>
  static Plan ahead(Path& path, const Medium& medium, Segment segment) {
    if (path.last_.delta && path.world_.camera_points > 0)
      return {Points::ahead(path, medium, segment, path.world_.camera_points), {}};
    return {std::nullopt, Single::ahead(path, medium, segment)};
  }

  template <class Path>
  static Vertex vertex(const Path& path, const Medium& medium, const Plan& plan, float t) {
    if (plan.points) return {true, Points::vertex(path, medium, *plan.points, t), {}};
    return {false, {}, Single::vertex(path, medium, plan.single, t)};
  }

  template <class Path>
  static void at_vertex(Path& path, const Medium& medium, const V3& p, const V3& d) {
    if (!path.last_.in_medium.by_points) Single::at_vertex(path, medium, p, d);
  }
};

}  // namespace ls::render
