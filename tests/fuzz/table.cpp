#include "tests/fuzz/all_targets.h"

namespace ls::fuzz {

std::span<const Target> targets() {
  static constexpr Target kAll[] = {
      {"scene_xml", scene_xml, scene_xml_seeds},
      {"scene_pbrt", scene_pbrt, scene_pbrt_seeds},
      {"scene_gltf", scene_gltf, scene_gltf_seeds},
      {"scene_json", scene_json, scene_json_seeds},
      {"small_json", small_json, small_json_seeds},
      {"image", image, image_seeds},
      {"mesh", mesh, mesh_seeds},
      {"volume", volume, volume_seeds},
      {"partial", partial, partial_seeds},
      {"http", http, http_seeds},
      {"wire", wire, wire_seeds},
      {"bundle", bundle, bundle_seeds},
      {"protocol", protocol, protocol_seeds},
  };
  return kAll;
}

}  // namespace ls::fuzz
