// The builder of scenes for the cases of `lightshaft validate`, for use in tests.
#pragma once

#include "validation/fixtures/scene_builder.h"

namespace ls::test {

using cases::operator*;
using cases::add_image;
using cases::add_sky;
using cases::cross;
using cases::kPi;
using cases::look_at;
using cases::one_texel_irradiance;
using cases::rotate_x;
using cases::rotate_y;
using cases::scale;
using cases::SceneBuilder;
using cases::ScratchFolder;
using cases::SkyImage;
using cases::translate;
using cases::unit;

}  // namespace ls::test
