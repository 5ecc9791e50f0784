// `lightshaft render --frames`: renders frame after frame, with the same pixels as on a farm.
#pragma once

#include "cli/local/local_render.h"

namespace ls::cli {

// Renders the frames. `options` are those for one image; a run of # in their paths stands for the frame
// number. Everything is checked before the first frame is rendered. Returns the exit code, and stops at the
// first frame whose exit code is not 0.
int render_sequence(const std::string& scene, const FrameRange& frames, const LocalRenderOptions& options);

}  // namespace ls::cli
