// A Cryptomatte manifest lists the names of objects that an image's cryptomattes refer to by identifiers.
#pragma once

#include "common/image/exr/aov_layers.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"

namespace ls::coordinator {

// True if the settings ask for cryptomattes, so that the scene must be read with labels.
bool wants_labels(const RenderSettings& settings);

CryptomatteManifests manifests_of(const Scene& scene, AovSet aovs);

}  // namespace ls::coordinator
