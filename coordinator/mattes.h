// The names behind the identifiers of an image's mattes.
#pragma once

#include "common/image/aov_layers.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"

namespace ls::coordinator {

// Whether the settings ask for mattes, so that the scene must be read with labels.
bool wants_labels(const RenderSettings& settings);

MatteManifests manifests_of(const Scene& scene, AovSet aovs);

}  // namespace ls::coordinator
