// Wrappers for the parts of Embree that differ between version 3 (Debian 12) and version 4 (Debian 13, Ubuntu
// 24.04). CMake chooses the version that it finds. The other code that uses Embree (accel.cpp,
// accel_shapes.h) is the same for both versions.
#pragma once

#if LIGHTSHAFT_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

namespace ls::render {

#if LIGHTSHAFT_EMBREE == 3

using EmbreeContext = RTCIntersectContext;
constexpr RTCSceneFlags kFilterOfQuery = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

inline void embree_start(EmbreeContext& context) { rtcInitIntersectContext(&context); }
// Requires that the scene has the flag kFilterOfQuery if `filter` is not null.
inline void embree_intersect(RTCScene scene, EmbreeContext& context, RTCRayHit& ray,
                             RTCFilterFunctionN filter) {
  context.filter = filter;
  rtcIntersect1(scene, &context, &ray);
}
inline void embree_occluded(RTCScene scene, EmbreeContext& context, RTCRay& ray) {
  rtcOccluded1(scene, &context, &ray);
}

#else

using EmbreeContext = RTCRayQueryContext;
constexpr RTCSceneFlags kFilterOfQuery = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

inline void embree_start(EmbreeContext& context) { rtcInitRayQueryContext(&context); }
inline void embree_intersect(RTCScene scene, EmbreeContext& context, RTCRayHit& ray,
                             RTCFilterFunctionN filter) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  if (filter) {
    arguments.filter = filter;
    arguments.flags =
        static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  }
  rtcIntersect1(scene, &ray, &arguments);
}
inline void embree_occluded(RTCScene scene, EmbreeContext& context, RTCRay& ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.context = &context;
  rtcOccluded1(scene, &ray, &arguments);
}

#endif

}  // namespace ls::render
