#include "common/image/frame/frame.h"

#include <fmt/format.h>

namespace ls {

std::string show(const PixelRect& r) { return fmt::format("[{},{},{},{}]", r.x0, r.y0, r.x1, r.y1); }

}  // namespace ls
