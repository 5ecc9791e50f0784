// `lightshaft render --frames`: frame after frame, each to the pixels that a farm gives it.
#pragma once

#include "cli/local_render.h"

namespace ls::cli {

// `options` as of one image; a run of # in its paths is the number of the frame. Everything is checked before
// the first frame is rendered. Returns the exit code: that of the first frame that ends with another than 0,
// and no frame comes after it.
int render_sequence(const std::string& scene, const FrameRange& frames, const LocalRenderOptions& options);

}  // namespace ls::cli
