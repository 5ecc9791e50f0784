// What fuzz.cpp lists. To add a target: its function and its seeds here, its row there, its file.
#pragma once

#include "tests/fuzz/fuzz.h"

namespace ls::fuzz {

using Seeds = std::vector<std::string>;

// scene.cpp: Mitsuba and Nori XML; pbrt; glTF; the canonical scene of workers
void scene_xml(Bytes input);
Seeds scene_xml_seeds();
void scene_pbrt(Bytes input);
Seeds scene_pbrt_seeds();
void scene_gltf(Bytes input);
Seeds scene_gltf_seeds();
void scene_json(Bytes input);
Seeds scene_json_seeds();
// small_json.cpp: settings, specs, stored jobs, health, unit headers, jobs for a render child
void small_json(Bytes input);
Seeds small_json_seeds();
// assets.cpp: files that a scene names
void image(Bytes input);
Seeds image_seeds();
void mesh(Bytes input);
Seeds mesh_seeds();
void volume(Bytes input);
Seeds volume_seeds();
// partial.cpp: partial EXRs, one by one and merged into a final EXR
void partial(Bytes input);
Seeds partial_seeds();
// http.cpp: requests to a coordinator; wire.cpp: bytes of a client's connection; bundle.cpp: zip and tar
void http(Bytes input);
Seeds http_seeds();
void wire(Bytes input);
Seeds wire_seeds();
void bundle(Bytes input);
Seeds bundle_seeds();
// protocol.cpp: messages of workers to a coordinator, and of a coordinator to workers
void protocol(Bytes input);
Seeds protocol_seeds();

}  // namespace ls::fuzz
