// The kit of scenes that the cases of `lightshaft validate` are made with, for tests.
#pragma once

#include "validation/fixtures/scene_builder.h"

namespace ls::test {

using cases::operator*;
using cases::cross;
using cases::kPi;
using cases::look_at;
using cases::rotate_x;
using cases::rotate_y;
using cases::scale;
using cases::SceneBuilder;
using cases::ScratchFolder;
using cases::translate;
using cases::unit;

}  // namespace ls::test
